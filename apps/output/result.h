/* Text results for --csv: a file that is replaced atomically, or standard output for "-". */
#ifndef APPS_OUTPUT_RESULT_H
#define APPS_OUTPUT_RESULT_H

#include "physics/io/atomic_file.h"

#include <stdio.h>

struct result {
    FILE *out; /* NULL: not asked for */
    struct phys_atomic_file file;
};

/* `target` NULL: not asked for. A file that cannot be written is found here: AD_E_IO. */
enum ad_status result_begin(struct result *result, const char *target, struct ad_error *error);
enum ad_status result_commit(struct result *result, struct ad_error *error);
void result_abandon(struct result *result);

/* A comma and a number behind it, nothing where it is not finite. */
void csv_number(FILE *out, int digits, double value);

#endif
