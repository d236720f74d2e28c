/* Charts of derivatives, jobs, networks, wave packets and the gas: their files have the documented
   columns, rows and numbers. No times are asserted. */
#include "chart_table.h"
#include "tests/apps/picture_text.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "apps/bench/hand/hand.h"
#include "autodiff/status.h"
#include "tests/mentions.h"

#include <string.h>

static void test_gradients(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart gradients --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("gradients.csv");
    assert_int_equal(t->rows, HAND_N);
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_number(t, r, "tape_gradient_ns") > 0);
        assert_true(table_number(t, r, "hand_gradient_ns") > 0);
        assert_true(table_number(t, r, "limit_gradient_ns") > 0);
        assert_true(table_number(t, r, "native_limit_ratio") > 0);
        assert_true(table_number(t, r, "tape_product_ns") > 0);
        assert_true(table_number(t, r, "hessian_blocks_ns") > 0);
        assert_true(table_number(t, r, "disagreement") < 1e-11);
        assert_true(table_number(t, r, "second_disagreement") < 1e-11);
    }
    table_free(t);
    t = table_read("gradients-sizes.csv");
    assert_int_equal(t->rows, 2); /* of one length */
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_number(t, r, "tape_ns") > 0 && table_number(t, r, "native_ns") > 0);
        assert_true(table_number(t, r, "memory_ratio") > 0);
        assert_true(table_number(t, r, "memory_ratio") < 2);
        assert_true(table_number(t, r, "disagreement") < 1e-12);
    }
    table_free(t);
    t = table_read("forces.csv");
    assert_int_equal(t->rows, HAND_FORCES + 1); /* and what a run of a program takes */
    for (size_t r = 0; r < HAND_FORCES; r++) {
        assert_true(table_number(t, r, "force_ns") > 0 && table_number(t, r, "force_ratio") > 0);
        assert_true(table_number(t, r, "force_disagreement") < 1e-12);
    }
    assert_true(table_is(t, HAND_FORCES, "force", "program"));
    table_free(t);
}

/* Three bodies moved together have the same action: their gradient adds up to nothing, and so do
   the second derivatives times any vector. */
static void test_gradient_values(void **state)
{
    (void)state;
    static const char *const names[] = {"gradient", "product"};
    struct table *t = table_read("gradients-values.csv");
    table_expect_header(t, "scene,coordinate,slice,x,u,gradient,product,adam");
    for (size_t k = 0; k < 2; k++) {
        double sum = 0, largest = 0;
        for (size_t r = 0; r < t->rows; r++) {
            double value = table_number(t, r, names[k]);
            if (table_is(t, r, "scene", "threebody")) {
                sum += value;
                largest = fmax(largest, fabs(value));
            }
        }
        assert_true(largest > 0);
        assert_close(sum, 0, 0, 1e-13 * 600 * largest);
    }
    table_free(t);
}

/* Bytes a slice, and a pair, do not rise with their number. */
static void test_linear(void **state)
{
    (void)state;
    static const char *const names[] = {"program_bytes", "tape_bytes"};
    assert_int_equal(shell("$LA chart linear --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("linear.csv");
    assert_int_equal(t->rows, 3 + 4); /* of slices, of bodies */
    for (size_t r = 1; r < t->rows; r++) {
        double factor = table_number(t, r, "units") / table_number(t, r - 1, "units");
        if (strcmp(t->cell[r][0], t->cell[r - 1][0]) != 0)
            continue;
        assert_true(factor > 1);
        for (size_t k = 0; k < 2; k++)
            assert_true(table_number(t, r, names[k]) <
                        1.05 * factor * table_number(t, r - 1, names[k]));
        assert_true(table_number(t, r, "interpreted_seconds") > 0);
        assert_true(table_number(t, r, "compiled_seconds") > 0);
    }
    table_free(t);
}

/* Programs of scalars: gradients are right, and bytes per operation do not rise with their number.
 */
static void test_tape(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart tape --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("tape.csv");
    assert_int_equal(t->rows, 2 * 2);
    for (size_t r = 0; r < t->rows; r++) {
        double n = table_number(t, r, "operations");
        assert_close(log10(n), 3 + (double)(r % 2), 0, 0.2);
        assert_true(table_number(t, r, "error") < 1e-6);
        assert_true(r % 2 == 0 || table_number(t, r, "bytes") < 100);
        assert_true(table_number(t, r, "gradient_ns") > 0);
        assert_true(table_number(t, r, "replay_ns") > 0);
    }
    table_free(t);
}

/* A second thread changes no bit. */
static void test_threads(void **state)
{
    (void)state;
    struct table *t = table_read("threads.csv");
    table_expect_header(t, "job,one_thread_seconds,two_threads_seconds,speedup,same_bits");
    assert_int_equal(t->rows, 3 + 1); /* gradients, a training step */
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_is(t, r, "same_bits", "yes"));
        assert_close(table_number(t, r, "speedup") * table_number(t, r, "two_threads_seconds"),
                     table_number(t, r, "one_thread_seconds"), 1e-3, 0);
    }
    table_free(t);
}

