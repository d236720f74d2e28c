/* A motion with its measured error, events and diagnostics from two calls: phys_motion_solve,
   phys_motion_diagnose. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/stability/diagnostics.h"

#include <math.h>
#include <stdlib.h>

struct solved {
    struct phys_system system;
    struct phys_motion_solution motion;
    struct phys_diagnosis diagnosis;
    struct ad_error error;
};

static void solve(struct solved *s, const char *scene, const struct phys_motion_settings *settings)
{
    s->error = (struct ad_error){0};
    phys_system_open(scene, &s->system, &s->error);
    phys_motion_solve(&s->system, settings, &s->motion, &s->error);
}

static void end(struct solved *s)
{
    phys_motion_solution_free(&s->motion);
    phys_system_close(&s->system);
}

/* Between its steps a motion of dop853 is off by more than at their ends. */
static void the_drift_is_that_of_the_samples_too(void **state)
{
    (void)state;
    struct solved s = {0};
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 3, .integrator = phys_integrator_find("dop853", &s.error)};
    solve(&s, "kepler", &settings);
    assert_int_equal(s.error.status, AD_OK);
    double most = 0;
    for (size_t i = 0; i < s.motion.n; i++)
        most = fmax(most, fabs(s.motion.energy[i] + 0.5) / 0.5);
    assert_true(most > 1e-8);
    assert_close(s.motion.info.energy_drift, most, 1e-6, 0);
    end(&s);
}

/* A Kepler orbit, e = 0.6, a = GM = 1, from the pericentre, at mean anomaly 1. */
static void an_error_asked_for_is_met(void **state)
{
    (void)state;
    struct solved s = {0};
    const double at_1[] = {-0.628948176826624, 0.799664730970039};
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 1, .error = 1e-9, .n_samples = 4};
    solve(&s, "kepler", &settings);
    const struct phys_motion_solution *m = &s.motion;
    assert_int_equal(s.error.status, AD_OK);
    assert_int_equal(phys_motion_met(&settings, m, &s.error), AD_OK);
    assert_true(m->n == 5 && m->n_trials > 0 && m->trial[m->n_trials - 1].chosen);
    assert_true(m->error > 0 && m->error <= 1e-9);
    const double *last = m->x + 4 * 4;
    assert_true(hypot(last[0] - at_1[0], last[1] - at_1[1]) <= m->error + 1e-14);
    assert_close(m->distance[4], m->error_end, 0, 0);
    assert_true(m->keeps_energy && m->conserved.angular && !m->conserved.momentum);
    end(&s);
}

/* At rest in an equilibrium neither force nor torque acts; beside it both do. */
static ad_var valley(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var potential = ad_add(ad_square(ad_row(q, 0)), ad_mul(2.0, ad_square(ad_row(q, 1))));
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), potential);
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = q[1] = v[0] = v[1] = 0;
    return AD_OK;
}

static void conservation_is_looked_at_beside_the_motion(void **state)
{
    (void)state;
    const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                     .size = sizeof(struct phys_scene),
                                     .name = "valley",
                                     .what = "a valley",
                                     .dof = 2,
                                     .dims = 2,
                                     .unit = "1",
                                     .time_unit = "1",
                                     .energy_unit = "1",
                                     .picture = PHYS_PICTURE_PLANE,
                                     .lagrangian = valley,
                                     .slices = 9,
                                     .dt = 0.1,
                                     .start = at_rest};
    const double x[4] = {0}, t = 0;
    struct phys_system system;
    struct phys_conserved conserved;
    struct ad_error error = {0};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_conserved(&system, 1, x, &t, &conserved, &error), AD_OK);
    assert_true(conserved.bodies && !conserved.momentum && !conserved.angular);
    phys_system_close(&system);
}

/* Of a Kepler orbit, a = GM = 1, from the pericentre, in long double. */
static void kepler_at(long double e, long double t, long double q[2])
{
    const long double turn = 2 * acosl(-1), mean = fmodl(t, turn);
    long double low = 0, high = turn;
    for (int k = 0; k < 200; k++) {
        long double middle = (low + high) / 2;
        *(middle - e * sinl(middle) < mean ? &low : &high) = middle;
    }
    q[0] = cosl(low) - e;
    q[1] = sqrtl(1 - e * e) * sinl(low);
}

