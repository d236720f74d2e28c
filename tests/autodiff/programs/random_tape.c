/* Random recordings (random_tape.h). Values are kept of order one: each new value is evaluated as
   soon as it is recorded, and scaled if it is large. */
#include "random_steps.h"

#include <stdlib.h>

static void range(struct maker *m, ad_var x, double *lo, double *hi)
{
    plain_run(&m->r->plain);
    const double *v = m->r->plain.value[x.id];
    *lo = INFINITY, *hi = -INFINITY;
    for (size_t k = 0; k < ad_rows(x) * ad_cols(x); k++) {
        *lo = fmin(*lo, v[k]);
        *hi = fmax(*hi, v[k]);
    }
}

ad_var maker_into(struct maker *m, ad_var x, double lo, double hi)
{
    double least, most;
    range(m, x, &least, &most);
    if (least >= lo && most <= hi)
        return x;
    double width = most - least, scale = width > hi - lo ? (hi - lo) / width : 1;
    double middle = (lo + hi) / 2 - scale * (least + most) / 2;
    if (!isfinite(scale) || !isfinite(middle) || scale == 0)
        return ad_add((lo + hi) / 2, ad_mul(0.1 * (hi - lo), ad_tanh(x)));
    return ad_add((double)(float)middle, ad_mul((double)(float)(0.99 * scale), x));
}

void maker_keep(struct maker *m, ad_var x)
{
    double lo, hi;
    range(m, x, &lo, &hi);
    if (!(fmax(fabs(lo), fabs(hi)) < 4) && isfinite(lo) && isfinite(hi))
        x = ad_mul((double)(float)(2 / fmax(fabs(lo), fabs(hi))), x);
    else if (!isfinite(lo) || !isfinite(hi))
        x = ad_select(ad_lt(ad_abs(x), 4.0), x, 0.5);
    if (m->n == m->max) {
        m->max = 2 * m->max + 64;
        m->pool = realloc(m->pool, m->max * sizeof *m->pool);
        if (!m->pool)
            abort();
    }
    m->pool[m->n++] = x;
}

ad_var maker_any(struct maker *m)
{
    size_t recent = m->n < 8 ? m->n : 8;
    return m->pool[pick(m, 3) ? m->n - 1 - pick(m, recent) : pick(m, m->n)];
}

ad_var maker_partner(struct maker *m, ad_var a)
{
    for (int attempt = 0; attempt < 12; attempt++) {
        ad_var b = maker_any(m);
        if (fits(ad_rows(a), ad_rows(b)) && fits(ad_cols(a), ad_cols(b)) &&
            larger(ad_rows(a), ad_rows(b)) * larger(ad_cols(a), ad_cols(b)) <= m->most)
            return b;
    }
    return a;
}

/* ---- programs ---- */

static void add_inputs(struct maker *m)
{
    struct random_tape *r = m->r;
    r->n_inputs = 1 + pick(m, TAPE_INPUTS);
    r->n_held = pick(m, 3) ? 0 : pick(m, r->n_inputs);
    for (size_t k = 0; k < r->n_inputs; k++) {
        size_t rows = k == 0 || pick(m, 3) ? m->rows : 1, cols = k == 0 || pick(m, 3) ? m->cols : 1;
        r->in[k] = ad_input(r->tape, rows, cols, NULL);
        if (k < r->n_held)
            ad_hold(r->in[k]);
        for (int v = 0; v < 2; v++)
            r->values[v][k] = random_values(&m->random, rows * cols, -1.5, 1.5);
        plain_set(&r->plain, r->in[k], r->values[0][k]);
        maker_keep(m, r->in[k]);
    }
    double *c = random_values(&m->random, m->rows * m->cols, -1, 1);
    maker_keep(m, ad_const(r->tape, m->rows, m->cols, c));
    free(c);
}

static ad_var objective(struct maker *m)
{
    ad_var y = ad_mean(m->pool[m->n - 1]);
    size_t terms = 2 + m->n / 10;
    for (size_t k = 0; k < terms; k++) {
        ad_var x = k < 4 ? maker_any(m) : m->pool[pick(m, m->n)];
        y = ad_add(y, ad_mul(number(m, 0.5, 1.5), ad_mean(ad_mul(x, ad_add(1.0, x)))));
    }
    return y;
}

static ad_var add_gradient(struct maker *m, ad_var y)
{
    struct random_tape *r = m->r;
    ad_var g[TAPE_INPUTS], next = ad_scalar(r->tape, 0);
    ad_grad(y, r->n_inputs, r->in, g);
    for (size_t k = 0; k < r->n_inputs; k++) {
        r->out[r->n_out++] = g[k];
        next = ad_add(next, ad_dot(g[k], g[k]));
    }
    return next;
}

void random_tape_init(struct random_tape *r, uint64_t seed, size_t nodes)
{
    static const size_t rows[] = {1, 1, 2, 3, 5, 8, 12, 40, 300};
    static const size_t cols[] = {1, 1, 2, 3, 7, 8, 16, 17, 33, 100, 257, 1000};
    struct maker m = {.r = r, .random = seed * 2 + 1};
    *r = (struct random_tape){.tape = ad_tape_new(pick(&m, 4) ? AD_F64 : AD_F32)};
    plain_init(&r->plain, r->tape);
    size_t budget = pick(&m, 4) ? 60000 : 400000; /* elements of all nodes */
    size_t smooth = nodes < 400 ? 12 * pick(&m, 2) : pick(&m, 8) ? 40 : 0;
    r->order = (int)pick(&m, 5) / 2;
    do {
        m.rows = rows[pick(&m, sizeof rows / sizeof *rows)];
        m.cols = cols[pick(&m, sizeof cols / sizeof *cols)];
    } while (m.rows * m.cols * (nodes + 20) > budget && m.rows * m.cols > 8);
    m.most = 2 * m.rows * m.cols + 64;
    add_inputs(&m);
    size_t own = r->order == 0 ? nodes : r->order == 1 ? nodes / 4 : nodes / 12;
    for (size_t k = 0; r->plain.n < own + 8 && k < 20 * own + 20; k++)
        random_step(&m, smooth);
    for (size_t k = 0; k < 5; k++)
        r->out[r->n_out++] = k ? maker_any(&m) : m.pool[m.n - 1];
    r->out[r->n_out++] = m.pool[pick(&m, m.n)];
    ad_var y = objective(&m);
    r->out[r->n_out++] = y;
    for (int k = 0; k < r->order; k++)
        y = add_gradient(&m, y);
    plain_run(&r->plain);
    free(m.pool);
}

void random_tape_release(struct random_tape *r)
{
    plain_release(&r->plain);
    for (int v = 0; v < 2; v++)
        for (size_t k = 0; k < r->n_inputs; k++)
            free(r->values[v][k]);
    ad_tape_free(r->tape);
}