/* What ranks send is what the model has, and by hand for two of them: a sum is an agreement
   on errors of two numbers either way, its half, and its result; a gradient two sums of two
   numbers, and six numbers either way. More ranks than blocks gain nothing; speed-ups end where
   sending takes all the time.
 */
static void test_scale(void **state)
{
    (void)state;
    const double sum = 2 * 16 + 2 * 16;
    shell_works("$LA chart scale --quick --quiet --out . --latency 1e-5");
    picture_texts_are_apart();
    struct table *t = table_read("scale_counts.csv");
    assert_int_equal(t->rows, 4 * 4);
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_is(t, r, "as_modelled", "yes"));
        assert_true((table_number(t, r, "messages") > 0) == (table_number(t, r, "ranks") > 1));
        if (table_is(t, r, "job", "path: gradient") && table_is(t, r, "ranks", "2")) {
            assert_true(table_number(t, r, "messages") == 2 * 4 + 2);
            assert_true(table_number(t, r, "bytes") == 2 * sum + 2 * 48);
        }
    }
    table_free(t);
    t = table_read("scale_model.csv");
    assert_int_equal(t->rows, 5 * 16);
    for (size_t r = 0; r < t->rows; r++) {
        double share = table_number(t, r, "sending_share");
        assert_close(table_number(t, r, "speedup"),
                     table_number(t, r, "efficiency") * table_number(t, r, "ranks"), 1e-3, 0);
        assert_true(table_number(t, r, "efficiency") <= 1 - share + 1e-3);
        assert_true(share >= 0 && share < 1);
        if (table_is(t, r, "job", "training on 1e6 samples"))
            assert_true(table_number(t, r, "speedup") <= 244);
        if (table_is(t, r, "job", "gradient of 1e6 slices") && table_is(t, r, "ranks", "10000"))
            assert_true(share > 0.9);
    }
    table_free(t);
}

/* Newton ends on the stationary path, where the published descent is not. */
static void test_jobs(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart jobs --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("jobs.csv");
    size_t paths = 0;
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_number(t, r, "published_seconds") > 0 &&
                    table_number(t, r, "our_seconds") > 0);
        if (!table_is(t, r, "group", "path"))
            continue;
        paths++;
        assert_true(table_number(t, r, "published_error") > 1e-4);
        assert_true(table_number(t, r, "our_error") < 1e-12);
        assert_true(table_number(t, r, "level_seconds") <= table_number(t, r, "our_seconds"));
    }
    assert_int_equal(paths, 5);
    table_free(t);
}

static void test_hnn_steps(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart hnn --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("hnn-steps.csv");
    assert_int_equal(t->rows, 2 * 2 * 2); /* kinds, precisions, threads */
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_number(t, r, "step_ms") > 0 && table_number(t, r, "field_us") > 0);
        assert_true(table_number(t, r, "blas_share") > 0 && table_number(t, r, "blas_share") < 1);
        assert_true(table_number(t, r, "products_ms") > 0 &&
                    table_number(t, r, "activation_ms") > 0);
        bool by_hand = table_is(t, r, "model", "hnn") && table_is(t, r, "precision", "f32") &&
                       table_is(t, r, "threads", "1");
        assert_true(by_hand
                        ? table_number(t, r, "hand_ms") > 0 && table_number(t, r, "hand_ratio") > 0
                        : table_is(t, r, "hand_ms", "") && table_is(t, r, "hand_ratio", ""));
    }
    table_free(t);
}

/* From the same weights: in f32 and f64 the same but for rounding, and smaller at the end. */
static void test_hnn_losses(void **state)
{
    (void)state;
    enum { STEPS = 20 };
    struct table *t = table_read("hnn-losses.csv");
    table_expect_header(t, "model,precision,width,batch,step,loss");
    assert_int_equal(t->rows, 2 * 2 * STEPS); /* kinds, precisions */
    for (size_t r = 0; r < t->rows; r++) {
        if (table_is(t, r, "precision", "f64"))
            assert_close(table_number(t, r - STEPS, "loss"), table_number(t, r, "loss"), 1e-5, 0);
        if (table_number(t, r, "step") == STEPS)
            assert_true(table_number(t, r, "loss") < 0.6 * table_number(t, r + 1 - STEPS, "loss"));
    }
    table_free(t);
}

