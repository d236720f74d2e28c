/* Constraints g(q, t) = 0 against closed forms and other coordinates; multipliers as forces; the
   order and the energy of RATTLE. */
#include "constrained.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>

static const char *const one[] = {"rod"}, *const four_bars[] = {"crank", "coupler", "rocker"};

/* ---- a pendulum in x and y ---- */

static struct phys_scene rod_scene(void)
{
    return constrained_scene("rod", 2, constrained_falls, constrained_tilted, constrained_sphere, 1,
                             one);
}

static void a_rod_swings_as_an_angle(void **state)
{
    (void)state;
    const struct phys_scene scene = rod_scene();
    struct phys_system rod = constrained_system(&scene), angle = system_opened("pendulum");
    system_set(&angle, "l", 1);
    system_set(&angle, "g", constrained_g);
    system_set(&angle, "theta0", 2);
    system_set(&angle, "rate0", 0.7);
    struct phys_motion_solution a = constrained_motion(&rod, NULL, 0, 2e-11, 5),
                                b = constrained_motion(&angle, NULL, 0, 2e-11, 5);
    double force[2 * (CONSTRAINED_SAMPLES + 1)], off[2];
    struct ad_error error = {0};
    assert_true(a.keeps_energy);
    assert_true(a.error < 2e-11 && a.info.energy_drift < 1e-11);
    assert_int_equal(phys_motion_reactions(&a, force, off, &error), AD_OK);
    assert_true(off[0] < 1e-10 && off[1] < 1e-9);
    for (size_t i = 0; i < a.n; i++) {
        const double *x = a.x + 4 * i, theta = b.x[2 * i], rate = b.x[2 * i + 1];
        const double pull =
            -(rate * rate + constrained_g * cos(theta)); /* along r, with its sign */
        assert_close(x[0], sin(theta), 0, 1e-10);
        assert_close(x[1], -cos(theta), 0, 1e-10);
        assert_close(x[2], rate * cos(theta), 0, 1e-9);
        assert_close(force[2 * i], pull * sin(theta), 0, 1e-8);
        assert_close(force[2 * i + 1], -pull * cos(theta), 0, 1e-8);
    }
    phys_motion_solution_free(&a);
    phys_motion_solution_free(&b);
    phys_system_close(&rod);
    phys_system_close(&angle);
}

/* The same in polar coordinates, whose masses vary: r = 1 is the constraint. */
static ad_var polar(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var r = ad_row(q, 0), turn = ad_mul(r, ad_row(v, 1));
    (void)t, (void)params;
    ad_var T = ad_mul(0.5, ad_add(ad_square(ad_row(v, 0)), ad_square(turn)));
    return ad_add(T, ad_mul(constrained_g, ad_mul(r, ad_cos(ad_row(q, 1)))));
}

static ad_var unit_length(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_row(q, 0), 1.0);
}

static enum ad_status polar_start(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    q[1] = 2;
    v[0] = 0;
    v[1] = 0.7;
    return AD_OK;
}

