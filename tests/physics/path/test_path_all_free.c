/* All paths where ends move: those of pendulums are counted by another integrator's scan of the
   initial velocity, and a linear oscillator has one. */
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>
#include <stdlib.h>

enum { SLICES = 121, DEGREE = 4, MOST = 16 };

static const bool free_one[] = {true}, free_first[] = {true, false};

/* By the fourth order of Forest and Ruth: momentum at the end, or with a given end its miss. */
static double end_of(double q, double v, double to, double time)
{
    enum { STEPS = 200 };
    static const double c[] = {0.6756035959798289, -0.17560359597982889, -0.17560359597982889,
                               0.6756035959798289};
    static const double d[] = {1.3512071919596578, -1.7024143839193153, 1.3512071919596578, 0};
    const double h = time / STEPS;
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < 4; j++) {
            q += c[j] * h * v;
            v -= d[j] * h * sin(q);
        }
    return isnan(to) ? v : q - to;
}

/* Energies of the motions of a pendulum from a to an end, NaN: free, slower than `fastest`. */
static size_t count_motions(double a, double to, double time, double fastest, double *energy)
{
    enum { SCAN = 3000 };
    size_t n = 0;
    double before = (double)NAN;
    for (int k = 0; k <= SCAN; k++) {
        double high = fastest * (2. * k / SCAN - 1.00003), low = high - 2 * fastest / SCAN;
        const double here = end_of(a, high, to, time);
        for (int b = 0; !isnan(before) && (here < 0) != (before < 0) && b < 40; b++) {
            const double middle = (low + high) / 2;
            *((end_of(a, middle, to, time) < 0) == (before < 0) ? &low : &high) = middle;
        }
        if (!isnan(before) && (here < 0) != (before < 0))
            energy[n++] = low * low / 2 - cos(a);
        assert_true(n < MOST);
        before = here;
    }
    return n;
}

static ad_var pendulums(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_mul(0.5, ad_sum_rows(ad_square(v))), ad_sum_rows(ad_cos(q)));
}

static ad_var oscillator(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), ad_sum_rows(ad_square(q))));
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = q[1] = v[0] = v[1] = 0;
    return AD_OK;
}

static struct phys_system opened(phys_lagrangian *L, size_t dof)
{
    static struct phys_scene scene;
    struct phys_system system;
    struct ad_error error = {0};
    scene = scene_of("moving ends", dof, L, SLICES, 0.1, at_rest);
    phys_system_make(&scene, &system, &error);
    assert_no_error(&error);
    return system;
}

/* Between ends [2 dof] of a line. */
static void search(const struct phys_system *system, const struct phys_ends *ends,
                   const double *between, double time, struct phys_solutions *all)
{
    static double path[2 * DEGREE * SLICES];
    struct phys_path_settings settings = phys_path_defaults(system);
    struct ad_error error = {0};
    settings.rule = phys_rule_find("gauss4", &error);
    settings.slices = SLICES;
    settings.dt = time / (SLICES - 1);
    settings.ends = ends;
    for (size_t k = 0; k < system->dof * SLICES; k++) {
        const double share = (double)(k % SLICES) / (SLICES - 1);
        path[k] = (1 - share) * between[k / SLICES * 2] + share * between[k / SLICES * 2 + 1];
    }
    phys_rule_interpolate(settings.rule, system->dof, SLICES, path);
    phys_path_all(system, &settings, path, 40, 1, all, &error);
    assert_no_error(&error);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Pairs of motions close to each other among them, and close to the one that ends on top. */
static void every_motion_to_a_free_end(void **state)
{
    const struct phys_ends end = {.size = sizeof end, .free = {NULL, free_one}};
    struct phys_system system = opened(pendulums, 1);
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        const double a = 1 - 0.6 * (double)k, time = 10 - 2.3 * (double)k;
        double energy[MOST];
        struct phys_solutions all;
        const size_t known = count_motions(a, (double)NAN, time, 3, energy);
        qsort(energy, known, sizeof *energy, ascending);
        search(&system, &end, (double[]){a, a}, time, &all);
        print_message("from %g in %g: %zu of %zu\n", a, time, all.n, known);
        assert_true(known > 2 && !all.exhaustive);
        assert_int_equal(all.n, known);
        for (size_t i = 0; i < known; i++)
            assert_close(all.solution[i].energy, energy[i], 0, 1e-5);
        phys_solutions_free(&all);
    }
    phys_system_close(&system);
}

