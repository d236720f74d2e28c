/* Motion from L: accelerations against formulas by hand, the published paths, known orbits. */
#include "published.h"
#include "physics/physics.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

static void motion_of(const struct phys_system *system, phys_motion **motion)
{
    struct ad_error error = {0};
    phys_motion_new(system, motion, &error);
    assert_no_error(&error);
}

enum { STATES = 3, MOST_DOF = 64 };

/* Of several states at once, as one program, into column after column of a; there velocities depend
   on q, as recorded. */
static void accelerations(const struct phys_system *system, size_t states, const double *q,
                          const double *v, double t, double *a)
{
    const size_t n = system->dof;
    double all[3][MOST_DOF * STATES];
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, n, states, "q"), w = ad_input(tape, n, states, "v less q");
    ad_var at = ad_input(tape, 1, states, "t");
    ad_var y = phys_record_accelerations(system, x, ad_add(w, x), at);
    ad_program *p;
    assert_in_range(n, 1, MOST_DOF);
    for (size_t i = 0; i < n * states; i++) {
        all[0][i] = q[i % states * n + i / states];
        all[1][i] = v[i % states * n + i / states] - all[0][i];
    }
    for (size_t k = 0; k < states; k++)
        all[2][k] = t;
    if (ad_compile(tape, 1, &y, &p) != AD_OK)
        fail_msg("%s", ad_tape_error(tape)->message);
    ad_set(p, x, all[0]);
    ad_set(p, w, all[1]);
    ad_set(p, at, all[2]);
    ad_run(p);
    ad_get(p, y, all[0]);
    for (size_t i = 0; i < n * states; i++)
        a[i % states * n + i / states] = all[0][i];
    ad_program_free(p);
    ad_tape_free(tape);
}

static void acceleration(const struct phys_system *system, const double *q, const double *v,
                         double t, double *a)
{
    const size_t n = system->dof, states = n > 32 ? 1 : STATES;
    double all_q[MOST_DOF * STATES], all_v[MOST_DOF * STATES], same[MOST_DOF * STATES];
    phys_motion *motion;
    struct ad_error error = {0};
    motion_of(system, &motion);
    for (size_t i = 0; i < n * states; i++) { /* the last state is the one asked for */
        const double near = 1 - 0.01 * (double)(states - 1 - i / n);
        all_q[i] = q[i % n] * near;
        all_v[i] = v[i % n] * near;
    }
    accelerations(system, states, all_q, all_v, t, same);
    for (size_t k = 0; k < states; k++) {
        double largest = 0;
        phys_motion_acceleration(motion, all_q + k * n, all_v + k * n, t, a, &error);
        assert_no_error(&error);
        for (size_t i = 0; i < n; i++)
            largest = fmax(largest, fabs(a[i]));
        for (size_t i = 0; i < n; i++)
            assert_close(same[k * n + i], a[i], 0, 1e-12 * largest);
    }
    phys_motion_free(motion);
}

/* A system of a Lagrangian in this file; `scene` must outlive it. */
static struct phys_system made_of(struct phys_scene *scene, phys_lagrangian *L, size_t dof)
{
    *scene = (struct phys_scene){.version = PHYS_SCENE_VERSION,
                                 .size = sizeof *scene,
                                 .name = "test",
                                 .dof = dof,
                                 .dims = 1,
                                 .lagrangian = L};
    return (struct phys_system){.scene = scene, .dof = dof, .bodies = dof, .dims = 1};
}

/* ---- accelerations ---- */

static void double_pendulum_accelerates_as_in_the_books(void **state)
{
    (void)state;
    struct phys_system system = published_system("dblpend");
    uint64_t seed = 7;
    for (int k = 0; k < 20; k++) {
        double x[4], a[2];
        for (size_t i = 0; i < 4; i++, seed = seed * 6364136223846793005 + 1442695040888963407)
            x[i] = 6 * ((double)(seed >> 11) * 0x1p-53 - 0.5);
        acceleration(&system, x, x + 2, 0, a);
        /* m = l = g = 1: (2, c; c, 1) a = (-w2^2 s - 2 sin a, w1^2 s - sin b), c + i s = e^i(a - b)
         */
        double c = cos(x[0] - x[1]), s = sin(x[0] - x[1]);
        double r0 = -x[3] * x[3] * s - 2 * sin(x[0]), r1 = x[2] * x[2] * s - sin(x[1]);
        double det = 2 - c * c;
        assert_close(a[0], (r0 - c * r1) / det, 1e-12, 1e-13);
        assert_close(a[1], (2 * r1 - c * r0) / det, 1e-12, 1e-13);
    }
    phys_system_close(&system);
}

