/* Derivatives of a user's own operation y = f(x). First ones are its adjoint's: (df/dx)' g is an
   operation of x, y and g. Those of the adjoint come from its recorded form, in copies of x and g:
   what else x and g depend on is the sweep's. Forward, row i of df/dx is the adjoint of unit i. */
#include "autodiff/free.h"
#include "sweep.h"

#include <stdlib.h>

/* (df/dx)' g as the recorded form has it. */
static ad_var recorded(ad_tape *tape, const struct custom *c, ad_var x, ad_var y, ad_var g)
{
    ad_var part[CUSTOM_INPUTS], slope[CUSTOM_INPUTS] = {{0}};
    if (!c->by.recorded)
        return ad_refuse(tape, AD_E_ARGUMENT,
                         c->by.adjoint
                             ? "custom \"%s\": a second derivative needs its recorded form (NULL)"
                             : "custom \"%s\": a derivative needs its adjoint or its recorded form "
                               "(both NULL)",
                         c->name);
    for (uint32_t k = 0, row = 0; k < c->n; row += c->rows[k++])
        part[k] = ad_slice_rows(x, row, c->rows[k]);
    c->by.recorded(c->by.user, part, y, g, slope);
    for (size_t k = 0; k < c->n; k++) {
        if (tape->error.status == AD_OK && (slope[k].tape != tape || !ad_is_current(slope[k])))
            return ad_refuse(tape, AD_E_TAPE,
                             "custom \"%s\": its recorded form leaves gx[%zu] unset", c->name, k);
        slope[k] = ad_broadcast(slope[k], c->rows[k], ad_cols(x));
    }
    return c->n == 1 ? slope[0] : ad_concat_rows(c->n, slope);
}

/* (df/dx)' g. */
static ad_var adjoint(ad_tape *tape, uint32_t number, ad_var x, ad_var y, ad_var g)
{
    const struct custom c = tape->customs[number]; /* recording may move the others */
    if (c.by.adjoint)
        return ad_append(tape, (struct node){.op = AD_OP_custom_adjoint,
                                             .rows = c.inputs,
                                             .cols = (uint32_t)ad_cols(x),
                                             .in = {x.id, y.id, g.id},
                                             .aux = number});
    return recorded(tape, &c, x, y, g);
}

/* The recorded adjoint of node n, in copies of x and g. */
static ad_var in_copies(ad_tape *tape, const struct node *n, ad_var copy[2])
{
    const struct custom c = tape->customs[n->aux];
    copy[0] = ad_copy(ad_at(tape, n->in[0]));
    copy[1] = ad_copy(ad_at(tape, n->in[2]));
    ad_var y = ad_append(tape, (struct node){.op = AD_OP_custom,
                                             .rows = (uint32_t)c.by.rows,
                                             .cols = n->cols,
                                             .in = {copy[0].id},
                                             .aux = n->aux});
    return recorded(tape, &c, copy[0], y, copy[1]);
}

/* df/dx t. */
static ad_var along(ad_tape *tape, uint32_t number, ad_var x, ad_var y, ad_var t, bool tainted)
{
    size_t rows = ad_rows(y), cols = ad_cols(y);
    ad_var *row = malloc(rows * sizeof *row), result = ad_at(tape, 0);
    double *unit = calloc(rows, sizeof *unit);
    if (!row || !unit)
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the derivative");
    for (size_t i = 0; row && unit && i < rows; i++) {
        unit[i] = 1;
        ad_var g = ad_broadcast(ad_const(tape, rows, 1, unit), rows, cols);
        unit[i] = 0;
        row[i] = ad_sum_rows(ad_binary(tainted ? AD_OP_mul0 : AD_OP_mul,
                                       AD_ARG(adjoint(tape, number, x, y, g)), AD_ARG(t)));
    }
    if (row && unit)
        result = rows == 1 ? row[0] : ad_concat_rows(rows, row);
    AD_FREE(row, unit);
    return result;
}

void ad_custom_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g)
{
    ad_var slope = adjoint(s->tape, n->aux, sweep_var(s, n->in[0]), y, g);
    ad_accumulate(s, n->in[0],
                  s->tainted ? ad_select(ad_sum_rows(ad_ne(g, 0.0)), slope, 0.0) : slope);
}

void ad_custom_adjoint_rule(struct sweep *s, const struct node *n, ad_var g)
{
    const ad_var x = sweep_var(s, n->in[0]), y = sweep_var(s, n->in[1]);
    ad_var copy[2], by[2];
    if (!is_needed(s, x.id)) { /* linear in the adjoint of y */
        ad_accumulate(s, n->in[2], along(s->tape, n->aux, x, y, g, s->tainted));
        return;
    }
    ad_var slope = in_copies(s->tape, n, copy);
    if (s->tape->error.status != AD_OK ||
        ad_sweep_back(s->tape, 1, &slope, &g, s->tainted, 2, copy, by) != AD_OK)
        return;
    ad_accumulate(s, n->in[0], by[0]);
    if (is_needed(s, n->in[2]))
        ad_accumulate(s, n->in[2], by[1]);
}

ad_var ad_custom_tangent(const struct node *n, ad_var y, const ad_var t[3], bool tainted)
{
    ad_tape *tape = y.tape;
    const ad_var x = ad_at(tape, n->in[0]);
    ad_var copy[2], moving[2], by[2], dy = ad_at(tape, 0);
    if (n->op == AD_OP_custom)
        return t[0].id ? along(tape, n->aux, x, y, t[0], tainted) : t[0];
    if (!t[0].id)
        return t[2].id ? adjoint(tape, n->aux, x, ad_at(tape, n->in[1]), t[2]) : t[2];
    ad_var slope = in_copies(tape, n, copy);
    size_t moves = 0;
    for (size_t k = 0; k < 2; k++)
        if (t[2 * k].id) {
            moving[moves] = copy[k];
            by[moves++] = t[2 * k];
        }
    if (tape->error.status == AD_OK)
        ad_sweep_forward(tape, tainted, moves, moving, by, 1, &slope, &dy);
    return dy;
}
