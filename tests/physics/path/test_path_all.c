/* Several stationary paths between the same ends: the swings of a pendulum; spurious ones are
   rejected. */
#include "physics/path/verify/grid_independence.h"
#include "physics/path/newton.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* theta(0) = theta(10) = 0, g = l = 1: three swings, each with its mirror image, and rest. */
static void four_answers_of_the_pendulum(void **state)
{
    static const struct {
        double energy, amplitude;
        size_t index, copies;
    } known[] = {{0, 0, 3, 1},
                 {0.42766904, 0.96145072, 2, 2},
                 {1.76375516, 2.43990697, 1, 2},
                 {1.99854509, 3.08764330, 0, 2}};
    enum { SLICES = 101 };
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss4", &error),
                                          .slices = SLICES,
                                          .dt = 10. / (SLICES - 1),
                                          .learning_rate = 1};
    double path[4 * SLICES] = {0};
    struct phys_solutions all;
    phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_int_equal(all.n, sizeof known / sizeof *known);
    for (size_t k = 0; k < all.n; k++) {
        assert_close(all.solution[k].energy, known[k].energy, 0, 6e-9);
        /* V = 1 - cos theta is all there is where the swing turns round */
        assert_close(acos(1 - all.solution[k].energy), known[k].amplitude, 0, 2e-8);
        assert_int_equal(all.solution[k].spectrum.index, known[k].index);
        assert_int_equal(all.solution[k].copies, known[k].copies);
    }
    phys_solutions_free(&all);
    phys_system_close(&pendulum);
}

/* By rule left q_i = cos((i - 1/2) w) / cos(w / 2) with 2 - 2 cos w = dt^2 begins 1, 1; the mean of
   T + V over its slices is a sum that needs no path. */
static void the_energy_of_a_spring_is_that_of_its_recurrence(void **state)
{
    enum { SLICES = 100 };
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    const double dt = 0.025, w = acos(1 - dt * dt / 2);
    phys_system_open("spring", &spring, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("left", &error),
                                          .slices = SLICES,
                                          .dt = dt,
                                          .learning_rate = 1};
    double path[SLICES], mean = 0;
    for (size_t i = 0; i < SLICES; i++)
        path[i] = cos(((double)i - 0.5) * w) / cos(0.5 * w);
    for (size_t i = 0; i + 1 < SLICES; i++)
        mean += 0.5 * (pow((path[i + 1] - path[i]) / dt, 2) + pow(path[i], 2)) / (SLICES - 1);
    for (size_t i = 1; i + 1 < SLICES; i++) /* the ends alone are given */
        path[i] = path[0] + (path[SLICES - 1] - path[0]) * (double)i / (SLICES - 1);
    struct phys_solutions all;
    phys_path_all(&spring, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_int_equal(all.n, 1);
    assert_close(mean, 0.501088971842, 0, 1e-12); /* and by 40 digits */
    assert_close(all.solution[0].energy, mean, 0, 1e-12);
    phys_solutions_free(&all);
    phys_system_close(&spring);
}

/* q'' = q - q^3 from the top of the hill between its wells, nearly at rest: motions that stay there
   at the start half as long as where they come by again, and one that rests there and falls at
   last. */
static ad_var wells(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(0.25, ad_square(ad_sub(ad_square(q), 1))));
}

static enum ad_status on_the_top(const void *params, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = v[0] = 0;
    return AD_OK;
}

static void none_is_left_out_from_the_top(void **state)
{
    enum { SLICES = 41 };
    static const double to[] = {-1.33, 0.7, 0};
    const struct phys_scene scene = scene_of("wells", 1, wells, SLICES, 0.25, on_the_top);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = phys_rule_find("gauss4", &error),
                                                .slices = SLICES,
                                                .dt = 20. / (SLICES - 1),
                                                .learning_rate = 1};
    for (size_t k = 0; k < LENGTH(to); k++) {
        double path[4 * SLICES] = {[SLICES - 1] = to[k]};
        struct phys_solutions all;
        phys_path_all(&system, &settings, path, 0, 1, &all, &error);
        assert_no_error(&error);
        print_message("to %g: %zu paths, %zu left out\n", to[k], all.n, all.unresolved);
        assert_true(all.exhaustive);
        assert_int_equal(all.unresolved, 0);
        phys_solutions_free(&all);
    }
    phys_system_close(&system);
}

