/* Scenes: parameters, starts, the ephemeris's choice of bodies, and every Lagrangian held against
   differences, slice locality and known energies. */
#include "physics/horizons.h"
#include "published.h"
#include "tests/close.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct phys_system opened(const char *name)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open(name, &system, &error);
    assert_no_error(&error);
    return system;
}

static void set(struct phys_system *system, const char *name, double value)
{
    struct ad_error error = {0};
    phys_system_set(system, name, value, &error);
    assert_no_error(&error);
}

static void start(const struct phys_system *system, uint64_t seed, double *q, double *v)
{
    struct ad_error error = {0};
    system->scene->start(system->params, seed, q, v, &error);
    assert_no_error(&error);
}

/* ---- names and parameters ---- */

static void unknown_names_suggest_the_nearest(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open("pendlum", &system, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "did you mean 'pendulum'"));
    phys_system_close(&system);

    error = (struct ad_error){0};
    assert_int_equal(phys_system_open("wave equation", &system, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "freebody, pendulum, dblpend"));
    phys_system_close(&system);

    system = opened("gas");
    error = (struct ad_error){0};
    assert_int_equal(phys_system_set(&system, "sofening", 1, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "parameter of gas"));
    assert_non_null(strstr(error.message, "'softening'"));
    assert_true(isnan(phys_system_get(&system, "sofening")));
    phys_system_close(&system);

    error = (struct ad_error){0};
    assert_null(phys_rule_find("left-repeat", &error));
    assert_non_null(strstr(error.message, "'left+repeat'"));
    error = (struct ad_error){0};
    assert_null(phys_solver_find("adma", &error));
    assert_non_null(strstr(error.message, "'adam'"));
}

static void parameters_are_set_by_name(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system = opened(phys_scenes[s]->name);
        for (size_t k = 0; k < system.scene->n_params; k++) {
            const struct phys_param *p = &system.scene->params[k];
            assert_true(phys_system_get(&system, p->name) == p->value);
            struct ad_error error = {0};
            double other = p->value == 0 ? 0.37 : p->value * 0.75;
            if (phys_system_set(&system, p->name, other, &error) == AD_OK)
                assert_true(phys_system_get(&system, p->name) == other);
            else /* whole numbers: refused whole */
                assert_true(phys_system_get(&system, p->name) == p->value);
            error = (struct ad_error){0};
            assert_int_equal(phys_system_set(&system, p->name, NAN, &error), AD_E_ARGUMENT);
            assert_non_null(strstr(error.message, p->name));
        }
        phys_system_close(&system);
    }
}

static void presets_name_parameters_that_exist(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_PUBLISHED; k++) {
        struct phys_system system = published_system(published[k].scene);
        const struct phys_preset *paper = system.scene->paper;
        for (size_t i = 0; i < paper->n_set; i++)
            assert_true(phys_system_get(&system, paper->set[i].name) == paper->set[i].value);
        phys_system_close(&system);
    }
}

