/* A subcommand: one file, one const struct, one line in commands.def. A command is options, a
   library call, and a report.

       output/     results as text, JSON and HDF5 (report.h), pictures (figure.h, plot.h), output
                   files (outputs.h), tables of charts (sheet.h), progress
       commands/   subcommands of one file
       path/ simulate/ quantum/    path.h, simulate.h, quantum.h list the parts of a subcommand
       hnn/        dataset.h, train.h, rollout.h, field.h
       bench/      leastaction chart (chart.h); hand/: hand-written kernels; measure/: timing and
                   test problems */
#ifndef APPS_COMMAND_H
#define APPS_COMMAND_H

#include "autodiff/version.h"
#include "options.h"

enum {
    DONE = 0,
    NOT_REACHED = 1, /* ran, but did not reach what was asked */
    WRONG_USE = 2    /* wrong use or bad input */
};

struct command {
    struct command_line line;
    size_t bytes; /* of its struct of options, which begins with struct common */
    /* Returns the exit status; a message in `error` is printed after it. */
    int (*run)(const void *options, struct ad_error *error);
};

#define COMMAND(name) extern const struct command command_##name;
#include "commands.def"

/* All of them, in the order of --help; NULL at the end. */
extern const struct command *const commands[];

/* The one of this name; an AD_E_ARGUMENT suggests the nearest, and is returned as NULL. */
const struct command *command_find(const char *name, struct ad_error *error);

/* --scan (output/scan.h): a subcommand for each value of a parameter. Exit status 1 where a run did
   not reach what was asked; its row is empty then, or has what it reported. */
int scan_run(const struct command *command, const struct common *common, struct ad_error *error);

/* All that main does: the exit status of a command line. */
int command_main(int argc, char *argv[]);

/* The exit status that an error of the library stands for. */
int command_status(const struct ad_error *error);

#endif
