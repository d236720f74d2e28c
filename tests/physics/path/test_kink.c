/* H7: a kink, tanh(t / eps), from a straight line, by levels of phys_path_refine; and on a lattice,
   by Newton's method. */
#include "physics/path/internal.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>

static const double widths[] = {0.1};
static double eps;

static ad_var kink(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_mul(0.5, ad_square(v)),
                  ad_mul(0.5 / eps / eps, ad_square(ad_sub(1.0, ad_square(q)))));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0;
    v[0] = 1 / eps;
    return AD_OK;
}

enum { SLICES = 129 };

static const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                        .size = sizeof(struct phys_scene),
                                        .name = "kink",
                                        .what = "a kink",
                                        .dof = 1,
                                        .dims = 1,
                                        .unit = "1",
                                        .time_unit = "1",
                                        .energy_unit = "1",
                                        .lagrangian = kink,
                                        .slices = SLICES,
                                        .dt = 1. / (SLICES - 1),
                                        .start = start};

/* The largest error of the path from time t0 to 1 by levels; NaN: there is none. */
static double error_from(double t0, double width)
{
    struct phys_system system;
    struct phys_refined refined;
    struct ad_error error = {0};
    double line[SLICES], most = (double)NAN;
    eps = width;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    double first = tanh(t0 / eps), last = tanh(1 / eps);
    for (size_t i = 0; i < SLICES; i++)
        line[i] = first + (last - first) * (double)i / (SLICES - 1);
    struct phys_path_settings settings = phys_path_defaults(&system);
    settings.rule = NULL;
    settings.dt = (1 - t0) / (SLICES - 1);
    phys_path_refine(&system, &settings, line, 0, 1e-6, &refined, &error);
    size_t slices = refined.settings->slices;
    for (size_t i = 0; error.status == AD_OK && i < slices; i++) {
        double t = t0 + (1 - t0) * (double)i / (double)(slices - 1);
        most = fmax(most, fabs(refined.path[i] - tanh(t / eps)));
    }
    phys_refined_free(&refined);
    phys_system_close(&system);
    return most;
}

static void a_kink_from_a_line(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(widths); k++)
        assert_close(error_from(0, widths[k]), 0, 0, 1e-6);
}

/* Where it lies between distant ends, S depends on by exp(-4/eps) only: the grid alone holds it. */
static void a_whole_kink_is_right_or_refused(void **state)
{
    (void)state;
    static const double whole[] = {0.2, 0.02};
    for (size_t k = 0; k < LENGTH(whole); k++) {
        double most = error_from(-1, whole[k]);
        print_message("width %g: error %g\n", whole[k], most);
        assert_true(most <= 1e-6 || (isnan(most) && k > 0));
    }
}

/* C12: a kink of sine-Gordon between two of its shapes, from a line: Adam's steps before lead to
   large gradients, as the action has no lower bound over so long a time. */
enum { SITES = 48 };
static const double spacing = 0.2, kink_speed = 0.6;

static ad_var sine_gordon(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var apart = ad_sub(ad_slice_rows(q, 1, SITES - 1), ad_slice_rows(q, 0, SITES - 1));
    ad_var potential = ad_add(ad_mul(0.5 / spacing, ad_sum_rows(ad_square(apart))),
                              ad_mul(spacing, ad_sum_rows(ad_sub(1.0, ad_cos(q)))));
    return ad_sub(ad_mul(0.5 * spacing, ad_sum_rows(ad_square(v))), potential);
}

static double on_lattice(size_t site, double t)
{
    double x = spacing * ((double)site - SITES / 3.0) - kink_speed * t;
    return 4 * atan(exp(x / sqrt(1 - kink_speed * kink_speed)));
}

static enum ad_status lattice_start(const void *params, uint64_t seed, double *q, double *v,
                                    struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < SITES; k++) {
        q[k] = on_lattice(k, 0);
        v[k] = (on_lattice(k, 1e-5) - on_lattice(k, -1e-5)) / 2e-5;
    }
    return AD_OK;
}

static void a_kink_of_a_lattice_is_found_from_a_line(void **state)
{
    enum { STEPS = 21 };
    const struct phys_scene lattice =
        scene_of("kink", SITES, sine_gordon, STEPS, 0.15, lattice_start);
    static double path[SITES * STEPS];
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_system_make(&lattice, &system, &error), AD_OK);
    struct phys_path_settings settings = phys_path_defaults(&system);
    struct phys_path_info info;
    settings.rule = phys_rule_find("left", &error);
    const double end = lattice.dt * (STEPS - 1);
    for (size_t k = 0; k < SITES; k++)
        for (size_t i = 0; i < STEPS; i++)
            path[k * STEPS + i] = on_lattice(k, 0) +
                                  (on_lattice(k, end) - on_lattice(k, 0)) * (double)i / (STEPS - 1);
    settings.adam_steps = 200;
    settings.steps = 30;
    phys_path_solve(&phys_solver_newton, &system, &settings, path, &info, &error);
    assert_no_error(&error);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    for (size_t k = SITES / 4; k < SITES * 3 / 4; k++)
        for (size_t i = 0; i < STEPS; i++)
            assert_close(path[k * STEPS + i], on_lattice(k, lattice.dt * (double)i), 0,
                         0.2); /* of a lattice */
    phys_system_close(&system);
}

/* The momentum jumps where v = 1.13. */
static ad_var faster_or_slower(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_max(ad_sub(v, 1.13), 0.0));
}

static void a_path_jumps_by_its_velocity(void **state)
{
    enum { POINTS = 17 };
    const struct phys_scene two = scene_of("two", 1, faster_or_slower, POINTS, 0.1, start);
    struct phys_system system;
    struct ad_error error = {0};
    double path[POINTS];
    (void)state;
    assert_int_equal(phys_system_make(&two, &system, &error), AD_OK);
    const struct phys_path_settings settings = phys_path_defaults(&system);
    for (int crosses = 0; crosses < 2; crosses++) {
        for (size_t i = 0; i < POINTS; i++)
            path[i] = 0.1 * (double)i * (crosses ? 0.1 * (double)i : 1); /* v = 1, or 2 t */
        assert_int_equal(phys_path_jumps(&system, &settings, path), crosses);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_path_jumps_by_its_velocity),
                                       cmocka_unit_test(a_kink_from_a_line),
                                       cmocka_unit_test(a_whole_kink_is_right_or_refused),
                                       cmocka_unit_test(a_kink_of_a_lattice_is_found_from_a_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
