/* Parameters and starts from motions that are known, with and without noise. */
#include "measured.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/io/random.h"

#include <stdlib.h>
#include <string.h>

/* Root mean squares of the residuals of each component, by the definition. */
static void assert_rms(const struct phys_fit *fit, const struct measured *m, size_t d)
{
    for (size_t i = 0; i < 2 * d; i++) {
        const bool held = i >= d;
        double sum = 0, n = 0;
        for (size_t k = 0; k < m->data.n; k++)
            if (fit->held[k] == held) {
                sum += pow(m->x[k * d + i % d] - fit->model[k * d + i % d], 2);
                n++;
            }
        assert_close((held ? fit->held_rms : fit->rms)[i % d], sqrt(sum / n), 1e-12, 0);
    }
}

static struct phys_system spring(double k, double damping, double rest)
{
    struct phys_system system = system_opened("spring");
    system_set(&system, "k", k);
    system_set(&system, "damping", damping);
    system_set(&system, "rest", rest);
    return system;
}

/* Two trials, rows without numbers, positions alone: all digits of exact data come back, from other
   values to begin with, too, and with the mass as it is. */
static void exact_data_give_the_truth(void **state)
{
    static const char *const names[] = {"k", "damping", "rest", "m"};
    (void)state;
    static struct measured m;
    struct phys_system system = spring(7.3, 0.21, 0.4);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, (double[]){1.2, -0.3}, 5, 0.07, 90, NULL, NULL);
    add_trial(&m, &system, (double[]){-0.4, 1.9}, 2, 0.05, 70, NULL, NULL);
    forget_velocities(&m, 1);
    for (size_t k = 0; k < m.data.n; k += 7)
        m.x[2 * k] = NAN;
    phys_system_close(&system);
    system = spring(1, 0, 0);
    const struct phys_fit_settings how = {
        .size = sizeof how, .n_free = 3, .free = names, .tries = 5};
    struct phys_fit fit = fitted(&system, &m, &how);
    assert_int_equal(fit.tries, 5);
    assert_int_equal(fit.agreeing, 5);
    assert_int_equal(fit.n_trials, 2);
    assert_int_equal(fit.n_unknown, 7);
    assert_close(fit.value[0], 7.3, 1e-8, 0);
    assert_close(fit.value[1], 0.21, 1e-7, 0);
    assert_close(fit.value[2], 0.4, 1e-8, 0);
    assert_close(fit.value[3], 1.2, 1e-8, 0);
    assert_close(fit.value[6], 1.9, 1e-8, 0);
    phys_fit_free(&fit);
    phys_system_close(&system);
}

/* A minimum is left where a step promises nothing, although rounding of the motion still moves it:
   1e-4 of a standard deviation, which steps that gain by chance took for more than 170 iterations.
 */
static void a_minimum_is_not_searched_again(void **state)
{
    (void)state;
    static struct measured m;
    struct phys_random random;
    struct phys_system system = system_opened("kepler");
    memset(&m, 0, sizeof m);
    system_set(&system, "e", 0.6);
    phys_random_seed(&random, 2);
    add_trial(&m, &system, (double[]){0.4, 0, 0, 2}, 0, 0.2, 61, (double[]){1e-10, 0}, &random);
    forget_velocities(&m, 2);
    const struct phys_fit_settings how = {
        .size = sizeof how, .n_free = 1, .free = (const char *const[]){"gm"}};
    struct phys_fit fit = fitted(&system, &m, &how);
    assert_close(fit.value[0], 1, 1e-7, 0);
    assert_true(fit.iterations < 100);
    phys_fit_free(&fit);
    phys_system_close(&system);
}

/* Differences from the truth, in the standard deviations that each fit gives, have variance 1; so
   do predictions of what was held out. Noise is known, or found for coordinates and velocities
   apart from each other: few rows, so that wrong degrees of freedom show. */
