/* Paths on uneven elements: closed forms, and all that is said of them. */
#include "physics/path/mesh.h"
#include "physics/path/newton.h"
#include "physics/path/path_nodes.h"
#include "tests/physics/published.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLICES = 41, MOST = 4 };
static const double TIME = 5; /* half a period of the spring is 3.14 */

/* Elements from 1 to about 1/40 of the mean, back and forth. */
static void uneven(size_t slices, double *mesh)
{
    for (size_t i = 0; i < slices; i++)
        mesh[i] = i == 0 ? 0 : mesh[i - 1] + 0.02 + pow(sin(0.61 * (double)i), 4);
    for (size_t i = 0; i < slices; i++)
        mesh[i] *= i + 1 < slices ? (double)(slices - 1) / mesh[slices - 1] : 1;
    mesh[slices - 1] = (double)(slices - 1);
}

static ad_var spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var force =
        ad_mul(q, ad_sin(ad_mul(2.0, t))); /* q'' = -q + sin 2t: q = A sin t - sin(2t)/3 */
    ad_var free = ad_mul(0.5, ad_sub(ad_square(v), ad_square(q)));
    return ad_add(free, force);
}

static ad_var still(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(v), ad_square(q)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0;
    v[0] = 1;
    return AD_OK;
}

static const struct phys_scene driven = {.version = PHYS_SCENE_VERSION,
                                         .size = sizeof(struct phys_scene),
                                         .name = "driven",
                                         .what = "a driven spring",
                                         .dof = 1,
                                         .dims = 1,
                                         .unit = "1",
                                         .time_unit = "1",
                                         .energy_unit = "1",
                                         .lagrangian = spring,
                                         .slices = SLICES,
                                         .dt = 0.1,
                                         .start = start};

static double exact(double t) { return 2 * sin(t) - sin(2 * t) / 3; }

struct solved {
    double path[MOST * SLICES], mesh[SLICES], error;
    struct phys_path_settings settings;
    struct phys_path_found found;
    struct phys_system system;
    struct phys_scene scene;
};

/* The path of the driven spring, or of the free one, over TIME on a mesh. */
static void solve(const char *rule, size_t slices, bool is_driven, struct solved *s)
{
    struct ad_error error = {0};
    memset(s, 0, sizeof *s);
    s->scene = driven;
    s->scene.lagrangian = is_driven ? spring : still;
    uneven(slices, s->mesh);
    assert_int_equal(phys_system_make(&s->scene, &s->system, &error), AD_OK);
    s->settings = phys_path_defaults(&s->system);
    s->settings.rule = phys_rule_find(rule, &error);
    s->settings.slices = slices;
    s->settings.dt = TIME / (double)(slices - 1);
    s->settings.mesh = s->mesh;
    double other[MOST * SLICES] = {1, 2, 3}; /* what is said is not of it */
    s->settings.compare = other;
    s->path[slices - 1] = is_driven ? exact(TIME) : sin(TIME);
    assert_int_equal(
        phys_path_find(&phys_solver_newton, &s->system, &s->settings, s->path, &s->found, &error),
        AD_OK);
    assert_int_equal(s->found.info.stop, PHYS_STOP_ROUNDING);
    s->settings.compare = NULL;
    const struct phys_grid grid = phys_grid_of(&s->settings);
    for (size_t i = 0; i < slices; i++) {
        double t = phys_grid_time(&grid, i);
        s->error = fmax(s->error, fabs(s->path[i] - (is_driven ? exact(t) : sin(t))));
    }
}

static void close_all(struct solved *s)
{
    phys_path_found_free(&s->found);
    phys_system_close(&s->system);
}

/* Time is an input of L, so a wrong one shows; every rule keeps an order near its own. */
static void every_rule_converges(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        double least; /* error on 21 slices by that on 41 */
    } cases[] = {{"left", 1.5}, {"midpoint", 3}, {"trapezoid", 3}, {"gauss2", 10}, {"gauss4", 80}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct solved coarse, fine;
        solve(cases[k].rule, 21, true, &coarse);
        solve(cases[k].rule, 41, true, &fine);
        print_message("%s: %g, %g\n", cases[k].rule, coarse.error, fine.error);
        assert_true(coarse.error > cases[k].least * fine.error);
        assert_true(fine.error < 0.5);
        /* what is said of it: the motion from its own start, and a rule of higher order */
        if (k > 0) {
            assert_close(fine.found.discretisation, fine.error, 0.3, 1e-12);
            assert_true(fine.found.true_distance < 20 * fine.error);
        }
        close_all(&coarse);
        close_all(&fine);
    }
}

