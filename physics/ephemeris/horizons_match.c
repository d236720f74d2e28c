/* Matches a body's name or id with the target of a table (horizons_reader.h). */
#include "horizons_reader.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* "1 Ceres (A801 AA)" is ceres, "Mars Barycenter" mars. */
static bool loosely_equal(const char *target, const char *body)
{
    static const char suffix[] = " barycenter";
    const char *start = target + strspn(target, "0123456789");
    start = start > target && *start == ' ' ? start + 1 : target;
    size_t n = strcspn(start, "("), m = sizeof suffix - 1;
    while (n > 0 && start[n - 1] == ' ')
        n--;
    if (n > m && strncasecmp(start + n - m, suffix, m) == 0)
        n -= m;
    return strlen(body) == n && strncasecmp(start, body, n) == 0;
}

enum horizons_match phys_horizons_match(const struct phys_horizons *table, const char *body)
{
    char *end;
    long id = strtol(body, &end, 10);
    if (!*end && id == table->id && table->id != PHYS_HORIZONS_NO_ID)
        return HORIZONS_EXACT;
    if (strcasecmp(table->target, body) == 0)
        return HORIZONS_EXACT;
    return loosely_equal(table->target, body) ? HORIZONS_LOOSE : HORIZONS_OTHER;
}
