/* Colours the columns of a sparse matrix such that columns of one colour share no row and can be
   computed together (A. R. Curtis, M. J. D. Powell, J. K. Reid, IMA J. Appl. Math. 13, 117, 1974);
   greedy. */
#include "jacobian.h"

#include <stdlib.h>

/* Beyond this many steps each column gets a colour of its own: a matrix that dense needs about as
   many. */
static const double MOST_STEPS = 4e9;

static bool is_dense(const struct pattern *p)
{
    double steps = 0;
    for (size_t r = 0; r < p->rows; r++) {
        size_t n = p->start[r + 1] - p->start[r];
        if (n == p->cols)
            return true;
        steps += (double)n * (double)n;
    }
    return steps > MOST_STEPS;
}

size_t ad_colour_columns(const struct pattern *p, const struct pattern *t, size_t most,
                         uint32_t *colour)
{
    size_t n = 0;
    for (size_t c = 0; c < p->cols; c++)
        colour[c] = UINT32_MAX;
    if (is_dense(p)) {
        for (size_t c = 0; c < p->cols; c++)
            colour[c] = (uint32_t)c;
        return p->cols;
    }
    size_t *taken = calloc(p->cols + 1, sizeof *taken); /* per colour: 1 + the column it met last */
    for (size_t c = 0; taken && c < p->cols && n <= most; c++) {
        if (t->start[c] == t->start[c + 1])
            continue; /* an empty column */
        for (size_t i = t->start[c]; i < t->start[c + 1]; i++)
            for (size_t k = p->start[t->col[i]]; k < p->start[t->col[i] + 1]; k++)
                if (colour[p->col[k]] != UINT32_MAX)
                    taken[colour[p->col[k]]] = c + 1;
        uint32_t free_one = 0;
        while (taken[free_one] == c + 1)
            free_one++;
        colour[c] = free_one;
        n = free_one + 1 > n ? free_one + 1 : n;
    }
    bool done = taken;
    free(taken);
    return done && !n ? 1 : n; /* at least one run */
}
