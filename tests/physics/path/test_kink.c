/* H7: a kink, tanh(t / eps), from a straight line, by levels of phys_path_refine. */
#include "physics/path/internal.h"
#include "tests/physics/published.h"
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

static void a_kink_from_a_line(void **state)
{
    enum { SLICES = 129 };
    const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
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
    (void)state;
    for (size_t k = 0; k < LENGTH(widths); k++) {
        struct phys_system system;
        struct phys_refined refined;
        struct ad_error error = {0};
        double line[SLICES];
        eps = widths[k];
        assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
        for (size_t i = 0; i < SLICES; i++)
            line[i] = tanh(1 / eps) * (double)i / (SLICES - 1);
        struct phys_path_settings settings = phys_path_defaults(&system);
        settings.rule = NULL;
        phys_path_refine(&system, &settings, line, 0, 1e-6, &refined, &error);
        assert_no_error(&error);
        size_t slices = refined.settings.slices;
        for (size_t i = 0; i < slices; i++)
            assert_close(refined.path[i], tanh((double)i / (double)(slices - 1) / eps), 0, 1e-6);
        phys_refined_free(&refined);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_kink_from_a_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
