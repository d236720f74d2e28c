#include "scan_cases.h"

#include "autodiff/internal.h"

#include <stdlib.h>
#include <string.h>

/* ---- steps ---- */

static void logistic(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                     ad_var out[])
{
    (void)in, (void)out;
    next[0] = ad_mul(w[0], ad_mul(s[0], ad_sub(1.0, s[0])));
}

/* A layer of two columns, inputs of two columns, outputs of two of its rows. */
static void layer(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                  ad_var out[])
{
    next[0] = ad_tanh(ad_add(ad_add(ad_matmul(w[0], false, s[0], false), in[0]), w[1]));
    out[0] = ad_mul(ad_slice_rows(next[0], 1, 2), ad_exp(ad_slice_rows(in[0], 0, 2)));
}

/* States change places: next states lie where states do. */
static void swaps(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                  ad_var out[])
{
    (void)w;
    next[0] = s[1];
    next[1] = s[0];
    next[2] = ad_add(ad_mul(s[2], ad_sin(s[0])), in[0]);
    out[0] = s[1];
}

/* What is not used, not changed, constant, an input, a shared value; twice the same. */
static void oddities(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                     ad_var out[])
{
    next[0] = ad_sin(in[0]);
    next[1] = s[1];
    next[2] = ad_scalar(in[0].tape, 0.75);
    out[0] = in[0];
    out[1] = w[0];
    out[2] = ad_mul(ad_mul(s[0], s[1]), s[2]);
    out[3] = out[2];
}

static void map(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[], ad_var out[])
{
    (void)s, (void)next;
    out[0] = ad_mul(ad_exp(ad_mul(in[0], w[0])), in[1]);
}

/* Pendulum by leapfrog, and its energy. */
static void pendulum(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                     ad_var out[])
{
    (void)in;
    ad_var p = ad_sub(s[1], ad_mul(ad_mul(0.05, w[0]), ad_sin(s[0])));
    next[0] = ad_add(s[0], ad_mul(0.1, p));
    next[1] = ad_sub(p, ad_mul(ad_mul(0.05, w[0]), ad_sin(next[0])));
    out[0] = ad_sub(ad_mul(0.5, ad_square(next[1])), ad_mul(w[0], ad_cos(next[0])));
}

static void branches(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                     ad_var out[])
{
    ad_var x = ad_max(ad_mul(w[0], s[0]), ad_sub(in[0], s[0]));
    next[0] = ad_select(ad_gt(x, 0.3), ad_sqrt(ad_abs(x)), ad_mul(0.7, ad_cos(x)));
    out[0] = ad_mul(ad_detach(s[0]), next[0]);
}

/* Three systems of two equations in each step. */
static void systems(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                    ad_var out[])
{
    next[0] = ad_solve(ad_add(w[0], ad_mul(0.1, in[0])), s[0], AD_LU);
    out[0] = ad_logdet(ad_add(w[0], ad_mul(0.1, in[0])), AD_LU);
}

/* A loop of three steps in each step. */
static void nested(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                   ad_var out[])
{
    ad_tape *inner = ad_tape_new(s[0].tape->type);
    ad_var a = ad_input(inner, 2, 1, "a"), k = ad_input(inner, 1, 1, "k");
    ad_var b = ad_input(inner, 1, 1, "b");
    ad_var after = ad_sin(ad_add(ad_mul(a, k), b)), half = ad_mul(0.5, ad_sum(after));
    const struct ad_body body = {.size = sizeof body,
                                 .tape = inner,
                                 .n_state = 1,
                                 .state = &a,
                                 .next = &after,
                                 .n_in = 1,
                                 .in = &b,
                                 .n_shared = 1,
                                 .shared = &k,
                                 .n_out = 1,
                                 .out = &half,
                                 .checkpoints = 2};
    ad_scan(s[0].tape, &body, 3, s, in, w, next, out);
    ad_tape_free(inner);
}

