/* Patterns of symmetric matrices (pattern.h). Colours are greedy (Curtis, Powell, Reid, J. Inst.
   Math. Appl. 13, 1974); the order is that of Cuthill and McKee (Proc. 24th ACM Conf., 1969) from
   an end of each component found as by Gibbs, Poole and Stockmeyer (SIAM J. Numer. Anal. 13, 1976),
   where it gives a narrower band than the columns as they are. */
#include "autodiff/ascending.h"
#include "pattern.h"
#include "autodiff/free.h"

#include <stdlib.h>
#include <string.h>

/* ---- entries ---- */

/* Sorts the rows of each column, and keeps one of equals. */
static void sort_rows(struct phys_pattern *p)
{
    size_t to = 0, from = 0;
    for (size_t j = 0; j < p->n; j++) {
        const size_t end = p->start[j + 1];
        qsort(p->row + from, end - from, sizeof *p->row, ad_ascending_indices);
        p->start[j] = to;
        for (; from < end; from++)
            if (to == p->start[j] || p->row[to - 1] != p->row[from])
                p->row[to++] = p->row[from];
    }
    p->start[p->n] = to;
}

/* Entries (i, j) and (j, i) of each, and the diagonal, column after column. */
static bool list_entries(struct phys_pattern *p, const struct ad_sparse *m)
{
    const size_t n = p->n;
    if (!(p->row = malloc((n + 2 * m->start[m->rows]) * sizeof *p->row)))
        return false;
    for (size_t j = 0; j < n; j++)
        p->start[j + 1] = 1;
    for (size_t i = 0; i < m->rows; i++)
        for (size_t k = m->start[i]; k < m->start[i + 1]; k++) {
            p->start[i % n + 1]++;
            p->start[m->col[k] % n + 1]++;
        }
    for (size_t j = 0; j < n; j++)
        p->start[j + 1] += p->start[j];
    for (size_t j = n; j-- > 0;) { /* from now on where the next row of column j goes */
        p->row[p->start[j]] = (uint32_t)j;
        p->place[j] = 1;
    }
    for (size_t i = 0; i < m->rows; i++)
        for (size_t k = m->start[i]; k < m->start[i + 1]; k++) {
            const uint32_t a = (uint32_t)(i % n), b = (uint32_t)(m->col[k] % n);
            p->row[p->start[a] + p->place[a]++] = b;
            p->row[p->start[b] + p->place[b]++] = a;
        }
    sort_rows(p);
    return true;
}

static bool couple_all(struct phys_pattern *p)
{
    const size_t n = p->n;
    if (n > SIZE_MAX / sizeof *p->row / n || !(p->row = malloc(n * n * sizeof *p->row)))
        return false;
    for (size_t k = 0; k < n * n; k++)
        p->row[k] = (uint32_t)(k % n);
    for (size_t j = 0; j <= n; j++)
        p->start[j] = j * n;
    return true;
}

/* ---- colours ---- */

static bool is_full(const struct phys_pattern *p) { return p->start[p->n] == p->n * p->n; }

/* Each column takes the first colour that none has with which it shares a row. */
static void choose_colours(struct phys_pattern *p, uint32_t *taken_by)
{
    p->colours = is_full(p) ? p->n : 0;
    for (uint32_t j = 0; j < p->colours; j++)
        p->colour[j] = j;
    if (p->colours)
        return;
    for (size_t k = 0; k < p->n; k++)
        taken_by[k] = (uint32_t)p->n;
    for (uint32_t j = 0; j < p->n; j++) {
        for (size_t a = p->start[j]; a < p->start[j + 1]; a++)
            for (size_t b = p->start[p->row[a]]; b < p->start[p->row[a] + 1] && p->row[b] < j; b++)
                taken_by[p->colour[p->row[b]]] = j;
        uint32_t colour = 0;
        while (taken_by[colour] == j)
            colour++;
        p->colour[j] = colour;
        p->colours = colour >= p->colours ? colour + 1 : p->colours;
    }
}

/* ---- order ---- */

