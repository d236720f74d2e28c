/* Derivatives of motions by parameters: closed forms, and differences of motions. */
#include "physics/stability/internal.h"
#include "systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 30, PARAMS = 8 };

struct result {
    double matrix[MOST * PARAMS], u[MOST * PARAMS];
};

static struct result sensitivity(const struct phys_system *system, double t, size_t n,
                                 const char *const names[])
{
    struct result r;
    struct ad_error error = {0};
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = t};
    assert_true(2 * system->dof <= MOST && n <= PARAMS);
    phys_sensitivity(system, NULL, 1, &how, n, names, r.matrix, r.u, &error);
    assert_string_equal(error.message, "");
    return r;
}

/* x = q0 cos w t + v0/w sin w t. */
static void the_spring_has_its_closed_form(void **state)
{
    static const char *const names[] = {"k", "m", "q0", "v0"};
    (void)state;
    struct phys_system system = system_opened("spring");
    const double m = 1.3, k = 9.1, q0 = 0.7, v0 = -0.4, t = 2.3, w = sqrt(k / m);
    system_set(&system, "m", m);
    system_set(&system, "k", k);
    system_set(&system, "q0", q0);
    system_set(&system, "v0", v0);
    const struct result r = sensitivity(&system, t, 4, names);
    const double c = cos(w * t), s = sin(w * t);
    const double by_w = -q0 * t * s - v0 / (w * w) * s + v0 / w * t * c;
    assert_close(r.matrix[0], by_w * w / (2 * k), 1e-13, 0);
    assert_close(r.matrix[1], -by_w * w / (2 * m), 1e-13, 0);
    assert_close(r.matrix[2], c, 1e-13, 0);
    assert_close(r.matrix[3], s / w, 1e-13, 0);
    for (size_t j = 0; j < 4; j++)
        assert_true(r.u[j] < 1e-11);
    phys_system_close(&system);
}

/* The start depends on gm, too: x(t) is a function of sqrt(gm) t alone. */
static void the_start_counts(void **state)
{
    static const char *const names[] = {"gm", "a", "e"};
    (void)state;
    struct phys_system system = system_opened("kepler");
    const double t = 2.6, gm = 1.7;
    system_set(&system, "gm", gm);
    system_set(&system, "e", 0.95); /* steps beyond 1 are no orbits */
    struct phys_ode ode;
    struct ad_error error = {0};
    double y[4];
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find("taylor", &error),
                                        .t1 = t,
                                        .rtol = 1e-15};
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    system_start(&system, 1, y, y + 2);
    assert_int_equal(phys_simulate(&how, &ode, y, NULL, &error), AD_OK);
    phys_ode_free(&ode);
    const struct result r = sensitivity(&system, t, 3, names);
    assert_close(r.matrix[0], y[2] * t / (2 * gm), 1e-9, 0);
    assert_close(r.matrix[3], y[3] * t / (2 * gm), 1e-9, 0);
    /* lengths scale with a, times with a^1.5: a x_a = x - 1.5 t v */
    assert_close(r.matrix[1], y[0] - 1.5 * t * y[2], 1e-8, 1e-9);
    assert_close(r.matrix[4], y[1] - 1.5 * t * y[3], 1e-8, 1e-9);
    phys_system_close(&system);
}

static void follow(struct phys_system *system, const char *name, double p, double t, double *x)
{
    struct phys_ode ode;
    struct ad_error error = {0};
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find("dop853", &error),
                                        .t1 = t,
                                        .rtol = 1e-14};
    const double before = phys_system_get(system, name);
    system_set(system, name, p);
    assert_int_equal(phys_ode_lagrangian(system, &ode, &error), AD_OK);
    system_start(system, 1, x, x + system->dof);
    assert_int_equal(phys_simulate(&how, &ode, x, NULL, &error), AD_OK);
    system_set(system, name, before);
    phys_ode_free(&ode);
}

/* Masses that vary, masses of parameters, more than six coordinates. */
static void differences_agree(void **state)
{
    static const struct {
        const char *scene;
        double t;
        size_t n;
        const char *names[PARAMS];
    } cases[] = {
        {"pendulum", 40, 5, {"l", "g", "m", "theta0", "rate0"}},
        {"dblpend", 2, 7, {"m1", "m2", "l1", "l2", "g", "a0", "b_rate0"}},
        {"threebody", 9, 5, {"m1", "m2", "G", "softening", "offset"}},
        {"arenstorf", 3, 2, {"mu", "vy0"}},
        {"double-well", 4, 3, {"a", "height", "m"}},
        {"ephemeris", 4e6, 2, {"G", "mass_venus"}},
    };
    (void)state;
    for (size_t c = 0; c < LENGTH(cases); c++) {
        struct phys_system system = system_opened(cases[c].scene);
        if (strcmp(cases[c].scene, "ephemeris") == 0)
            system_set(&system, "mass_venus", 4.87e24);
        const size_t d = 2 * system.dof, n = cases[c].n;
        const struct result r = sensitivity(&system, cases[c].t, n, cases[c].names);
        for (size_t k = 0; k < n; k++) {
            double up[MOST], down[MOST], largest[2] = {0};
            const char *name = cases[c].names[k];
            const double p = phys_system_get(&system, name), h = 1e-5 * (p == 0 ? 1 : fabs(p));
            follow(&system, name, p + h, cases[c].t, up);
            follow(&system, name, p - h, cases[c].t, down);
            for (size_t i = 0; i < d; i++)
                largest[i / system.dof] =
                    fmax(largest[i / system.dof],
                         fmax(fabs(r.matrix[i * n + k]), fabs(up[i]) / fabs(p + h)));
            for (size_t i = 0; i < d; i++)
                assert_close(r.matrix[i * n + k], (up[i] - down[i]) / (2 * h), 1e-6,
                             1e-7 * largest[i / system.dof]);
        }
        phys_system_close(&system);
    }
}

