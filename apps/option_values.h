/* Values of options: one in a struct of values, for options.c; lists of numbers in a text. */
#ifndef APPS_OPTION_VALUES_H
#define APPS_OPTION_VALUES_H

#include "options.h"

/* Stores `text` as the value. AD_E_ARGUMENT says what was expected. */
enum ad_status option_store(const struct option *option, const char *text, char *values,
                            struct ad_error *error);
/* The value of an option that is not given. */
void option_store_default(const struct option *option, char *values);
/* Frees what the value owns. */
void option_release(const struct option *option, char *values);

/* ---- lists of numbers: "1,0,-0.5" ---- */

/* Finite numbers, commas between, of which the first `most` are kept; how many there are. Returns
   NULL, or where something else stands. */
const char *numbers_list(const char *text, size_t most, double *values, size_t *found);
/* Exactly n finite numbers, commas between. AD_E_ARGUMENT names the option, what was found, and
   `what` was expected. */
enum ad_status numbers_read(const char *option, const char *text, size_t n, const char *what,
                            double *values, struct ad_error *error);

#endif
