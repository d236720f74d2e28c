/* Loops as motions: an integrator differentiated along 20000 steps, against the variational
   equations, and the loss of a Hamiltonian network over a motion, against the same unrolled. */
#include "scan_cases.h"

/* ---- the driven pendulum by rk4 ---- */

enum { STEPS = 20000, STORED = 500 };
static const double dt = 0.01;

static void field(const ad_var x[3], ad_var w, ad_var f[3])
{
    f[0] = x[1];
    f[1] = ad_sub(ad_mul(0.3, ad_cos(x[2])), ad_mul(w, ad_sin(x[0])));
    f[2] = ad_scalar(w.tape, 1);
}

static void rk4(const ad_var x[3], ad_var w, ad_var next[3])
{
    static const double at[] = {0.5, 0.5, 1}, weight[] = {1, 2, 2, 1};
    ad_var y[3] = {x[0], x[1], x[2]}, f[3];
    for (int k = 0; k < 3; k++)
        next[k] = x[k];
    for (int stage = 0; stage < 4; stage++) {
        field(y, w, f);
        for (int k = 0; k < 3; k++) {
            next[k] = ad_add(next[k], ad_mul(dt / 6 * weight[stage], f[k]));
            if (stage < 3)
                y[k] = ad_add(x[k], ad_mul(dt * at[stage], f[k]));
        }
    }
}

/* Of x, then its derivatives by q, v and w, one after the other. */
static void variations(const double x[12], double w, double f[12])
{
    f[0] = x[1];
    f[1] = 0.3 * cos(x[2]) - w * sin(x[0]);
    f[2] = 1;
    for (int k = 0; k < 3; k++) {
        const double *d = x + 3 + 3 * k;
        f[3 + 3 * k] = d[1];
        f[4 + 3 * k] = -w * cos(x[0]) * d[0] - (k == 2 ? sin(x[0]) : 0);
        f[5 + 3 * k] = 0;
    }
}

static void step_variations(double x[12], double w)
{
    static const double at[] = {0.5, 0.5, 1}, weight[] = {1, 2, 2, 1};
    double y[12], next[12], f[12];
    for (int k = 0; k < 12; k++)
        y[k] = next[k] = x[k];
    for (int stage = 0; stage < 4; stage++) {
        variations(y, w, f);
        for (int k = 0; k < 12; k++) {
            next[k] += dt / 6 * weight[stage] * f[k];
            y[k] = x[k] + (stage < 3 ? dt * at[stage] * f[k] : 0);
        }
    }
    for (int k = 0; k < 12; k++)
        x[k] = next[k];
}

static void test_variational_equations(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var x[3], next[3], start[4], last[3], g[2][3], w = ad_input(body, 1, 1, "w");
    for (int k = 0; k < 4; k++)
        start[k] = ad_input(tape, 1, 1, NULL);
    for (int k = 0; k < 3; k++)
        x[k] = ad_input(body, 1, 1, NULL);
    rk4(x, w, next);
    struct ad_body b = {.tape = body,
                        .n_state = 3,
                        .state = x,
                        .next = next,
                        .n_shared = 1,
                        .shared = &w,
                        .checkpoints = STORED};
    assert_int_equal(ad_scan(tape, &b, STEPS, start, NULL, &start[3], last, NULL), AD_OK);
    for (int i = 0; i < 2; i++)
        ad_grad(last[i], 3, (ad_var[]){start[0], start[1], start[3]}, g[i]);
    const double at[] = {0.4, 0.1, 0, 1.3};
    double want[12] = {0.4, 0.1, 0, 1, 0, 0, 0, 1}, is;
    for (int t = 0; t < STEPS; t++)
        step_variations(want, at[3]);
    ad_program *p = compile(tape, 6, &g[0][0]);
    for (int k = 0; k < 4; k++)
        ad_set(p, start[k], &at[k]);
    ad_run(p);
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++) {
            ad_get(p, g[i][k], &is);
            assert_close(is, want[3 + 3 * k + i], 1e-9, 1e-9);
        }
    ad_program_free(p);
    ad_tape_free(tape);
    ad_tape_free(body);
}

