/* An argument that was not found, not opened or not given is an error, or the error already held.
 */
#include "tests/close.h"
#include "physics/physics.h"
#include "autodiff/series.h"

#include <string.h>

static void test_failed_searches(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct phys_ode ode;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_path_info path_info;
    double y[2] = {1, 0}, path[9] = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&pendulum, &ode, &error), AD_OK);
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find("dop85", &error),
                                .t1 = 1,
                                .rtol = 1e-9};
    assert_int_equal(phys_simulate(&s, &ode, y, &info, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "dop85"));
    error = (struct ad_error){0};
    struct phys_path_settings settings = phys_path_defaults(&pendulum);
    assert_int_equal(phys_path_solve(phys_solver_find("newtom", &error), &pendulum, &settings, path,
                                     &path_info, &error),
                     AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "newtom"));
    phys_ode_free(&ode);
    phys_system_close(&pendulum);
}

/* Nothing given and no error held: a new one. */
static void test_nothing_given(void **state)
{
    (void)state;
    struct phys_system pendulum, closed = {0};
    struct phys_ode ode = {0};
    struct phys_spectrum spectrum;
    struct phys_solutions solutions;
    struct phys_simulation_info info;
    struct phys_step_limits limits;
    struct phys_motion *motion;
    struct phys_legendre *legendre;
    struct phys_closest_approach approach;
    struct phys_reference reference;
    struct phys_conserved conserved;
    struct phys_locality locality;
    struct ad_check check;
    double path[12] = {0}, q[2] = {1, 1}, v[2] = {0, 0};
    struct ad_error e = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    const struct phys_points no_time = {.size = sizeof no_time, 2, q, v, NULL};
    struct phys_path_settings no_rule = {.size = sizeof no_rule, .slices = 5, .dt = 0.1};
    const struct phys_simulation nothing = {.size = sizeof nothing, .t1 = 1};
    const struct phys_motion_settings asked = {.size = sizeof asked, .time = 1};
    struct phys_motion_solution solution;
    struct phys_crossing crossing;
    phys_rule_interpolate(NULL, 1, 3, path);
    phys_rule_nodes(NULL, 1, 3, 1, path, path, NULL);
#define REFUSED(call) (e = (struct ad_error){0}, assert_int_equal((call), AD_E_ARGUMENT))
    REFUSED(phys_path_spectrum(&pendulum, &no_rule, path, &spectrum, &e));
    REFUSED(phys_path_all(&pendulum, &no_rule, path, 3, 1, &solutions, &e));
    REFUSED(phys_simulate(&nothing, &ode, q, &info, &e));
    REFUSED(phys_ode_enter(NULL, 0, q, v, path, &e));
    REFUSED(phys_ode_enter(&ode, 0, q, NULL, path, &e));
    REFUSED(phys_ode_leave(&ode, 0, NULL, q, v, &e));
    REFUSED(phys_ode_leave(&ode, 0, path, q, NULL, &e));
    REFUSED(phys_typical_sizes(NULL, 0, q, path, &e));
    REFUSED(phys_closest_approach_begin(NULL, 0, q, &approach, &e));
    REFUSED(phys_motion_solve(&closed, &asked, &solution, &e));
    REFUSED(phys_motion_solve(&pendulum, NULL, &solution, &e));
    REFUSED(phys_crossing_read(&closed, "q=1", &crossing, &e));
    REFUSED(phys_crossing_read(&pendulum, NULL, &crossing, &e));
    REFUSED(phys_ode_for(&pendulum, NULL, &ode, &e));
    REFUSED(phys_motion_path(&closed, NULL, q, v, 3, 0.1, path, &e));
    REFUSED(phys_first_slices(NULL, q, v, 3, 0.1, true, path, &e));
    REFUSED(phys_reference(&closed, q, v, 2, path, 0.1, NULL, NULL, &reference, &e));
    REFUSED(phys_reference(&pendulum, q, v, 2, NULL, 0.1, NULL, NULL, &reference, &e));
    REFUSED(phys_conserved(&pendulum, 0, NULL, NULL, &conserved, &e));
    REFUSED(phys_conserved(&pendulum, 1, path, NULL, &conserved, &e));
    REFUSED(phys_ode_lagrangian(&closed, &ode, &e));
    REFUSED(phys_ode_canonical(&closed, &ode, &e));
    REFUSED(phys_ode_hamiltonian(NULL, 1, NULL, &ode, &e));
    REFUSED(phys_motion_new(&closed, &motion, &e));
    REFUSED(phys_legendre_new(&closed, &legendre, &e));
    REFUSED(phys_check_finite(&pendulum, &no_time, &e));
    REFUSED(phys_check_gradient(&pendulum, &no_time, 1, 1e-6, 0, &check, &e));
    REFUSED(phys_check_locality(&pendulum, NULL, &locality, &e));
    REFUSED(phys_step_limits(NULL, &limits, &e));
    REFUSED(phys_system_open(NULL, &closed, &e));
    REFUSED(phys_system_set(&closed, "m", 1, &e));
    REFUSED((phys_integrator_find(NULL, &e), e.status));
    REFUSED((phys_solver_find(NULL, &e), e.status));
    REFUSED((phys_rule_find(NULL, &e), e.status));
    phys_system_close(&pendulum);
}

