/* Settings of fits, ensembles, periodic motions and quantum runs, as test_settings.c has them of
   optimisers, paths and motions, and test_settings_networks.c of networks. */
#include "physics/fit/fit.h"
#include "physics/modes/modes.h"
#include "physics/motion/ensemble.h"
#include "physics/physics.h"
#include "physics/stability/family.h"
#include "quantum/run.h"
#include "quantum/slit.h"
#include "tests/contract/settings.h"

#include <math.h>

enum { ROWS = 12 };
static struct phys_system pendulum, free_particle;
static double t[ROWS], motion[2 * ROWS];

/* ---- physics ---- */

static struct phys_fit_data rows(void)
{
    return (struct phys_fit_data){
        .size = sizeof(struct phys_fit_data), .n = ROWS, .t = t, .x = motion};
}

static struct phys_fit_settings fit(void)
{
    static const char *const names[] = {"l"};
    return (struct phys_fit_settings){
        .size = sizeof(struct phys_fit_settings), .n_free = 1, .free = names, .tries = 1};
}

static enum ad_status fit_both(const struct phys_fit_data *data, const struct phys_fit_settings *s,
                               struct ad_error *error)
{
    struct phys_fit result;
    phys_fit_solve(&pendulum, data, s, &result, error);
    phys_fit_free(&result);
    return error->status;
}

static enum ad_status use_rows(const struct phys_fit_data *s, struct ad_error *error)
{
    const struct phys_fit_settings how = fit();
    return fit_both(s, &how, error);
}

static enum ad_status use_fit(const struct phys_fit_settings *s, struct ad_error *error)
{
    const struct phys_fit_data data = rows();
    return fit_both(&data, s, error);
}

static void test_fit(void **state)
{
    (void)state;
    wrong = 0;
    TRY(rows, use_rows, "", (void)s);
    TRY(rows, use_rows, "size", s.size = 0);
    TRY(rows, use_rows, "rows", s.n = 0);
    TRY(rows, use_rows, "t", s.t = NULL);
    TRY(rows, use_rows, "x", s.x = NULL);
    TRY(rows, use_rows, "row 1: time", s.n = 2, s.t = (double[]){NAN, 1});
    TRY(rows, use_rows, "row 2: time", s.n = 2, s.t = (double[]){1, 1});
    TRY(rows, use_rows, "row 1: trial", s.n = 2, s.trial = (size_t[]){1, 1});
    TRY(rows, use_rows, "row 2: column 1", s.x = (double[2 * ROWS]){1, 1, INFINITY, 1});
    TRY(fit, use_fit, "", (void)s);
    TRY(fit, use_fit, "size", s.size = 0);
    TRY(fit, use_fit, "free", s.free = NULL);
    TRY(fit, use_fit, "free", s.free = (const char *[]){NULL});
    TRY(fit, use_fit, "ll", s.free = (const char *[]){"ll"});
    TRY(fit, use_fit, "noise", s.noise = (double[]){NAN, 1});
    TRY(fit, use_fit, "noise", s.noise = (double[]){0, -1});
    TRY(fit, use_fit, "noise", s.noise = (double[]){INFINITY, 1});
    TRY(fit, use_fit, "held-out", s.held_out = NAN);
    TRY(fit, use_fit, "held-out", s.held_out = -.1);
    TRY(fit, use_fit, "held-out", s.held_out = 1);
    assert_int_equal(wrong, 0);
}

static struct phys_motion_settings each;
static struct phys_ensemble_settings ensemble(void)
{
    static const char *const names[] = {"theta"};
    static const double values[] = {.1, .2};
    each = (struct phys_motion_settings){.size = sizeof each, .time = .5, .no_reference = true};
    return (struct phys_ensemble_settings){.size = sizeof(struct phys_ensemble_settings),
                                           .n = 2,
                                           .n_columns = 1,
                                           .names = names,
                                           .values = values,
                                           .motion = &each};
}

static enum ad_status use_ensemble(const struct phys_ensemble_settings *s, struct ad_error *error)
{
    struct phys_ensemble result;
    phys_ensemble_solve(&pendulum, s, &result, error);
    phys_ensemble_free(&result);
    return error->status;
}

static struct phys_periodic_settings periodic(void)
{
    static const double begin[] = {1.5, 0};
    return (struct phys_periodic_settings){.size = sizeof(struct phys_periodic_settings),
                                           .x = begin,
                                           .period = 115,
                                           .hold_energy = true};
}

static enum ad_status use_periodic(const struct phys_periodic_settings *s, struct ad_error *error)
{
    struct phys_periodic found;
    phys_periodic_find(&pendulum, s, &found, error);
    phys_periodic_free(&found);
    return error->status;
}

