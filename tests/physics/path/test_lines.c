/* Paths from a straight line with the settings of `leastaction path --tol` and no others: the
   problems of boundary-value codes. Each is a motion by an integrator that shares nothing with the
   rules of the action. (Kinks: test_kink.c; a layer: test_mesh.c; the brachistochrone:
   test_free_time.c; an ellipsoid with a constraint: test_path_constraints.c.) */
#include "physics/path/newton.h"
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static ad_var kinetic(ad_var v) { return ad_mul(0.5, ad_sum_rows(ad_square(v))); }

/* Sun, metres and seconds. */
static ad_var transfer(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(kinetic(v), ad_div(1.32712440018e20, ad_sqrt(ad_sum_rows(ad_square(q)))));
}

static enum ad_status from_earth(const void *params, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1.496e11, q[1] = 0, v[0] = 0, v[1] = 32.7e3;
    return AD_OK;
}

enum { SITES = 20 };

/* Toda's chain between walls. */
static ad_var toda(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var left = ad_slice_rows(q, 0, SITES - 1), right = ad_slice_rows(q, 1, SITES - 1);
    ad_var V = ad_sum_rows(ad_exp(ad_sub(left, right)));
    V = ad_add(V, ad_add(ad_exp(ad_row(q, SITES - 1)), ad_exp(ad_neg(ad_row(q, 0)))));
    return ad_sub(kinetic(v), V);
}

static enum ad_status excited(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < SITES; k++) {
        q[k] = 0.4 * sin(1.7 * (double)k);
        v[k] = cos(2.3 * (double)k);
    }
    return AD_OK;
}

static ad_var driven(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var push = ad_mul(ad_mul(0.8, ad_cos(ad_mul(0.7, t))), q);
    return ad_add(kinetic(v), ad_add(ad_cos(q), push));
}

static enum ad_status at_an_angle(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.3, v[0] = 0.5;
    return AD_OK;
}

/* Free motion on the ellipsoid of semi-axes 1, 0.8, 0.6 in latitude and longitude. */
static ad_var ellipsoid(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var a = ad_row(q, 0), b = ad_row(q, 1), da = ad_row(v, 0), db = ad_row(v, 1);
    ad_var x = ad_add(ad_mul(ad_mul(ad_sin(a), ad_cos(b)), da),
                      ad_mul(ad_mul(ad_cos(a), ad_sin(b)), db)),
           y = ad_sub(ad_mul(ad_mul(ad_cos(a), ad_cos(b)), db),
                      ad_mul(ad_mul(ad_sin(a), ad_sin(b)), da)),
           z = ad_mul(ad_cos(a), da);
    (void)t, (void)params;
    return ad_mul(
        0.5, ad_add(ad_square(x), ad_add(ad_mul(0.64, ad_square(y)), ad_mul(0.36, ad_square(z)))));
}

static enum ad_status on_the_ellipsoid(const void *params, uint64_t seed, double *q, double *v,
                                       struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.2, q[1] = 0.1, v[0] = 0.5, v[1] = 0.8;
    return AD_OK;
}

static enum ad_status excited_three(const void *params, uint64_t seed, double *q, double *v,
                                    struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.2, q[1] = 0.1, q[2] = 0, v[0] = 0.5, v[1] = 0.8, v[2] = 0;
    return AD_OK;
}

static ad_var plus_square(double a, ad_var x) { return ad_add(a, ad_square(x)); }

/* Wells where masses vary with the place: |g| has minima of its own there. */
static ad_var one_mass(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var m = plus_square(0.8, ad_atan2(ad_sin(q), ad_add(3.0, ad_cos(ad_cos(q)))));
    return ad_sub(ad_mul(ad_mul(0.5, m), ad_square(v)), ad_add(q, ad_mul(0.3, ad_square(q))));
}

static ad_var two_masses(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), vx = ad_row(v, 0);
    ad_var vy = ad_add(ad_row(v, 1), ad_mul(0.3, vx));
    ad_var T = ad_add(ad_mul(plus_square(0.8, ad_sin(ad_mul(x, y))), ad_square(vx)),
                      ad_mul(plus_square(0.8, x), ad_square(vy)));
    ad_var A = ad_mul(0.369664, ad_atan2(0.918, ad_add(3.0, ad_cos(y))));
    ad_var V = ad_tanh(ad_sin(ad_sqrt(plus_square(1, ad_sin(x)))));
    return ad_sub(ad_add(ad_mul(0.5, T), ad_mul(vx, A)),
                  ad_add(V, ad_mul(0.3, ad_sum_rows(ad_square(q)))));
}

