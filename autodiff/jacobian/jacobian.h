/* Internals of sparse Jacobians: their sparsity pattern (pattern.c, over sets of columns in
   sets.c), the colouring of columns or rows (colours.c), and the program that computes them
   (jacobian.c). */
#ifndef AUTODIFF_JACOBIAN_H
#define AUTODIFF_JACOBIAN_H

#include "autodiff/internal.h"

/* Entries by rows, as in struct ad_sparse. */
struct pattern {
    size_t rows, cols;
    size_t *start;
    uint32_t *col;
};

/* Immutable sets of numbers below `limit`, ascending; number 0 is the empty set. */
struct sets {
    size_t limit;
    size_t *start; /* set k is items[start[k]] up to items[start[k + 1] - 1] */
    uint32_t *items;
    size_t n, max_sets, max_items;
    struct known_union {
        uint32_t a, b, both;
    } * known;              /* hash table of unions */
    uint32_t *stamp, epoch; /* per number: the last union of many sets that contained it */
    bool failed;            /* out of memory */
};

bool ad_sets_init(struct sets *sets, size_t limit);
void ad_sets_free(struct sets *sets);
/* Each returns the number of a set, 0 when out of memory. */
uint32_t ad_set_single(struct sets *sets, uint32_t item);
uint32_t ad_set_union(struct sets *sets, uint32_t a, uint32_t b);
uint32_t ad_set_union_all(struct sets *sets, size_t n, const uint32_t of[]);

/* Which elements of y depend on which of the x; false when out of memory. */
bool ad_pattern_find(struct pattern *pattern, ad_var y, size_t n, const ad_var x[]);
bool ad_pattern_transpose(const struct pattern *pattern, struct pattern *transposed);
void ad_pattern_free(struct pattern *pattern);

/* Colours the columns such that no row has a colour twice; `rows` is the transpose. Returns the
   number of colours, 0 when out of memory. */
size_t ad_colour_columns(const struct pattern *pattern, const struct pattern *transposed,
                         uint32_t *colour);

#endif
