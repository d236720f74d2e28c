/* The program around command_main, which tests call without it. */
#include "command.h"

int main(int argc, char *argv[]) { return command_main(argc, argv); }
