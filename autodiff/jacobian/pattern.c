/* The sparsity pattern of a Jacobian, found node by node: for each element of a value, the set of
   columns it depends on. It is independent of the values at which the Jacobian is taken. */
#include "autodiff/free.h"
#include "autodiff/gradient/sweep.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

struct search {
    const ad_tape *tape;
    struct sets sets;
    uint32_t *
        *of; /* per node: a set for each element, row-major; NULL: no element depends on an x */
    uint32_t *room; /* for the terms of a union */
    size_t max_room;
};

static uint32_t element(const struct search *s, uint32_t id, size_t r, size_t c)
{
    const struct elements x = ad_broadcast_elements(node_at(s->tape, id));
    return s->of[id] ? s->of[id][element_at(&x, r, c)] : 0;
}

/* ---- elementwise ---- */

static uint32_t of_operands(struct search *s, const struct node *n, size_t r, size_t c)
{
    unsigned operands = ad_derivative_operands(n->op);
    uint32_t all = 0;
    for (unsigned k = 0; k < ad_ops[n->op].arity; k++)
        if (operands >> k & 1)
            all = ad_set_union(&s->sets, all, element(s, n->in[k], r, c));
    return all;
}

/* ---- sums: each element is one of several terms ---- */

/* Terms in the order of their results: term k goes into result to[k]. */
struct terms {
    size_t n, max_to, max_set;
    uint32_t *to, *set;
};

static bool add_term(struct terms *t, size_t to, uint32_t set)
{
    if (!set)
        return true;
    if (!ad_reserve((void **)&t->to, t->n, &t->max_to, 1, sizeof *t->to) ||
        !ad_reserve((void **)&t->set, t->n, &t->max_set, 1, sizeof *t->set))
        return false;
    t->to[t->n] = (uint32_t)to;
    t->set[t->n++] = set;
    return true;
}

/* The union of the terms of each of `size` results. */
static bool add_up(struct search *s, const struct terms *t, size_t size, uint32_t *result)
{
    size_t *start = calloc(size + 2, sizeof *start);
    uint32_t *sorted = malloc((t->n + 1) * sizeof *sorted);
    bool done = start && sorted;
    for (size_t k = 0; done && k < t->n; k++)
        start[t->to[k] + 2]++;
    for (size_t k = 2; done && k < size + 2; k++)
        start[k] += start[k - 1];
    for (size_t k = 0; done && k < t->n; k++)
        sorted[start[t->to[k] + 1]++] = t->set[k];
    for (size_t k = 0; done && k < size; k++)
        result[k] = ad_set_union_all(&s->sets, start[k + 1] - start[k], sorted + start[k]);
    AD_FREE(start, sorted);
    return done;
}

static bool sum(struct search *s, const struct node *n, uint32_t *result)
{
    const struct node *x = node_at(s->tape, n->in[0]);
    const struct elements to = ad_summed_elements(s->tape, n);
    struct terms t = {0};
    bool done = true;
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; done && c < x->cols; c++)
            done = add_term(&t, element_at(&to, r, c), element(s, n->in[0], r, c));
    done = done && add_up(s, &t, node_size(n), result);
    AD_FREE(t.to, t.set);
    return done;
}

static bool placed(struct search *s, const struct node *n, uint32_t *result)
{
    const uint32_t *list = s->tape->lists + n->aux;
    struct terms t = {0};
    bool done = true;
    for (size_t k = 0; k < list[0]; k++) {
        const uint32_t *part = list + 1 + 3 * k;
        const struct node *x = node_at(s->tape, part[0]);
        for (size_t r = 0; r < x->rows; r++)
            for (size_t c = 0; done && c < x->cols; c++)
                done =
                    add_term(&t, (part[1] + r) * n->cols + part[2] + c, element(s, part[0], r, c));
    }
    done = done && add_up(s, &t, node_size(n), result);
    AD_FREE(t.to, t.set);
    return done;
}

/* ---- products, differences, running sums ---- */

/* The union of row (or column) k of node id. */
static uint32_t line(struct search *s, uint32_t id, bool column, size_t k)
{
    const struct node *x = node_at(s->tape, id);
    size_t n = column ? x->rows : x->cols;
    if (!s->of[id])
        return 0;
    for (size_t i = 0; i < n; i++)
        s->room[i] = column ? s->of[id][i * x->cols + k] : s->of[id][k * x->cols + i];
    return ad_set_union_all(&s->sets, n, s->room);
}

