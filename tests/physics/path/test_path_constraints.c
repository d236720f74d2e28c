/* Paths with constraints: against the same motion in other coordinates, geodesics, closed forms;
   order, Morse index on the tangent spaces, forces. */
#include "constrained_path.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>

static const char *const one[] = {"surface"}, *const three[] = {"crank", "coupler", "rocker"};

static ad_var ellipsoid(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var x = ad_row(q, 0), y = ad_div(ad_row(q, 1), 0.8), z = ad_div(ad_row(q, 2), 0.6);
    return ad_sub(ad_add(ad_square(x), ad_add(ad_square(y), ad_square(z))), 1.0);
}

/* ---- the pendulum ---- */

/* The same path, index, conjugate point and tension in x, y and in the angle. */
static void a_rod_is_an_angle(void **state)
{
    (void)state;
    enum { SLICES = 81 };
    const double T = 2, ends[] = {2, 1};
    const struct phys_scene scene = constrained_scene(
        "rod", 2, constrained_falls, constrained_tilted, constrained_sphere, 1, one);
    struct phys_system opened = system_opened("pendulum");
    const struct phys_scene pendulum = *opened.scene;
    struct constrained_path a = constrained_path(&scene, "gauss6", SLICES, T, ends, ends),
                            b = constrained_path(&pendulum, "gauss6", SLICES, T, ends, ends);
    struct ad_error error = {0};
    system_set(&b.system, "l", 1);
    system_set(&b.system, "g", constrained_g);
    system_set(&b.system, "theta0", 2);
    system_set(&b.system, "rate0", 0.7);
    phys_scene_path(&b.system, 1, NULL, SLICES, b.settings.dt, b.path, &error);
    for (size_t i = 0; i < SLICES; i++) {
        b.path[i] += 0.1 * sin(M_PI * (double)i / (SLICES - 1)) * (i + 1 < SLICES);
        a.path[i] = sin(b.path[i]);
        a.path[SLICES + i] = -cos(b.path[i]);
    }
    constrained_path_found(&a);
    constrained_path_found(&b);
    const double E = 0.5 * 0.7 * 0.7 - constrained_g * cos(2.0);
    for (size_t i = 0; i < SLICES; i++) {
        const double theta = b.path[i], x = sin(theta), y = -cos(theta);
        const double rate2 = 2 * (E + constrained_g * cos(theta)),
                     pull = -(rate2 + constrained_g * cos(theta));
        assert_close(a.path[i], x, 0, 1e-10);
        assert_close(a.path[SLICES + i], y, 0, 1e-10);
        assert_close(a.found.force[i], pull * x, 0, 1e-7);
        assert_close(a.found.force[SLICES + i], pull * y, 0, 1e-7);
    }
    assert_close(a.found.info.action, b.found.info.action + constrained_g * T, 1e-11,
                 0); /* V(0) = 0 */
    assert_true(a.found.info.grad_norm < 1e-9);
    assert_true(a.found.true_distance < 1e-9 && a.found.discretisation < 1e-10);
    assert_int_equal(b.found.spectrum.index, 1);
    assert_int_equal(a.found.spectrum.index, b.found.spectrum.index);
    assert_int_equal(a.found.spectrum.n_conjugate, 1);
    assert_close(a.found.spectrum.conjugate[0].time, b.found.spectrum.conjugate[0].time, 0,
                 a.found.spectrum.conjugate[0].error);
    /* x^2 of a path beside it is that of its angle */
    assert_close(a.found.spectrum.second_variation, b.found.spectrum.second_variation, 1e-3, 0);
    constrained_path_end(&a);
    constrained_path_end(&b);
    phys_system_close(&opened);
}

/* ---- geodesics ---- */