/* Everything missing: a status, no crash. Then each output missing, the rest given. */
static void test_all_null(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct ad_error e = {0};
    struct phys_ode ode = {0};
    struct phys_motion_solution solution = {0};
    double q[3] = {1, 1, 1}, v[3] = {0}, path[12] = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    struct phys_path_settings settings = phys_path_defaults(&pendulum);
    const struct phys_points points = {.size = sizeof points, 2, q, v, v};
    const struct phys_motion_settings asked = {.size = sizeof asked, .time = 1};
    const struct phys_ephemeris_motion empty = {0};
    struct phys_ephemeris_track track;
    REFUSED(phys_system_open(NULL, NULL, &e));
    REFUSED(phys_system_open("pendulum", NULL, &e));
    REFUSED(phys_system_make(NULL, NULL, &e));
    REFUSED(phys_system_make(pendulum.scene, NULL, &e));
    REFUSED(phys_system_set_all(&pendulum, 1, NULL, &e));
    REFUSED(phys_ode_for(NULL, NULL, NULL, &e));
    REFUSED(phys_ode_for(&pendulum, phys_integrators[0], NULL, &e));
    REFUSED(phys_ode_gas(NULL, 0, NULL, &e));
    REFUSED(phys_ode_hamiltonian(NULL, 0, NULL, NULL, &e));
    REFUSED(phys_ode_lagrangian(NULL, NULL, &e));
    REFUSED(phys_ode_lagrangian(&pendulum, NULL, &e));
    REFUSED(phys_ode_canonical(&pendulum, NULL, &e));
    REFUSED(phys_ode_path(NULL, 0, 0, 0, NULL, &e));
    REFUSED(phys_motion_new(NULL, NULL, &e));
    REFUSED(phys_motion_new(&pendulum, NULL, &e));
    REFUSED(phys_motion_acceleration(NULL, NULL, NULL, 0, NULL, &e));
    REFUSED(phys_motion_solve(NULL, NULL, NULL, &e));
    REFUSED(phys_motion_solve(&pendulum, &asked, NULL, &e));
    REFUSED(phys_motion_met(NULL, NULL, &e));
    REFUSED(phys_motion_diagnose(NULL, NULL, 0, NULL, &e));
    REFUSED(phys_motion_diagnose(&asked, &solution, 0, NULL, &e));
    REFUSED(phys_reference(&pendulum, q, v, 2, path, 0.1, NULL, NULL, NULL, &e));
    REFUSED(phys_crossing_read(&pendulum, "q=1", NULL, &e));
    REFUSED(phys_closest_approach_begin(&ode, 0, q, NULL, &e));
    REFUSED(phys_conserved(NULL, 0, NULL, NULL, NULL, &e));
    REFUSED(phys_check_gradient(&pendulum, &points, 1, 1e-6, 0, NULL, &e));
    REFUSED(phys_check_locality(&pendulum, &points, NULL, &e));
    REFUSED(phys_path_spectrum(NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_path_spectrum(&pendulum, &settings, path, NULL, &e));
    REFUSED(phys_path_conjugate(NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_path_conjugate(&pendulum, &settings, path, NULL, &e));
    REFUSED(phys_path_all(NULL, NULL, NULL, 0, 0, NULL, &e));
    REFUSED(phys_path_all(&pendulum, &settings, path, 3, 1, NULL, &e));
    REFUSED(phys_path_free_time(&pendulum, NULL, 1, path, NULL, &e));
    REFUSED(phys_lyapunov(NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_lyapunov(&ode, q, NULL, &(struct phys_lyapunov){0}, &e));
    REFUSED(phys_lyapunov_spectrum(&pendulum, NULL, NULL, 1, NULL, NULL, &e));
    REFUSED(phys_transition(&pendulum, NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_ode_variations(&pendulum, 1, NULL, &e));
    REFUSED(phys_normal_modes(NULL, 0, NULL, NULL, NULL, &e));
    REFUSED(phys_normal_modes(&pendulum, 1, NULL, NULL, &(struct phys_normal_modes){0}, &e));
    REFUSED(phys_step_limits(phys_integrators[0], NULL, &e));
    REFUSED(phys_step_advise(NULL, NULL, 0, NULL, NULL, 0, NULL, &e));
    REFUSED(phys_gas_order(NULL, NULL, NULL, &e));
    REFUSED(phys_order(3, NULL, 1, NULL, NULL, NULL, &e));
    REFUSED(phys_pair_distribution(0, NULL, NULL, 0, 0, NULL, &e));
    REFUSED(phys_horizons_read(NULL, NULL, &e));
    REFUSED(phys_horizons_read(NULL, &(struct phys_horizons){0}, &e));
    REFUSED(phys_horizons_epoch(NULL, NULL, NULL, &e));
    REFUSED(phys_horizons_folder(NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_ephemeris_choose(NULL, NULL, 0, &e));
    REFUSED(phys_ephemeris_add(NULL, NULL, 0, &e));
    REFUSED(phys_ephemeris_use(NULL, 0, NULL, 0, 0, 0, NULL, &e));
    REFUSED(phys_ephemeris_tables_read(NULL, NULL, 0, NULL, &e));
    REFUSED(phys_ephemeris_motion_open(NULL, NULL, NULL, &e));
    REFUSED(phys_ephemeris_measure(NULL, NULL, NULL, NULL, &e));
    REFUSED(phys_ephemeris_measure(NULL, NULL, &track, &(struct phys_ephemeris_distances){0}, &e));
    REFUSED(phys_ephemeris_least(NULL, 0, NULL, &e));
    REFUSED(phys_ephemeris_track_tables(NULL, 0, NULL, &e));
    REFUSED(phys_ephemeris_follow(NULL, 0, NULL, &e));
    REFUSED(phys_ephemeris_follow(&empty, 1, &track, &e));
    REFUSED(phys_ephemeris_follow_tightly(&empty, 1, &track, &e));
    REFUSED(phys_ephemeris_choose_step(NULL, NULL, 0, &e));
    phys_ephemeris_tables_free(NULL);
    phys_ephemeris_track_free(NULL);
    phys_ephemeris_motion_close(NULL);
    phys_motion_solution_free(NULL);
    assert_true(isnan(phys_ephemeris_apart(NULL, NULL, 0, 0)));
    assert_true(phys_ephemeris_compare(NULL, NULL).worst == 0);
    assert_null(phys_simulation_of(NULL, 1, 1).integrator);
    ad_tape *tape = ad_tape_new(AD_F64);
    assert_int_equal(phys_action_record(tape, &pendulum, settings.rule, 3, 1, 0, NULL),
                     AD_E_ARGUMENT);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    ad_tape_free(tape);
    assert_false(ad_series_native(NULL, 0, &e));
    phys_system_close(&pendulum);
}

/* G4: components that are zero at the start, and no atol. */
static void test_start_at_rest(void **state)
{
    (void)state;
    static const char *const scenes[] = {"pendulum", "dblpend", "pythagorean", "fall"};
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct phys_system system;
        struct phys_ode ode;
        struct phys_simulation_info info;
        struct ad_error error = {0};
        double y[32] = {0};
        assert_int_equal(phys_system_open(scenes[k], &system, &error), AD_OK);
        assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
        assert_int_equal(system.scene->start(system.params, 1, y, y + system.dof, &error), AD_OK);
        struct phys_simulation s = {.size = sizeof s,
                                    .integrator = phys_integrator_find("dop853", &error),
                                    .t1 = 1,
                                    .rtol = 1e-9};
        if (phys_simulate(&s, &ode, y, &info, &error) != AD_OK)
            print_error("%s: %s\n", scenes[k], error.message);
        assert_int_equal(error.status, AD_OK);
        assert_true(info.steps > 0 && info.steps < 2000);
        phys_ode_free(&ode);
        phys_system_close(&system);
    }
}

/* ---- G2: functions that return no status ---- */

static void test_unknown_numbers(void **state)
{
    (void)state;
    struct phys_system pendulum, closed = {0};
    struct phys_legendre *l;
    struct phys_totals totals;
    struct ad_error e = {0};
    double q[2] = {1, 2}, v[2] = {3, 4}, p[2], force[2];
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    assert_int_equal(phys_legendre_new(&pendulum, &l, &e), AD_OK);
    const double numbers[] = {
        phys_system_get(NULL, "m"),
        phys_system_get(&pendulum, NULL),
        phys_system_get(&closed, "m"),
        phys_system_get(&pendulum, "none"),
        phys_legendre_energy(NULL, q, v, 0),
        phys_legendre_energy(l, NULL, v, 0),
        phys_legendre_energy(l, q, NULL, 0),
        phys_legendre_condition(NULL, q, v, 0),
        phys_legendre_condition(l, q, NULL, 0),
    };
    for (size_t k = 0; k < LENGTH(numbers); k++)
        if (!isnan(numbers[k]))
            fail_msg("number %zu: %g", k, numbers[k]);
    phys_totals(NULL, q, v, 0, &totals);
    assert_true(isnan(totals.energy) && isnan(totals.angular[2]) && isnan(totals.mass));
    phys_totals(l, q, NULL, 0, &totals);
    assert_true(isnan(totals.energy) && isnan(totals.momentum[0]));
    phys_totals(l, q, v, 0, NULL);
    phys_legendre_momentum(NULL, q, v, 0, p, force);
    p[0] = force[0] = 1;
    phys_legendre_momentum(l, NULL, v, 0, p, force);
    assert_true(isnan(p[0]) && isnan(force[0]));
    phys_legendre_momentum(l, q, NULL, 0, NULL, NULL);
    assert_int_equal(phys_legendre_velocity(NULL, q, p, 0, v, &e), AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_int_equal(phys_legendre_velocity(l, q, NULL, 0, v, &e), AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_false(phys_keeps_energy(NULL, &e) || phys_keeps_energy(&closed, &e));
    assert_int_equal(e.status, AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_true(phys_keeps_energy(&pendulum, &e));
    phys_legendre_free(l);
    phys_system_close(&pendulum);
}

static void test_unknown_names(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct ad_error e = {0};
    struct phys_ode ode = {0};
    char name[20];
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    phys_coordinate_name(&pendulum, 1, name, sizeof name); /* it has one coordinate */
    assert_string_equal(name, "?");
    phys_coordinate_name(NULL, 0, name, sizeof name);
    assert_string_equal(name, "?");
    phys_ode_component(NULL, 0, name, sizeof name);
    assert_string_equal(name, "?");
    phys_coordinate_name(&pendulum, 0, NULL, sizeof name);
    phys_ode_component(&ode, 0, NULL, sizeof name);
    phys_horizons_date(2451545, NULL, 20);
    assert_string_equal(phys_state_text((enum phys_state)99), "unknown");
    assert_string_equal(phys_state_text((enum phys_state) - 1), "unknown");
    assert_null(phys_nearest(NULL, 1, (const char *const[]){"a"}));
    assert_null(phys_nearest("a", 1, NULL));
    assert_int_equal(phys_find("thing", "a", 3, NULL, &e), 3);
    assert_int_equal(e.status, AD_E_ARGUMENT);
    phys_system_close(&pendulum);
}

/* Each call leaves its error in the tape of q, four rows. */
static void test_unknown_values(void **state)
{
    (void)state;
    struct phys_system closed = {0};
    const uint32_t one[] = {0}, other[] = {1}, far[] = {0x80000000u}; /* row 2^32 is not row 0 */
    for (int k = 0; k < 12; k++) {
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var q = ad_input(tape, 4, 1, "q"), d[4], T, V;
        struct phys_rule_points points;
        k == 0    ? phys_pair_differences(q, 2, 2, NULL)
        : k == 1  ? phys_pair_differences(q, (size_t)1 << 33, 2, d)
        : k == 2  ? phys_pair_differences(q, 1, 2, d)
        : k == 3  ? phys_listed_differences(q, 2, 1, NULL, other, d)
        : k == 4  ? phys_listed_differences(q, 2, 1, one, other, NULL)
        : k == 5  ? phys_listed_differences(q, 2, 1, one, far, d)
        : k == 6  ? (void)phys_listed_squares(q, 2, 1, one, NULL, 0)
        : k == 7  ? (void)phys_pair_squares(q, 3, 2, 0)
        : k == 8  ? (void)phys_system_lagrangian(NULL, q, q, q)
        : k == 9  ? (void)phys_system_lagrangian(&closed, q, q, q)
        : k == 10 ? (void)phys_system_energies(&closed, q, q, q, &T, &V)
                  : phys_rule_points(NULL, q, 1, &points);
        if (ad_tape_error(tape)->status == AD_OK)
            fail_msg("call %d leaves no error", k);
        ad_tape_free(tape);
    }
    phys_pair_squares((ad_var){0}, 2, 2, 0);
    phys_rule_points(NULL, (ad_var){0}, 1, NULL);
    phys_action_hold_energy(NULL, 1);
    phys_action_hold_energy(&(struct phys_action){0}, 1);
}

static void test_nothing_done(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct ad_error e = {0};
    double path[6] = {1, 1, 1, 1, 1, 1};
    const struct phys_noise noise = {.sigma = 1};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    phys_noise_add(NULL, &pendulum, 6, 1, path);
    phys_noise_add(&noise, NULL, 6, 1, path);
    phys_noise_add(&noise, &pendulum, 6, 1, NULL);
    for (size_t k = 0; k < LENGTH(path); k++)
        assert_true(path[k] == 1);
    assert_int_equal(phys_path_defaults(NULL).slices, 0);
    const struct phys_grid grid = {phys_rule_find("midpoint", &e), 3, 0.5, NULL},
                           still = {grid.rule, 3, 0, NULL};
    assert_null(phys_path_resample(NULL, path, &grid, 1, &e));
    assert_int_equal(e.status, AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_null(phys_path_resample(&grid, path, &still, 1, &e));
    assert_int_equal(e.status, AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_null(phys_path_resample(&(struct phys_grid){NULL, 3, 0.5, NULL}, path, &grid, 1, &e));
    assert_int_equal(e.status, AD_E_ARGUMENT);
    phys_system_close(&pendulum);
    phys_system_close(NULL);
    phys_spectrum_free(NULL);
    phys_solutions_free(NULL);
    phys_path_found_free(NULL);
    phys_refined_free(NULL);
    phys_ode_free(NULL);
    phys_reference_free(NULL);
    phys_motion_free(NULL);
    phys_horizons_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_failed_searches), cmocka_unit_test(test_nothing_given),
        cmocka_unit_test(test_all_null),        cmocka_unit_test(test_start_at_rest),
        cmocka_unit_test(test_unknown_numbers), cmocka_unit_test(test_unknown_names),
        cmocka_unit_test(test_unknown_values),  cmocka_unit_test(test_nothing_done),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
