/* Settings with one change, and whether they are refused by its name. */
#ifndef TESTS_CONTRACT_SETTINGS_H
#define TESTS_CONTRACT_SETTINGS_H

#include "tests/close.h"
#include "tests/mentions.h"

static int wrong;

/* Good settings with one change: refused by the name of it, or, with no name, taken. Too large ones
   may be refused as out of memory. */
static void judge(const char *change, enum ad_status status, const struct ad_error *error,
                  const char *names)
{
    if (!*names ? status == AD_OK
                : (status == AD_E_ARGUMENT || status == AD_E_NONFINITE || status == AD_E_MEMORY) &&
                      mentions(error->message, names))
        return;
    print_error("%s: %d, \"%s\"\n", change, status, error->message);
    wrong++;
}
#define TRY(good, use, names, ...)                                                                 \
    do {                                                                                           \
        struct ad_error error = {0};                                                               \
        __typeof__(good()) s = good();                                                             \
        __VA_ARGS__;                                                                               \
        judge(#__VA_ARGS__, use(&s, &error), &error, names);                                       \
    } while (0)

#endif
