/* "Did you mean": the nearest of several names by optimal string alignment (insertion, deletion,
   substitution, transposition), ignoring case. */
#include "names.h"

#include <ctype.h>
#include <string.h>

enum { LONGEST = 63 }; /* longer names are not matched */

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

/* Three rows of the distance table suffice: a swap looks two back. */
static size_t distance(const char *a, const char *b)
{
    size_t rows[3][LONGEST + 1], n = strlen(b);
    for (size_t j = 0; j <= n; j++)
        rows[0][j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        const size_t *older = rows[(i + 1) % 3], *above = rows[(i + 2) % 3];
        size_t *row = rows[i % 3];
        row[0] = i;
        for (size_t j = 1; j <= n; j++) {
            int x = tolower((unsigned char)a[i - 1]), y = tolower((unsigned char)b[j - 1]);
            row[j] = least(above[j - 1] + (x != y), least(above[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && x == tolower((unsigned char)b[j - 2]) &&
                y == tolower((unsigned char)a[i - 2]))
                row[j] = least(row[j], older[j - 2] + 1);
        }
    }
    return rows[strlen(a) % 3][n];
}

const char *phys_nearest(const char *name, size_t n, const char *const names[])
{
    if (!name || !names)
        return NULL;
    size_t length = strlen(name);
    size_t best = length / 3 + 2; /* one slip in a short name, one more every three letters */
    const char *nearest = NULL;
    if (length > LONGEST)
        return NULL;
    for (size_t k = 0; k < n; k++) {
        if (strlen(names[k]) > LONGEST)
            continue;
        size_t d = distance(name, names[k]);
        if (d < best && d < length) {
            best = d;
            nearest = names[k];
        }
    }
    return nearest;
}
