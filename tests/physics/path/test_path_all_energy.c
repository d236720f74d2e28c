/* All paths of one energy, free end time: times and numbers of closed forms. A false list would
   miss one, have one twice, one of another energy, or one of no duration between equal ends. */
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>

enum { SLICES = 41, DEGREE = 4, MOST = 40 };

static const double field = 1.3; /* of the magnetic force */

static ad_var kinetic(ad_var v) { return ad_mul(0.5, ad_sum_rows(ad_square(v))); }

static ad_var projectile(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(kinetic(v), ad_row(q, ad_rows(q) - 1));
}

static ad_var pendulum(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(kinetic(v), ad_cos(q));
}

static ad_var centre(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(kinetic(v), ad_div(1, ad_sqrt(ad_sum_rows(ad_square(q)))));
}

static ad_var magnet(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(kinetic(v), ad_mul(field, ad_mul(ad_row(q, 0), ad_row(v, 1))));
}

/* Rest energy 1: of energy E it moves at sqrt(1 - 1 / E^2). */
static ad_var relativistic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var still = ad_mul(0, ad_sum_rows(q));
    return ad_sub(still, ad_sqrt(ad_sub(1, ad_sum_rows(ad_square(v)))));
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < 3; k++)
        q[k] = 0.4 + 0.1 * (double)k, v[k] = 0;
    return AD_OK;
}

struct question {
    phys_lagrangian *L;
    size_t dof;
    double from[3], to[3], energy, longest;
};

static enum ad_status ask(const struct question *a, struct phys_solutions *all,
                          struct ad_error *error)
{
    const struct phys_scene scene = scene_of("one energy", a->dof, a->L, SLICES, 0.1, at_rest);
    const struct phys_ends ends = {.size = sizeof ends, .free_time = true, .energy = a->energy};
    double path[3 * DEGREE * SLICES];
    struct phys_system system;
    phys_system_make(&scene, &system, error);
    assert_no_error(error);
    struct phys_path_settings settings = phys_path_defaults(&system);
    settings.rule = phys_rule_find("gauss4", error);
    settings.slices = SLICES;
    settings.dt = a->longest / (SLICES - 1);
    settings.ends = &ends;
    for (size_t k = 0; k < a->dof * SLICES; k++) {
        const double share = (double)(k % SLICES) / (SLICES - 1);
        path[k] = (1 - share) * a->from[k / SLICES] + share * a->to[k / SLICES];
    }
    phys_rule_interpolate(settings.rule, a->dof, SLICES, path);
    phys_path_all(&system, &settings, path, 0, 1, all, error);
    phys_system_close(&system);
    return error->status;
}

/* Exactly these times, ascending. */
static void has_times(const struct question *a, size_t n, const double *times)
{
    struct phys_solutions all;
    struct ad_error error = {0};
    ask(a, &all, &error);
    assert_no_error(&error);
    print_message("E %g: %zu of %zu, %zu unresolved\n", a->energy, all.n, n, all.unresolved);
    assert_true(a->dof == 1 ? all.exhaustive : all.saturated || n == 0);
    assert_int_equal(all.unresolved, 0);
    assert_int_equal(all.n, n);
    for (size_t k = 0; k < n; k++) {
        const struct phys_solution *found = &all.solution[k];
        assert_close(found->time, times[k], 1e-9, 0);
        assert_close(found->energy, a->energy, 1e-6, 1e-9);
        assert_int_equal(found->copies, 1);
        for (size_t d = 0; d < a->dof; d++) {
            assert_true(found->path[d * SLICES] == a->from[d]);
            assert_true(found->path[(d + 1) * SLICES - 1] == a->to[d]);
        }
    }
    phys_solutions_free(&all);
}

/* Thrown with v^2 = 2 E over x to a height y: T^4/4 - (v^2 - y) T^2 + x^2 + y^2 = 0 for g = 1; two
   throws, one if the longest time lies between, none out of range; upwards and back from a place to
   itself, one. */
static void throws(void **state)
{
    const double x = 0.7, y = 0.2, E = 1.5, b = 2 * E - y, root = sqrt(b * b - x * x - y * y);
    const double times[] = {sqrt(2 * (b - root)), sqrt(2 * (b + root))}, up[] = {2 * sqrt(2 * E)};
    struct question plane = {projectile, 2, {0, 0}, {x, y}, E, 5};
    struct question space = {projectile, 3, {0, 0, 0}, {0.6 * x, 0.8 * x, y}, E, 5};
    (void)state;
    has_times(&plane, 2, times);
    has_times(&space, 2, times);
    plane.longest = 2;
    has_times(&plane, 1, times);
    has_times(&(struct question){projectile, 2, {0, 0}, {3.1, 0}, E, 5}, 0, NULL);
    has_times(&(struct question){projectile, 2, {0, 0}, {0, 0}, E, 5}, 1, up);
    has_times(&(struct question){projectile, 1, {0}, {0.5}, 1, 9}, 2,
              (double[]){sqrt(2) - 1, sqrt(2) + 1});
    has_times(&(struct question){projectile, 1, {0}, {-2}, 0, 9}, 1, (double[]){2}); /* dropped */
    has_times(&(struct question){projectile, 1, {0}, {1.5}, 1, 9}, 0, NULL);
}