static struct phys_family_settings family(void)
{
    const struct phys_periodic_settings first = periodic();
    return (struct phys_family_settings){.size = sizeof(struct phys_family_settings),
                                         .x = first.x,
                                         .period = first.period,
                                         .along = "period",
                                         .to = 116,
                                         .steps = 2};
}

static enum ad_status use_family(const struct phys_family_settings *s, struct ad_error *error)
{
    struct phys_family found;
    phys_family_follow(&pendulum, s, &found, error);
    phys_family_free(&found);
    return error->status;
}

static struct phys_equilibria_settings equilibria(void)
{
    return (struct phys_equilibria_settings){.size = sizeof(struct phys_equilibria_settings),
                                             .starts = 3};
}

static enum ad_status use_equilibria(const struct phys_equilibria_settings *s,
                                     struct ad_error *error)
{
    struct phys_equilibria found;
    phys_equilibria_find(&pendulum, s, &found, error);
    phys_equilibria_free(&found);
    return error->status;
}

static void test_motions(void **state)
{
    (void)state;
    wrong = 0;
    TRY(ensemble, use_ensemble, "", (void)s);
    TRY(ensemble, use_ensemble, "size", s.size = 0);
    TRY(ensemble, use_ensemble, "members", s.n = 0);
    TRY(ensemble, use_ensemble, "names", s.names = NULL);
    TRY(ensemble, use_ensemble, "names", s.names = (const char *[]){NULL});
    TRY(ensemble, use_ensemble, "phi", s.names = (const char *[]){"phi"});
    TRY(ensemble, use_ensemble, "values", s.values = NULL);
    TRY(ensemble, use_ensemble, "row 2: theta", s.values = (double[]){1, NAN});
    TRY(ensemble, use_ensemble, "motion", s.motion = NULL);
    TRY(ensemble, use_ensemble, "size", each.size = 0);
    TRY(ensemble, use_ensemble, "time", each.time = 0);
    TRY(ensemble, use_ensemble, "time", each.time = NAN);
    TRY(ensemble, use_ensemble, "time", each.time = INFINITY);
    TRY(ensemble, use_ensemble, "tolerance", each.tolerance = NAN);
    TRY(ensemble, use_ensemble, "tolerance", each.tolerance = -1);
    TRY(ensemble, use_ensemble, "error", each.error = NAN);
    TRY(ensemble, use_ensemble, "error", each.error = -1);
    TRY(periodic, use_periodic, "", (void)s);
    TRY(periodic, use_periodic, "size", s.size = 0);
    TRY(periodic, use_periodic, "x", s.x = NULL);
    TRY(periodic, use_periodic, "x[0]", s.x = (double[]){NAN, 0});
    TRY(periodic, use_periodic, "period", s.period = 0);
    TRY(periodic, use_periodic, "period", s.period = NAN);
    TRY(family, use_family, "", (void)s);
    TRY(family, use_family, "size", s.size = 0);
    TRY(family, use_family, "x", s.x = NULL);
    TRY(family, use_family, "x[1]", s.x = (double[]){1, INFINITY});
    TRY(family, use_family, "period", s.period = -1);
    TRY(family, use_family, "along", s.along = NULL);
    TRY(family, use_family, "periods", s.along = "periods");
    TRY(family, use_family, "period to inf", s.to = INFINITY);
    TRY(family, use_family, "hold", s.hold = (enum phys_family_hold)9);
    TRY(equilibria, use_equilibria, "", (void)s);
    TRY(equilibria, use_equilibria, "size", s.size = 0);
    TRY(equilibria, use_equilibria, "low", s.high = (double[]){1});
    TRY(equilibria, use_equilibria, "low", s.low = (double[]){1}, s.high = (double[]){1});
    TRY(equilibria, use_equilibria, "low", s.low = (double[]){1}, s.high = (double[]){INFINITY});
    assert_int_equal(wrong, 0);
}

/* ---- quantum ---- */

static struct qm_slice slice(void)
{
    return (struct qm_slice){.size = sizeof(struct qm_slice),
                             .system = &free_particle,
                             .grid = {-8, 8, 16},
                             .dt = 1,
                             .hbar = 1};
}

static enum ad_status use_slice(const struct qm_slice *s, struct ad_error *error)
{
    qm_propagator *p;
    qm_propagator_new(&qm_method_kernel, s, &p, error);
    qm_propagator_free(p);
    return error->status;
}

static struct qm_slice of_run;
static struct qm_gaussian packet;
static struct qm_run_settings run(void)
{
    of_run = slice();
    packet = (struct qm_gaussian){0, 1, 0};
    return (struct qm_run_settings){.size = sizeof(struct qm_run_settings),
                                    .slice = &of_run,
                                    .method = &qm_method_kernel,
                                    .steps = 2,
                                    .every = 1,
                                    .packets = 1,
                                    .packet = &packet};
}

