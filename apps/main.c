/* The program around command_main, which tests call without it. */
#include "command.h"
#include "interrupt.h"

int main(int argc, char *argv[])
{
    interrupt_start();
    return command_main(argc, argv);
}