/* Starts whose rounding shows: what is claimed is no less than the truth, nor beyond it by more
   than the uncertainty. */
static void an_error_counts_the_rounding_of_the_start(void **state)
{
    (void)state;
    static const struct {
        const char *e;
        double time, tol;
    } runs[] = {{"0.9999", 12, 1e-13},  {"0.9999", 6.2831853, 1e-13}, {"0.99999", 6.2831853, 1e-13},
                {"0.99999", 12, 1e-13}, {"0.999", 7, 1e-12},          {"0.9", 7, 1e-12},
                {"0.6", 12, 1e-13}};
    for (size_t r = 0; r < LENGTH(runs); r++) {
        struct solved s = {0};
        const struct phys_motion_settings settings = {.size = sizeof settings,
                                                      .time = runs[r].time,
                                                      .integrator =
                                                          phys_integrator_find("dop853", &s.error),
                                                      .tolerance = runs[r].tol,
                                                      .n_samples = 1000};
        assert_int_equal(phys_system_open("kepler", &s.system, &s.error), AD_OK);
        assert_int_equal(phys_system_set(&s.system, "e", atof(runs[r].e), &s.error), AD_OK);
        assert_int_equal(phys_motion_solve(&s.system, &settings, &s.motion, &s.error), AD_OK);
        const struct phys_motion_solution *m = &s.motion;
        double worst = 0;
        for (size_t i = 0; i < m->n; i++) {
            long double q[2];
            kepler_at(strtold(runs[r].e, NULL), m->t[i], q);
            worst = fmax(worst, (double)hypotl(m->x[4 * i] - q[0], m->x[4 * i + 1] - q[1]));
        }
        if (!(m->error >= worst && m->error - worst <= m->reference_uncertainty))
            fail_msg("e = %s, t = %g: claimed %.17g, true %.17g, uncertainty %g", runs[r].e,
                     runs[r].time, m->error, worst, m->reference_uncertainty);
        end(&s);
    }
}

/* Equations that err on the way forwards alone: two runs agree, the way back does not. */
enum { ERRING_END = 2 };
static const double ERRS = 1e-6;
static bool on_the_way_back;

static enum ad_status erring_field(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)context;
    (void)error;
    on_the_way_back = t >= ERRING_END || (on_the_way_back && t > 0);
    rate[0] = y[1];
    rate[1] = -y[0] + (on_the_way_back ? 0 : ERRS);
    return AD_OK;
}

static enum ad_status erring_ode(const struct phys_system *system, struct phys_ode *ode,
                                 struct ad_error *error)
{
    (void)error;
    *ode = (struct phys_ode){.n = 2, .field = erring_field, .system = system};
    return AD_OK;
}

/* Times of steps are what the clock says: 800 periods of a spring are known to rounding, where the
   rounding of t + h in every step would add up. */
static void the_clock_does_not_drift(void **state)
{
    (void)state;
    struct solved s = {0};
    const double q = 1, v = 0;
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 5, .error = 1e-9, .q = &q, .v = &v};
    phys_system_open("spring", &s.system, &s.error);
    phys_system_set(&s.system, "m", 1, &s.error);
    phys_system_set(&s.system, "k", 1e6, &s.error);
    phys_motion_solve(&s.system, &settings, &s.motion, &s.error);
    assert_int_equal(s.error.status, AD_OK);
    assert_true(s.motion.reference_uncertainty < 1e-12 && s.motion.error < 1e-10);
    assert_close(s.motion.reference_tolerance, 1e-15, 0, 0); /* long, not noisy */
    for (size_t i = 0; i < s.motion.n; i++)
        assert_close(s.motion.x[2 * i], (double)cosl(1e3L * s.motion.t[i]), 0,
                     s.motion.error + 1e-12);
    end(&s);
}

/* A coordinate that is small and fast beside one that is large and slow: its error is seen by
   itself. */
static ad_var two_scales(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var V = ad_add(ad_mul(1e6, ad_square(ad_row(q, 0))), ad_square(ad_row(q, 1)));
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), V));
}

