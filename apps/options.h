/* Command lines from tables: one row per option, from which parsing, --help and the error messages
   are derived. A subcommand's options are stored in a struct of its own that begins with struct
   common. */
#ifndef APPS_OPTIONS_H
#define APPS_OPTIONS_H

#include "autodiff/ranks.h"
#include "physics/physics.h"

#include <math.h>
#include <stdio.h>

enum option_kind {
    OPTION_FLAG,     /* bool */
    OPTION_TEXT,     /* const char *; NULL if not given */
    OPTION_INPUT,    /* the same: a file or folder to read, or a name that is none */
    OPTION_OUTPUT,   /* the same: a file to write, which may not be an input; - is none */
    OPTION_PICTURE,  /* the same: a file to write by gnuplot */
    OPTION_NUMBER,   /* double, finite; OPTION_NO_NUMBER (NaN) if not given */
    OPTION_POSITIVE, /* the same, more than 0 */
    OPTION_SIZE,     /* the same, at least 0 */
    OPTION_COUNT,    /* size_t; OPTION_NO_COUNT if not given */
    OPTION_SOME,     /* the same, at least 1 */
    OPTION_TWO,      /* the same, at least 2 */
    OPTION_SLICES,   /* the same, at least 3 */
    OPTION_SEED,     /* uint64_t */
    OPTION_TEXTS,    /* struct texts: repeatable */
    OPTION_SETTINGS  /* struct settings: NAME=VALUE, repeatable */
};

#define OPTION_NO_NUMBER ((double)NAN)
#define OPTION_NO_COUNT SIZE_MAX

struct option {
    const char *name, *placeholder; /* without dashes; placeholder NULL: a flag */
    enum option_kind kind;
    const char *fallback; /* parsed first, and shown; NULL: not given, and `help` says what then */
    const char *help;
    size_t offset; /* of its destination in the struct of options */
};

/* Every text, as often as the option was given. */
struct texts {
    size_t n;
    const char **text; /* owned; the texts themselves are words of the command line */
};

/* NAME=VALUE as often as --set was given. */
struct settings {
    size_t n;
    struct phys_setting *setting; /* owned, and so are the names */
};

struct scan;

/* What every subcommand takes. */
struct common {
    bool help, version, json, quiet, verbose, no_native;
    uint64_t seed;
    size_t threads;
    const char *out, *csv, *log, *plot; /* where the subcommand has results to write */
    struct settings set;                /* where it opens a scene */
    struct texts scan;                  /* where it does both */
    struct texts sweep;                 /* there, and where each run keeps files of its own */
    const char *seeds, *curves;
    struct scan *scanning;   /* that this run belongs to: its report goes there; NULL: none */
    struct ad_ranks *ranks;  /* that share the work; NULL: alone */
    const char *argument[2]; /* what is not an option, in order; NULL beyond the last */
    size_t n_arguments;
    const char *command; /* the whole command line, quoted for a shell; set by main */
    const struct command_line *line;
    uint64_t given; /* bit k: row k of the line */
};

/* The command line of one subcommand. */
struct command_line {
    const char *name, *what;  /* "path", "stationary path between two ends" */
    const char *arguments[2]; /* placeholders: "SCENE" is needed, "[SCENE]" optional */
    bool names;               /* the arguments are names, never files to read */
    bool scene;               /* takes --set */
    bool ranks;               /* shares its work among ranks */
    bool outputs;             /* takes --out, --csv and --plot */
    bool members;             /* each run of a sweep keeps files of its own, named after it */
    const struct option *options;
    size_t n_options;
    const char *more; /* closing paragraph of --help, or NULL */
};

/* Fills `values` (a struct that begins with struct common) from the words after the subcommand.
   AD_E_ARGUMENT names the option and what was expected. Where --help or --version was given the
   rest is not looked at. Ends with options_free. */
enum ad_status options_parse(const struct command_line *line, int argc, char *const argv[],
                             void *values, struct ad_error *error);
void options_free(const struct command_line *line, void *values);

/* The rows of a command line: its own, then those that every subcommand takes. */
size_t options_rows(const struct command_line *line);
const struct option *options_row(const struct command_line *line, size_t k);
/* The row of an option whose name has this length; the number of rows if there is none. */
size_t options_find(const struct command_line *line, const char *name, size_t length);
/* No output may be an input or another output: AD_E_ARGUMENT. */
enum ad_status options_check_files(const struct command_line *line, const struct common *common,
                                   struct ad_error *error);

/* The text of --help. */
void options_help(const struct command_line *line, FILE *out);

/* What was given, else the other. */
static inline double option_number_or(double given, double otherwise)
{
    return isnan(given) ? otherwise : given;
}
static inline size_t option_count_or(size_t given, size_t otherwise)
{
    return given == OPTION_NO_COUNT ? otherwise : given;
}

/* AD_E_ARGUMENT, "--NAME WHAT", for the first that was given of these options, names apart by
   blanks. */
enum ad_status options_refuse(const struct common *common, const char *names, const char *what,
                              struct ad_error *error);

/* The same of the first of some rows that is so: options that such a run does not look at. */
struct unused {
    bool so;
    const char *names, *what;
};
enum ad_status options_unused(const struct common *common, size_t n, const struct unused rows[],
                              struct ad_error *error);

/* AD_E_ARGUMENT for the first of some rows that is wrong. */
struct conflict {
    bool wrong;
    const char *what;
};
enum ad_status options_conflicts(size_t n, const struct conflict rows[], struct ad_error *error);

/* Index of the value of an option that is one of names[0..n-1]; n, and an AD_E_ARGUMENT that lists
   them, if it is none. */
size_t options_choose(const char *option, const char *given, size_t n, const char *const names[],
                      struct ad_error *error);

/* A number, all of `text`, or multiples of pi with it, as in 1.2+2pi or -pi/2: false for anything
   else, infinities and NaN. */
bool options_number(const char *text, double *value);
/* NAME=FROM:TO, the name of at most size - 1 characters and the numbers as above. */
bool options_range(const char *text, char *name, size_t size, double *from, double *to);
/* A whole number from 0 to `most`, in decimal digits alone. */
bool options_integer(const char *text, uint64_t most, uint64_t *value);

#endif