static ad_var three_masses(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), z = ad_row(q, 2), vx = ad_row(v, 0);
    ad_var vy = ad_row(v, 1), a = ad_add(vy, ad_mul(0.3, vx));
    ad_var b = ad_add(ad_row(v, 2), ad_mul(0.3, vy));
    ad_var mx = plus_square(0.8, ad_div(0.699, plus_square(1.2, ad_div(y, plus_square(1.2, z)))));
    ad_var my = plus_square(0.8, ad_sin(x));
    ad_var mz = plus_square(0.8, ad_exp(ad_sin(ad_exp(ad_sin(x)))));
    ad_var T = ad_add(ad_mul(mx, ad_square(vx)),
                      ad_add(ad_mul(my, ad_square(a)), ad_mul(mz, ad_square(b))));
    ad_var dip = ad_div(ad_sub(y, 1.168), plus_square(1.2, ad_sub(y, 1.173)));
    ad_var V = ad_add(ad_atan2(z, 3.698), ad_tanh(dip));
    return ad_sub(ad_add(ad_mul(0.5, T), ad_mul(vx, ad_mul(y, ad_square(z)))),
                  ad_add(V, ad_mul(0.3, ad_sum_rows(ad_square(q)))));
}

static const struct {
    const char *name;
    double time;
    size_t dof; /* 0: a scene of the library */
    phys_lagrangian *lagrangian;
    scene_start *start;
    double end[3][2];     /* instead of those of a motion from the start */
    const char *approach; /* how the path was approached */
} problems[] = {
    {.name = "pendulum", .time = 99},
    {.name = "dblpend", .time = 2.5},
    {.name = "threebody", .time = 49.5},
    {.name = "kepler", .time = 2.5},
    {.name = "figure8", .time = 3.16},
    {.name = "pythagorean", .time = 1.5},
    {"transfer", 200 * 86400., 2, transfer, from_earth, {{0}}, NULL},
    {"toda", 1, SITES, toda, excited, {{0}}, NULL},
    {"driven", 6, 1, driven, at_an_angle, {{0}}, NULL},
    {"ellipsoid", 1.5, 2, ellipsoid, on_the_ellipsoid, {{0}}, NULL},
    {"one-mass", 3.56, 1, one_mass, at_an_angle, {{0.84, 0.21}}, "a path of a shorter time"},
    {"two-masses",
     3.73,
     2,
     two_masses,
     on_the_ellipsoid,
     {{0.87, -0.33}, {0.4, -0.94}},
     "a motion from the same start"},
    {"three-masses",
     3.15,
     3,
     three_masses,
     excited_three,
     {{0.27, -0.38}, {-0.62, -0.42}, {-0.81, 0.53}},
     NULL},
};

static void problems_of_boundary_value_codes(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(problems); k++) {
        const struct phys_scene own = scene_of(problems[k].name, problems[k].dof,
                                               problems[k].lagrangian, 3, 1, problems[k].start);
        const struct phys_simulation how = {.size = sizeof how, .rtol = 1e-13};
        struct phys_system system;
        struct ad_error error = {0};
        if (problems[k].dof)
            phys_system_make(&own, &system, &error);
        else
            phys_system_open(problems[k].name, &system, &error);
        assert_no_error(&error);
        double *ends = malloc(2 * system.dof * sizeof *ends), size = 0;
        phys_scene_path(&system, 1, &how, 2, problems[k].time, ends, &error);
        assert_no_error(&error);
        const bool between = problems[k].end[0][0] != 0;
        if (between)
            memcpy(ends, problems[k].end, 2 * system.dof * sizeof *ends);
        for (size_t i = 0; i < 2 * system.dof; i++)
            size = fmax(size, fabs(ends[i]));
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_refined refined;
        struct phys_path_found found;
        settings.rule = NULL;
        settings.slices = 2;
        settings.dt = problems[k].time;
        settings.adam_steps = 200;
        phys_path_refine(&system, &settings, ends, 0, (between ? 1e-9 : 1e-6) * size, &refined,
                         &error);
        if (error.status != AD_OK)
            fail_msg("%s: %s", problems[k].name, error.message);
        assert_string_equal(refined.approach ? refined.approach : "",
                            problems[k].approach ? problems[k].approach : "");
        settings = *refined.settings;
        settings.refined = &refined;
        const size_t bytes = settings.rule->degree * system.dof * settings.slices * sizeof(double);
        double *path = memcpy(malloc(bytes), refined.path, bytes);
        phys_path_find(phys_solver_find("newton", &error), &system, &settings, path, &found,
                       &error);
        assert_no_error(&error);
        assert_true(found.stationary);
        assert_true(found.discretisation < 1e-6 * size);
        assert_true(found.true_distance < 1e-5 * size);
        for (size_t i = 0; i < 2 * system.dof; i++)
            assert_true(path[i / 2 * settings.slices + i % 2 * (settings.slices - 1)] == ends[i]);
        free(path);
        phys_path_found_free(&found);
        phys_refined_free(&refined);
        free(ends);
        phys_system_close(&system);
    }
}