/* B3: a search and a path end wherever they are asked to: in the sweep of energies, within Newton's
   steps, in the spectrum; and ask hardly again. */
struct patience {
    size_t asked, least; /* how often, and from when on the answer is no */
};

static bool go_on(void *context)
{
    struct patience *p = context;
    return p->asked++ < p->least;
}

static void a_search_ends_where_it_is_asked_to(void **state)
{
    enum { SLICES = 21 };
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    struct patience patience = {.least = SIZE_MAX};
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss2", &error),
                                          .slices = SLICES,
                                          .dt = 10. / (SLICES - 1),
                                          .steps = 50,
                                          .proceed = go_on,
                                          .context = &patience};
    struct phys_solutions all;
    struct phys_path_found found;
    struct phys_spectrum spectrum;
    double path[2 * SLICES] = {0};
    phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error);
    assert_false(all.interrupted);
    size_t asks = patience.asked, n = all.n;
    phys_solutions_free(&all);
    assert_true(asks > 1000);
    for (size_t k = 0; k < asks; k += asks / 5) {
        patience = (struct patience){.least = k};
        assert_int_equal(phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error), AD_OK);
        assert_true(all.interrupted && !all.exhaustive && all.n <= n);
        assert_true(patience.asked < k + 12);
        phys_solutions_free(&all);
    }
    size_t with_kind = 0;
    for (size_t k = 0;; k += 1 + k / 4) {
        patience = (struct patience){.least = k};
        for (size_t i = 0; i < 2 * SLICES; i++)
            path[i] = 0.1 * sin(0.7 * (double)i) * (i % SLICES && i % SLICES != SLICES - 1);
        assert_int_equal(
            phys_path_find(&phys_solver_newton, &pendulum, &settings, path, &found, &error), AD_OK);
        bool stopped = found.info.stop == PHYS_STOP_INTERRUPTED;
        assert_true(stopped == !found.stationary);
        with_kind += found.stationary;
        phys_path_found_free(&found);
        if (patience.asked <= k)
            break;
    }
    assert_true(with_kind > 0);
    patience = (struct patience){.least = 20};
    assert_int_equal(phys_path_spectrum(&pendulum, &settings, path, &spectrum, &error),
                     AD_E_ACCURACY);
    phys_spectrum_free(&spectrum);
    phys_system_close(&pendulum);
}

/* A straight line is the only path of a free body. */
static void one_answer_of_a_free_body(void **state)
{
    enum { SLICES = 20 };
    (void)state;
    struct phys_system body;
    struct ad_error error = {0};
    phys_system_open("freebody", &body, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("midpoint", &error),
                                          .slices = SLICES,
                                          .dt = 0.1,
                                          .learning_rate = 1};
    double path[SLICES] = {[0] = 1.3, [SLICES - 1] = -0.7};
    struct phys_solutions all;
    phys_path_all(&body, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_int_equal(all.n, 1);
    assert_int_equal(all.solution[0].copies, 1);
    phys_solutions_free(&all);
    phys_system_close(&body);
}

/* A10, H3: every path of the published pendulum, pairs that lie near each other and those beside
   the energy of the separatrix, 360, too. */
static void every_path_of_the_pendulum(void **state)
{
    static const struct {
        const char *rule;
        size_t slices;
        double dt;
        size_t n;
        double near[6];
    } cases[] = {
        {"gauss3", 400, 1, 17, {180, 181.431701, 315.434709, 315.470712, 359.997991, 359.997995}},
        {"gauss4", 201, 1.25, 11, {180, 358.7424, 359.7850, 359.99995, 348.013087, 348.039121}},
    };
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    phys_system_open("pendulum", &pendulum, &error);
    for (size_t c = 0; c < LENGTH(cases); c++) {
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find(cases[c].rule, &error),
                                              .slices = cases[c].slices,
                                              .dt = cases[c].dt,
                                              .learning_rate = 1};
        size_t n = settings.slices;
        double *path = calloc(4 * n, sizeof *path), q, v;
        pendulum.scene->start(pendulum.params, 1, &q, &v, &error);
        phys_motion_path(&pendulum, NULL, &q, &v, n, settings.dt, path, &error);
        phys_rule_interpolate(settings.rule, 1, n, path);
        struct phys_solutions all;
        phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error);
        assert_no_error(&error);
        assert_true(all.exhaustive && !all.limited);
        assert_int_equal(all.n, cases[c].n);
        assert_int_equal(all.unresolved, 0);
        for (size_t j = 0; j < LENGTH(cases[c].near); j++) {
            size_t found = 0;
            for (size_t k = 0; k < all.n; k++)
                found += is_close(all.solution[k].energy, cases[c].near[j], 3e-9, 5e-5);
            assert_in_range(found, 1, 2);
        }
        phys_solutions_free(&all);
        free(path);
    }
    phys_system_close(&pendulum);
}