static void sizes_follow_the_parameters(void **state)
{
    (void)state;
    struct phys_system system = opened("gas");
    assert_int_equal(system.dof, 100);
    set(&system, "bodies", 7);
    assert_int_equal(system.dof, 14);
    assert_int_equal(system.bodies, 7);
    const double bad[] = {1, 2.5, -3, 1e9};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error error = {0};
        assert_int_equal(phys_system_set(&system, "bodies", bad[k], &error), AD_E_ARGUMENT);
        assert_int_equal(system.dof, 14);
        assert_true(phys_system_get(&system, "bodies") == 7);
    }
    phys_system_close(&system);
    system = opened("kepler");
    struct ad_error error = {0};
    assert_int_equal(phys_system_set(&system, "e", 1, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

static void coordinates_have_names(void **state)
{
    (void)state;
    const struct {
        const char *scene;
        size_t k;
        const char *name;
    } table[] = {{"freebody", 0, "x"},   {"pendulum", 0, "theta"},      {"dblpend", 1, "b"},
                 {"threebody", 3, "y2"}, {"ephemeris", 5, "z_mercury"}, {"gas", 98, "x50"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct phys_system system = opened(table[i].scene);
        char name[32];
        phys_coordinate_name(&system, table[i].k, name, sizeof name);
        assert_string_equal(name, table[i].name);
        phys_system_close(&system);
    }
}

/* ---- Lagrangians ---- */

/* Irregular states around the start: the same everywhere, of a size that suits the scene. */
static void scatter_states(const struct phys_system *system, size_t n, double *q, double *v,
                           double *t)
{
    size_t dof = system->dof;
    double *q0 = malloc(2 * dof * sizeof *q0), *v0 = q0 + dof, size = 0, speed = 0;
    start(system, 5, q0, v0);
    for (size_t k = 0; k < dof; k++) {
        size = fmax(size, fabs(q0[k]));
        speed = fmax(speed, fabs(v0[k]));
    }
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++) {
            double phase = 1.7 * (double)k + 2.9 * (double)i;
            q[k * n + i] = q0[k] + 0.02 * (size + 0.1) * sin(phase);
            v[k * n + i] = v0[k] + 0.3 * (speed + 0.1) * cos(1.3 * phase);
        }
    for (size_t i = 0; i < n; i++)
        t[i] = 0.3 + 0.7 * (double)i;
    free(q0);
}

static void check_lagrangian(const struct phys_system *system)
{
    enum { N = 5 };
    struct ad_error error = {0};
    double *q = malloc((2 * system->dof + 1) * N * sizeof *q), *v = q + system->dof * N;
    double *t = v + system->dof * N;
    scatter_states(system, N, q, v, t);
    struct phys_points at = {N, q, v, t};
    phys_check_finite(system, &at, &error);
    assert_no_error(&error);
    for (int order = 1; order <= 2; order++) {
        struct ad_check report;
        phys_check_gradient(system, &at, order, 1e-6, 40, &report, &error);
        assert_no_error(&error);
        if (!report.passed)
            fail_msg("%s, order %d: error %g at input %zu (%zu, %zu)", system->scene->name, order,
                     report.worst, report.input, report.row, report.col);
    }
    struct phys_locality locality;
    phys_check_locality(system, &at, &locality, &error);
    assert_no_error(&error);
    assert_true(locality.passed);
    free(q);
}

static void lagrangians_pass_the_checks(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system = opened(phys_scenes[s]->name);
        if (strcmp(system.scene->name, "gas") == 0)
            set(&system, "bodies", 6); /* the same law, sooner checked */
        check_lagrangian(&system);
        phys_system_close(&system);
    }
}

/* T and V of one state. */
static void energies(const struct phys_system *system, const double *q, const double *v, double *T,
                     double *V)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, system->dof, 1, "q"), u = ad_input(tape, system->dof, 1, "v");
    ad_var out[2];
    phys_system_energies(system, x, u, ad_scalar(tape, 0), &out[0], &out[1]);
    ad_program *program;
    assert_int_equal(ad_compile(tape, 2, out, &program), AD_OK);
    ad_set(program, x, q);
    ad_set(program, u, v);
    ad_run(program);
    ad_get(program, out[0], T);
    ad_get(program, out[1], V);
    ad_program_free(program);
    ad_tape_free(tape);
}

static void kepler_has_its_known_energy_and_momentum(void **state)
{
    (void)state;
    struct phys_system system = opened("kepler");
    double q[2], v[2], T, V;
    start(&system, 0, q, v);
    energies(&system, q, v, &T, &V);
    assert_close(T + V, -0.5, 1e-15, 0);
    assert_close(q[0] * v[1] - q[1] * v[0], 0.8, 1e-15, 0);
    phys_system_close(&system);
}