const struct scan_case scan_cases[] = {
    {"logistic", 1, 0, 1, 0, {{1, 1}}, {{0, 0}}, {{1, 1}}, logistic, 0.3, 0.9},
    {"layer", 1, 1, 2, 1, {{3, 2}}, {{3, 2}}, {{3, 3}, {3, 1}}, layer, -1, 1},
    {"swaps", 3, 1, 0, 1, {{2, 1}, {2, 1}, {2, 1}}, {{2, 1}}, {{0, 0}}, swaps, -1, 1},
    {"oddities", 3, 1, 1, 4, {{1, 1}, {1, 1}, {1, 1}}, {{1, 1}}, {{2, 2}}, oddities, -1, 1},
    {"map", 0, 2, 1, 1, {{0, 0}}, {{2, 3}, {2, 3}}, {{2, 1}}, map, -1, 1},
    {"pendulum", 2, 0, 1, 1, {{1, 3}, {1, 3}}, {{0, 0}}, {{1, 1}}, pendulum, 0.2, 1},
    {"branches", 1, 1, 1, 1, {{2, 2}}, {{2, 2}}, {{1, 1}}, branches, 0.1, 1},
    {"systems", 1, 1, 1, 1, {{2, 3}}, {{4, 3}}, {{4, 1}}, systems, 0.2, 1},
    {"nested", 1, 1, 1, 1, {{2, 1}}, {{1, 3}}, {{1, 1}}, nested, 0.2, 1},
};
const size_t n_scan_cases = LENGTH(scan_cases);

const struct scan_case *scan_case_named(const char *name)
{
    for (size_t k = 0; k < n_scan_cases; k++)
        if (!strcmp(scan_cases[k].name, name))
            return &scan_cases[k];
    fail_msg("no case %s", name);
    return NULL;
}

/* ---- recording ---- */

static void inputs(ad_tape *tape, size_t n, const struct scan_shape shape[], size_t times,
                   ad_var x[])
{
    for (size_t k = 0; k < n; k++)
        x[k] = ad_input(tape, shape[k].rows, shape[k].cols * times, "x");
}

struct ad_body scan_body(const struct scan_case *c, ad_tape *tape, struct scan_vars *v)
{
    inputs(tape, c->n_state, c->state, 1, v->state);
    inputs(tape, c->n_in, c->in, 1, v->in);
    inputs(tape, c->n_shared, c->shared, 1, v->shared);
    c->step(v->state, v->in, v->shared, v->next, v->out);
    return (struct ad_body){.size = sizeof(struct ad_body),
                            .tape = tape,
                            .n_state = c->n_state,
                            .state = v->state,
                            .next = v->next,
                            .n_in = c->n_in,
                            .in = v->in,
                            .n_shared = c->n_shared,
                            .shared = v->shared,
                            .n_out = c->n_out,
                            .out = v->out};
}

static void unroll(const struct scan_case *c, size_t steps, const ad_var x[], ad_var last[],
                   ad_var out[])
{
    ad_var state[SCAN_MOST], in[SCAN_MOST], next[SCAN_MOST], part[SCAN_MOST];
    ad_var *kept = malloc((c->n_out * steps + 1) * sizeof *kept);
    assert_non_null(kept);
    memcpy(state, x, c->n_state * sizeof *x);
    for (size_t t = 0; t < steps; t++) {
        for (size_t k = 0; k < c->n_in; k++)
            in[k] = ad_slice_cols(x[c->n_state + k], t * c->in[k].cols, c->in[k].cols);
        c->step(state, in, x + c->n_state + c->n_in, next, part);
        memcpy(state, next, c->n_state * sizeof *next);
        for (size_t k = 0; k < c->n_out; k++)
            kept[k * steps + t] = part[k];
    }
    memcpy(last, state, c->n_state * sizeof *state);
    for (size_t k = 0; k < c->n_out; k++)
        out[k] = ad_concat_cols(steps, kept + k * steps);
    free(kept);
}