static bool product(struct search *s, const struct node *n, uint32_t *result)
{
    bool ta = n->aux & 1, tb = n->aux >> 1 & 1;
    uint32_t *of_row = malloc(((size_t)n->rows + n->cols) * sizeof *of_row), *of_col;
    if (!of_row)
        return false;
    of_col = of_row + n->rows;
    for (size_t r = 0; r < n->rows; r++)
        of_row[r] = line(s, n->in[0], ta, r);
    for (size_t c = 0; c < n->cols; c++)
        of_col[c] = line(s, n->in[1], !tb, c);
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            result[r * n->cols + c] = ad_set_union(&s->sets, of_row[r], of_col[c]);
    free(of_row);
    return true;
}

/* Column c of a difference or of its adjoint: the union of the neighbours that exist. */
static uint32_t neighbours(struct search *s, const struct node *n, size_t r, size_t c)
{
    size_t width = node_at(s->tape, n->in[0])->cols, from, to;
    if (n->op == AD_OP_diff) {
        from = c + 1 < width ? c : width - 2;
        to = from + 1;
    } else {
        from = c ? c - 1 : 0;
        to = c < width ? c : width - 1;
        to = n->in[2] && c + 2 >= n->cols ? width - 1 : to;
    }
    uint32_t all = 0;
    for (size_t k = from; k <= to; k++)
        all = ad_set_union(&s->sets, all, element(s, n->in[0], r, k));
    return all;
}

static void running(struct search *s, const struct node *n, uint32_t *result)
{
    bool rows = n->aux & CUMSUM_ROWS, reversed = n->aux & CUMSUM_REVERSED;
    size_t length = rows ? n->rows : n->cols, others = rows ? n->cols : n->rows;
    for (size_t k = 0; k < others; k++) {
        uint32_t all = 0;
        for (size_t j = 0; j < length; j++) {
            size_t i = reversed ? length - 1 - j : j, r = rows ? i : k, c = rows ? k : i;
            all = ad_set_union(&s->sets, all, element(s, n->in[0], r, c));
            result[r * n->cols + c] = all;
        }
    }
}

/* Small systems and a user's own operation: each element depends on all of its column of the
   operands. */
static void solved(struct search *s, const struct node *n, uint32_t *result)
{
    for (size_t c = 0; c < n->cols; c++) {
        uint32_t all = line(s, n->in[0], true, c);
        if (n->op == AD_OP_solve || n->op == AD_OP_custom_adjoint)
            all = ad_set_union(&s->sets, all, line(s, n->in[2], true, c));
        for (size_t r = 0; r < n->rows; r++)
            result[r * n->cols + c] = all;
    }
}

/* Loops: each element by all operands. */
static void looped(struct search *s, const struct node *n, uint32_t *result)
{
    uint32_t all = 0;
    for (size_t k = 0; k < n_inputs(s->tape, n); k++) {
        const uint32_t x = input_of(s->tape, n, k);
        for (size_t r = 0; r < node_at(s->tape, x)->rows; r++)
            all = ad_set_union(&s->sets, all, line(s, x, false, r));
    }
    for (size_t k = 0; k < node_size(n); k++)
        result[k] = all;
}

/* ---- nodes ---- */

static bool fill(struct search *s, const struct node *n, uint32_t *result)
{
    switch (n->op) {
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
    case AD_OP_scatter:
    case AD_OP_scatter_cols:
        return sum(s, n, result);
    case AD_OP_place:
        return placed(s, n, result);
    case AD_OP_matmul:
        return product(s, n, result);
    case AD_OP_cumsum:
        running(s, n, result);
        return true;
    case AD_OP_solve:
    case AD_OP_logdet:
    case AD_OP_custom:
    case AD_OP_custom_adjoint:
        solved(s, n, result);
        return true;
    case AD_OP_scan:
    case AD_OP_scan_adjoint:
        looped(s, n, result);
        return true;
    case AD_OP_factor: /* derivatives pass through its operands */
        return true;
    default:
        break;
    }
    const bool stencil = n->op == AD_OP_diff || n->op == AD_OP_diff_adjoint;
    const uint32_t *of = s->of[n->in[0]];
    const struct elements at = ad_viewed_elements(s->tape, n);
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            result[r * n->cols + c] = ad_ops[n->op].elementwise ? of_operands(s, n, r, c)
                                      : stencil                 ? neighbours(s, n, r, c)
                                      : of                      ? of[element_at(&at, r, c)]
                                                                : 0;
    return true;
}

