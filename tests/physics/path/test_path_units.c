/* Paths whose coordinates have different units: each has as many digits as the tolerance asks. */
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>

/* Two springs that know nothing of each other, the faster one in a unit of its own. */
static double unit;
static size_t other;

static ad_var springs(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    (void)params;
    ad_var x = ad_row(q, 1 - other), y = ad_mul(1 / unit, ad_row(q, other));
    ad_var x_rate = ad_row(v, 1 - other), y_rate = ad_mul(1 / unit, ad_row(v, other));
    return ad_mul(0.5, ad_sub(ad_add(ad_square(x_rate), ad_square(y_rate)),
                              ad_add(ad_square(x), ad_mul(9, ad_square(y)))));
}

static double solution(size_t k, double t)
{
    return k == other ? unit * sin(3 * t + 0.2) : 0.8 * cos(t);
}

static enum ad_status no_start(const void *params, uint64_t seed, double *q, double *v,
                               struct ad_error *error)
{
    (void)params;
    (void)seed;
    for (size_t k = 0; k < 2; k++)
        q[k] = v[k] = 1;
    return error->status;
}

enum { GUESS = 12, MOST = 1100 };
static const double units[] = {1, 1e-3, 1e-6, 1e-9, 1e-12}, T = 2;

static struct phys_scene scene;
static struct phys_system system_of_springs(void)
{
    struct phys_system system;
    struct ad_error error = {0};
    scene = scene_of("springs", 2, springs, GUESS, T / (GUESS - 1), no_start);
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    return system;
}

/* The solution at `slices`, or the line between its ends. */
static void fill(size_t slices, bool line, double *path)
{
    for (size_t k = 0; k < 2; k++)
        for (size_t i = 0; i < slices; i++) {
            double share = (double)i / (double)(slices - 1);
            path[k * slices + i] = line ? (1 - share) * solution(k, 0) + share * solution(k, T)
                                        : solution(k, share * T);
        }
}

/* The largest error of a coordinate in its own unit. */
static double worst(const double *path, size_t slices)
{
    double most = 0, exact[2 * MOST];
    assert_true(slices <= MOST);
    fill(slices, false, exact);
    for (size_t k = 0; k < 2; k++)
        for (size_t i = 0; i < slices; i++)
            most = fmax(most, fabs(path[k * slices + i] - exact[k * slices + i]) /
                                  (k == other ? unit : 1));
    return most;
}

static void each_unit_has_its_digits(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        double tolerance;
    } cases[] = {{NULL, 1e-3}, {NULL, 1e-8}, {"gauss3", 1e-8}, {"midpoint", 1e-3}};
    for (size_t c = 0; c < LENGTH(cases); c++)
        for (other = 0; other < 2; other++) {
            size_t elements = 0;
            for (size_t u = 0; u < LENGTH(units); u++) {
                unit = units[u];
                struct phys_system system = system_of_springs();
                struct ad_error error = {0};
                struct phys_refined r;
                struct phys_path_found found;
                double guess[2 * GUESS];
                fill(GUESS, true, guess);
                struct phys_path_settings settings = {
                    .size = sizeof settings,
                    .rule = cases[c].rule ? phys_rule_find(cases[c].rule, &error) : NULL,
                    .slices = GUESS,
                    .dt = T / (GUESS - 1),
                    .steps = 50};
                if (phys_path_refine(&system, &settings, guess, 0, cases[c].tolerance, &r,
                                     &error) != AD_OK)
                    fail_msg("case %zu, unit %g: %s", c, unit, error.message);
                double made = worst(r.path, r.settings->slices),
                       estimate = r.level[r.n - 1].estimate;
                print_message("case %zu, unit %g: %zu elements, error %.2g, estimate %.2g\n", c,
                              unit, r.level[r.n - 1].elements, made, estimate);
                assert_true(made <= cases[c].tolerance && made <= 1.1 * estimate);
                elements = elements ? elements : r.level[r.n - 1].elements;
                assert_int_equal(r.level[r.n - 1].elements, elements); /* whatever the unit */
                r.settings->refined = &r;
                assert_int_equal(phys_path_find(phys_solver_find("newton", &error), &system,
                                                r.settings, r.path, &found, &error),
                                 AD_OK);
                assert_true(found.stationary && found.discretisation <= cases[c].tolerance);
                assert_true(found.true_distance >= 0.1 * made || made < 1e-11);
                phys_path_found_free(&found);
                phys_refined_free(&r);
                phys_system_close(&system);
            }
        }
}

/* Coarse elements, on which the faster one has hardly a digit: the distances say so. */
static void distances_count_each_unit(void **state)
{
    (void)state;
    for (other = 0; other < 2; other++)
        for (size_t u = 0; u < LENGTH(units); u++) {
            unit = units[u];
            struct phys_system system = system_of_springs();
            struct ad_error error = {0};
            struct phys_path_found found;
            double path[2 * GUESS], exact[2 * GUESS];
            fill(GUESS, true, path);
            fill(GUESS, false, exact);
            struct phys_path_settings settings = {.size = sizeof settings,
                                                  .rule = phys_rule_find("midpoint", &error),
                                                  .slices = GUESS,
                                                  .dt = T / (GUESS - 1),
                                                  .compare = exact,
                                                  .steps = 50};
            assert_int_equal(phys_path_find(phys_solver_find("newton", &error), &system, &settings,
                                            path, &found, &error),
                             AD_OK);
            double made = worst(path, GUESS);
            print_message("unit %g: error %.2g, %.2g %.2g %.2g\n", unit, made, found.discretisation,
                          found.reference_distance, found.true_distance);
            assert_true(made > 0.01);
            assert_close(found.discretisation / made, 1, 0, 0.3);
            assert_close(found.reference_distance / made, 1, 0, 0.3);
            assert_true(found.true_distance > 0.1 * made);
            assert_false(found.another);
            phys_path_found_free(&found);
            phys_system_close(&system);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_unit_has_its_digits),
        cmocka_unit_test(distances_count_each_unit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
