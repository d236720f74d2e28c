/* Helpers shared by the random operations of a world (world.h). */
#ifndef TESTS_AUTODIFF_PROGRAMS_WORLD_OPERATIONS_H
#define TESTS_AUTODIFF_PROGRAMS_WORLD_OPERATIONS_H

#include "world.h"

/* Values stay of order one, and no operation amplifies rounding much: a wrong program is off by far
   more than a different order of additions. */
enum { LARGEST = 20000, ROWS = 7 };

struct matrix world_matrix(size_t rows, size_t cols); /* of zeros */
void world_add(struct world *w, ad_var var, struct matrix m);

/* One of 0 ... n-1, and a number that f32 can hold. */
size_t world_pick(struct world *w, size_t n);
double world_number(struct world *w, double lo, double hi);
/* One of the values so far. Recent ones are more likely, so that programs get deep. */
size_t world_any(struct world *w);
/* A value that broadcasts with value a (and b); a itself if none turns up. */
size_t world_partner(struct world *w, size_t a, size_t b);

/* Element (r, c) as broadcast. */
static inline double at(const struct matrix *m, size_t r, size_t c)
{
    return m->v[(m->rows == 1 ? 0 : r) * m->cols + (m->cols == 1 ? 0 : c)];
}

static inline size_t larger(size_t a, size_t b) { return a > b ? a : b; }

/* ---- operations: each adds a value, or none where none fits ---- */

typedef void world_operation(struct world *w);

/* Elementwise (world_elementwise.c). */
world_operation world_unary, world_binary, world_select_by_constant;
/* Sums and products (world_sums.c). */
world_operation world_sum, world_dot, world_matmul, world_transpose, world_scatter,
    world_sum_of_sums, world_diff, world_diff_adjoint;
/* Views, indices and places (world_views.c). */
world_operation world_slice, world_reshape, world_broadcast, world_gather, world_gather_one,
    world_concat, world_place;

#endif
