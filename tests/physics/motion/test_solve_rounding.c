/* Forces whose terms cancel, so that their rounding is more than the tolerance of the reference. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "own.h"
#include "physics/stability/diagnostics.h"

#include <math.h>

static double size = 1e8;

/* q^2/2 and size ((1 - cos q) - 2 sin^2(q/2)), which is 0. */
static ad_var cancelling(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var none = ad_sub(ad_mul(size, ad_sub(1.0, ad_cos(q))),
                         ad_mul(2 * size, ad_square(ad_sin(ad_mul(0.5, q)))));
    return ad_sub(ad_mul(0.5, ad_sub(ad_square(v), ad_square(q))), none);
}

enum { MOST = 1000000 }; /* steps: a tenth are taken, at 1e-15 there would be 4e6 */

static bool soon(void *context) { return ++*(size_t *)context <= MOST; }

static void open_cancelling(struct phys_system *spring, struct phys_system *system)
{
    struct ad_error error = {0};
    static struct phys_scene scene;
    assert_int_equal(phys_system_open("spring", spring, &error), AD_OK);
    scene = *spring->scene;
    scene.lagrangian = cancelling;
    scene.kinetic = scene.potential = NULL;
    scene.start = begin_own;
    assert_int_equal(phys_system_make(&scene, system, &error), AD_OK);
}

static void a_reference_ends_where_terms_of_the_forces_cancel(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system spring, system;
    struct phys_motion_solution m = {0};
    struct phys_diagnosis diagnosis;
    size_t steps = 0;
    double worst = 0;
    struct phys_motion_settings settings = {.size = sizeof settings,
                                            .time = 1,
                                            .error = 1e-6,
                                            .n_samples = 10,
                                            .proceed = soon,
                                            .context = &steps};
    open_cancelling(&spring, &system);
    assert_int_equal(phys_motion_solve(&system, &settings, &m, &error), AD_OK);
    assert_int_equal(m.info.stop, PHYS_SIMULATION_END);
    for (size_t i = 0; i < m.n; i++)
        worst = fmax(worst, fabs(m.x[2 * i] - 0.5 * cos(m.t[i]) - 0.25 * sin(m.t[i])));
    assert_true(worst > 0 && m.error >= worst && m.error < 1e-8);
    assert_true(m.error - worst <= m.reference_uncertainty);
    assert_true(m.reference_tolerance > 5e-15 && m.reference_tolerance < 1e-10);
    phys_motion_diagnose(&settings, &m, 0, &diagnosis, &error);
    assert_true(diagnosis.n_warnings == 1 && strstr(diagnosis.warning[0], "terms of the forces"));
    settings.error = m.reference_uncertainty / 2; /* nothing shows that it is met */
    assert_int_equal(phys_motion_met(&settings, &m, &error), AD_E_ACCURACY);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
    phys_system_close(&spring);
}

enum { MOST_SEARCHED = 2000000 }; /* evaluations; steps of 1e-13 to the end would take 1e9 */

static void a_search_ends_where_terms_of_the_forces_cancel(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system spring, system;
    struct phys_motion_solution m = {0};
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 10, .error = 1e-9};
    size_t searched = 0;
    size = 1e11;
    open_cancelling(&spring, &system);
    assert_int_equal(phys_motion_solve(&system, &settings, &m, &error), AD_E_ACCURACY);
    assert_mentions(error.message, "terms cancel");
    for (size_t k = 0; k < m.n_trials; k++)
        searched += m.trial[k].searched;
    assert_true(searched > 0 && searched < MOST_SEARCHED);
    phys_motion_solution_free(&m);
    size = 1e8;
    phys_system_close(&system);
    phys_system_close(&spring);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_reference_ends_where_terms_of_the_forces_cancel),
        cmocka_unit_test(a_search_ends_where_terms_of_the_forces_cancel),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
