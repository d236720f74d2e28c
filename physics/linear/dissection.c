/* Nested dissection (dissection.h). */
#include "dissection.h"
#include "autodiff/free.h"
#include "autodiff/lazy.h"

#include <stdlib.h>
#include <string.h>

enum side { LEFT, RIGHT, BETWEEN };

struct work {
    const struct phys_pattern *graph;
    struct phys_dissection *to;
    uint32_t *inside; /* [n]: the number of the part that is divided now, plus 1 */
    uint32_t *seen;   /* [n]: the search that has been there last */
    uint32_t *level, *queue, searches;
    int32_t *side;           /* [n], by vertices; by places in the part where METIS fills it */
    int32_t *start, *beside; /* the part as METIS reads it */
};

/* ---- by levels ---- */

/* Breadth first from a vertex of part `now`; how many are reached. */
static size_t search(struct work *w, uint32_t now, uint32_t from)
{
    const struct phys_pattern *g = w->graph;
    size_t end = 0;
    w->searches++;
    w->queue[end++] = from;
    w->seen[from] = w->searches;
    w->level[from] = 0;
    for (size_t at = 0; at < end; at++) {
        const uint32_t v = w->queue[at];
        for (size_t k = g->start[v]; k < g->start[v + 1]; k++) {
            const uint32_t u = g->row[k];
            if (w->inside[u] != now || w->seen[u] == w->searches)
                continue;
            w->seen[u] = w->searches;
            w->level[u] = w->level[v] + 1;
            w->queue[end++] = u;
        }
    }
    return end;
}

/* The level in the middle separates, without those that nothing behind is beside. */
static void divide_by_levels(struct work *w, uint32_t now, size_t count)
{
    const struct phys_pattern *g = w->graph;
    const uint32_t middle = w->level[w->queue[count / 2]];
    for (size_t k = 0; k < count; k++) {
        const uint32_t v = w->queue[k], level = w->level[v];
        bool behind = false;
        for (size_t j = g->start[v]; j < g->start[v + 1]; j++)
            behind = behind || (w->inside[g->row[j]] == now && w->level[g->row[j]] > level);
        w->side[v] = level > middle ? RIGHT : level < middle || !behind ? LEFT : BETWEEN;
    }
}

/* ---- by METIS ---- */

/* Its indices have 32 bits under this name. Returns 1 where it has done so. */
typedef int metis_separator(int32_t *n, int32_t *start, int32_t *beside, int32_t *weight,
                            int32_t *options, int32_t *size, int32_t *side);

static metis_separator *find_metis(void)
{
    static void *found, *const none = &found;
    void *at = __atomic_load_n(&found, __ATOMIC_ACQUIRE);
    metis_separator *separate;
    if (!at) {
        at = ad_lazy_find("libmetis.so.5", "METIS_ComputeVertexSeparator");
        at = at ? at : none;
        __atomic_store_n(&found, at, __ATOMIC_RELEASE);
    }
    memcpy(&separate, &at, sizeof separate); /* POSIX: a function's address as an object's */
    return at == none ? NULL : separate;
}

enum { LEAST = 100 }; /* vertices that are worth its call */

static bool divide_by_metis(struct work *w, uint32_t now, size_t count)
{
    const struct phys_pattern *g = w->graph;
    metis_separator *separate = count < LEAST ? NULL : find_metis();
    int32_t n = (int32_t)count, edges = 0, size = 0;
    if (!separate)
        return false;
    for (size_t k = 0; k < count; k++)
        w->level[w->queue[k]] = (uint32_t)k;
    for (size_t k = 0; k < count; k++) {
        const uint32_t v = w->queue[k];
        w->start[k] = edges;
        for (size_t j = g->start[v]; j < g->start[v + 1]; j++)
            if (g->row[j] != v && w->inside[g->row[j]] == now)
                w->beside[edges++] = (int32_t)w->level[g->row[j]];
    }
    w->start[count] = edges;
    int32_t *side = w->start + count + 1;
    int status;
#pragma omp critical(phys_separator) /* its random numbers are the process's */
    status = separate(&n, w->start, w->beside, NULL, NULL, &size, side);
    if (status != 1)
        return false;
    for (size_t k = 0; k < count; k++)
        w->side[w->queue[k]] = side[k];
    return true;
}