static void a_small_coordinate_is_judged_by_its_own_size(void **state)
{
    (void)state;
    struct solved s = {0};
    const double v[] = {0, 0};
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 5, .v = v};
    phys_system_open("spring", &s.system, &s.error);
    struct phys_scene scene = *s.system.scene;
    scene.lagrangian = two_scales;
    scene.kinetic = scene.potential = NULL;
    s.system.scene = &scene;
    s.system.dof = s.system.dims = 2;
    for (int run = 0; run < 4; run++) { /* in the units of the test, or in larger ones */
        const bool fine = run % 2;
        const double unit = run / 2 ? 1e-20 : 1, q[] = {1e-6 * unit, 1e3 * unit};
        settings.q = q;
        settings.tolerance = fine ? 1e-14 : 1e-8;
        phys_motion_solve(&s.system, &settings, &s.motion, &s.error);
        phys_motion_diagnose(&settings, &s.motion, 0, &s.diagnosis, &s.error);
        assert_int_equal(s.error.status, AD_OK);
        assert_int_equal(s.motion.worst, 0);
        assert_int_equal(s.motion.worst_error > 0.1, !fine);
        assert_int_equal(s.diagnosis.n_warnings, !fine);
        phys_motion_solution_free(&s.motion);
    }
    phys_system_close(&s.system);
}

static void an_error_that_both_runs_share_is_seen_on_the_way_back(void **state)
{
    (void)state;
    struct phys_system spring = {0}, erring = {0};
    struct phys_reference reference;
    struct ad_error error = {0};
    const double q = 1, v = 0, times[] = {0, 0.5, 1, 1.5, ERRING_END};
    assert_int_equal(phys_system_open("spring", &spring, &error), AD_OK);
    for (int errs = 0; errs < 2; errs++) {
        struct phys_scene scene = *spring.scene;
        scene.ode = errs ? erring_ode : NULL;
        on_the_way_back = false;
        assert_int_equal(phys_system_make(&scene, &erring, &error), AD_OK);
        assert_int_equal(phys_reference(&erring, &q, &v, LENGTH(times), times, 0.1, NULL, NULL,
                                        &reference, &error),
                         AD_OK);
        if (errs) {
            assert_true(reference.reversal > 0.5 * ERRS && reference.reversal < 4 * ERRS);
            assert_true(reference.uncertainty[4] >= 0.5 * reference.reversal &&
                        reference.uncertainty[4] < 8 * ERRS);
        } else
            assert_true(reference.reversal < 1e-13 && reference.uncertainty[4] < 1e-13);
        phys_reference_free(&reference);
        phys_system_close(&erring);
    }
    phys_system_close(&spring);
}

static void defaults_follow_the_scenes_start_or_a_given_one(void **state)
{
    (void)state;
    struct solved s = {0};
    const double q = 0.3, v = -0.2;
    solve(&s, "spring",
          &(struct phys_motion_settings){
              .size = sizeof(struct phys_motion_settings), .time = 1, .reverse = true});
    assert_int_equal(s.error.status, AD_OK);
    assert_true(s.motion.n == 1001 && s.motion.n_trials == 0);
    assert_string_equal(s.motion.integrator->name, "dop853");
    assert_close(s.motion.reversal, 0, 0, 1e-7);
    end(&s);
    solve(&s, "spring",
          &(struct phys_motion_settings){.size = sizeof(struct phys_motion_settings),
                                         .time = 1,
                                         .q = &q,
                                         .v = &v,
                                         .no_reference = true});
    assert_true(s.motion.x[0] == 0.3 && s.motion.x[1] == -0.2);
    assert_true(!s.motion.distance && isnan(s.motion.error));
    end(&s);
}

/* However few samples: at the far end of the orbit, or 157 steps apart. */
static void an_error_does_not_depend_on_the_samples(void **state)
{
    (void)state;
    static const char *const methods[] = {"dop853", "velocity-verlet"};
    for (size_t k = 0; k < LENGTH(methods); k++) {
        struct ad_error none = {0};
        struct phys_motion_settings settings = {.size = sizeof settings,
                                                .time = 3 * M_PI,
                                                .dt = 3 * M_PI / 628,
                                                .tolerance = 1e-6,
                                                .integrator =
                                                    phys_integrator_find(methods[k], &none)};
        double error = 0;
        for (int few = 0; few < 3; few++) {
            struct solved s;
            settings.n_samples = few == 1 ? 1 : 0;
            settings.every = few == 2 && k == 1 ? 157 : 0;
            solve(&s, "kepler", &settings);
            assert_int_equal(s.error.status, AD_OK);
            assert_int_equal(s.motion.n, settings.every       ? 5
                                         : settings.n_samples ? 2
                                         : k                  ? 629
                                                              : 1001);
            assert_close(s.motion.t[s.motion.n - 1], 3 * M_PI, 1e-14, 0);
            assert_true(s.motion.distance[s.motion.n - 1] == s.motion.error_end);
            error = few == 0 ? s.motion.error : error;
            assert_close(s.motion.error, error, 1e-6, 0);
            assert_true(k == 0 || s.motion.error > 1.5 * s.motion.error_end);
            end(&s);
        }
    }
}

