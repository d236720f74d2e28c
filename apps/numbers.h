/* Lists of numbers on the command line: "1,0,-0.5". */
#ifndef APPS_NUMBERS_H
#define APPS_NUMBERS_H

#include "autodiff/autodiff.h"

/* Finite numbers, commas between, of which the first `most` are kept; how many there are. Returns
   NULL, or where something else stands. */
const char *numbers_list(const char *text, size_t most, double *values, size_t *found);
/* Exactly n finite numbers, commas between. AD_E_ARGUMENT names the option, what was found, and
   `what` was expected. */
enum ad_status numbers_read(const char *option, const char *text, size_t n, const char *what,
                            double *values, struct ad_error *error);

#endif
