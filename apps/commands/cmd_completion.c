/* leastaction completion: bash completion of subcommands, options and scenes, from their tables. */
#include "apps/command.h"

#include <stdio.h>
#include <string.h>

static void print_commands(void)
{
    fputs("    local commands='", stdout);
    for (size_t k = 0; commands[k]; k++)
        printf("%s ", commands[k]->line.name);
    puts("--help --version'");
}

static void print_scenes(void)
{
    fputs("    local scenes='", stdout);
    for (size_t k = 0; phys_scenes[k]; k++)
        printf("%s%s", k ? " " : "", phys_scenes[k]->name);
    puts("'");
}

/* One branch of the case over subcommands; other words than options and scenes are files. */
static void print_branch(const struct command_line *line)
{
    const char *argument = line->arguments[0];
    printf("    %s)\n        options='", line->name);
    for (size_t k = 0; k < options_rows(line); k++)
        printf("%s--%s", k ? " " : "", options_row(line, k)->name);
    puts("'");
    if (argument && strstr(argument, "SCENE"))
        puts("        words=$scenes");
    puts("        ;;");
}

static int run(const void *options, struct ad_error *error)
{
    (void)options;
    puts("_leastaction()\n{\n    local words options");
    print_commands();
    print_scenes();
    puts("    case ${COMP_WORDS[1]} in");
    for (size_t k = 0; commands[k]; k++)
        print_branch(&commands[k]->line);
    puts("    esac\n"
         "    [[ $2 == -* ]] && words=$options\n"
         "    ((COMP_CWORD == 1)) && words=$commands\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$2\")\n"
         "}\n"
         "complete -o default -F _leastaction leastaction");
    return command_status(error);
}

const struct command command_completion = {
    .line = {.name = "completion",
             .what = "bash completion script",
             .more = "source <(leastaction completion)"},
    .bytes = sizeof(struct common),
    .run = run,
};