/* Of two pendulums one has a free end, or start, which is the same backwards, or either has one of
   both: every pair of motions, once. */
static void every_pair_with_a_free_end(void **state)
{
    static const bool second[] = {false, true};
    static const struct phys_ends ends[] = {
        {.size = sizeof *ends, .free = {NULL, free_first}},
        {.size = sizeof *ends, .free = {free_first, NULL}},
        {.size = sizeof *ends, .free = {free_first, second}},
    };
    struct phys_system system = opened(pendulums, 2);
    const double time = 4;
    (void)state;
    for (size_t c = 0; c < LENGTH(ends); c++) {
        const bool both = c == 2;
        double energy[2][MOST];
        struct phys_solutions all;
        const size_t n = count_motions(0.5, (double)NAN, time, 3, energy[0]);
        const size_t m = count_motions(-0.3, both ? (double)NAN : 0.8, time, 12, energy[1]);
        search(&system, &ends[c], (double[]){0.5, 0.5, -0.3, both ? -0.3 : 0.8}, time, &all);
        print_message("%zu of %zu\n", all.n, n * m);
        assert_int_equal(all.n + all.unresolved, n * m);
        assert_true(all.saturated && all.starts == 0 && all.unresolved <= 1);
        assert_true((all.farthest > 0) == (c > 0));
        for (size_t k = 0; k < all.n; k++) {
            size_t same = 0;
            for (size_t i = 0; i < n * m; i++)
                same += fabs(energy[0][i / m] + energy[1][i % m] - all.solution[k].energy) < 1e-5;
            assert_int_equal(same, all.solution[k].copies);
        }
        phys_solutions_free(&all);
    }
    phys_system_close(&system);
}

/* x(T) = 1 - x(0) and momenta that are opposite leave one path, A cos(t - T/2), which is half of 1
   at both ends. */
static void a_linear_relation_leaves_one_path(void **state)
{
    static const double relation[] = {1, 1, 1};
    const struct phys_ends related = {.size = sizeof related,
                                      .free = {free_one, free_one},
                                      .n_relations = 1,
                                      .relation = relation};
    struct phys_system system = opened(oscillator, 1);
    struct phys_solutions all;
    const double time = 2;
    (void)state;
    search(&system, &related, (double[]){0.9, 0.1}, time, &all);
    assert_int_equal(all.n, 1);
    assert_true(all.starts >= 30 && all.led >= 30 && all.unseen == 0);
    for (size_t i = 0; i < SLICES; i++)
        assert_close(all.solution[0].path[i],
                     0.5 * cos(time * ((double)i / (SLICES - 1) - 0.5)) / cos(time / 2), 0, 1e-11);
    phys_solutions_free(&all);
    phys_system_close(&system);
}

/* Newton's method leaves it coordinates of 1e-168, which are nothing but rounding. */
static void rest_at_zero_between_free_ends(void **state)
{
    const struct phys_ends free_ends = {.size = sizeof free_ends, .free = {free_one, free_one}};
    struct phys_system system = opened(oscillator, 1);
    struct phys_solutions all;
    (void)state;
    search(&system, &free_ends, (double[]){1, 1}, 2, &all);
    assert_int_equal(all.n, 1);
    assert_int_equal(all.unresolved, 0);
    assert_true(all.solution[0].largest == 0);
    assert_int_equal(all.solution[0].spectrum.index, 1);
    phys_solutions_free(&all);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_motion_to_a_free_end),
        cmocka_unit_test(every_pair_with_a_free_end),
        cmocka_unit_test(a_linear_relation_leaves_one_path),
        cmocka_unit_test(rest_at_zero_between_free_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