/* How many steps fit into the time is the machine's; where a number of steps leads is not. */
static double loss_after(const struct table *t, const char *model, const char *type, double step)
{
    for (size_t r = 0; r < t->rows; r++)
        if (table_is(t, r, "model", model) && table_is(t, r, "precision", type) &&
            table_number(t, r, "step") == step)
            return table_number(t, r, "test_loss");
    print_error("no row of %s in %s after %g steps\n", model, type, step);
    fail();
    return NAN;
}

static void test_hnn_learning(void **state)
{
    (void)state;
    struct table *t = table_read("hnn-learning.csv");
    table_expect_header(t, "model,precision,width,step,seconds,test_loss,energy_mse");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(table_number(t, r, "seconds") > 0 && table_number(t, r, "energy_mse") > 0);
    static const char *const models[] = {"hnn", "baseline"};
    for (size_t k = 0; k < 2; k++)
        assert_close(loss_after(t, models[k], "f32", 4), loss_after(t, models[k], "f64", 4), 1e-3,
                     0);
    table_free(t);
}

static double least_rollout_error(const struct table *t, const char *type)
{
    double least = INFINITY;
    for (size_t r = 0; r < t->rows; r++)
        if (table_is(t, r, "precision", type))
            least = fmin(least, table_number(t, r, "error"));
    return least;
}

/* The roundings of f32, 6e-8, add up over hundreds of steps; f64 goes on to the reference. */
static void test_hnn_rollouts(void **state)
{
    (void)state;
    struct table *t = table_read("hnn-rollouts.csv");
    table_expect_header(t, "method,precision,setting,evaluations,seconds,error");
    assert_true(least_rollout_error(t, "f64") < 1e-9);
    assert_true(least_rollout_error(t, "f32") > 1e-9 && least_rollout_error(t, "f32") < 1e-4);
    double error[2] = {NAN, NAN}, dt[2] = {NAN, NAN}; /* of the two finest */
    for (size_t r = 0; r < t->rows; r++)
        if (table_is(t, r, "method", "rk4") && table_is(t, r, "precision", "f64")) {
            error[0] = error[1], dt[0] = dt[1];
            error[1] = table_number(t, r, "error"), dt[1] = table_number(t, r, "setting");
        }
    assert_close(log(error[0] / error[1]) / log(dt[0] / dt[1]), 4, 0, 0.5);
    table_free(t);
}

static void test_hnn_files(void **state)
{
    (void)state;
    static const char *const names[] = {"hnn-steps.csv",    "hnn-losses.csv",   "hnn-learning.csv",
                                        "hnn-learning.svg", "hnn-rollouts.csv", "hnn-rollouts.svg"};
    if (!gnuplot()) {
        print_message("gnuplot is not installed\n");
        skip();
    }
    expect_files(sizeof names / sizeof *names, names);
}

static void test_quantum(void **state)
{
    (void)state;
    shell_works("$LA chart quantum --quick --out . --json");
    assert_true(shell_number("fft") > 0); /* seconds to one per cent in the double well */
    static const char *const names[] = {"quantum.csv", "quantum.svg", "quantum-slices.csv"};
    expect_files(sizeof names / sizeof *names, names);
}

static void test_gas(void **state)
{
    (void)state;
    shell_works("$LA chart gas --quick --out . --json");
    assert_true(shell_number("crossover") > 0);
    static const char *const names[] = {"gas.csv", "gas.svg", "gas-order.csv"};
    expect_files(sizeof names / sizeof *names, names);
}

static void test_wrong_format(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart paths --format pdf --out new"), 2);
    assert_mentions(shell_err(), "--format 'pdf' svg png");
    assert_int_equal(shell_files(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_wrong_format, shell_empty),
        cmocka_unit_test_setup(test_gradients, shell_empty),
        cmocka_unit_test(test_gradient_values),
        cmocka_unit_test_setup(test_tape, shell_empty),
        cmocka_unit_test_setup(test_linear, shell_empty),
        cmocka_unit_test(test_threads),
        cmocka_unit_test_setup(test_scale, shell_empty),
        cmocka_unit_test_setup(test_jobs, shell_empty),
        cmocka_unit_test_setup(test_hnn_steps, shell_empty),
        cmocka_unit_test(test_hnn_losses),
        cmocka_unit_test(test_hnn_learning),
        cmocka_unit_test(test_hnn_rollouts),
        cmocka_unit_test(test_hnn_files),
        cmocka_unit_test_setup(test_quantum, shell_empty),
        cmocka_unit_test_setup(test_gas, shell_empty),
    };
    return cmocka_run_group_tests_name("charts", tests, shell_setup, shell_teardown);
}
