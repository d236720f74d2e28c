/* The numbers that a scan shows (scan_parts.h): those of --curves, or some that vary. */
#include "scan_parts.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool varies(const struct scan *scan, const struct result_column *column)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t k = 0; k < scan->runs; k++) {
        low = fmin(low, isnan(column->value[k]) ? low : column->value[k]);
        high = fmax(high, isnan(column->value[k]) ? high : column->value[k]);
    }
    return low < high;
}

/* Whether a key is the one asked for; items FROM-TO there are any of these. */
static bool matches(const char *key, const char *asked, size_t length)
{
    const char *end = asked + length;
    for (; asked < end; asked++, key++) {
        char *dash, *behind, *after;
        const unsigned long from = strtoul(asked, &dash, 10);
        if (isdigit((unsigned char)*asked) && *dash == '-') {
            const unsigned long to = strtoul(dash + 1, &behind, 10),
                                item = strtoul(key, &after, 10);
            return after > key && item >= from && item <= to &&
                   matches(after, behind, behind < end ? (size_t)(end - behind) : 0);
        }
        if (*asked != *key)
            return false;
    }
    return *key == 0;
}

/* Of how many keys that is: of all items of its ranges. */
static double keys_asked(const char *asked, size_t length)
{
    const char *end = asked + length;
    double n = 1;
    for (char *dash; asked < end; asked++)
        if (isdigit((unsigned char)*asked)) {
            const double from = (double)strtoul(asked, &dash, 10);
            if (*dash == '-')
                n *= (double)strtoul(dash + 1, &dash, 10) - from + 1;
            asked = dash;
        }
    return n;
}

enum ad_status scan_choose(struct scan *scan, struct ad_error *error)
{
    size_t shown = 0;
    const char *names = scan->common->curves;
    for (size_t length; names && *names; names += length + (names[length] == ',')) {
        size_t found = 0, fresh = 0;
        bool known = false;
        length = strcspn(names, ",");
        for (size_t k = 0; k < scan->n; k++) {
            struct result_column *column = &scan->column[k];
            if (!matches(column->key, names, length))
                continue;
            found++;
            for (size_t r = 0; r < scan->runs; r++)
                known = known || isfinite(column->value[r]);
            if (!column->shown) {
                fresh++;
                column->panel = shown + 1;
            }
            column->shown = true;
        }
        if (found == 0)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--curves: no number '%.*s' in the results; --json lists them",
                           (int)length, names);
        if ((double)found < keys_asked(names, length))
            return ad_fail(error, AD_E_ARGUMENT,
                           "--curves: '%.*s' are %g numbers, of which the results have %zu",
                           (int)length, names, keys_asked(names, length), found);
        if (!known)
            return ad_fail(error, AD_E_ARGUMENT, "--curves: '%.*s' has no value in any run",
                           (int)length, names);
        if (found > 1 && scan->axes == AXES)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--curves: '%.*s' are %zu numbers; a map shows one", (int)length, names,
                           found);
        shown += fresh > 0;
        if (shown > PANELS)
            return ad_fail(error, AD_E_ARGUMENT, "--curves: expected at most %d", PANELS);
    }
    for (size_t k = 0; k < 2 * scan->n && !scan->common->curves && shown < PANELS; k++) {
        struct result_column *column = &scan->column[k % scan->n]; /* those of the run first */
        const bool item = strchr(column->key, '.') != NULL;
        if (item == (k >= scan->n) && column->labelled && varies(scan, column)) {
            column->shown = true;
            column->panel = ++shown;
        }
    }
    return AD_OK;
}
