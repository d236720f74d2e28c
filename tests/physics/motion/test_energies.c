/* Energies of motions, v L_v - L, against formulas: by series, by a program, and where L has kinks
   or no series. */
#include "physics/ode/internal.h"
#include "physics/physics.h"
#include "tests/close.h"
#include "tests/physics/published.h"

/* Damped oscillator (Caldirola, Kanai): L = e^(0.3 t) (v^2 - 4 q^2)/2, a = -0.3 v - 4 q. */
static ad_var damped(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var spring = ad_sub(ad_square(v), ad_mul(4.0, ad_square(q)));
    return ad_mul(ad_mul(0.5, ad_exp(ad_mul(0.3, t))), spring);
}

static ad_var damped_many(ad_var q, ad_var v, ad_var t, const void *params)
{
    return ad_sum_rows(damped(q, v, t, params));
}

/* V = q^2/2 where q > 0, else q^4. */
static ad_var kinked(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var V = ad_select(ad_gt(q, 0.0), ad_mul(0.5, ad_square(q)), ad_square(ad_square(q)));
    return ad_sum_rows(ad_sub(ad_mul(0.5, ad_square(v)), V));
}

/* V = q^2 / (2 (1 + q^2)) by a linear system, which has no series. */
static ad_var solved(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var x = ad_solve(ad_add(ad_square(q), 1.0), q, AD_LU);
    return ad_mul(0.5, ad_sub(ad_square(v), ad_mul(q, x)));
}

static double energy_damped(double q, double v, double t)
{
    return exp(0.3 * t) * 0.5 * (v * v + 4 * q * q);
}

static double energy_kinked(double q, double v, double t)
{
    (void)t;
    return 0.5 * v * v + (q > 0 ? 0.5 * q * q : q * q * q * q);
}

static double energy_solved(double q, double v, double t)
{
    (void)t;
    return 0.5 * (v * v + q * q / (1 + q * q));
}

/* v L_v - L by formulas, of few coordinates, of many, and where L has kinks or no series: also once
   the accelerations were asked for, and then refused a series. */
static void energies_are_those_of_the_formulas(void **state)
{
    (void)state;
    static const struct {
        phys_lagrangian *L;
        double (*energy)(double q, double v, double t);
        size_t dof;
    } cases[] = {{damped, energy_damped, 1},       {damped_many, energy_damped, 12},
                 {damped_many, energy_damped, 13}, {kinked, energy_kinked, 1},
                 {kinked, energy_kinked, 3},       {solved, energy_solved, 1}};
    for (size_t k = 0; k < LENGTH(cases); k++)
        for (int thin = 0; thin < 2; thin++) {
            const size_t dof = cases[k].dof;
            const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                             .size = sizeof scene,
                                             .name = "test",
                                             .dof = dof,
                                             .dims = 1,
                                             .lagrangian = cases[k].L};
            struct phys_system system = {.scene = &scene, .dof = dof, .bodies = dof, .dims = 1};
            struct phys_ode ode = {0};
            struct ad_error error = {0};
            phys_ode_lagrangian(&system, &ode, &error);
            assert_no_error(&error);
            if (thin)
                phys_ode_thin(&ode);
            for (double t = 0; t < 3; t++) {
                double y[26], rate[26], expected = 0;
                for (size_t i = 0; i < dof; i++) {
                    y[i] = sin(1.7 * (double)i + t + 0.3);
                    y[dof + i] = cos(2.3 * (double)i - t);
                    expected += cases[k].energy(y[i], y[dof + i], t);
                }
                ode.field(ode.context, t, y, rate, &error);
                assert_no_error(&error);
                assert_close(ode.energy(ode.context, t, y), expected, 4e-15, 0);
            }
            phys_ode_free(&ode);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(energies_are_those_of_the_formulas)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