static enum ad_status use_run(const struct qm_run_settings *s, struct ad_error *error)
{
    struct qm_run_result result;
    qm_run(s, &result, error);
    qm_run_free(&result);
    return error->status;
}

static struct qm_slit_setup slit(void) { return qm_slit_defaults(); }

static enum ad_status use_slit(const struct qm_slit_setup *s, struct ad_error *error)
{
    struct qm_slit made;
    if (error->status == AD_OK)
        qm_slit_new(s, &made, error);
    qm_slit_free(&made);
    return error->status;
}

static void test_quantum(void **state)
{
    (void)state;
    wrong = 0;
    TRY(slice, use_slice, "", (void)s);
    TRY(slice, use_slice, "size", s.size = 0);
    TRY(slice, use_slice, "system", s.system = NULL);
    TRY(slice, use_slice, "walls", s.walls = (enum qm_walls)3);
    TRY(slice, use_slice, "points", s.grid.n = 0);
    TRY(slice, use_slice, "kernel", s.grid.n = SIZE_MAX);
    TRY(slice, use_slice, "box", s.grid.low = NAN);
    TRY(slice, use_slice, "box", s.grid.high = -8);
    TRY(slice, use_slice, "absorbing", s.absorb = NAN);
    TRY(slice, use_slice, "absorbing", s.absorb = -1);
    TRY(slice, use_slice, "absorbing", s.absorb = 9);
    TRY(slice, use_slice, "dt", s.dt = 0);
    TRY(slice, use_slice, "dt", s.dt = NAN);
    TRY(slice, use_slice, "hbar", s.hbar = 0);
    TRY(slice, use_slice, "hbar", s.hbar = INFINITY);
    TRY(run, use_run, "", (void)s);
    TRY(run, use_run, "size", s.size = 0);
    TRY(run, use_run, "slice", s.slice = NULL);
    TRY(run, use_run, "method", s.method = NULL);
    TRY(run, use_run, "packets", s.packets = 0);
    TRY(run, use_run, "packet", s.packet = NULL);
    TRY(run, use_run, "packets", s.packets = SIZE_MAX);
    TRY(run, use_run, "", s.steps = 0);
    TRY(run, use_run, "steps", s.steps = SIZE_MAX);
    TRY(run, use_run, "every", s.every = 0);
    TRY(run, use_run, "squarings", s.leap = true, s.power = 2000);
    TRY(run, use_run, "packet", packet.sigma = 0);
    TRY(run, use_run, "packet", packet.sigma = NAN);
    TRY(run, use_run, "packet", packet.x = NAN);
    TRY(run, use_run, "packet", packet.p = INFINITY);
    TRY(run, use_run, "dt", of_run.dt = NAN);
    TRY(slit, use_slit, "size", s.size = 0);
    TRY(slit, use_slit, "apart", s.apart = NAN);
    TRY(slit, use_slit, "sigma", s.sigma = 0);
    TRY(slit, use_slit, "speed", s.speed = -1);
    TRY(slit, use_slit, "flight", s.flight = INFINITY);
    TRY(slit, use_slit, "m", s.mass = NAN);
    TRY(slit, use_slit, "hbar", s.hbar = 0);
    TRY(slit, use_slit, "points", s.points = 0);
    TRY(slit, use_slit, "points", s.points = SIZE_MAX);
    TRY(slit, use_slit, "steps", s.steps = 0);
    assert_int_equal(wrong, 0);
}

static int prepare(void **state)
{
    struct ad_error error = {0};
    struct phys_motion_settings how = {
        .size = sizeof how, .time = 2, .n_samples = ROWS, .no_reference = true};
    struct phys_motion_solution m = {0};
    (void)state;
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_open("freebody", &free_particle, &error);
    phys_motion_solve(&pendulum, &how, &m, &error);
    for (int k = 0; k < ROWS && error.status == AD_OK; k++) {
        t[k] = m.t[k];
        for (int i = 0; i < 2; i++)
            motion[2 * k + i] = m.x[2 * k + i];
    }
    phys_motion_solution_free(&m);
    if (error.status != AD_OK)
        print_error("%s\n", error.message);
    return error.status;
}

static int release(void **state)
{
    (void)state;
    phys_system_close(&pendulum);
    phys_system_close(&free_particle);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fit),
        cmocka_unit_test(test_motions),
        cmocka_unit_test(test_quantum),
    };
    return cmocka_run_group_tests(tests, prepare, release);
}
