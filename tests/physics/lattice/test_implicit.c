/* Implicit methods on lattices: modes of linear rings against the methods' own rational functions
   of h lambda, in steps so long that fixed-point iteration fails; and fields that vanish far away.
 */
#include "physics/integrators/integrators.h"
#include "physics/motion/motion.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <complex.h>
#include <stdlib.h>

enum { SITES = 150, STEP = 7, MODE = 11, STEPS = 8 };
static const double friction = 0.4, h = 2.5;

static double kappa(void) { return 2 - 2 * cos(2 * M_PI * MODE / SITES); }

/* Site k is coordinate STEP k: neighbours are far from each other. */
static ad_var neighbour(ad_var x, size_t step)
{
    uint32_t rows[SITES];
    for (size_t j = 0; j < SITES; j++)
        rows[j] = (uint32_t)((j + step) % SITES);
    return ad_gather_rows(x, SITES, rows);
}

static ad_var free_sites(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)t, (void)p;
    return ad_mul(0.5, ad_sum_rows(ad_sub(ad_square(v), ad_square(q))));
}

/* Couples sites that L does not. */
static ad_var rub(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)q, (void)t, (void)p;
    ad_var both = ad_add(neighbour(v, STEP), neighbour(v, SITES - STEP));
    return ad_mul(friction, ad_sub(both, ad_mul(2, v)));
}

static ad_var springs(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)t, (void)p;
    ad_var d = ad_sub(neighbour(q, STEP), q);
    return ad_mul(0.5, ad_sum_rows(ad_sub(ad_square(v), ad_square(d))));
}

static double wave(size_t coordinate)
{
    size_t site = 0;
    while (STEP * site % SITES != coordinate)
        site++;
    return cos(2 * M_PI * MODE * (double)site / SITES);
}

static enum ad_status rest(const void *p, uint64_t seed, double *q, double *v,
                           struct ad_error *error)
{
    (void)p, (void)seed, (void)error;
    for (size_t k = 0; k < SITES; k++)
        q[k] = v[k] = 0;
    return AD_OK;
}

/* y = (q, v) or, the masses being 1, (q, p). */
static void assert_mode(const char *method, const struct phys_scene *scene, double complex lambda,
                        double complex factor)
{
    struct phys_system system = {0};
    struct phys_ode ode;
    struct ad_error e = {0};
    struct phys_simulation_info info;
    double y[2 * SITES];
    const struct phys_simulation run = {.size = sizeof run,
                                        .integrator = phys_integrator_find(method, &e),
                                        .t1 = STEPS * h,
                                        .dt = h};
    assert_int_equal(phys_system_make(scene, &system, &e), AD_OK);
    assert_int_equal(run.integrator->lagrangian ? phys_ode_canonical(&system, &ode, &e)
                                                : phys_ode_lagrangian(&system, &ode, &e),
                     AD_OK);
    for (size_t k = 0; k < SITES; k++) {
        y[k] = wave(k);
        y[SITES + k] = creal(lambda) * wave(k);
    }
    assert_int_equal(phys_simulate(&run, &ode, y, &info, &e), AD_OK);
    for (size_t k = 0; k < SITES; k++) {
        assert_close(y[k], wave(k) * creal(cpow(factor, STEPS)), 0, 1e-11);
        assert_close(y[SITES + k], wave(k) * creal(lambda * cpow(factor, STEPS)), 0, 1e-11);
    }
    assert_true(info.evaluations < 1000); /* a difference for each component takes more */
    phys_ode_free(&ode);
    phys_system_close(&system);
}

static double complex half_of(size_t stages, double complex z)
{
    const double complex terms[] = {1 + z / 2, 1 + z / 2 + z * z / 12,
                                    1 + z / 2 + z * z / 10 + z * z * z / 120};
    return terms[stages - 1];
}

static void modes_turn_as_the_methods_do(void **state)
{
    static const char *const methods[] = {"implicit-midpoint", "gauss2", "gauss3"};
    struct phys_scene rubbed = scene_of("rubbed", SITES, free_sites, 10, h, rest);
    struct phys_scene ring = scene_of("ring", SITES, springs, 10, h, rest);
    const double complex damped =
        -friction * kappa() / 2 + I * sqrt(1 - pow(friction * kappa() / 2, 2));
    const double complex turning = I * sqrt(kappa());
    (void)state;
    rubbed.forces = rub;
    for (size_t s = 1; s <= LENGTH(methods); s++) {
        assert_mode(methods[s - 1], &rubbed, damped,
                    half_of(s, h * damped) / half_of(s, -h * damped));
        assert_mode(methods[s - 1], &ring, turning,
                    half_of(s, h * turning) / half_of(s, -h * turning));
    }
    assert_mode("variational-midpoint", &ring, turning,
                half_of(1, h * turning) / half_of(1, -h * turning));
}

/* A kink in a field that is 1e-250 and less elsewhere, and 0: by other methods the same. */
static void fields_may_vanish(void **state)
{
    static const struct {
        const char *method;
        double dt;
    } cases[] = {{"gauss4", 0.25}, {"gauss4", 1}, {"variational-gauss4", 0.25}};
    enum { N = 1200 };
    struct phys_system system = system_opened("sine-gordon");
    struct ad_error e = {0};
    (void)state;
    system_set(&system, "sites", N);
    system_set(&system, "length", 2000);
    double *q = malloc(6 * N * sizeof *q), *end = q + 2 * N, *own = q + 4 * N;
    system_start(&system, 0, q, q + N);
    assert_int_equal(phys_motion_path(&system, NULL, q, q + N, 2, 4, end, &e), AD_OK);
    for (size_t c = 0; c < LENGTH(cases); c++) {
        const struct phys_integrator *method = phys_integrator_find(cases[c].method, &e);
        const struct phys_simulation run = {
            .size = sizeof run, .integrator = method, .t1 = 4, .dt = cases[c].dt};
        struct phys_simulation_info info;
        struct phys_ode ode;
        assert_int_equal(method->lagrangian ? phys_ode_canonical(&system, &ode, &e)
                                            : phys_ode_lagrangian(&system, &ode, &e),
                         AD_OK);
        system_start(&system, 0, q, q + N);
        assert_int_equal(phys_ode_enter(&ode, 0, q, q + N, own, &e), AD_OK);
        assert_int_equal(phys_simulate(&run, &ode, own, &info, &e), AD_OK);
        for (size_t k = 0; k < N; k++)
            assert_close(own[k], end[2 * k + 1], 0, cases[c].dt < 1 ? 1e-6 : 1e-2);
        phys_ode_free(&ode);
    }
    free(q);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(modes_turn_as_the_methods_do),
                                       cmocka_unit_test(fields_may_vanish)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