static void masses_may_vary(void **state)
{
    (void)state;
    const struct phys_scene scene = constrained_scene("polar", 2, polar, polar_start, unit_length,
                                                      1, one),
                            plane = rod_scene();
    struct phys_system system = constrained_system(&scene), rod = constrained_system(&plane);
    struct phys_motion_solution a = constrained_motion(&system, NULL, 0, 2e-11, 3),
                                b = constrained_motion(&rod, NULL, 0, 2e-11, 3);
    double force[2 * (CONSTRAINED_SAMPLES + 1)], off[2];
    struct ad_error error = {0};
    phys_motion_reactions(&a, force, off, &error);
    for (size_t i = 0; i < a.n; i++) {
        assert_close(sin(a.x[4 * i + 1]), b.x[4 * i], 0, 1e-10);
        assert_close(force[2 * i], -(pow(a.x[4 * i + 3], 2) + constrained_g * cos(a.x[4 * i + 1])),
                     0, 1e-9);
        assert_close(force[2 * i + 1], 0, 0, 1e-12);
    }
    phys_motion_solution_free(&a);
    phys_motion_solution_free(&b);
    phys_system_close(&system);
    phys_system_close(&rod);
    assert_int_equal(constrained_refused(&scene, "rattle", &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "rattle polar dop853");
}

/* ---- a bead on a sphere ---- */

/* A conical pendulum turns at the rate sqrt(g/h), h below the centre. */
static enum ad_status conical(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.6;
    q[2] = -0.8;
    q[1] = v[0] = v[2] = 0;
    v[1] = 0.6 * sqrt(constrained_g / 0.8);
    return AD_OK;
}

static enum ad_status thrown(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    conical(params, seed, q, v, error);
    v[1] = 1.3;
    return AD_OK;
}

static void a_bead_on_a_sphere(void **state)
{
    (void)state;
    static const char *const sphere[] = {"sphere"};
    struct phys_scene scene =
        constrained_scene("cone", 3, constrained_falls, conical, constrained_sphere, 1, sphere);
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_solution m = constrained_motion(&system, NULL, 0, 2e-11, 4);
    const double w = sqrt(constrained_g / 0.8);
    for (size_t i = 0; i < m.n; i++) {
        assert_close(m.x[6 * i], 0.6 * cos(w * m.t[i]), 0, 1e-10);
        assert_close(m.x[6 * i + 1], 0.6 * sin(w * m.t[i]), 0, 1e-10);
        assert_close(m.x[6 * i + 2], -0.8, 0, 1e-10);
    }
    phys_motion_solution_free(&m);
    phys_system_close(&system);

    scene.start = thrown; /* the height is between the roots of a cubic; L_z is kept */
    system = constrained_system(&scene);
    m = constrained_motion(&system, NULL, 0, 2e-11, 10);
    const double L = 0.6 * 1.3, E = 0.5 * 1.3 * 1.3 - 0.8 * constrained_g;
    double least = 0;
    for (size_t i = 0; i < m.n; i++) {
        const double *x = m.x + 6 * i, z = x[2];
        assert_close(x[0] * x[4] - x[1] * x[3], L, 1e-10, 0);
        assert_close(x[5] * x[5], 2 * (E - constrained_g * z) * (1 - z * z) - L * L, 0, 1e-9);
        least = fmin(least, z);
    }
    assert_true(least < -0.85);
    assert_false(m.conserved.momentum);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* L alone would keep momenta that the sphere changes; the angular momentum is kept. */
static void what_constraints_change_is_not_called_conserved(void **state)
{
    (void)state;
    struct phys_scene scene =
        constrained_scene("free", 3, constrained_coasts, thrown, constrained_sphere, 1, one);
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_solution m = constrained_motion(&system, NULL, 0, 1e-10, 4);
    bool cyclic[3];
    double value[3], change[3];
    struct ad_error error = {0};
    assert_true(m.conserved.bodies && m.conserved.angular && !m.conserved.momentum);
    assert_true(m.conserved.angular_change < 1e-9 && m.conserved.momentum_change > 1);
    phys_cyclic(&system, m.n, m.x, m.t, cyclic, value, change, &error);
    assert_false(cyclic[0] || cyclic[1] || cyclic[2]);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* ---- constraints that move ---- */

static enum ad_status on_the_wire(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    q[1] = v[0] = 0;
    v[1] = 2;
    return AD_OK;
}

/* A wrong bias fails here, before motions look for accuracy that they cannot have. */
static void accelerations_are_the_closed_form(void **state)
{
    (void)state;
    const struct phys_scene scene =
        constrained_scene("wire", 2, constrained_coasts, on_the_wire, constrained_wire, 1,
                          (const char *const[]){"wire"});
    struct phys_system system = constrained_system(&scene);
    struct ad_error error = {0};
    phys_motion *motion;
    const double t = 0.3, r = cosh(2 * t), rate = 2 * sinh(2 * t), c = cos(2 * t), s = sin(2 * t),
                 q[] = {r * c, r * s}, v[] = {rate * c - 2 * r * s, rate * s + 2 * r * c};
    double a[2];
    assert_int_equal(phys_motion_new(&system, &motion, &error), AD_OK);
    assert_int_equal(phys_motion_acceleration(motion, q, v, t, a, &error), AD_OK);
    assert_close(a[0], -4 * rate * s, 0, 1e-13);
    assert_close(a[1], 4 * rate * c, 0, 1e-13);
    phys_motion_free(motion);
    phys_system_close(&system);
}

static void a_wire_that_turns(void **state)
{
    (void)state;
    static const char *const methods[] = {NULL, "rattle"};
    const struct phys_scene scene =
        constrained_scene("wire", 2, constrained_coasts, on_the_wire, constrained_wire, 1,
                          (const char *const[]){"wire"});
    struct phys_system system = constrained_system(&scene);
    for (size_t k = 0; k < LENGTH(methods); k++) {
        struct phys_motion_solution m = constrained_motion(
            &system, methods[k], methods[k] ? 1e-3 : 0, methods[k] ? 0 : 1e-10, 1);
        double force[2 * (CONSTRAINED_SAMPLES + 1)], off[2], allowed = methods[k] ? 1e-5 : 1e-9;
        struct ad_error error = {0};
        assert_false(m.keeps_energy);
        assert_int_equal(phys_motion_reactions(&m, force, off, &error), AD_OK);
        assert_true(off[0] < allowed && off[1] < allowed);
        for (size_t i = 0; i < m.n; i++) {
            const double at = 2 * m.t[i], push = 8 * sinh(at); /* 2 w r', to the side */
            assert_close(m.x[4 * i], cosh(at) * cos(at), 0, allowed);
            assert_close(m.x[4 * i + 1], cosh(at) * sin(at), 0, allowed);
            assert_close(force[2 * i], -push * sin(at), 0, 10 * allowed);
            assert_close(force[2 * i + 1], push * cos(at), 0, 10 * allowed);
        }
        phys_motion_solution_free(&m);
    }
    phys_system_close(&system);
}

/* ---- a closed linkage ---- */

/* Of one freedom, the angle: its rate is that of the energy, its change the integral of the rate.
 */
static void a_closed_linkage(void **state)
{
    (void)state;
    const struct phys_scene scene = constrained_scene(
        "linkage", 4, constrained_coasts, constrained_cranked, constrained_bars, 3, four_bars);
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_solution m = constrained_motion(&system, NULL, 0, 1e-10, 3);
    double B[2], slope[2], turned = 0, last = 1, sum = 0, before = 0;
    constrained_joint(1, B, slope);
    const double E = 9 * (1 + slope[0] * slope[0] + slope[1] * slope[1]);
    assert_true(m.error < 1e-10);
    for (size_t i = 0; i < m.n; i++) {
        const double *x = m.x + 8 * i, angle = atan2(x[1], x[0]);
        constrained_joint(angle, B, slope);
        const double weight = 1 + slope[0] * slope[0] + slope[1] * slope[1],
                     rate = sqrt(E / weight);
        assert_close(x[2], B[0], 0, 1e-9);
        assert_close(x[3], B[1], 0, 1e-9);
        assert_close(x[0] * x[5] - x[1] * x[4], rate, 0, 1e-8);
        turned += i ? remainder(angle - last, 2 * acos(-1.0)) : 0;
        sum += i ? (m.t[i] - m.t[i - 1]) * (rate + before) / 2 : 0;
        last = angle;
        before = rate;
    }
    assert_true(turned > 6.5); /* all around */
    assert_close(sum, turned, 1e-3, 0);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* Steps whose errors the energy shows leave the constraint by rounding alone: what goes on is
   projected, and the errors are of the order of the method. */
static void every_step_is_on_the_constraints(void **state)
{
    (void)state;
    const struct phys_scene scene = rod_scene();
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_settings how = {.size = sizeof how, .time = 20, .dt = 0.04, .every = 1};
    struct phys_motion_solution m;
    struct ad_error error = {0};
    how.integrator = phys_integrator_find("rk4", &error);
    assert_int_equal(phys_motion_solve(&system, &how, &m, &error), AD_OK);
    assert_true(m.info.energy_drift > 1e-5 && m.error > 1e-4);
    for (size_t i = 0; i < m.n; i++) {
        const double *x = m.x + 4 * i;
        assert_close(hypot(x[0], x[1]), 1, 1e-15, 1e-15);
        assert_close(x[0] * x[2] + x[1] * x[3], 0, 0, 1e-14);
    }
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* ---- RATTLE ---- */

static void rattle_is_of_order_2_and_bounds_the_energy(void **state)
{
    (void)state;
    const struct phys_scene scene = rod_scene();
    struct phys_system system = constrained_system(&scene);
    double errors[2], change[2] = {0};
    for (int k = 0; k < 2; k++) {
        struct phys_motion_solution m = constrained_motion(&system, "rattle", 4e-3 / (1 + k), 0, 4);
        errors[k] = m.error_end;
        phys_motion_solution_free(&m);
    }
    assert_close(log2(errors[0] / errors[1]), 2, 0, 0.02);
    struct phys_motion_settings how = {
        .size = sizeof how, .time = 2000, .dt = 0.04, .every = 1, .no_reference = true};
    struct phys_motion_solution m;
    struct ad_error error = {0};
    how.integrator = phys_integrator_find("rattle", &error);
    assert_int_equal(phys_motion_solve(&system, &how, &m, &error), AD_OK);
    for (size_t i = 0; i < m.n; i++) {
        const double *x = m.x + 4 * i;
        double *most = &change[2 * i >= m.n];
        *most = fmax(*most, fabs(m.energy[i] - m.energy[0]));
        assert_close(hypot(x[0], x[1]), 1, 1e-13, 0);
        assert_close(x[0] * x[2] + x[1] * x[3], 0, 0, 1e-12);
    }
    assert_true(change[0] > 1e-3); /* there is something to bound */
    assert_close(change[1], change[0], 0.02, 0);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest first[] = {cmocka_unit_test(accelerations_are_the_closed_form)},
                            tests[] = {
                                cmocka_unit_test(a_rod_swings_as_an_angle),
                                cmocka_unit_test(masses_may_vary),
                                cmocka_unit_test(a_bead_on_a_sphere),
                                cmocka_unit_test(what_constraints_change_is_not_called_conserved),
                                cmocka_unit_test(a_wire_that_turns),
                                cmocka_unit_test(a_closed_linkage),
                                cmocka_unit_test(every_step_is_on_the_constraints),
                                cmocka_unit_test(rattle_is_of_order_2_and_bounds_the_energy),
                            };
    const int failed = cmocka_run_group_tests(first, NULL, NULL);
    return failed ? failed : cmocka_run_group_tests(tests, NULL, NULL);
}