struct scan_made scan_make(const struct scan_case *c, enum ad_type type, size_t steps,
                           size_t checkpoints, bool unrolled)
{
    struct scan_made m = {.tape = ad_tape_new(type), .n = c->n_state + c->n_in + c->n_shared};
    inputs(m.tape, c->n_state, c->state, 1, m.x);
    inputs(m.tape, c->n_in, c->in, steps, m.x + c->n_state);
    inputs(m.tape, c->n_shared, c->shared, 1, m.x + c->n_state + c->n_in);
    if (unrolled) {
        unroll(c, steps, m.x, m.last, m.out);
    } else {
        struct scan_vars v;
        ad_tape *tape = ad_tape_new(type);
        struct ad_body body = scan_body(c, tape, &v);
        body.checkpoints = checkpoints;
        ad_scan(m.tape, &body, steps, m.x, m.x + c->n_state, m.x + c->n_state + c->n_in, m.last,
                m.out);
        ad_tape_reset(tape); /* the loop has a copy */
        ad_tape_free(tape);
    }
    assert_tape_ok(m.tape);
    m.y = ad_scalar(m.tape, 0);
    for (size_t k = 0; k < c->n_state; k++)
        m.y = ad_add(m.y, weighted_sum(m.last[k]));
    for (size_t k = 0; k < c->n_out; k++)
        m.y = ad_add(m.y, weighted_sum(m.out[k]));
    return m;
}

/* ---- derivatives ---- */

double *scan_derivatives(const struct scan_case *c, enum ad_type type, size_t steps,
                         size_t checkpoints, bool unrolled, int order, size_t threads, size_t *n)
{
    struct scan_made m = scan_make(c, type, steps, checkpoints, unrolled);
    ad_var out[1 + SCAN_ORDERS * 3 * SCAN_MOST], y = m.y;
    size_t n_out = 0, size = 0;
    out[n_out++] = y;
    for (int o = 0; o < order; o++) {
        ad_var *g = out + n_out;
        ad_grad(y, m.n, m.x, g);
        y = weighted_sum(g[0]);
        for (size_t k = 1; k < m.n; k++)
            y = ad_add(y, weighted_sum(g[k]));
        n_out += m.n;
    }
    assert_tape_ok(m.tape);
    ad_program *p = compile(m.tape, n_out, out);
    if (threads)
        ad_set_threads(p, threads);
    else
        assert_true(ad_native(p, INFINITY, NULL));
    uint64_t seed = 7;
    for (size_t k = 0; k < m.n; k++) {
        double *at = random_values(&seed, ad_rows(m.x[k]) * ad_cols(m.x[k]), c->lo, c->hi);
        ad_set(p, m.x[k], at);
        free(at);
    }
    for (size_t k = 0; k < n_out; k++)
        size += ad_rows(out[k]) * ad_cols(out[k]);
    double *values = malloc(size * sizeof *values);
    assert_non_null(values);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    *n = 0;
    for (size_t k = 0; k < n_out; k++) {
        ad_get(p, out[k], values + *n);
        *n += ad_rows(out[k]) * ad_cols(out[k]);
    }
    ad_program_free(p);
    ad_tape_free(m.tape);
    return values;
}

void scan_set_all(ad_program *p, const struct scan_made *m, uint64_t seed)
{
    for (size_t k = 0; k < m->n; k++) {
        double *at = random_values(&seed, size_of(m->x[k]), 0.2, 0.9);
        assert_int_equal(ad_set(p, m->x[k], at), AD_OK);
        free(at);
    }
}

void scan_assert_like(ad_program *p, ad_var x, ad_program *q, ad_var y)
{
    const double *a = ad_data(p, x), *b = ad_data(q, y);
    for (size_t i = 0; i < size_of(x); i++)
        assert_close(a[i], b[i], 1e-12, 1e-12);
}