/* Steps of Adam end where Newton's method converges: to the path that all of them lead to. The kind
   of that path alone, and with its eigenvalues. */
static void descents_end_early(void **state)
{
    enum { SLICES = 9, DEGREE = 2 };
    const double time = 40;
    struct phys_system system = system_opened("pendulum");
    struct ad_error error = {0};
    double ends[2], path[2][DEGREE * SLICES];
    const struct phys_simulation how = {.size = sizeof how, .rtol = 1e-13};
    struct phys_path_info info[2];
    struct phys_spectrum of[2];
    (void)state;
    phys_scene_path(&system, 1, &how, 2, time, ends, &error);
    for (size_t k = 0; k < 2; k++) {
        const bool sparing = k == 1;
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_derivatives L = {0};
        struct phys_newton newton;
        settings.rule = phys_rule_find("gauss2", &error);
        settings.slices = SLICES;
        settings.dt = time / (SLICES - 1);
        settings.adam_steps = 200;
        for (size_t i = 0; i < SLICES; i++)
            path[k][i] = ends[0] + (ends[1] - ends[0]) * (double)i / (SLICES - 1);
        phys_rule_interpolate(settings.rule, 1, SLICES, path[k]);
        phys_derivatives_new(&L, &system, PHYS_LADDER_COLUMNS, NULL, &error);
        phys_newton_over(&system, &settings, &L, sparing, path[k], &info[k], &error);
        assert_int_equal(phys_newton_new(&newton, &system, &settings, &L, &error), AD_OK);
        phys_newton_spectrum(&newton, sparing ? PHYS_KIND : PHYS_KIND | PHYS_EIGENVALUES, path[k],
                             &of[k], &error);
        if (sparing) {
            assert_true(isnan(of[k].smallest) && isnan(of[k].second_variation));
            phys_newton_spectrum(&newton, PHYS_EIGENVALUES, path[k], &of[k], &error);
        }
        assert_no_error(&error);
        assert_int_equal(info[k].stop, PHYS_STOP_ROUNDING);
        phys_newton_free(&newton);
        phys_derivatives_free(&L);
    }
    assert_true(info[1].steps > info[0].steps);
    for (size_t i = 0; i < DEGREE * SLICES; i++)
        assert_close(path[1][i], path[0][i], 0, 1e-11);
    assert_int_equal(of[1].index, of[0].index);
    assert_close(of[1].smallest, of[0].smallest, 1e-11, 0);
    assert_close(of[1].second_variation, of[0].second_variation, 1e-11, 0);
    assert_close(of[0].around[1], of[0].second_variation, 0.01, 0);
    assert_close(of[1].around[1], of[0].second_variation, 0.25, 0);
    for (size_t k = 0; k < 2; k++)
        phys_spectrum_free(&of[k]);
    phys_system_close(&system);
}

/* A path by the recording of L of an earlier one is the same to the last bit, also where parameters
   have changed meanwhile, whose recording is another. */
static void recordings_serve_again(void **state)
{
    struct phys_system system = system_opened("pendulum");
    struct phys_refined refined[4] = {{0}};
    struct ad_error error = {0};
    const double ends[] = {1.2, 0.4};
    (void)state;
    for (size_t k = 0; k < 4; k++) {
        struct phys_path_settings settings = phys_path_defaults(&system);
        settings.rule = NULL;
        settings.slices = 2;
        settings.dt = 20;
        settings.refined = k % 2 ? &refined[0] : NULL;
        if (k == 2)
            phys_system_set(&system, "g", 0.7, &error);
        phys_path_refine(&system, &settings, ends, 0, 1e-8, &refined[k], &error);
        assert_no_error(&error);
        assert_true((refined[k].of == refined[0].of) == (k < 2));
    }
    for (size_t k = 0; k < 4; k += 2) {
        const struct phys_path_settings *own = refined[k].settings,
                                        *again = refined[k + 1].settings;
        assert_ptr_equal(own->rule, again->rule);
        assert_int_equal(own->slices, again->slices);
        assert_memory_equal(refined[k].path, refined[k + 1].path,
                            own->rule->degree * own->slices * sizeof *refined[k].path);
    }
    assert_true(refined[0].path[1] != refined[2].path[1]);
    for (size_t k = 4; k-- > 0;)
        phys_refined_free(&refined[k]);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(problems_of_boundary_value_codes),
        cmocka_unit_test(descents_end_early),
        cmocka_unit_test(recordings_serve_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