static void what_is_out_of_reach_is_an_error(void **state)
{
    (void)state;
    struct solved s = {0};
    solve(&s, "kepler",
          &(struct phys_motion_settings){
              .size = sizeof(struct phys_motion_settings), .time = 60, .error = 1e-15});
    assert_int_equal(s.error.status, AD_E_ACCURACY);
    assert_true(s.motion.n_trials > 0 && s.motion.n == 0);
    end(&s);
    solve(&s, "kepler",
          &(struct phys_motion_settings){.size = sizeof(struct phys_motion_settings), .time = 0});
    assert_int_equal(s.error.status, AD_E_ARGUMENT);
    end(&s);
}

static bool ten_times(void *context) { return ++*(int *)context <= 10; }

static void an_interruption_keeps_what_was_reached(void **state)
{
    (void)state;
    struct solved s = {0};
    int asked = 0;
    struct ad_error none = {0};
    solve(&s, "kepler",
          &(struct phys_motion_settings){.size = sizeof(struct phys_motion_settings),
                                         .time = 100,
                                         .integrator = phys_integrator_find("rk4", &none),
                                         .dt = 0.01,
                                         .every = 1,
                                         .proceed = ten_times,
                                         .context = &asked});
    assert_int_equal(s.error.status, AD_OK);
    assert_int_equal(s.motion.info.stop, PHYS_SIMULATION_INTERRUPTED);
    assert_int_equal(s.motion.n, 11);
    assert_close(s.motion.t[10], 0.1, 1e-12, 0);
    end(&s);
}

static void diagnoses_name_what_is_wrong(void **state)
{
    (void)state;
    struct solved s = {0};
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 60, .dt = 0.8};
    struct ad_error none = {0};
    settings.integrator = phys_integrator_find("verlet", &none);
    solve(&s, "kepler", &settings); /* too long for the pericentre */
    phys_motion_diagnose(&settings, &s.motion, 0, &s.diagnosis, &s.error);
    assert_int_equal(s.error.status, AD_OK);
    assert_true(s.diagnosis.n_warnings > 0 && !s.diagnosis.has_horizon);
    assert_close(s.diagnosis.mass_condition, 1, 1e-12, 0);
    end(&s);
    settings = (struct phys_motion_settings){
        .size = sizeof(struct phys_motion_settings), .time = 60, .no_reference = true};
    solve(&s, "dblpend", &settings);
    phys_motion_diagnose(&settings, &s.motion, 1e-6, &s.diagnosis, &s.error);
    assert_int_equal(s.error.status, AD_OK);
    assert_true(s.diagnosis.has_horizon && s.diagnosis.chaos.megno > 2);
    assert_true(isnan(s.diagnosis.error_before));
    end(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_drift_is_that_of_the_samples_too),
        cmocka_unit_test(an_error_asked_for_is_met),
        cmocka_unit_test(conservation_is_looked_at_beside_the_motion),
        cmocka_unit_test(an_error_counts_the_rounding_of_the_start),
        cmocka_unit_test(the_clock_does_not_drift),
        cmocka_unit_test(a_small_coordinate_is_judged_by_its_own_size),
        cmocka_unit_test(an_error_that_both_runs_share_is_seen_on_the_way_back),
        cmocka_unit_test(defaults_follow_the_scenes_start_or_a_given_one),
        cmocka_unit_test(an_error_does_not_depend_on_the_samples),
        cmocka_unit_test(what_is_out_of_reach_is_an_error),
        cmocka_unit_test(an_interruption_keeps_what_was_reached),
        cmocka_unit_test(diagnoses_name_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
