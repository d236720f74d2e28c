/* The value of one option in a struct of values, for options.c. */
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

#endif