/* Damped oscillator (Caldirola, Kanai): L = e^(0.3 t) (v^2 - 4 q^2)/2, a = -0.3 v - 4 q. */
static ad_var damped(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var spring = ad_sub(ad_square(v), ad_mul(4.0, ad_square(q)));
    return ad_mul(ad_mul(0.5, ad_exp(ad_mul(0.3, t))), spring);
}

static void time_in_the_lagrangian_counts(void **state)
{
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made_of(&scene, damped, 1);
    const double q = 0.7, v = -1.3;
    double a;
    acceleration(&system, &q, &v, 2.5, &a);
    assert_close(a, -0.3 * v - 4 * q, 1e-14, 0);
}

/* A charge in the field B(x) = 1 + x, A = (0, x + x^2/2): L = v^2/2 + A v, a = B (vy, -vx). */
static ad_var charged(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var x = ad_row(q, 0), A = ad_add(x, ad_mul(0.5, ad_square(x)));
    return ad_add(ad_mul(0.5, ad_sum_rows(ad_square(v))), ad_mul(A, ad_row(v, 1)));
}

/* F1: M a has L_vq v taken off, which is (0, A' v1) here, not L_qv v = (A' v2, 0). */
static void velocity_dependent_forces_count(void **state)
{
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made_of(&scene, charged, 2);
    const double q[] = {0.6, -2}, v[] = {0.9, 0.4};
    double a[2];
    acceleration(&system, q, v, 0, a);
    assert_close(a[0], 1.6 * v[1], 1e-14, 0);
    assert_close(a[1], -1.6 * v[0], 1e-14, 0);
}

/* Relativistic mass: L = -sqrt(1 - v^2) - q^2/2, M = gamma^3 (for one dimension). */
static ad_var relativistic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_neg(ad_add(ad_sqrt(ad_sub(1.0, ad_square(v))), ad_mul(0.5, ad_square(q))));
}

static void the_mass_may_depend_on_the_velocity(void **state)
{
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made_of(&scene, relativistic, 1);
    const double q = 0.4, v = 0.8;
    double a;
    acceleration(&system, &q, &v, 0, &a);
    assert_close(a, -q * pow(1 - v * v, 1.5), 1e-13, 0);
}

static ad_var massive(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(q, ad_mul(0.5, ad_square(v)));
}

/* A mass that is the coordinate itself takes no operation, and varies: q a = -v^2 / 2. */
static void the_mass_may_be_the_coordinate(void **state)
{
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made_of(&scene, massive, 1);
    double a;
    acceleration(&system, (double[]){1.7}, (double[]){0.6}, 0, &a);
    assert_close(a, -0.5 * 0.36 / 1.7, 1e-15, 0);
}

static void bodies_attract_as_newton_says(void **state)
{
    (void)state;
    struct phys_system system = published_system("ephemeris");
    const double m[] = {1.99e30, 3.3e23, 4.87e24, 5.97e24, 6.42e23};
    double q[10], v[10], a[10];
    struct ad_error error = {0};
    system.scene->start(system.params, 0, q, v, &error);
    acceleration(&system, q, v, 0, a);
    for (size_t i = 0; i < 5; i++) {
        double expected[2] = {0, 0}, size = 0;
        for (size_t j = 0; j < 5; j++) {
            double dx = q[2 * j] - q[2 * i], dy = q[2 * j + 1] - q[2 * i + 1], r = hypot(dx, dy);
            if (j == i)
                continue;
            expected[0] += 6.67e-11 * m[j] * dx / (r * r * r);
            expected[1] += 6.67e-11 * m[j] * dy / (r * r * r);
            size += 6.67e-11 * m[j] / (r * r);
        }
        assert_close(a[2 * i], expected[0], 0, 1e-13 * size);
        assert_close(a[2 * i + 1], expected[1], 0, 1e-13 * size);
    }
    phys_system_close(&system);
}

/* ---- what cannot be solved ---- */

static ad_var massless(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_square(ad_row(v, 0)), ad_sum_rows(ad_square(q)));
}

static ad_var degenerate(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_square(ad_sum_rows(v)), ad_sum_rows(ad_square(q)));
}

static ad_var singular_force(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_sum_rows(ad_square(v)), ad_recip(ad_row(q, 1)));
}

static void unsolvable_motion_names_the_coordinate(void **state)
{
    (void)state;
    const struct {
        phys_lagrangian *L;
        const char *message;
    } bad[] = {
        {massless, "singular x2"}, {degenerate, "singular x2"}, {singular_force, "finite x2"}};
    for (size_t k = 0; k < 3; k++) {
        struct phys_scene scene;
        struct phys_system system = made_of(&scene, bad[k].L, 2);
        struct ad_error error = {0};
        phys_motion *motion;
        const double q[] = {1, 0}, v[] = {0.5, 0.5};
        double a[2];
        motion_of(&system, &motion);
        assert_int_equal(phys_motion_acceleration(motion, q, v, 0, a, &error), AD_E_NONFINITE);
        assert_mentions(error.message, bad[k].message);
        phys_motion_free(motion);
    }
}