static void pulls(bool known, bool velocities, size_t repeats)
{
    static const char *const names[] = {"k", "damping"};
    static const double noise[] = {0.02, 0.3};
    const double truth[] = {4.1, 0.3, 0.9, 0.2};
    struct phys_random random;
    double mean[4] = {0}, square[4] = {0}, found[2] = {0};
    phys_random_seed(&random, 7);
    struct phys_system system = spring(truth[0], truth[1], 0);
    for (size_t k = 0; k < repeats; k++) {
        static struct measured m;
        memset(&m, 0, sizeof m);
        add_trial(&m, &system, truth + 2, 0, 0.3, 14, noise, &random);
        if (!velocities)
            forget_velocities(&m, 1);
        const struct phys_fit_settings how = {.size = sizeof how,
                                              .n_free = 2,
                                              .free = names,
                                              .tries = 1,
                                              .noise = known ? noise : NULL};
        struct phys_fit fit = fitted(&system, &m, &how);
        for (size_t j = 0; j < 4; j++) {
            const double pull = (fit.value[j] - truth[j]) / fit.deviation[j];
            mean[j] += pull / (double)repeats;
            square[j] += pull * pull / (double)repeats;
        }
        for (size_t i = 0; i < 2; i++)
            found[i] += fit.noise[i] * fit.noise[i] / (double)repeats;
        phys_fit_free(&fit);
    }
    for (size_t j = 0; j < 4; j++) {
        const double wider = sqrt(200 / (double)repeats); /* 3.5 standard deviations */
        assert_close(mean[j], 0, 0, 0.25 * wider);
        assert_close(square[j], 1, 0,
                     wider * (known ? 0.35 : 0.45)); /* of t with 10 degrees: 1.25 */
    }
    assert_close(sqrt(found[0]), noise[0], 0.1, 0);
    if (velocities)
        assert_close(sqrt(found[1]), noise[1], 0.1, 0);
    phys_system_close(&system);
}

static void deviations_are_those_of_repeated_fits(void **state)
{
    (void)state;
    pulls(true, true, 50);
    pulls(false, true, 200);
    pulls(false, false, 50);
}

/* A pendulum moves by g/l alone. */
static void what_the_data_cannot_tell_is_named(void **state)
{
    static const char *const names[] = {"l", "g", "damping"};
    (void)state;
    static struct measured m;
    struct phys_system system = system_opened("pendulum");
    system_set(&system, "l", 1.1);
    system_set(&system, "g", 9.81);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, (double[]){1.2, 0}, 0, 0.05, 80, NULL, NULL);
    struct phys_fit fit;
    struct ad_error error = {0};
    const struct phys_fit_settings how = {.size = sizeof how, .n_free = 3, .free = names};
    assert_int_equal(phys_fit_solve(&system, &m.data, &how, &fit, &error), AD_E_ACCURACY);
    assert_mentions(error.message, "l, g apart");
    assert_true(isinf(fit.deviation[0]));
    phys_fit_free(&fit);
    phys_system_close(&system);
}

/* Parameters of the start, masses of a varying mass matrix, rows held out, from values far off. */
static void starts_of_the_scene_are_followed(void **state)
{
    static const char *const names[] = {"m2", "l1", "a0", "b_rate0"};
    static const double noise[] = {2e-3, 0.02}, truth[] = {1.7, 0.8, 1.1, -0.7};
    (void)state;
    static struct measured m;
    struct phys_random random;
    struct phys_system system = system_opened("dblpend");
    double start[4];
    phys_random_seed(&random, 3);
    for (size_t k = 0; k < 4; k++)
        system_set(&system, names[k], truth[k]);
    system_start(&system, 1, start, start + 2);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, start, 0, 0.1, 100, noise, &random);
    for (size_t k = 0; k < 4; k++)
        system_set(&system, names[k], truth[k] * (k % 2 ? 1.2 : 0.75));
    const struct phys_fit_settings how = {
        .size = sizeof how, .n_free = 4, .free = names, .fixed_start = true, .held_out = 0.2};
    struct phys_fit fit = fitted(&system, &m, &how);
    assert_int_equal(fit.n_unknown, 4);
    assert_true(fit.held[80] && !fit.held[79]);
    for (size_t k = 0; k < 4; k++)
        assert_true(fabs(fit.value[k] - truth[k]) < 4 * fit.deviation[k]);
    assert_close(fit.held_rms[0], noise[0], 0.5, 0);
    assert_close(fit.held_rms[3], noise[1], 0.5, 0);
    assert_rms(&fit, &m, 4);
    for (size_t i = 0; i < 4; i++)
        assert_close(fit.noise[i], noise[i >= 2], 0.2, 0);
    phys_fit_free(&fit);
    phys_system_close(&system);
}

