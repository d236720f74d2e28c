/* The random programs of world.h. */
#include "world_operations.h"

#include <stdlib.h>

struct matrix world_matrix(size_t rows, size_t cols)
{
    struct matrix m = {rows, cols, calloc(rows * cols, sizeof *m.v)};
    assert_non_null(m.v);
    return m;
}

size_t world_pick(struct world *w, size_t n) { return below(&w->structure, n); }

double world_number(struct world *w, double lo, double hi)
{
    return (float)uniform(&w->structure, lo, hi);
}

void world_add(struct world *w, ad_var var, struct matrix m)
{
    assert_tape_ok(w->tape);
    assert_int_equal(ad_rows(var), m.rows);
    assert_int_equal(ad_cols(var), m.cols);
    w->var[w->n] = var;
    w->m[w->n++] = m;
}

size_t world_any(struct world *w)
{
    return world_pick(w, 3) ? w->n - 1 - world_pick(w, w->n < 6 ? w->n : 6) : world_pick(w, w->n);
}

static bool fits(size_t a, size_t b) { return a == b || a == 1 || b == 1; }

size_t world_partner(struct world *w, size_t a, size_t b)
{
    for (int attempt = 0; attempt < 20; attempt++) {
        size_t c = world_any(w), rows = larger(w->m[a].rows, w->m[b].rows);
        size_t cols = larger(w->m[a].cols, w->m[b].cols);
        if (fits(rows, w->m[c].rows) && fits(cols, w->m[c].cols) &&
            larger(rows, w->m[c].rows) * larger(cols, w->m[c].cols) <= LARGEST)
            return c;
    }
    return a;
}

/* ---- worlds ---- */

static const struct {
    world_operation *record;
    size_t weight;
} operations[] = {
    {world_unary, 6},        {world_binary, 8},      {world_sum, 1},
    {world_dot, 1},          {world_matmul, 2},      {world_slice, 4},
    {world_transpose, 1},    {world_reshape, 1},     {world_broadcast, 1},
    {world_gather, 2},       {world_gather_one, 1},  {world_scatter, 2},
    {world_concat, 2},       {world_place, 1},       {world_diff, 3},
    {world_diff_adjoint, 1}, {world_sum_of_sums, 2}, {world_select_by_constant, 1},
};

static world_operation *pick_operation(struct world *w)
{
    size_t total = 0, k = 0;
    for (size_t i = 0; i < sizeof operations / sizeof operations[0]; i++)
        total += operations[i].weight;
    for (total = world_pick(w, total); total >= operations[k].weight; k++)
        total -= operations[k].weight;
    return operations[k].record;
}

static struct matrix random_matrix(uint64_t *state, size_t rows, size_t cols)
{
    return (struct matrix){rows, cols, random_values(state, rows * cols, -1.5, 1.5)};
}

void world_init(struct world *w, enum ad_type type, uint64_t structure, uint64_t values,
                size_t cols, size_t n_operations, bool smooth)
{
    *w = (struct world){.tape = ad_tape_new(type), .structure = structure, .values = values};
    w->smooth = smooth;
    w->n_inputs = 1 + world_pick(w, MAX_INPUTS);
    for (size_t k = 0; k < w->n_inputs; k++) {
        size_t rows = world_pick(w, 3) ? 1 + world_pick(w, ROWS) : 1, wide = world_pick(w, 4);
        struct matrix m = random_matrix(&w->values, rows, k == 0 || wide ? cols : 1);
        world_add(w, ad_input(w->tape, m.rows, m.cols, NULL), m);
    }
    struct matrix constant =
        random_matrix(&w->structure, 1 + world_pick(w, 3), world_pick(w, 2) ? cols : 1);
    world_add(w, ad_const(w->tape, constant.rows, constant.cols, constant.v), constant);
    for (size_t k = 0; k < n_operations && w->n < MAX_NODES - 4; k++)
        pick_operation(w)(w);
}

void world_release(struct world *w)
{
    for (size_t k = 0; k < w->n; k++)
        free(w->m[k].v);
    ad_tape_free(w->tape);
}
