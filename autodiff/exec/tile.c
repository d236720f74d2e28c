/* Runs the instructions of a fused segment over one tile: one kernel call each, or one per row
   where an operand is not contiguous within the tile. */
#include "exec.h"

#include <string.h>

struct call ad_joined_call(const ad_program *p, const struct instruction *in, const struct tile *t,
                           uint32_t row)
{
    const struct instruction *next = in + 1;
    unsigned kind = in->joined - JOINED_PRODUCT;
    bool circle = in->joined == JOINED_CIRCLE, sine = p->values[in->value].op == AD_OP_sin;
    bool last = kind / N_VARIANTS == PRODUCT_PLUS || kind / N_VARIANTS == PRODUCT_MINUS;
    const uint32_t locs[] = {(circle && !sine ? next
                              : circle        ? in
                                              : next)
                                 ->loc[0],
                             (circle && !sine ? in : next)->loc[0], in->loc[1], in->loc[in->n_in],
                             next->loc[last ? 2 : 1]};
    void *at[LENGTH(locs)];
    for (size_t k = 0; k < LENGTH(locs); k++) {
        const struct cursor c = cursor_at(p, &p->locs[locs[k]], t);
        at[k] = cursor_row(&c, row);
    }
    size_t n = in->flat ? (size_t)t->rows * t->cols : t->cols;
    if (circle)
        return (struct call){.n = n, .o = at[0], .second = at[1], .a = at[2]};
    return (struct call){.run = p->kernels->product_sum[kind / N_VARIANTS][kind % N_VARIANTS],
                         .n = n,
                         .o = at[0],
                         .a = at[2],
                         .b = at[3],
                         .c = at[4]};
}

static void run_joined(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    for (uint32_t r = 0; r < (in->flat ? 1 : t->rows); r++) {
        const struct call c = ad_joined_call(p, in, t, r);
        if (c.run)
            c.run(c.n, c.o, c.a, c.b, c.c);
        else
            p->kernels->sin_and_cos(c.n, c.o, c.second, c.a);
    }
}

static void elementwise(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct cursor o = cursor_at(p, &p->locs[in->loc[0]], t);
    const struct cursor a = cursor_at(p, &p->locs[in->loc[1]], t);
    const struct cursor b = in->n_in > 1 ? cursor_at(p, &p->locs[in->loc[2]], t) : a;
    const struct cursor c = in->n_in > 2 ? cursor_at(p, &p->locs[in->loc[3]], t) : a;
    if (in->flat) {
        in->run((size_t)t->rows * t->cols, o.start, cursor_row(&a, 0), cursor_row(&b, 0),
                cursor_row(&c, 0));
        return;
    }
    if (t->cols == 1 && ad_run_column(p, in, t))
        return;
    for (uint32_t r = 0; r < t->rows; r++)
        in->run(t->cols, cursor_row(&o, r), cursor_row(&a, r), cursor_row(&b, r),
                cursor_row(&c, r));
}

static void put(const ad_program *p, char *row, size_t i, double x)
{
    if (p->type == AD_F32)
        ((float *)(void *)row)[i] = (float)x;
    else
        ((double *)(void *)row)[i] = x;
}

/* The rows of the tile follow each other without a gap. */
static bool is_contiguous(const ad_program *p, const struct cursor *c, const struct tile *t)
{
    return t->rows > 1 && !c->list && c->step == t->cols * p->element;
}

/* Columns [t->col, t->col + t->cols) of scale*(x[i+1] - x[i]); a repeated last column is the one
   before it again. Contiguous rows are one: only what their last columns hold is wrong. */
static void diff(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct cursor o = cursor_at(p, &p->locs[in->loc[0]], t);
    const struct cursor x = cursor_at(p, &p->locs[in->loc[1]], t);
    const size_t e = p->element;
    bool last = in->loc[3] && t->col + t->cols == p->values[in->value].cols;
    bool whole = last && is_contiguous(p, &o, t) && is_contiguous(p, &x, t);
    double scale = p->numbers[in->loc[2]];
    if (whole)
        p->kernels->diff((size_t)t->rows * t->cols - 1, o.start, x.start, scale);
    for (uint32_t r = 0; r < t->rows; r++) {
        const char *a = cursor_row(&x, r);
        char *y = cursor_row(&o, r);
        if (!whole)
            p->kernels->diff(t->cols - last, y, a, scale);
        if (last && t->cols > 1)
            memcpy(y + (t->cols - 1) * e, y + (t->cols - 2) * e, e);
        else if (last) /* reads before the tile */
            p->kernels->diff(1, y, a - e, scale);
    }
}

/* Columns of the adjoint: g[i] = scale*(u[i-1] - u[i]) inside, with the repeated column of u
   counted to the one before it. */
