/* The loss of a Hamiltonian network over a motion as a loop, compiled and direct, against the same
   unrolled. */
#include "scan_cases.h"

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
        struct ad_body b = {.size = sizeof b,
                            .tape = body,
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
    double at[WEIGHTS + 1][2 * HIDDEN], slope[WEIGHTS + 1][2 * HIDDEN], value;
    struct ad_error error = {0};
    for (int u = 0; u < 2; u++) {
        p[u] = loss(u, &tape[u], in[u], out[u]);
        for (int k = 0; k <= WEIGHTS; k++) {
            for (int i = 0; i < 2 * HIDDEN; i++)
                at[k][i] = sin(1 + i + 5 * k);
            ad_set(p[u], in[u][k], at[k]);
        }
        ad_run(p[u]);
    }
    assert_int_equal(ad_gradient(WEIGHTS + 1, in[0], (const double *[]){at[0], at[1], at[2], at[3]},
                                 out[0][WEIGHTS], &value,
                                 (double *[]){slope[0], slope[1], slope[2], slope[3]}, &error),
                     AD_OK);
    assert_close(value, *(const double *)ad_data(p[1], out[1][WEIGHTS]), 1e-13, 0);
    for (int k = 0; k < WEIGHTS; k++)
        for (size_t i = 0; i < size_of(out[0][k]); i++)
            assert_close(slope[k][i], ((const double *)ad_data(p[1], out[1][k]))[i], 1e-13, 1e-14);
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
        cmocka_unit_test(test_loss),
    };
    return cmocka_run_group_tests_name("scan of a loss", tests, NULL, NULL);
}
