/* Checks that the files of a run are different ones, because an output replaces its target. */
#ifndef APPS_FILE_NAMES_H
#define APPS_FILE_NAMES_H

#include "autodiff/autodiff.h"

#include <stdbool.h>
#include <stddef.h>

struct file_name {
    const char *dashes, *option; /* "--", "out" */
    const char *file;            /* NULL: not given */
    bool output;
};

/* AD_E_ARGUMENT where an output is the same file as an input, another output, standard output or
   standard error, whatever its name; or a file anywhere below a folder that is an input, unless
   files of its extension are not read there. "-" is not a file. */
enum ad_status file_names_check(size_t n, const struct file_name names[], struct ad_error *error);

#endif
