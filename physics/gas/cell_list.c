/* Pairs of near bodies by a grid of cells no smaller than the reach (cell_list.h): the partners of
   a body lie in its own cell and the eight around it (Allen and Tildesley, Computer Simulation of
   Liquids, section 5.3.2). Half of these neighbours are searched, so that each pair is found once.
 */
#include "cell_list.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdlib.h>

struct grid {
    double low[2], size; /* corner, side of a cell */
    size_t columns, rows;
    uint32_t *begin;         /* [cells + 1] where each cell begins in `bodies` */
    uint32_t *bodies, *cell; /* [n]: bodies by cell; the cell of each */
};

void phys_near_free(struct phys_near *near)
{
    AD_FREE(near->first, near->second);
    *near = (struct phys_near){0};
}

/* Cells as large as the reach, but no more of them than there are bodies, however far some are. */
static enum ad_status measure(struct grid *g, size_t n, const double *x, double reach,
                              struct ad_error *error)
{
    double high[2] = {-INFINITY, -INFINITY}, most = ceil(sqrt((double)n));
    g->low[0] = g->low[1] = INFINITY;
    for (size_t k = 0; k < 2 * n; k++) {
        if (!isfinite(x[k]))
            return ad_fail(error, AD_E_NONFINITE, "body %zu is nowhere: its %c is not finite",
                           k / 2 + 1, k % 2 ? 'y' : 'x');
        g->low[k % 2] = fmin(g->low[k % 2], x[k]);
        high[k % 2] = fmax(high[k % 2], x[k]);
    }
    double width = high[0] - g->low[0], height = high[1] - g->low[1];
    g->size = fmax(reach, fmax(width, height) / most);
    g->columns = (size_t)(width / g->size) + 1;
    g->rows = (size_t)(height / g->size) + 1;
    return AD_OK;
}

static size_t cell_of(const struct grid *g, const double *x)
{
    return (size_t)((x[1] - g->low[1]) / g->size) * g->columns +
           (size_t)((x[0] - g->low[0]) / g->size);
}

/* A counting sort. */
static enum ad_status fill(struct grid *g, size_t n, const double *x, struct ad_error *error)
{
    size_t cells = g->columns * g->rows;
    g->begin = calloc(cells + 1 + 2 * n, sizeof *g->begin);
    if (!g->begin)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu bodies", n);
    g->bodies = g->begin + cells + 1;
    g->cell = g->bodies + n;
    for (size_t i = 0; i < n; i++)
        g->begin[g->cell[i] = (uint32_t)cell_of(g, x + 2 * i)]++;
    for (size_t c = 1; c <= cells; c++)
        g->begin[c] += g->begin[c - 1];
    for (size_t i = n; i-- > 0;)
        g->bodies[--g->begin[g->cell[i]]] = (uint32_t)i;
    return AD_OK;
}

static bool grow(struct phys_near *near)
{
    size_t room = near->room ? 2 * near->room : 1024;
    uint32_t *first = realloc(near->first, room * sizeof *first);
    if (first)
        near->first = first;
    uint32_t *second = realloc(near->second, room * sizeof *second);
    if (second)
        near->second = second;
    if (first && second)
        near->room = room;
    return first && second;
}

static bool add(struct phys_near *near, uint32_t i, uint32_t j)
{
    if (near->n == near->room && !grow(near))
        return false;
    near->first[near->n] = i < j ? i : j;
    near->second[near->n++] = i < j ? j : i;
    return true;
}

/* Partners of the body at place `at` of the sorted list among those from `from` to `to`. */
static bool meet(const struct grid *g, const double *x, double square, size_t at, size_t from,
                 size_t to, struct phys_near *near)
{
    uint32_t i = g->bodies[at];
    for (size_t k = from; k < to; k++) {
        uint32_t j = g->bodies[k];
        double dx = x[2 * i] - x[2 * j], dy = x[2 * i + 1] - x[2 * j + 1];
        if (dx * dx + dy * dy <= square && !add(near, i, j))
            return false;
    }
    return true;
}

/* The rest of its own cell and the cell to the right, then three cells of the row above: cells that
   follow each other in the list. */
static bool meet_all(const struct grid *g, size_t n, const double *x, double reach,
                     struct phys_near *near)
{
    for (size_t at = 0; at < n; at++) {
        size_t cell = g->cell[g->bodies[at]], column = cell % g->columns;
        size_t right = column + 1 < g->columns, left = column > 0, above = cell + g->columns;
        if (!meet(g, x, reach * reach, at, at + 1, g->begin[cell + right + 1], near))
            return false;
        if (above < g->columns * g->rows && !meet(g, x, reach * reach, at, g->begin[above - left],
                                                  g->begin[above + right + 1], near))
            return false;
    }
    return true;
}

enum ad_status phys_near_pairs(size_t bodies, const double *x, double reach, struct phys_near *near,
                               struct ad_error *error)
{
    struct grid g = {0};
    near->n = 0;
    if (measure(&g, bodies, x, reach, error) != AD_OK || fill(&g, bodies, x, error) != AD_OK)
        return error->status;
    if (!meet_all(&g, bodies, x, reach, near))
        ad_fail(error, AD_E_MEMORY, "out of memory for the pairs of %zu bodies", bodies);
    free(g.begin);
    return error->status;
}