/* A changed parameter holds at once, in one recording: masses are evaluated anew. */
static void values_are_read_when_the_motion_is(void **state)
{
    static const char *const names[] = {"m2", "l1", "g"};
    (void)state;
    struct phys_system system = system_opened("dblpend");
    struct phys_ode ode, fresh;
    struct ad_error error = {0};
    double y[4 * 4] = {0.4, -0.9, 0.3, 1.2}, rate[16], expected[16];
    assert_int_equal(phys_ode_parameters(&system, 0, 3, names, &ode, &error), AD_OK);
    assert_int_equal(ode.n, 16);
    assert_int_equal(ode.field(ode.context, 0, y, rate, &error), AD_OK);
    system_set(&system, "m2", 2.5);
    system_set(&system, "l1", 0.6);
    assert_int_equal(ode.field(ode.context, 0, y, rate, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&system, &fresh, &error), AD_OK);
    assert_int_equal(fresh.field(fresh.context, 0, y, expected, &error), AD_OK);
    for (size_t k = 0; k < 4; k++)
        assert_close(rate[k], expected[k], 1e-13, 0);
    phys_ode_free(&fresh);
    phys_ode_free(&ode);
    phys_system_close(&system);
}

/* A pulse of momentum f at t = 5. */
struct kicked {
    double f, width, plain;
};
static ad_var kicked(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct kicked *p = params;
    ad_var s = ad_div(ad_sub(t, 5.0), PHYS_PARAM(p, width));
    ad_var height = ad_div(ad_mul(1 / sqrt(M_PI), PHYS_PARAM(p, f)), PHYS_PARAM(p, width));
    ad_var pulse = ad_mul(height, ad_exp(ad_neg(ad_square(s))));
    return ad_add(ad_mul(0.5 * p->plain, ad_square(v)), ad_mul(pulse, q));
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = v[0] = 0;
    return AD_OK;
}

static void pulses_are_not_stepped_over(void **state)
{
    static const struct phys_param params[] = {
        {"f", "1", "", 2, offsetof(struct kicked, f)},
        {"width", "1", "", 2e-2, offsetof(struct kicked, width)},
        {"plain", "1", "", 1, offsetof(struct kicked, plain)}};
    static const char *const names[] = {"f"}, *const plain[] = {"plain"};
    (void)state;
    struct phys_scene scene = scene_of("kicked", 1, kicked, 11, 1, at_rest);
    scene.params = params;
    scene.n_params = LENGTH(params);
    scene.params_bytes = sizeof(struct kicked);
    struct phys_system system;
    struct ad_error error = {0};
    double none[2], u[2];
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct result r = sensitivity(&system, 10, 1, names);
    assert_close(r.matrix[1], 1, 1e-9, 0); /* v = f */
    assert_close(r.matrix[0], 5, 1e-9, 0);
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 10};
    assert_int_equal(phys_sensitivity(&system, NULL, 0, &how, 1, plain, none, u, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "plain");
    assert_mentions(error.message, "PHYS_PARAM");
    assert_true(isnan(none[0]));
    phys_system_close(&system);
}

/* There is no orbit of e < 0. */
static void starts_end_where_they_are_defined(void **state)
{
    static const char *const names[] = {"a", "e"};
    (void)state;
    struct phys_system system = system_opened("kepler");
    struct ad_error error = {0};
    double slope[8], off[8];
    system_set(&system, "e", 0);
    assert_int_equal(phys_start_slopes(&system, 1, 1, names, slope, off, &error), AD_OK);
    assert_int_equal(phys_start_slopes(&system, 1, 2, names, slope, off, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "kepler e 0");
    phys_system_close(&system);
}

static void what_is_lost_is_refused(void **state)
{
    static const char *const names[] = {"g"};
    (void)state;
    struct phys_system system = system_opened("dblpend");
    struct ad_error error = {0};
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 120};
    double matrix[4], u[4];
    assert_int_equal(phys_sensitivity(&system, NULL, 0, &how, 1, names, matrix, u, &error),
                     AD_E_ACCURACY);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spring_has_its_closed_form),
        cmocka_unit_test(the_start_counts),
        cmocka_unit_test(differences_agree),
        cmocka_unit_test(values_are_read_when_the_motion_is),
        cmocka_unit_test(pulses_are_not_stepped_over),
        cmocka_unit_test(starts_end_where_they_are_defined),
        cmocka_unit_test(what_is_lost_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