static void diff_adjoint(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct loc *x = &p->locs[in->loc[1]];
    const struct cursor o = cursor_at(p, &p->locs[in->loc[0]], t);
    struct tile rows = *t; /* from their first column on */
    rows.col = 0;
    const struct cursor from_u = cursor_at(p, x, &rows);
    uint32_t width = p->values[in->value].cols, end = t->col + t->cols;
    bool whole = t->cols == width && is_contiguous(p, &o, t) && is_contiguous(p, &from_u, t);
    double scale = p->numbers[in->loc[2]];
    if (whole)
        p->kernels->diff((size_t)t->rows * width - 1, o.start + p->element, from_u.start, -scale);
    for (uint32_t r = 0; r < t->rows; r++) {
        const char *u = cursor_row(&from_u, r);
        char *y = cursor_row(&o, r);
        double extra = in->loc[3] && end >= width - 1 ? element_at(p, u, width - 1) : 0;
        uint32_t from = t->col ? t->col : 1, to = end < width ? end : width - 1;
        if (from < to && !whole)
            p->kernels->diff(to - from, y + (from - t->col) * p->element,
                             u + (from - 1) * p->element, -scale);
        if (t->col == 0)
            put(p, y, 0, -scale * (element_at(p, u, 0) + (width == 2 ? extra : 0)));
        if (width > 2 && t->col <= width - 2 && end > width - 2)
            put(p, y, width - 2 - t->col,
                scale * (element_at(p, u, width - 3) - (element_at(p, u, width - 2) + extra)));
        if (end == width)
            put(p, y, width - 1 - t->col, scale * (element_at(p, u, width - 2) + extra));
    }
}

static double row_sum(const ad_program *p, const struct loc *a, const char *row, size_t n)
{
    return a->cs ? p->kernels->sum(n, row) : (double)n * element_at(p, row, 0);
}

static void sum(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct loc *a = &p->locs[in->loc[1]];
    const struct cursor x = cursor_at(p, a, t);
    double *into = sink_copy(p, &p->sinks[in->loc[3]], t->chunk);
    if (in->flat)
        *into += row_sum(p, a, cursor_row(&x, 0), (size_t)t->rows * t->cols);
    else
        for (uint32_t r = 0; r < t->rows; r++)
            *into += row_sum(p, a, cursor_row(&x, r), t->cols);
}

static void sum_cols(const ad_program *p, const struct segment *g, const struct instruction *in,
                     const struct tile *t)
{
    const struct loc *a = &p->locs[in->loc[1]];
    const struct cursor x = cursor_at(p, a, t);
    double *into = sink_copy(p, &p->sinks[in->loc[3]], g->by_rows ? 0 : t->chunk) + t->row;
    for (uint32_t r = 0; r < t->rows; r++)
        into[r] += row_sum(p, a, cursor_row(&x, r), t->cols);
}

static void add_rows(const ad_program *p, const struct segment *g, const struct instruction *in,
                     const struct tile *t)
{
    const struct loc to = sink_rows(p, g, in, t->chunk);
    const struct cursor o = cursor_at(p, &to, t);
    const struct cursor a = cursor_at(p, &p->locs[in->loc[1]], t);
    if (t->cols == 1) {
        bool subtract = in->run == p->kernels->op[AD_OP_sub][0];
        ad_add_column(p, &o, &a, t->rows, subtract ? -1 : 1);
        return;
    }
    for (uint32_t r = 0; r < t->rows; r++) {
        char *into = cursor_row(&o, r);
        in->run(t->cols, into, into, cursor_row(&a, r), NULL);
    }
}

void ad_run_instruction(const ad_program *p, const struct segment *g, const struct instruction *in,
                        const struct tile *t)
{
    switch (in->kind) {
    case DO_ELEMENTWISE:
        elementwise(p, in, t);
        break;
    case DO_DIFF:
        diff(p, in, t);
        break;
    case DO_DIFF_ADJOINT:
        diff_adjoint(p, in, t);
        break;
    case DO_SUM:
        sum(p, in, t);
        break;
    case DO_SUM_COLS:
        sum_cols(p, g, in, t);
        break;
    default:
        add_rows(p, g, in, t);
    }
}

/* ---- values that are not finite ---- */

/* Looks at the rows and columns of the tile in the memory of an instruction's value. */
static void look(const ad_program *p, const struct instruction *in, const struct tile *t,
                 struct check *check)
{
    const struct cursor o = cursor_at(p, &p->locs[in->value], t);
    size_t lane;
    for (uint32_t r = 0; r < t->rows && in->value < check->value; r++) {
        const char *row = cursor_row(&o, r);
        if (p->kernels->nonfinite(t->cols, row, &lane))
            *check = (struct check){in->value, t->row + r, t->col + (uint32_t)lane,
                                    element_at(p, row, lane)};
    }
}

void ad_inspect_value(const ad_program *p, const struct instruction *in, struct check *check)
{
    const struct value *v = &p->values[in->value];
    ad_inspect_tile(p, in, &(struct tile){.cols = v->cols, .base = {p->memory}}, check);
}

void ad_inspect_tile(const ad_program *p, const struct instruction *in, const struct tile *t,
                     struct check *check)
{
    struct tile all = *t;
    all.row = 0;
    all.rows = p->values[in->value].rows;
    look(p, in, &all, check);
}

void ad_run_tile(const ad_program *p, const struct segment *g, const struct tile *t,
                 struct check *check)
{
    const struct instruction *in = p->instructions + g->first, *end = in + g->count;
    for (; in < end; in++) {
        if (in->joined > JOINED_BEHIND && !check && (in->flat || t->cols > 1)) {
            run_joined(p, in++, t);
            continue;
        }
        ad_run_instruction(p, g, in, t);
        if (check && in->kind <= DO_DIFF_ADJOINT)
            look(p, in, t, check);
    }
}