/* ---- paths ---- */

static void the_published_ode_paths_come_out(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_PUBLISHED; k++) {
        struct phys_system system = published_system(published[k].scene);
        const struct phys_preset *paper = system.scene->paper;
        size_t n = paper->slices;
        double *expected = published_path(&system, "ode"), size = 0;
        double *path = calloc(system.dof * n, sizeof *path);
        phys_motion *motion;
        struct ad_error error = {0};
        for (size_t i = 0; i < system.dof; i++)
            memcpy(path + i * n, expected + i * n, 2 * sizeof *path);
        motion_of(&system, &motion);
        phys_ode_path(motion, n, paper->dt, paper->damping, path, &error);
        assert_no_error(&error);
        for (size_t i = 0; i < system.dof * n; i++)
            size = fmax(size, fabs(expected[i]));
        for (size_t i = 0; i < system.dof * n;
             i++) /* the gas doubles rounding errors every slice or so */
            assert_close(path[i], expected[i], 0, 1e-9 * size);
        phys_motion_free(motion);
        free(path);
        free(expected);
        phys_system_close(&system);
    }
}

static void the_published_starts_come_out(void **state)
{
    (void)state;
    const char *const scenes[] = {"freebody", "pendulum", "dblpend", "threebody"};
    for (size_t s = 0; s < 4; s++) {
        struct phys_system system = published_system(scenes[s]);
        const struct phys_preset *paper = system.scene->paper;
        double *expected = published_path(&system, "ode"), q[6], v[6], path[12];
        phys_motion *motion;
        struct ad_error error = {0};
        motion_of(&system, &motion);
        system.scene->start(system.params, 0, q, v, &error);
        phys_first_slices(motion, q, v, 2, paper->dt, paper->euler_start, path, &error);
        assert_no_error(&error);
        for (size_t k = 0; k < system.dof; k++)
            for (size_t i = 0; i < 2; i++)
                assert_close(path[2 * k + i], expected[k * paper->slices + i], 1e-15, 0);
        phys_motion_free(motion);
        free(expected);
        phys_system_close(&system);
    }
}

/* The coordinates of a scene after `time`. */
static void end_of(const struct phys_system *system, double time, double *end)
{
    struct ad_error error = {0};
    double q[8], v[8], path[16];
    system->scene->start(system->params, 0, q, v, &error);
    phys_motion_path(system, NULL, q, v, 2, time, path, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < system->dof; k++)
        end[k] = path[2 * k + 1];
}

static void motions_end_where_elliptic_functions_say(void **state)
{
    (void)state;
    struct phys_system system = published_system("pendulum");
    struct ad_error error = {0};
    phys_system_set(&system, "l", 1, &error);
    double period = 7.41629870921, bottom; /* g = l = 1, amplitude pi/2 */
    /* a quarter of a period after release from pi/2 it passes the bottom at full speed */
    end_of(&system, period / 4, &bottom);
    assert_close(bottom, 0, 0, 1e-10);
    phys_system_close(&system);

    struct phys_system kepler;
    phys_system_open("kepler", &kepler, &error);
    double end[2];
    end_of(&kepler, 1, end); /* mean anomaly 1 */
    assert_close(end[0], -0.628948176826624, 1e-11, 0);
    assert_close(end[1], 0.799664730970039, 1e-11, 0);
    phys_system_close(&kepler);
}

static void the_second_slice_is_euler_or_motion(void **state)
{
    (void)state;
    struct phys_system system = published_system("freebody");
    phys_motion *motion;
    struct ad_error error = {0};
    const double q = 3, v = 2;
    double path[5];
    motion_of(&system, &motion);
    phys_first_slices(motion, &q, &v, 5, 0.5, true, path, &error);
    assert_true(path[0] == 3 && path[1] == 4);
    phys_first_slices(motion, &q, &v, 5, 0.5, false, path, &error);
    assert_no_error(&error);
    assert_close(path[1], 4 - 0.125, 1e-15, 0); /* g = 1 */
    phys_motion_free(motion);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(double_pendulum_accelerates_as_in_the_books),
        cmocka_unit_test(time_in_the_lagrangian_counts),
        cmocka_unit_test(velocity_dependent_forces_count),
        cmocka_unit_test(the_mass_may_depend_on_the_velocity),
        cmocka_unit_test(the_mass_may_be_the_coordinate),
        cmocka_unit_test(bodies_attract_as_newton_says),
        cmocka_unit_test(unsolvable_motion_names_the_coordinate),
        cmocka_unit_test(the_published_ode_paths_come_out),
        cmocka_unit_test(the_published_starts_come_out),
        cmocka_unit_test(motions_end_where_elliptic_functions_say),
        cmocka_unit_test(the_second_slice_is_euler_or_motion),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
