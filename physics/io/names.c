/* Finding something by name in one of the tables, and saying what there is when it is not there. */
#include "physics/physics.h"

#include <stdio.h>
#include <string.h>

/* "a, b, c"; "a, b, ..." where it does not fit. */
static void list(size_t n, const char *const names[], size_t size, char text[])
{
    size_t used = 0, room = size - sizeof ", ...";
    text[0] = '\0';
    for (size_t k = 0; k < n; k++) {
        if (used + strlen(names[k]) + 2 > room) {
            snprintf(text + used, size - used, ", ...");
            return;
        }
        used += (size_t)snprintf(text + used, size - used, "%s%s", k ? ", " : "", names[k]);
    }
}

size_t phys_find(const char *what, const char *name, size_t n, const char *const names[],
                 struct ad_error *error)
{
    if (!name) {
        ad_fail(error, AD_E_ARGUMENT, "no name of a %s (NULL)", what);
        return n;
    }
    for (size_t k = 0; k < n; k++)
        if (strcmp(names[k], name) == 0)
            return k;
    const char *nearest = phys_nearest(name, n, names);
    char all[230];
    list(n, names, sizeof all, all);
    if (nearest)
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s'; did you mean '%s'?", what, name, nearest);
    else
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s'; expected one of: %s", what, name, all);
    return n;
}