static void double_pendulum_has_the_energy_of_its_bobs(void **state)
{
    (void)state;
    struct phys_system system = opened("dblpend");
    set(&system, "m1", 1.3);
    set(&system, "m2", 0.7);
    set(&system, "l1", 0.9);
    set(&system, "l2", 1.2);
    set(&system, "g", 9.81);
    const double q[] = {0.83, -1.27}, v[] = {1.9, -0.6};
    /* positions and velocities of the bobs in the plane */
    double y1 = -0.9 * cos(q[0]), y2 = y1 - 1.2 * cos(q[1]);
    double vx1 = 0.9 * cos(q[0]) * v[0], vy1 = 0.9 * sin(q[0]) * v[0];
    double vx2 = vx1 + 1.2 * cos(q[1]) * v[1], vy2 = vy1 + 1.2 * sin(q[1]) * v[1];
    double T, V;
    energies(&system, q, v, &T, &V);
    assert_close(T, 0.65 * (vx1 * vx1 + vy1 * vy1) + 0.35 * (vx2 * vx2 + vy2 * vy2), 1e-14, 0);
    assert_close(V, 9.81 * (1.3 * y1 + 0.7 * y2), 1e-14, 0);
    phys_system_close(&system);
}

static void energies_of_an_unsplit_lagrangian_follow_from_legendre(void **state)
{
    (void)state;
    struct phys_system split = opened("dblpend"), whole = split;
    struct phys_scene scene = *split.scene;
    struct phys_system reference = split;
    scene.kinetic =
        NULL; /* of a potential alone, -V is L: E = V, taken apart as (E-V)/2, (E+V)/2 */
    scene.lagrangian = scene.potential;
    scene.potential = NULL;
    whole.scene = &scene;
    const double q[] = {0.4, 1.1}, v[] = {0.3, -0.8};
    double T, V, T0, V0;
    energies(&reference, q, v, &T0, &V0);
    energies(&whole, q, v, &T, &V);
    assert_close(T, 0, 0, 1e-15);
    assert_close(V, -V0, 1e-14, 0);
    scene.lagrangian = split.scene->kinetic; /* of a kinetic energy alone: T whole, V none */
    energies(&whole, q, v, &T, &V);
    assert_close(T, T0, 1e-14, 0);
    assert_close(V, 0, 0, 1e-15);
    phys_system_close(&split);
}

static ad_var two_rows(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)t, (void)params;
    return ad_concat_rows(2, (ad_var[]){q, q});
}

static void a_lagrangian_of_the_wrong_shape_is_refused(void **state)
{
    (void)state;
    struct phys_system system = opened("freebody");
    struct phys_scene scene = *system.scene;
    scene.lagrangian = two_rows;
    system.scene = &scene;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var q = ad_input(tape, 1, 4, "q");
    phys_system_lagrangian(&system, q, q, q);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_SHAPE);
    assert_non_null(strstr(ad_tape_error(tape)->message, "2 x 4, expected 1 x 4"));
    ad_tape_free(tape);
    phys_system_close(&system);
}

static void pairs_are_in_lexicographic_order(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    const double q[] = {1, 10, 2, 40, 5, 90}; /* three bodies in the plane, one slice */
    ad_var x = ad_input(tape, 6, 1, "q"), d[2];
    phys_pair_differences(x, 3, 2, d);
    ad_var out[] = {d[0], d[1], phys_pair_squares(x, 3, 2, 0.5)};
    ad_program *program;
    assert_int_equal(ad_compile(tape, 3, out, &program), AD_OK);
    ad_set(program, x, q);
    ad_run(program);
    const double expected[3][3] = {{-1, -4, -3}, {-30, -80, -50}, {901.5, 6416.5, 2509.5}};
    for (size_t k = 0; k < 3; k++) {
        double y[3];
        ad_get(program, out[k], y);
        for (size_t p = 0; p < 3; p++)
            assert_true(y[p] == expected[k][p]);
    }
    ad_program_free(program);
    phys_pair_differences(x, 1, 2, d);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    ad_tape_free(tape);
}

/* ---- the gas ---- */