/* F(phi, k) by Simpson's rule. */
static double elliptic(double phi, double k)
{
    enum { N = 400 };
    double sum = 0;
    for (int i = 0; i <= N; i++) {
        double s = k * sin(phi * i / N);
        sum += (i == 0 || i == N ? 1 : i % 2 ? 4 : 2) / sqrt(1 - s * s);
    }
    return sum * phi / N / 3;
}

static double time_of_one_turn(double k)
{
    return 2 * elliptic(M_PI / 2, k) + elliptic(asin(sin(0.5) / k), k);
}

/* No motion is lost on a coarse grid: what its paths do not stand for is counted, also where two
   motions lead to one of them. From 0 to 1, g = l = 1: the direct motion, and two that turn once,
   which have just met: the time is the least of 2 K(k) + F(asin(sin(1/2)/k), k), and a part in
   1e8. */
static void every_motion_is_a_path_or_counted(void **state)
{
    static const char *const rules[] = {"left", "trapezoid", "midpoint", "gauss2"};
    enum { SLICES = 31, MOTIONS = 3 };
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    double a = 0.5, b = 0.95;
    while (b - a > 1e-7) {
        double x = a + (b - a) / 3, y = b - (b - a) / 3;
        *(time_of_one_turn(x) < time_of_one_turn(y) ? &b : &a) =
            time_of_one_turn(x) < time_of_one_turn(y) ? y : x;
    }
    const double least = time_of_one_turn(a);
    for (size_t c = 0; c < LENGTH(rules); c++) {
        const struct phys_path_settings settings = {.size = sizeof settings,
                                                    .rule = phys_rule_find(rules[c], &error),
                                                    .slices = SLICES,
                                                    .dt = least * (1 + 1e-8) / (SLICES - 1),
                                                    .learning_rate = 1};
        double path[2 * SLICES];
        size_t found = 0;
        for (size_t i = 0; i < SLICES; i++)
            path[i] = (double)i / (SLICES - 1);
        phys_rule_interpolate(settings.rule, 1, SLICES, path);
        struct phys_solutions all;
        phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error);
        assert_no_error(&error);
        assert_true(all.exhaustive && !all.limited);
        for (size_t k = 0; k < all.n; k++)
            found += all.solution[k].copies;
        print_message("%s: %zu of %d motions, %zu not\n", rules[c], found, MOTIONS, all.unresolved);
        assert_int_equal(found + all.unresolved, MOTIONS);
        assert_true(found < MOTIONS);
        phys_solutions_free(&all);
    }
    phys_system_close(&pendulum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(four_answers_of_the_pendulum),
        cmocka_unit_test(the_energy_of_a_spring_is_that_of_its_recurrence),
        cmocka_unit_test(none_is_left_out_from_the_top),
        cmocka_unit_test(a_search_ends_where_it_is_asked_to),
        cmocka_unit_test(one_answer_of_a_free_body),
        cmocka_unit_test(every_path_of_the_pendulum),
        cmocka_unit_test(every_motion_is_a_path_or_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
