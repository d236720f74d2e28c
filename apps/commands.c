/* The table of subcommands. */
#include "command.h"
#include "../physics/physics.h"

#include <string.h>

const struct command *const commands[] = {
#define COMMAND(name) &command_##name,
#include "commands.def"
    NULL,
};

const struct command *command_find(const char *name, struct ad_error *error)
{
    const char *names[sizeof commands / sizeof *commands], *nearest;
    size_t n = 0;
    for (; commands[n]; n++) {
        if (strcmp(name, commands[n]->line.name) == 0)
            return commands[n];
        names[n] = commands[n]->line.name;
    }
    nearest = phys_nearest(name, n, names);
    if (nearest)
        ad_fail(error, AD_E_ARGUMENT, "unknown subcommand '%s'; did you mean '%s'?", name, nearest);
    else
        ad_fail(error, AD_E_ARGUMENT, "unknown subcommand '%s'; --help lists them", name);
    return NULL;
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