/* ---- the loss of a Hamiltonian network ---- */

enum { SAMPLES = 4, HIDDEN = 6, TURNS = 7, WEIGHTS = 3 };

/* A step of a network's Hamiltonian: forces are its gradient, inside the step. */
static ad_var network_step(ad_var z, const ad_var w[WEIGHTS])
{
    ad_var hidden = ad_tanh(ad_add(ad_matmul(w[0], false, z, false), w[1])), slope;
    ad_grad(ad_sum(ad_matmul(w[2], false, hidden, false)), 1, &z, &slope);
    return ad_add(
        z, ad_mul(0.1, ad_concat_rows(2, (ad_var[]){ad_row(slope, 1), ad_neg(ad_row(slope, 0))})));
}

/* Mean square of a motion from given states, by the weights. */
static ad_program *loss(bool unrolled, ad_tape **tape, ad_var in[WEIGHTS + 1], ad_var out[4])
{
    static const size_t rows[] = {HIDDEN, HIDDEN, 1}, cols[] = {2, 1, HIDDEN};
    ad_tape *body = ad_tape_new(AD_F64);
    ad_var z = ad_input(body, 2, SAMPLES, "z"), w[WEIGHTS], next, all;
    *tape = ad_tape_new(AD_F64);
    for (int k = 0; k < WEIGHTS; k++) {
        in[k] = ad_input(*tape, rows[k], cols[k], NULL);
        w[k] = ad_input(body, rows[k], cols[k], NULL);
    }
    in[WEIGHTS] = ad_input(*tape, 2, SAMPLES, "start");
    next = network_step(z, w);
    if (unrolled) {
        ad_var parts[TURNS], x = in[WEIGHTS];
        for (int t = 0; t < TURNS; t++)
            parts[t] = x = network_step(x, in);
        all = ad_concat_cols(TURNS, parts);
    } else {
        struct ad_body b = {.tape = body,
                            .n_state = 1,
                            .state = &z,
                            .next = &next,
                            .n_shared = WEIGHTS,
                            .shared = w,
                            .n_out = 1,
                            .out = &next,
                            .checkpoints = 3};
        ad_var last;
        assert_int_equal(ad_scan(*tape, &b, TURNS, &in[WEIGHTS], NULL, in, &last, &all), AD_OK);
    }
    out[WEIGHTS] = ad_mean(ad_square(ad_sub(all, 0.3)));
    ad_grad(out[WEIGHTS], WEIGHTS, in, out);
    ad_tape_free(body);
    return compile(*tape, WEIGHTS + 1, out);
}

static void test_loss(void **state)
{
    (void)state;
    ad_tape *tape[2];
    ad_var in[2][WEIGHTS + 1], out[2][WEIGHTS + 1];
    ad_program *p[2];
    for (int u = 0; u < 2; u++) {
        p[u] = loss(u, &tape[u], in[u], out[u]);
        double at[2 * HIDDEN];
        for (int k = 0; k <= WEIGHTS; k++) {
            for (int i = 0; i < 2 * HIDDEN; i++)
                at[i] = sin(1 + i + 5 * k);
            ad_set(p[u], in[u][k], at);
        }
        ad_run(p[u]);
    }
    for (int k = 0; k <= WEIGHTS; k++)
        for (size_t i = 0; i < size_of(out[0][k]); i++) {
            const double *a = ad_data(p[0], out[0][k]), *b = ad_data(p[1], out[1][k]);
            assert_close(a[i], b[i], 1e-13, 1e-14);
        }
    for (int u = 0; u < 2; u++) {
        ad_program_free(p[u]);
        ad_tape_free(tape[u]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_variational_equations),
        cmocka_unit_test(test_loss),
    };
    return cmocka_run_group_tests_name("scan of motions", tests, NULL, NULL);
}
