/* leastaction manual: man(1) pages, from the tables that --help prints. */
#include "apps/command.h"

#include <stdio.h>

/* Text as man(7) reads it: escapes for the backslash, the dash of options, and a leading dot. */
static void plain(const char *text)
{
    bool first = true;
    for (; *text; text++) {
        if (first && (*text == '.' || *text == '\''))
            fputs("\\&", stdout);
        if (*text == '\\')
            fputs("\\e", stdout);
        else if (*text == '-')
            fputs("\\-", stdout);
        else
            putchar(*text);
        first = *text == '\n';
    }
}

static void heading(const char *name, const char *what)
{
    printf(".TH LEASTACTION%s%s 1 \"\" \"leastaction " LEASTACTION_VERSION
           "\"\n.SH NAME\nleastaction%s%s \\- ",
           *name ? "\\-" : "", name, *name ? "\\-" : "", name);
    plain(what);
    putchar('\n');
}

static void option(const struct option *option)
{
    fputs(".TP\n\\fB\\-\\-", stdout);
    plain(option->name);
    fputs("\\fR", stdout);
    if (option->placeholder) {
        fputs(" \\fI", stdout);
        plain(option->placeholder);
        fputs("\\fR", stdout);
    }
    putchar('\n');
    plain(option->help);
    if (option->fallback) {
        fputs(" [", stdout);
        plain(option->fallback);
        putchar(']');
    }
    putchar('\n');
}

static void exit_status(void)
{
    puts(".SH EXIT STATUS\n0 done; 1 ran, but did not reach what was asked; 2 wrong use or bad "
         "input.");
}

static void page(const struct command_line *line)
{
    heading(line->name, line->what);
    printf(".SH SYNOPSIS\n.B leastaction %s\n", line->name);
    for (size_t k = 0; k < sizeof line->arguments / sizeof *line->arguments && line->arguments[k];
         k++)
        printf(".I %s\n", line->arguments[k]);
    puts("[options]\n.SH OPTIONS");
    for (size_t k = 0; k < options_rows(line); k++)
        option(options_row(line, k));
    if (line->more) {
        puts(".SH NOTES\n.nf");
        plain(line->more);
        puts("\n.fi");
    }
    exit_status();
    puts(".SH SEE ALSO\n.BR leastaction (1)");
}

static void overview(void)
{
    heading("", "paths of stationary action, from a Lagrangian written once");
    puts(".SH SYNOPSIS\n.B leastaction\n.I SUBCOMMAND\n[options]\n.SH SUBCOMMANDS");
    for (size_t k = 0; commands[k]; k++) {
        printf(".TP\n.BR leastaction\\-%s (1)\n", commands[k]->line.name);
        plain(commands[k]->line.what);
        putchar('\n');
    }
    exit_status();
}

static int run(const void *options, struct ad_error *error)
{
    const struct common *common = options;
    if (common->n_arguments == 0) {
        overview();
        return DONE;
    }
    const struct command *command = command_find(common->argument[0], error);
    if (command)
        page(&command->line);
    return command_status(error);
}

const struct command command_manual = {
    .line = {.name = "manual",
             .what = "manual pages, for man(1)",
             .arguments = {"[SUBCOMMAND]"},
             .more = "leastaction manual path | man -l -"},
    .bytes = sizeof(struct common),
    .run = run,
};