/* Complete or incomplete elliptic integral of the first kind by Simpson's rule. */
static double elliptic(double phi, double k)
{
    enum { N = 2000 };
    double sum = 0;
    for (int i = 0; i <= N; i++) {
        const double s = k * sin(phi * i / N);
        sum += (i == 0 || i == N ? 1 : i % 2 ? 4 : 2) / sqrt(1 - s * s);
    }
    return sum * phi / N / 3;
}

/* From 0 to 1 rad: while it swings (E = 2 k^2 - 1 < 1) after t, P/2 - t and further periods P; from
   its turning point after P/2 and so on, once each; with turns once, for each angle to go. */
static void swings_and_turns(void **state)
{
    const double k = 0.8, K = elliptic(M_PI / 2, k), t = elliptic(asin(sin(0.5) / k), k);
    double times[MOST];
    size_t n = 0;
    (void)state;
    for (double base = 0; base < 20; base += 4 * K)
        for (int way = 0; way < 4; way++) { /* to the right or left, before or after the turn */
            const double at = base + (const double[]){t, 2 * K - t, 2 * K + t, 4 * K - t}[way];
            if (at < 20)
                times[n++] = at;
        }
    has_times(&(struct question){pendulum, 1, {0}, {1}, 2 * k * k - 1, 20}, n, times);
    const double top = 1.2, K0 = elliptic(M_PI / 2, sin(top / 2));
    has_times(&(struct question){pendulum, 1, {top}, {-top}, -cos(top), 9}, 1, (double[]){2 * K0});
    struct phys_solutions all; /* to rest on top it takes for ever */
    struct ad_error error = {0};
    ask(&(struct question){pendulum, 1, {0}, {1}, 1, 60}, &all, &error);
    assert_no_error(&error);
    assert_true(all.n == 1 && all.unresolved == 0 && !all.exhaustive);
    assert_close(all.solution[0].time, log(tan(M_PI / 4 + 0.25)), 1e-9, 0);
    phys_solutions_free(&all);
    for (int turns = 0; turns < 3; turns++) { /* E = 3: k^2 = 1/2 of the inverse modulus */
        const double to = 1 + 2 * M_PI * turns;
        const double time = sqrt(0.5) * elliptic(to / 2, sqrt(0.5));
        has_times(&(struct question){pendulum, 1, {0}, {to}, 3, 9}, 1, &time);
    }
}

/* Lambert's theorem: of two ellipses with a = 1 each way round. */
static void transfers(void **state)
{
    const double c = sqrt(2), s = (2 + c) / 2;
    const double alpha = 2 * asin(sqrt(s / 2)), beta = 2 * asin(sqrt((s - c) / 2));
    const double far = alpha - sin(alpha), near = beta - sin(beta), P = 2 * M_PI;
    (void)state;
    has_times(&(struct question){centre, 2, {1, 0}, {0, 1}, -0.5, 6.2}, 4,
              (double[]){far - near, far + near, P - far - near, P - far + near});
}

/* Two arcs of circles of radius v / field through two points, and of the next turn. */
static void arcs(void **state)
{
    const double E = 0.8, R = sqrt(2 * E) / field, angle = 2 * asin(0.5 / R);
    (void)state;
    has_times(&(struct question){magnet, 2, {0.2, 0.1}, {0.8, 0.9}, E, 6}, 3,
              (double[]){angle / field, (2 * M_PI - angle) / field, (2 * M_PI + angle) / field});
}

static void energies_that_are_no_square(void **state)
{
    const double E = 1.7, time = 1 / sqrt(1 - 1 / (E * E));
    (void)state;
    has_times(&(struct question){relativistic, 2, {0.2, 0.1}, {0.8, 0.9}, E, 3}, 1, &time);
    has_times(&(struct question){relativistic, 1, {0.2}, {1.2}, E, 3}, 1, &time);
}

static void refusals(void **state)
{
    static const struct {
        struct question asked;
        enum ad_status status;
    } cases[] = {{{projectile, 2, {0, 0}, {1, 0}, -0.1, 5}, AD_E_ACCURACY},
                 {{projectile, 2, {0, 0}, {1, 0}, 0, 5}, AD_E_ACCURACY}};
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct phys_solutions all;
        struct ad_error error = {0};
        assert_int_equal(ask(&cases[k].asked, &all, &error), cases[k].status);
        assert_true(all.n == 0 && strstr(error.message, "energy"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(throws),
        cmocka_unit_test(swings_and_turns),
        cmocka_unit_test(transfers),
        cmocka_unit_test(arcs),
        cmocka_unit_test(energies_that_are_no_square),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
