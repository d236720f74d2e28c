/* Lists of numbers on the command line (numbers.h). */
#include "numbers.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

const char *numbers_list(const char *text, size_t most, double *values, size_t *found)
{
    *found = 0;
    for (bool more = true; more; ++*found) {
        char *end;
        double value = strtod(text, &end);
        if (end == text || !isfinite(value) || (*end != ',' && *end != '\0'))
            return text;
        if (*found < most)
            values[*found] = value;
        more = *end == ',';
        text = end + more;
    }
    return NULL;
}

enum ad_status numbers_read(const char *option, const char *text, size_t n, const char *what,
                            double *values, struct ad_error *error)
{
    size_t found;
    const char *wrong = numbers_list(text, n, values, &found);
    if (wrong)
        return ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s, found '%.20s'", option, text,
                       what, wrong);
    return found == n
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s: %zu numbers, found %zu",
                         option, text, what, n, found);
}
