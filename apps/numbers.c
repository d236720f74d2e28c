/* Lists of numbers on the command line (numbers.h). */
#include "numbers.h"

#include <math.h>
#include <stdlib.h>

enum ad_status numbers_read(const char *option, const char *text, size_t n, const char *what,
                            double *values, struct ad_error *error)
{
    const char *at = text;
    size_t found = 0;
    for (bool more = true; more; found++) {
        char *end;
        double value = strtod(at, &end);
        if (end == at || !isfinite(value) || (*end != ',' && *end != '\0'))
            return ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s, found '%.20s'", option,
                           text, what, at);
        if (found < n)
            values[found] = value;
        more = *end == ',';
        at = end + more;
    }
    if (found != n)
        return ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s: %zu numbers, found %zu", option,
                       text, what, n, found);
    return AD_OK;
}
