/* Finds an entry of a table by name; the error lists the names or the nearest one. */
#include "names.h"

#include <stdio.h>
#include <stdlib.h>
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

/* Characters before the number that ends a name. */
static size_t stem(const char *name)
{
    size_t n = strlen(name);
    while (n > 0 && name[n - 1] >= '0' && name[n - 1] <= '9')
        n--;
    return n;
}

/* "gauss2 to gauss24", where the names that differ from `name` in their number alone are one range
   of numbers, in order; false where they are not, or are fewer than two. */
static bool find_range(const char *name, size_t n, const char *const names[], size_t size,
                       char text[])
{
    const char *first = NULL, *last = NULL;
    size_t length = stem(name), found = 0;
    for (size_t k = 0; k < n && name[length]; k++)
        if (stem(names[k]) == length && names[k][length] && strncmp(names[k], name, length) == 0) {
            first = first ? first : names[k];
            last = names[k];
            found++;
        }
    if (found < 2 || atol(last + length) - atol(first + length) + 1 != (long)found)
        return false;
    snprintf(text, size, "%s to %s", first, last);
    return true;
}

size_t phys_find(const char *what, const char *name, size_t n, const char *const names[],
                 struct ad_error *error)
{
    if (error->status != AD_OK)
        return n;
    if (!name || !names) {
        ad_fail(error, AD_E_ARGUMENT, "no name of a %s (NULL)", what);
        return n;
    }
    for (size_t k = 0; k < n; k++)
        if (strcmp(names[k], name) == 0)
            return k;
    const char *nearest = phys_nearest(name, n, names);
    char all[230];
    if (find_range(name, n, names, sizeof all, all)) {
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s'; expected %s", what, name, all);
        return n;
    }
    list(n, names, sizeof all, all);
    if (n == 0)
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s': there are none", what, name);
    else if (nearest)
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s'; did you mean '%s'?", what, name, nearest);
    else
        ad_fail(error, AD_E_ARGUMENT, "no %s '%s'; expected one of: %s", what, name, all);
    return n;
}