/* Of a great circle of some length, against cos and sin; conjugate to the start at pi, 2 pi. */
static void great_circles(void **state)
{
    (void)state;
    enum { SLICES = 41 };
    static const struct {
        double length;
        size_t index;
    } cases[] = {{2.5, 0}, {3.1, 0}, {3.2, 1}, {4, 1}, {7, 2}};
    const struct phys_scene scene = constrained_scene(
        "bead", 3, constrained_coasts, constrained_tilted, constrained_sphere, 1, one);
    const double a[] = {0.6, 0, 0.8}, b[] = {0, 1, 0};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        const double T = cases[k].length, q[] = {0.6 * cos(T), sin(T), 0.8 * cos(T)};
        struct constrained_path r = constrained_path(&scene, "gauss8", SLICES, T, a, q);
        for (size_t i = 1; i + 1 < SLICES; i++) /* off the sphere, and off the plane */
            for (size_t d = 0; d < 3; d++) {
                const double t = (double)i * r.settings.dt;
                r.path[d * SLICES + i] =
                    1.3 * (a[d] * cos(t) + b[d] * sin(t)) + (d == 2) * 0.05 * sin(M_PI * t / T);
            }
        constrained_path_found(&r);
        for (size_t i = 0; i < SLICES; i++)
            for (size_t d = 0; d < 3; d++) {
                const double t = (double)i * r.settings.dt;
                const double on = a[d] * cos(t) + b[d] * sin(t);
                assert_close(r.path[d * SLICES + i], on, 0, 1e-12);
                assert_close(r.found.force[d * SLICES + i], -on, 0, 1e-9);
            }
        assert_false(r.found.spectrum.undetermined);
        assert_int_equal(r.found.spectrum.index, cases[k].index);
        assert_int_equal(r.found.spectrum.n_conjugate, cases[k].index);
        for (size_t i = 0; i < cases[k].index; i++)
            assert_close(r.found.spectrum.conjugate[i].time, M_PI * (double)(i + 1), 0,
                         r.found.spectrum.conjugate[i].error);
        constrained_path_end(&r);
    }
}

static void place_on_ellipsoid(double theta, double phi, double *q)
{
    q[0] = cos(theta) * cos(phi);
    q[1] = 0.8 * cos(theta) * sin(phi);
    q[2] = 0.6 * sin(theta);
}

/* Its length and middle by scipy: dop853 at 1e-13 in two angles, the end met by fsolve. Refined
   from a line through the inside. */
static void a_geodesic_of_an_ellipsoid(void **state)
{
    (void)state;
    static const double middle[] = {0.5564478420105563, 0.3473832132346262, 0.4250316996565238},
                        length = 1.1998847111630064;
    const struct phys_scene scene =
        constrained_scene("bead", 3, constrained_coasts, constrained_tilted, ellipsoid, 1, one);
    double q0[3], q1[3];
    struct phys_refined refined;
    struct ad_error error = {0};
    place_on_ellipsoid(0.2, 0.1, q0);
    place_on_ellipsoid(0.9, 1.6, q1);
    struct constrained_path r = constrained_path(&scene, "left", 33, 1, q0, q1);
    phys_path_refine(&r.system, &r.settings, r.path, 0, 1e-10, &refined, &error);
    assert_int_equal(error.status, AD_E_ACCURACY); /* rule left has no such path */
    phys_refined_free(&refined);
    error = (struct ad_error){0};
    r.settings.rule = NULL;
    phys_path_refine(&r.system, &r.settings, r.path, 0, 1e-10, &refined, &error);
    assert_string_equal(error.message, "");
    const size_t n = refined.settings->slices;
    assert_true(n % 2 == 1 && refined.level[refined.n - 1].estimate < 1e-10);
    for (size_t k = 0; k < 3; k++)
        assert_close(refined.path[k * n + n / 2], middle[k], 0, 1e-10);
    struct phys_path_info info = {0};
    struct phys_path_settings settings = *refined.settings;
    phys_path_solve(phys_solver_find("newton", &error), &r.system, &settings, refined.path, &info,
                    &error);
    assert_close(info.action, length * length / 2, 1e-10, 0);
    assert_int_equal(refined.spectrum.index, 0);
    phys_refined_free(&refined);
    constrained_path_end(&r);
}

/* ---- a constraint that moves, and its order ---- */

static double error_on_wire(const char *rule, size_t slices, double *force_error)
{
    const struct phys_scene scene = constrained_scene("wire", 2, constrained_coasts,
                                                      constrained_tilted, constrained_wire, 1, one);
    const double T = 1.2, r1 = cosh(2 * T);
    struct constrained_path r = constrained_path(&scene, rule, slices, T, (double[]){1, 0},
                                                 (double[]){r1 * cos(2 * T), r1 * sin(2 * T)});
    double most = 0;
    constrained_path_found(&r);
    *force_error = 0;
    for (size_t i = 0; i < slices; i++) {
        const double at = 2 * (double)i * r.settings.dt, push = 8 * sinh(at);
        const double x[] = {cosh(at) * cos(at), cosh(at) * sin(at)};
        const double f[] = {-push * sin(at), push * cos(at)};
        for (size_t d = 0; d < 2; d++) {
            most = fmax(most, fabs(r.path[d * slices + i] - x[d]));
            *force_error = fmax(*force_error, fabs(r.found.force[d * slices + i] - f[d]));
        }
    }
    constrained_path_end(&r);
    return most;
}