static size_t degree(const struct phys_pattern *p, uint32_t j)
{
    return p->start[j + 1] - p->start[j];
}

static void swap(uint32_t *a, uint32_t *b)
{
    const uint32_t c = *a;
    *a = *b;
    *b = c;
}

/* Appends what is coupled to column `from`, level by level, neighbours of fewer entries first, to
   order[first]. Returns how many; *last: of the last level the one of fewest entries. */
static size_t spread(struct phys_pattern *p, uint32_t from, size_t first, uint32_t *last)
{
    size_t end = first, level = first;
    p->order[end++] = from;
    p->place[from] = (uint32_t)first;
    for (size_t at = first; at < end; at++) {
        const uint32_t j = p->order[at];
        const size_t begin = end;
        if (at == level) { /* the first of its level */
            level = end;
            *last = j;
        }
        if (degree(p, j) < degree(p, *last))
            *last = j;
        for (size_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const uint32_t i = p->row[k];
            if (p->place[i] != UINT32_MAX)
                continue;
            p->place[i] = 0;
            p->order[end++] = i;
            for (size_t at_i = end - 1;
                 at_i > begin && degree(p, p->order[at_i]) < degree(p, p->order[at_i - 1]); at_i--)
                swap(&p->order[at_i], &p->order[at_i - 1]);
        }
    }
    return end - first;
}

static size_t width_of(const struct phys_pattern *p)
{
    size_t width = 0;
    for (size_t j = 0; j < p->n; j++)
        for (size_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const uint32_t a = p->place[j], b = p->place[p->row[k]];
            const size_t apart = a > b ? a - b : b - a;
            width = apart > width ? apart : width;
        }
    return width;
}

static void as_they_are(struct phys_pattern *p)
{
    for (uint32_t j = 0; j < p->n; j++)
        p->order[j] = p->place[j] = j;
}

enum { TURNS = 4 }; /* from one end to the other */

static void choose_order(struct phys_pattern *p)
{
    as_they_are(p);
    const size_t plain = p->width = width_of(p);
    if (plain <= 1 || is_full(p))
        return;
    memset(p->place, 0xff, p->n * sizeof *p->place);
    size_t done = 0;
    for (uint32_t j = 0; j < p->n; j++) {
        if (p->place[j] != UINT32_MAX)
            continue;
        uint32_t from = j, last = j;
        size_t count = spread(p, from, done, &last);
        for (int turn = 0; turn < TURNS; turn++) {
            for (size_t k = done; k < done + count; k++)
                p->place[p->order[k]] = UINT32_MAX;
            from = last;
            spread(p, from, done, &last);
        }
        done += count;
    }
    for (uint32_t k = 0; k < p->n; k++)
        p->place[p->order[k]] = k;
    p->width = width_of(p);
    if (p->width >= plain) {
        as_they_are(p);
        p->width = plain;
    }
}

/* ---- */

bool phys_pattern_new(struct phys_pattern *pattern, size_t n, const struct ad_sparse *entries)
{
    struct phys_pattern *p = pattern;
    *p = (struct phys_pattern){.n = n, .start = calloc(n + 1, sizeof *p->start)};
    if (n >= UINT32_MAX || !p->start || !(p->colour = malloc(3 * n * sizeof *p->colour)))
        return false;
    p->order = p->colour + n;
    p->place = p->order + n;
    if (!(entries ? list_entries(p, entries) : couple_all(p)))
        return false; /* `place` is room so far */
    choose_colours(p, p->place);
    choose_order(p);
    return true;
}

bool phys_pattern_has(const struct phys_pattern *pattern, size_t i, size_t j)
{
    const uint32_t row = (uint32_t)i;
    const size_t start = pattern->start[j], end = pattern->start[j + 1];
    return bsearch(&row, pattern->row + start, end - start, sizeof row, ad_ascending_indices) !=
           NULL;
}

void phys_pattern_free(struct phys_pattern *pattern)
{
    AD_FREE(pattern->start, pattern->row, pattern->colour);
}