/* S = sin(2T)/4 between 0 and sin T; its energy is 1/2; one point, pi, is conjugate to the start.
 */
static void what_is_said_of_it(void **state)
{
    (void)state;
    struct solved s;
    solve("gauss4", SLICES, false, &s);
    assert_close(s.error, 0, 0, 1e-8);
    assert_close(s.found.info.action, sin(2 * TIME) / 4, 0, 1e-8);
    assert_close(s.found.info.energy_mean, 0.5, 0, 1e-8);
    assert_true(s.found.info.energy_drift < 1e-3);
    assert_int_equal(s.found.spectrum.index, 1);
    assert_int_equal(s.found.spectrum.n_conjugate, 1);
    assert_close(s.found.spectrum.conjugate[0].time, M_PI, 0, 1e-10);
    assert_true(s.found.true_distance < 1e-7);
    /* second variation: (pi k / T)^2 - 1, whatever the mesh */
    assert_close(s.found.spectrum.second_variation, pow(M_PI / TIME, 2) - 1, 1e-6, 0);
    struct phys_spectrum spectrum;
    struct ad_error error = {0};
    assert_int_equal(phys_path_spectrum(&s.system, &s.settings, s.path, &spectrum, &error), AD_OK);
    assert_true(fabs(spectrum.conjugate[0].time - M_PI) <= spectrum.conjugate[0].error);
    phys_spectrum_free(&spectrum);
    close_all(&s);
}

static void resampling_between_meshes(void **state)
{
    (void)state;
    struct ad_error error = {0};
    double mesh[SLICES], path[4 * SLICES];
    uneven(SLICES, mesh);
    struct phys_grid from = {phys_rule_find("gauss4", &error), SLICES, 0.1, mesh}, to = from;
    struct phys_rule_table table;
    from.rule->fill(from.rule, &table);
    for (size_t i = 0; i < SLICES; i++)
        for (size_t k = 0; k < 4; k++) {
            double end = i + 1 < SLICES ? mesh[i + 1] : mesh[i];
            path[k * SLICES + i] = pow(0.1 * (mesh[i] + table.node[k] * (end - mesh[i])), 4);
        }
    to.mesh = NULL;
    to.slices = 18;
    to.dt = from.dt * (SLICES - 1) / 17;
    double *even = phys_path_resample(&from, path, &to, 1, &error);
    assert_non_null(even);
    for (size_t i = 0; i < to.slices; i++)
        assert_close(even[i], pow((double)i * to.dt, 4), 1e-12, 1e-12);
    double *back = phys_path_resample(&to, even, &from, 1, &error);
    assert_non_null(back);
    for (size_t k = 0; k < 4 * SLICES; k++)
        assert_close(back[k], path[k], 1e-11, 1e-11);
    free(even);
    free(back);
}

/* ---- elements placed by phys_path_refine ---- */

static double centre, width;

/* A force that holds the path q = tanh((t - centre)/width) + sin t, whose q'' + q it is. */
static ad_var steep(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var u = ad_tanh(ad_mul(1 / width, ad_sub(t, centre)));
    ad_var bend = ad_mul(-2 / width / width, ad_mul(u, ad_sub(1.0, ad_square(u))));
    return ad_add(still(q, v, t, params), ad_mul(q, ad_add(bend, u)));
}

static double steep_exact(double t) { return tanh((t - centre) / width) + sin(t); }

/* q = tanh(t / width), from 0 to 1. */
static ad_var layer(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var apart = ad_sub(1.0, ad_square(q));
    return ad_mul(0.5, ad_add(ad_square(v), ad_mul(1 / width / width, ad_square(apart))));
}

static double layer_exact(double t) { return tanh(t / width); }

struct refined {
    double error, estimate, longest; /* element, in units of the mean */
    size_t elements;
    enum ad_status status;
};

/* From a line between the ends of the closed form, over `time`. */
static struct refined refine(phys_lagrangian *lagrangian, double (*closed)(double), double time,
                             double tolerance, const char *rule)
{
    struct ad_error error = {0};
    struct phys_system system;
    struct phys_refined refined;
    struct phys_scene scene = driven;
    double guess[9];
    scene.lagrangian = lagrangian;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    for (size_t i = 0; i < LENGTH(guess); i++)
        guess[i] = closed(0) + (closed(time) - closed(0)) * (double)i / 8;
    struct phys_path_settings settings = phys_path_defaults(&system);
    settings.rule = rule ? phys_rule_find(rule, &error) : NULL;
    settings.slices = LENGTH(guess);
    settings.dt = time / 8;
    struct refined r = {
        .status = phys_path_refine(&system, &settings, guess, 0, tolerance, &refined, &error)};
    const struct phys_grid grid = phys_grid_of(refined.settings);
    r.elements = grid.slices - 1;
    for (size_t i = 0; r.status == AD_OK && i < grid.slices; i++) {
        r.error = fmax(r.error, fabs(refined.path[i] - closed(phys_grid_time(&grid, i))));
        double before = i ? phys_grid_time(&grid, i - 1) : 0;
        r.longest = fmax(r.longest, (phys_grid_time(&grid, i) - before) / grid.dt);
    }
    r.estimate = refined.n ? refined.level[refined.n - 1].estimate : (double)NAN;
    phys_refined_free(&refined);
    phys_system_close(&system);
    return r;
}