/* However many stretches there are, their gaps close, and the minimum is the same. */
static void stretches_join(void **state)
{
    static const char *const names[] = {"l", "damping"};
    static const double noise[] = {0.02, 0.02};
    (void)state;
    static struct measured m;
    struct phys_random random;
    struct phys_system system = system_opened("pendulum");
    double whole[2];
    phys_random_seed(&random, 1);
    system_set(&system, "l", 2);
    system_set(&system, "damping", 0.15);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, (double[]){1.9, 0.3}, 100, 0.25, 120, noise, &random);
    forget_velocities(&m, 1);
    system_set(&system, "l", 3);
    system_set(&system, "damping", 0);
    for (size_t rows = 120; rows >= 5; rows /= 2) {
        const struct phys_fit_settings how = {
            .size = sizeof how, .n_free = 2, .free = names, .stretch = rows};
        struct phys_fit fit = fitted(&system, &m, &how);
        for (size_t k = 0; k < 2; k++) {
            whole[k] = rows == 120 ? fit.value[k] : whole[k];
            assert_close(fit.value[k], whole[k], 0, 0.01 * fit.deviation[k]);
        }
        phys_fit_free(&fit);
    }
    phys_system_close(&system);
}

struct dragged {
    double k, drag;
};

/* Drag counts forwards alone. */
static ad_var dragged(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct dragged *p = params;
    ad_var L = ad_mul(0.5, ad_sub(ad_square(v), ad_mul(PHYS_PARAM(p, k), ad_square(q))));
    return p->drag > 0 ? ad_mul(ad_exp(ad_mul(PHYS_PARAM(p, drag), t)), L) : L;
}

static enum ad_status dragged_start(const void *params, uint64_t seed, double *q, double *v,
                                    struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    v[0] = 0;
    return AD_OK;
}

/* A condition that the recording took one way, and the values found would take the other. */
static void another_form_of_L_is_no_fit(void **state)
{
    static const struct phys_param params[] = {
        {"k", "1", "stiffness", 2, offsetof(struct dragged, k)},
        {"drag", "1", "drag", 0.05, offsetof(struct dragged, drag)}};
    static const char *const names[] = {"k", "drag"};
    static struct measured m;
    (void)state;
    struct phys_scene scene = scene_of("dragged", 1, dragged, 11, 0.1, dragged_start);
    struct phys_system truth = spring(2.2, -0.1, 0), system;
    struct ad_error error = {0};
    struct phys_fit fit;
    scene.params = params;
    scene.n_params = LENGTH(params);
    scene.params_bytes = sizeof(struct dragged);
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    memset(&m, 0, sizeof m);
    add_trial(&m, &truth, (double[]){1, 0}, 0, 0.1, 60, NULL, NULL);
    const struct phys_fit_settings how = {
        .size = sizeof how, .n_free = 2, .free = names, .tries = 1};
    assert_int_equal(phys_fit_solve(&system, &m.data, &how, &fit, &error), AD_E_ACCURACY);
    assert_mentions(error.message, "another form");
    phys_fit_free(&fit);
    phys_system_close(&system);
    phys_system_close(&truth);
}

static void misuse_is_refused(void **state)
{
    static const char *const twice[] = {"k", "k"}, *const nobody[] = {"kk"}, *const k[] = {"k"};
    (void)state;
    static struct measured m;
    struct phys_system system = spring(2, 0, 0);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, (double[]){1, 0}, 0, 0.3, 20, NULL, NULL);
    const struct {
        struct phys_fit_settings how;
        size_t rows;
    } wrong[] = {{{.n_free = 2, .free = twice}, 20},
                 {{.n_free = 1, .free = nobody}, 20},
                 {{.n_free = 0, .fixed_start = true}, 20},
                 {{.n_free = 1, .free = k}, 1},
                 {{.n_free = 1, .free = k, .held_out = 1}, 20}};
    for (size_t i = 0; i < LENGTH(wrong); i++) {
        struct phys_fit fit;
        struct ad_error error = {0};
        struct phys_fit_settings how = wrong[i].how;
        how.size = sizeof how;
        m.data.n = wrong[i].rows;
        assert_int_equal(phys_fit_solve(&system, &m.data, &how, &fit, &error), AD_E_ARGUMENT);
        phys_fit_free(&fit);
    }
    m.data.n = 20;
    m.t[7] = m.t[6];
    struct phys_fit fit;
    struct ad_error error = {0};
    const struct phys_fit_settings how = {.size = sizeof how, .n_free = 1, .free = k};
    assert_int_equal(phys_fit_solve(&system, &m.data, &how, &fit, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "row 8");
    phys_fit_free(&fit);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_data_give_the_truth),
        cmocka_unit_test(a_minimum_is_not_searched_again),
        cmocka_unit_test(deviations_are_those_of_repeated_fits),
        cmocka_unit_test(what_the_data_cannot_tell_is_named),
        cmocka_unit_test(starts_of_the_scene_are_followed),
        cmocka_unit_test(stretches_join),
        cmocka_unit_test(another_form_of_L_is_no_fit),
        cmocka_unit_test(misuse_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