static void rules_keep_their_orders(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        double order;
    } rules[] = {{"midpoint", 2}, {"gauss2", 4}, {"gauss3", 6}};
    for (size_t k = 0; k < LENGTH(rules); k++) {
        double force[2], coarse = error_on_wire(rules[k].rule, 11, force),
                         fine = error_on_wire(rules[k].rule, 21, force + 1);
        print_message("%s: path %.2e, %.2e, force %.2e, %.2e\n", rules[k].rule, coarse, fine,
                      force[0], force[1]);
        assert_true(log2(coarse / fine) > rules[k].order - 0.35);
        assert_close(log2(force[0] / force[1]), rules[k].order, 0, 0.35);
    }
    double force;
    assert_true(error_on_wire("gauss8", 13, &force) < 1e-11);
    assert_true(force < 1e-9);
}

/* ---- a closed linkage ---- */

/* Of one freedom: between two states of a motion the path is that motion, with its forces. */
static void a_closed_linkage(void **state)
{
    (void)state;
    const struct phys_scene scene = constrained_scene(
        "linkage", 4, constrained_coasts, constrained_cranked, constrained_bars, 3, three);
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_solution m = constrained_motion(&system, NULL, 0, 1e-11, 0.6);
    const size_t n = m.n;
    struct constrained_path r = constrained_path(&scene, "gauss4", n, 0.6, m.x, m.x + 8 * (n - 1));
    double *force = malloc(4 * n * sizeof *force), off[2];
    struct ad_error error = {0};
    constrained_path_found(&r);
    assert_int_equal(phys_motion_reactions(&m, force, off, &error), AD_OK);
    for (size_t i = 0; i < n; i++)
        for (size_t d = 0; d < 4; d++) {
            assert_close(r.path[d * n + i], m.x[8 * i + d], 0, 1e-10);
            assert_close(r.found.force[d * n + i], force[4 * i + d], 0, 1e-6);
        }
    assert_int_equal(r.found.spectrum.index, 0);
    free(force);
    constrained_path_end(&r);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* ---- element matrices in another order than the coordinates ---- */

enum { LINKS = 6 };
static const uint32_t *along; /* the coordinates along the chain */

static ad_var chained(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var apart =
        ad_sub(ad_gather_rows(q, LINKS - 1, along + 1), ad_gather_rows(q, LINKS - 1, along));
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), ad_sum_rows(ad_cosh(ad_mul(2.0, apart))));
}

static ad_var centred(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_sum_rows(q), ad_mul(0.1, ad_sum_rows(ad_mul(q, ad_mul(q, q)))));
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < LINKS; k++)
        q[k] = v[k] = 0;
    return AD_OK;
}

/* A chain whose coordinates are numbered in turn, and as they come. */
static void numbers_of_coordinates_do_not_matter(void **state)
{
    (void)state;
    static const uint32_t orders[2][LINKS] = {{0, 1, 2, 3, 4, 5}, {0, 3, 1, 4, 2, 5}};
    const struct phys_scene chain =
        constrained_scene("chain", LINKS, chained, at_rest, centred, 1, one);
    enum { SLICES = 15 };
    struct constrained_path r[2];
    for (size_t k = 0; k < 2; k++) {
        double ends[2][LINKS] = {{0}};
        along = orders[k];
        for (size_t i = 0; i < LINKS; i++)
            ends[1][along[i]] = i < 3 ? 0.1 * (double)(i + 1) : -0.1 * (double)(LINKS - i);
        r[k] = constrained_path(&chain, "gauss3", SLICES, 1.3, ends[0], ends[1]);
        constrained_path_found(&r[k]);
    }
    assert_true(r[0].found.spectrum.index > 0);
    assert_int_equal(r[0].found.spectrum.index, r[1].found.spectrum.index);
    assert_in_range(r[1].found.info.steps, 1, r[0].found.info.steps + 1);
    for (size_t i = 0; i < LINKS; i++)
        for (size_t s = 0; s < SLICES; s++)
            assert_close(r[0].path[i * SLICES + s], r[1].path[orders[1][i] * SLICES + s], 0, 1e-10);
    constrained_path_end(&r[0]);
    constrained_path_end(&r[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rod_is_an_angle),
        cmocka_unit_test(great_circles),
        cmocka_unit_test(a_geodesic_of_an_ellipsoid),
        cmocka_unit_test(rules_keep_their_orders),
        cmocka_unit_test(a_closed_linkage),
        cmocka_unit_test(numbers_of_coordinates_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
