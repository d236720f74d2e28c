/* The table of subcommands. */
#include "command.h"

const struct command *const commands[] = {
#define COMMAND(name) &command_##name,
#include "commands.def"
    NULL,
};

const struct command *command_find(const char *name, struct ad_error *error)
{
    const char *names[sizeof commands / sizeof *commands];
    size_t n = 0;
    for (; commands[n]; n++)
        names[n] = commands[n]->line.name;
    return commands[phys_find("subcommand", name, n, names, error)]; /* NULL behind the last */
}

int command_status(const struct ad_error *error)
{
    switch (error->status) {
    case AD_OK:
        return DONE;
    case AD_E_NONFINITE:
    case AD_E_MEMORY:
    case AD_E_ACCURACY:
        return NOT_REACHED;
    default:
        return WRONG_USE;
    }
}