static double closest(const struct phys_system *system, const double *q)
{
    double least = INFINITY;
    for (size_t i = 0; i < system->bodies; i++)
        for (size_t j = i + 1; j < system->bodies; j++)
            least = fmin(least, hypot(q[2 * i] - q[2 * j], q[2 * i + 1] - q[2 * j + 1]));
    return least;
}

static void the_gas_starts_without_overlap(void **state)
{
    (void)state;
    struct phys_system system = opened("gas");
    double a[100], b[100], v[100];
    for (uint64_t seed = 0; seed < 20; seed++) {
        start(&system, seed, a, v);
        assert_true(closest(&system, a) > 0.85 * phys_system_get(&system, "spacing"));
    }
    start(&system, 19, b, v);
    assert_memory_equal(a, b, sizeof a);
    start(&system, 20, b, v);
    assert_memory_not_equal(a, b, sizeof a);
    phys_system_close(&system);

    system = published_system("gas"); /* at random in the box, at rest */
    start(&system, 1, a, v);
    for (size_t k = 0; k < 100; k++) {
        assert_true(a[k] >= 0.4 && a[k] < 0.6);
        assert_true(v[k] == 0);
    }
    phys_system_close(&system);
}

/* ---- the ephemeris ---- */

static void bodies_are_chosen_by_name_or_id(void **state)
{
    (void)state;
    struct phys_system system = opened("ephemeris");
    struct ad_error error = {0};
    assert_int_equal(system.dof, 15);
    phys_ephemeris_choose(&system, "Sun,399,venus", 2, &error);
    assert_no_error(&error);
    assert_int_equal(system.dof, 6);
    assert_int_equal(system.dims, 2);
    double q[6], v[6];
    start(&system, 0, q, v);
    assert_true(q[2] == 5.379184128556358E+07 * 1e3); /* Earth's x */
    char name[32];
    phys_coordinate_name(&system, 5, name, sizeof name);
    assert_string_equal(name, "y_venus");
    check_lagrangian(&system);

    const struct {
        const char *bodies;
        size_t dims;
        const char *message;
    } bad[] = {{"sun,erth", 2, "'earth'"},
               {"sun", 2, "1 bodies"},
               {"sun,10", 3, "twice"},
               {"sun,,mars", 3, "expected one of"},
               {"sun,earth", 4, "4 dimensions"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        error = (struct ad_error){0};
        assert_int_equal(phys_ephemeris_choose(&system, bad[k].bodies, bad[k].dims, &error),
                         AD_E_ARGUMENT);
        if (!strstr(error.message, bad[k].message))
            fail_msg("'%s' does not contain '%s'", error.message, bad[k].message);
        assert_int_equal(system.dof, 6);
    }
    phys_system_close(&system);
    system = opened("kepler");
    error = (struct ad_error){0};
    assert_int_equal(phys_ephemeris_choose(&system, "sun,earth", 2, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

enum { EPOCHS = 6 };

/* Two tables of bodies in uniform acceleration, without velocities. */
static void make_tables(struct phys_horizons tables[2], double jd[EPOCHS],
                        double position[2][3 * EPOCHS])
{
    for (size_t i = 0; i < EPOCHS; i++)
        jd[i] = 2459774.5 + (double)i;
    for (size_t b = 0; b < 2; b++)
        for (size_t i = 0; i < EPOCHS; i++)
            for (size_t k = 0; k < 3; k++) {
                double s = 86400 * (double)i, c = (double)(b + k + 1);
                position[b][3 * i + k] = 1e9 * c + 1e3 * c * s + 1e-3 * c * s * s;
            }
    tables[0] = (struct phys_horizons){
        .target = "Sun", .id = 10, .n = EPOCHS, .jd = jd, .position = position[0], .gm = 1e20};
    tables[1] = (struct phys_horizons){
        .target = "Ceres", .id = 1, .n = EPOCHS, .jd = jd, .position = position[1], .gm = 6e10};
}

static void tables_give_bodies_start_and_reference(void **state)
{
    (void)state;
    struct phys_system system = opened("ephemeris");
    struct phys_horizons tables[2];
    struct ad_error error = {0};
    double jd[EPOCHS], position[2][3 * EPOCHS], reference[4 * 4], q[4], v[4];
    make_tables(tables, jd, position);
    phys_ephemeris_use(&system, 2, tables, 2, 4, 2, reference, &error);
    assert_no_error(&error);
    assert_int_equal(system.dof, 4);
    start(&system, 0, q, v);
    for (size_t k = 0; k < 4; k++) {
        double c = (double)(k / 2 + k % 2 + 1);
        assert_true(q[k] == position[k / 2][3 * 2 + k % 2]);
        /* differences of second order are exact for a parabola */
        assert_close(v[k], 1e3 * c + 2e-3 * c * 2 * 86400, 1e-9, 0);
        for (size_t i = 0; i < 4; i++)
            assert_true(reference[k * 4 + i] == position[k / 2][3 * (2 + i) + k % 2]);
    }
    char name[32];
    phys_coordinate_name(&system, 2, name, sizeof name);
    assert_string_equal(name, "x_ceres");

    double zero[4] = {0}, T, V; /* masses are GM / G ... */
    double G = phys_system_get(&system, "G"), r = hypot(q[0] - q[2], q[1] - q[3]);
    energies(&system, q, zero, &T, &V);
    assert_close(V, -1e20 * 6e10 / G / r, 1e-14, 0);
    set(&system, "mass_sun", 3e28); /* ... unless set by name */
    energies(&system, q, zero, &T, &V);
    assert_close(V, -3e28 * 6e10 / r, 1e-14, 0);
    phys_system_close(&system);
}

static void unusable_tables_are_refused(void **state)
{
    (void)state;
    struct phys_system system = opened("ephemeris");
    struct phys_horizons tables[2];
    struct ad_error error = {0};
    double jd[EPOCHS], position[2][3 * EPOCHS];
    make_tables(tables, jd, position);
    assert_int_equal(phys_ephemeris_use(&system, 2, tables, 3, 4, 2, NULL, &error), AD_E_INPUT);
    assert_non_null(strstr(error.message, "4 epochs from index 3"));
    error = (struct ad_error){0};
    tables[1].gm = 0;
    assert_int_equal(phys_ephemeris_use(&system, 2, tables, 0, 4, 2, NULL, &error), AD_E_INPUT);
    assert_non_null(strstr(error.message, "Ceres"));
    assert_int_equal(system.dof, 15); /* untouched */
    error = (struct ad_error){0};
    set(&system, "mass_sun", 2e30);
    tables[0].gm = 0; /* a mass set by name does without */
    tables[1].gm = 6e10;
    phys_ephemeris_use(&system, 2, tables, 0, 4, 2, NULL, &error);
    assert_no_error(&error);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unknown_names_suggest_the_nearest),
        cmocka_unit_test(parameters_are_set_by_name),
        cmocka_unit_test(presets_name_parameters_that_exist),
        cmocka_unit_test(sizes_follow_the_parameters),
        cmocka_unit_test(coordinates_have_names),
        cmocka_unit_test(lagrangians_pass_the_checks),
        cmocka_unit_test(kepler_has_its_known_energy_and_momentum),
        cmocka_unit_test(double_pendulum_has_the_energy_of_its_bobs),
        cmocka_unit_test(energies_of_an_unsplit_lagrangian_follow_from_legendre),
        cmocka_unit_test(a_lagrangian_of_the_wrong_shape_is_refused),
        cmocka_unit_test(pairs_are_in_lexicographic_order),
        cmocka_unit_test(the_gas_starts_without_overlap),
        cmocka_unit_test(bodies_are_chosen_by_name_or_id),
        cmocka_unit_test(tables_give_bodies_start_and_reference),
        cmocka_unit_test(unusable_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