/* An estimate that holds on even meshes alone would show here: places and widths at random. */
static void estimates_hold_where_elements_are_placed(void **state)
{
    (void)state;
    static const char *const rules[] = {NULL, "gauss3", "gauss5"};
    size_t placed = 0, missed = 0;
    double worst = 0;
    for (size_t k = 0; k < 24; k++) {
        double share = fmod(0.618034 * (double)(k + 1), 1);
        centre = TIME * fmod(0.754878 * (double)(k + 1), 1);
        width = pow(10, -2.5 * share);
        double tolerance = pow(10, -3 - (double)(k % 7));
        struct refined r = refine(steep, steep_exact, TIME, tolerance, rules[k % 3]);
        missed += r.status != AD_OK;
        if (r.status != AD_OK)
            continue;
        assert_true(r.error <= r.estimate && r.estimate < tolerance && r.longest <= 2.001);
        placed += r.longest > 1.5;
        worst = fmax(worst, r.error / r.estimate);
    }
    print_message("%zu placed, %zu not reached, worst share of the estimate %g\n", placed, missed,
                  worst);
    assert_true(placed >= 8 && missed <= 1);
}

/* H7: a boundary layer from a straight line. */
static void layers_cost_little(void **state)
{
    (void)state;
    static const struct {
        double width;
        size_t most;
    } cases[] = {{0.02, 256}, {0.001, 2048}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        width = cases[k].width;
        struct refined r = refine(layer, layer_exact, 1, 1e-9, NULL);
        print_message("width %g: %zu elements, error %g\n", width, r.elements, r.error);
        assert_int_equal(r.status, AD_OK);
        assert_true(r.error <= 1e-9 && r.elements <= cases[k].most);
    }
}

static void refusals(void **state)
{
    (void)state;
    struct solved s;
    struct ad_error error = {0};
    struct phys_path_info info;
    solve("gauss4", SLICES, false, &s);
    assert_int_equal(phys_path_solve(phys_solver_find("adam", &error), &s.system, &s.settings,
                                     s.path, &info, &error),
                     AD_E_ARGUMENT);
    static const size_t at[] = {0, 20, SLICES - 1};
    for (size_t k = 0; k < LENGTH(at); k++) {
        double kept = s.mesh[at[k]];
        s.mesh[at[k]] = at[k] == 20 ? s.mesh[19] : kept + 1e-9;
        error = (struct ad_error){0};
        assert_int_equal(
            phys_path_solve(&phys_solver_newton, &s.system, &s.settings, s.path, &info, &error),
            AD_E_ARGUMENT);
        s.mesh[at[k]] = kept;
    }
    struct phys_solutions all;
    error = (struct ad_error){0};
    assert_int_equal(phys_path_all(&s.system, &s.settings, s.path, 10, 1, &all, &error),
                     AD_E_ARGUMENT);
    close_all(&s);
}

/* The highest derivative of a parabola on lines changes by as much in each element. */
static void a_parabola_asks_for_even_elements(void **state)
{
    enum { PARTS = 5 };
    struct ad_error error = {0};
    const struct phys_grid grid = {phys_rule_find("left", &error), SLICES, 0.1, NULL};
    const double unit = 1;
    double path[SLICES], mesh[PARTS + 1], gain;
    (void)state;
    for (int i = 0; i < SLICES; i++)
        path[i] = 0.01 * i * i;
    assert_int_equal(phys_mesh_place(&grid, path, &unit, 1, PARTS, mesh, &gain, &error), AD_OK);
    for (int k = 0; k <= PARTS; k++)
        assert_close(mesh[k], k, 0, 1e-9);
    assert_close(gain, 0.5, 1e-9, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_rule_converges),
        cmocka_unit_test(what_is_said_of_it),
        cmocka_unit_test(resampling_between_meshes),
        cmocka_unit_test(estimates_hold_where_elements_are_placed),
        cmocka_unit_test(layers_cost_little),
        cmocka_unit_test(a_parabola_asks_for_even_elements),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
