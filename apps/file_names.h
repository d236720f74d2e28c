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

/* AD_E_ARGUMENT where an output is an input or another output, by whatever name, or the file to
   which standard output or error goes; or is, by whatever name, a file in a folder that is an input
   (or in a folder in that), unless the extension it has there says that nobody reads it. "-" is no
   file. */
enum ad_status file_names_check(size_t n, const struct file_name names[], struct ad_error *error);

#endif
