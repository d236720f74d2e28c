/* Sets of columns (jacobian.h). Most unions are of a set with itself or a subset, and make no new
   set. */
#include "autodiff/ascending.h"
#include "autodiff/free.h"
#include "jacobian.h"

#include <stdlib.h>

enum { CACHE = 1 << 16 };

bool ad_sets_init(struct sets *s, size_t limit)
{
    *s = (struct sets){.limit = limit,
                       .known = calloc(CACHE, sizeof *s->known),
                       .stamp = calloc(limit + 1, sizeof *s->stamp)};
    s->failed = !s->known || !s->stamp ||
                !ad_reserve((void **)&s->start, 0, &s->max_sets, 2, sizeof *s->start);
    if (s->failed)
        return false;
    s->start[0] = s->start[1] = 0;
    s->n = 1;
    return true;
}

void ad_sets_free(struct sets *s) { AD_FREE(s->start, s->items, s->known, s->stamp); }

/* Room for a set of up to n numbers behind the others, or NULL. */
static uint32_t *begin(struct sets *s, size_t n)
{
    size_t end = s->start[s->n];
    if (s->failed || s->n >= UINT32_MAX - 1 ||
        !ad_reserve((void **)&s->items, end, &s->max_items, n, sizeof *s->items) ||
        !ad_reserve((void **)&s->start, s->n + 1, &s->max_sets, 1, sizeof *s->start)) {
        s->failed = true;
        return NULL;
    }
    return s->items + end;
}

static uint32_t finish(struct sets *s, size_t n)
{
    s->start[s->n + 1] = s->start[s->n] + n;
    return (uint32_t)s->n++;
}

static size_t size_of(const struct sets *s, uint32_t k) { return s->start[k + 1] - s->start[k]; }

uint32_t ad_set_single(struct sets *s, uint32_t item)
{
    uint32_t *to = begin(s, 1);
    if (!to)
        return 0;
    *to = item;
    return finish(s, 1);
}

static uint32_t merge(struct sets *s, uint32_t a, uint32_t b)
{
    size_t na = size_of(s, a), nb = size_of(s, b), i = 0, j = 0, n = 0;
    uint32_t *to = begin(s, na + nb);
    if (!to)
        return 0;
    const uint32_t *x = s->items + s->start[a], *y = s->items + s->start[b];
    while (i < na || j < nb) {
        uint32_t next = j == nb || (i < na && x[i] <= y[j]) ? x[i] : y[j];
        i += i < na && x[i] == next;
        j += j < nb && y[j] == next;
        to[n++] = next;
    }
    return n == na ? a : n == nb ? b : finish(s, n);
}

uint32_t ad_set_union(struct sets *s, uint32_t a, uint32_t b)
{
    if (a == b || !b || size_of(s, a) == s->limit)
        return a;
    if (!a || size_of(s, b) == s->limit)
        return b;
    size_t hash = (((size_t)a << 32 | b) * 0x9e3779b97f4a7c15u) >> 48;
    struct known_union *known = &s->known[hash % CACHE];
    if (known->a != a || known->b != b)
        *known = (struct known_union){a, b, merge(s, a, b)};
    return known->both;
}

uint32_t ad_set_union_all(struct sets *s, size_t n, const uint32_t of[])
{
    uint32_t one = 0;
    size_t different = 0, most = 0;
    for (size_t k = 0; k < n; k++) {
        different += of[k] && of[k] != one;
        one = of[k] ? of[k] : one;
        most += size_of(s, of[k]);
    }
    if (different <= 1)
        return one;
    most = most < s->limit ? most : s->limit;
    uint32_t *to = begin(s, most);
    if (!to)
        return 0;
    size_t count = 0;
    s->epoch++;
    for (size_t k = 0; k < n; k++)
        for (size_t i = s->start[of[k]]; i < s->start[of[k] + 1]; i++)
            if (s->stamp[s->items[i]] != s->epoch) {
                s->stamp[s->items[i]] = s->epoch;
                to[count++] = s->items[i];
            }
    qsort(to, count, sizeof *to, ad_ascending_indices);
    for (size_t k = 0; k < n; k++)
        if (of[k] && size_of(s, of[k]) == count)
            return of[k];
    return finish(s, count);
}