/* ---- */

/* Whether both parts have vertices, and none beside one of the other. */
static bool divided(const struct work *w, uint32_t now, const struct phys_dissected *p)
{
    const struct phys_pattern *g = w->graph;
    size_t have[3] = {0};
    for (size_t k = p->begin; k < p->end; k++) {
        const uint32_t v = w->to->vertex[k];
        if (w->side[v] < LEFT || w->side[v] > BETWEEN)
            return false;
        have[w->side[v]]++;
        for (size_t j = g->start[v]; j < g->start[v + 1]; j++)
            if (w->inside[g->row[j]] == now && w->side[v] + w->side[g->row[j]] == LEFT + RIGHT)
                return false;
    }
    return have[LEFT] && have[RIGHT];
}

enum { TURNS = 3 }; /* from one end to the other */

static bool divide(struct work *w, uint32_t now, const struct phys_dissected *p)
{
    const size_t count = p->end - p->begin;
    const uint32_t *vertex = w->to->vertex + p->begin;
    size_t reached = 0;
    for (size_t k = 0; k < count; k++)
        w->inside[vertex[k]] = now;
    for (int turn = 0; turn < TURNS; turn++)
        reached = search(w, now, reached ? w->queue[reached - 1] : vertex[0]);
    if (reached < count) { /* nothing joins them */
        for (size_t k = 0; k < count; k++)
            w->side[vertex[k]] = w->seen[vertex[k]] == w->searches ? LEFT : RIGHT;
        return true;
    }
    divide_by_levels(w, now, count);
    const bool by_levels = divided(w, now, p);
    return (by_levels && divide_by_metis(w, now, count) && divided(w, now, p)) ||
           (by_levels && (search(w, now, w->queue[0]), divide_by_levels(w, now, count), true));
}

/* Sorts the vertices of part `at` by sides, and adds its parts. */
static void enter(struct work *w, size_t at)
{
    struct phys_dissection *d = w->to;
    struct phys_dissected *p = &d->part[at];
    size_t ends[4] = {p->begin}, k = 0;
    for (int32_t side = LEFT; side <= BETWEEN; side++) {
        for (size_t i = p->begin; i < p->end; i++)
            if (w->side[d->vertex[i]] == side)
                w->queue[k++] = d->vertex[i];
        ends[side + 1] = p->begin + k;
    }
    memcpy(d->vertex + p->begin, w->queue, k * sizeof *d->vertex);
    p->separator = ends[BETWEEN];
    for (size_t side = LEFT; side <= RIGHT; side++) {
        p->part[side] = d->count;
        d->part[d->count++] = (struct phys_dissected){ends[side], ends[side], ends[side + 1], {0}};
    }
}

bool phys_dissection_new(struct phys_dissection *dissection, const struct phys_pattern *pattern)
{
    const size_t n = pattern->n, edges = pattern->start[n];
    *dissection = (struct phys_dissection){.n = n, .count = 1};
    struct phys_dissection *d = dissection;
    struct work w = {.graph = pattern, .to = d};
    d->vertex = malloc(n * sizeof *d->vertex);
    d->part = malloc(2 * n * sizeof *d->part); /* each division leaves a vertex more alone */
    w.inside = calloc(4 * n, sizeof *w.inside);
    w.side = malloc((3 * n + 1 + edges) * sizeof *w.side);
    const bool made = d->vertex && d->part && w.inside && w.side && edges < INT32_MAX;
    if (made) {
        w.seen = w.inside + n;
        w.level = w.seen + n;
        w.queue = w.level + n;
        w.start = w.side + n;
        w.beside = w.start + 2 * n + 1;
        d->part[0] = (struct phys_dissected){0, 0, n, {0}};
        for (uint32_t v = 0; v < n; v++)
            d->vertex[v] = v;
    }
    for (size_t at = 0; made && at < d->count; at++)
        if (divide(&w, (uint32_t)at + 1, &d->part[at]))
            enter(&w, at);
    AD_FREE(w.inside, w.side);
    return made;
}

void phys_dissection_free(struct phys_dissection *d) { AD_FREE(d->vertex, d->part); }