/* Sets of node id: its own, if it is one of the x, united with those of its operands. */
static bool visit(struct search *s, uint32_t id)
{
    const struct node *n = node_at(s->tape, id);
    bool any = false;
    for (size_t k = 0; k < n_inputs(s->tape, n); k++) {
        const struct node *x = node_at(s->tape, input_of(s->tape, n, k));
        any = any || s->of[input_of(s->tape, n, k)];
        size_t longest = x->rows > x->cols ? x->rows : x->cols;
        if (longest > s->max_room &&
            !ad_reserve((void **)&s->room, 0, &s->max_room, longest, sizeof *s->room))
            return false;
    }
    if (!any)
        return true;
    size_t size = node_size(n);
    uint32_t *own = s->of[id], *result = calloc(size, sizeof *result);
    if (!result)
        return false;
    s->of[id] = NULL;
    bool done = fill(s, n, result);
    for (size_t k = 0; own && done && k < size; k++)
        result[k] = ad_set_union(&s->sets, result[k], own[k]);
    free(own);
    s->of[id] = result;
    return done && !s->sets.failed;
}

static bool number_columns(struct search *s, size_t n, const ad_var x[], uint32_t last)
{
    uint32_t column = 0;
    for (size_t k = 0; k < n; k++) {
        size_t size = ad_rows(x[k]) * ad_cols(x[k]);
        if (x[k].id <= last && !s->of[x[k].id] && !(s->of[x[k].id] = calloc(size, sizeof **s->of)))
            return false;
        for (size_t i = 0; i < size; i++, column++)
            if (x[k].id <= last)
                s->of[x[k].id][i] =
                    ad_set_union(&s->sets, s->of[x[k].id][i], ad_set_single(&s->sets, column));
    }
    return !s->sets.failed;
}

static bool write_pattern(const struct search *s, struct pattern *p, const uint32_t *of)
{
    size_t entries = 0;
    const size_t *start = s->sets.start;
    for (size_t r = 0; of && r < p->rows; r++)
        entries += start[of[r] + 1] - start[of[r]];
    p->start = calloc(p->rows + 1, sizeof *p->start);
    p->col = malloc((entries + 1) * sizeof *p->col);
    if (!p->start || !p->col)
        return false;
    for (size_t r = 0; of && r < p->rows; r++) {
        size_t n = start[of[r] + 1] - start[of[r]];
        if (n)
            memcpy(p->col + p->start[r], s->sets.items + start[of[r]], n * sizeof *p->col);
        p->start[r + 1] = p->start[r] + n;
    }
    return true;
}

bool ad_pattern_find(struct pattern *p, ad_var y, size_t n, const ad_var x[])
{
    struct search s = {.tape = y.tape, .of = calloc((size_t)y.id + 1, sizeof *s.of)};
    *p = (struct pattern){.rows = ad_rows(y) * ad_cols(y)};
    for (size_t k = 0; k < n; k++)
        p->cols += ad_rows(x[k]) * ad_cols(x[k]);
    bool done = s.of && ad_sets_init(&s.sets, p->cols) && number_columns(&s, n, x, y.id);
    for (uint32_t id = 1; done && id <= y.id; id++)
        done = visit(&s, id);
    done = done && write_pattern(&s, p, s.of[y.id]);
    for (uint32_t id = 0; s.of && id <= y.id; id++)
        free(s.of[id]);
    AD_FREE(s.of, s.room);
    ad_sets_free(&s.sets);
    if (!done)
        ad_pattern_free(p);
    return done;
}

bool ad_pattern_transpose(const struct pattern *p, struct pattern *t)
{
    size_t entries = p->start[p->rows];
    *t = (struct pattern){.rows = p->cols,
                          .cols = p->rows,
                          .start = calloc(p->cols + 2, sizeof *t->start),
                          .col = malloc((entries + 1) * sizeof *t->col)};
    if (!t->start || !t->col) {
        ad_pattern_free(t);
        return false;
    }
    for (size_t k = 0; k < entries; k++)
        t->start[p->col[k] + 2]++;
    for (size_t k = 2; k < p->cols + 2; k++)
        t->start[k] += t->start[k - 1];
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++)
            t->col[t->start[p->col[k] + 1]++] = (uint32_t)r;
    return true;
}

void ad_pattern_free(struct pattern *p)
{
    AD_FREE(p->start, p->col);
    *p = (struct pattern){0};
}
