/* Settings of optimisers, paths and motions: an enum outside its range, a number that is not set,
   NaN, negative or too large, a pointer that is missing, is refused with the name of the setting.
 */
#include "autodiff/optim.h"
#include "physics/motion/solve.h"
#include "physics/physics.h"
#include "physics/stability/stability.h"
#include "tests/contract/settings.h"

#include <math.h>

static struct phys_system pendulum;

/* ---- autodiff ---- */

static struct ad_optimiser_settings adam(void) { return ad_optimiser_defaults(AD_ADAM); }

static enum ad_status use_adam(const struct ad_optimiser_settings *s, struct ad_error *error)
{
    ad_optimiser_free(ad_optimiser_new(s, AD_F64, 3, error));
    return error->status;
}

static void test_optimiser(void **state)
{
    (void)state;
    wrong = 0;
    TRY(adam, use_adam, "", (void)s);
    TRY(adam, use_adam, "size", s.size = 0);
    TRY(adam, use_adam, "method", s.method = (enum ad_optimiser_method)7);
    TRY(adam, use_adam, "method", s.method = (enum ad_optimiser_method) - 1);
    TRY(adam, use_adam, "learning rate", s.learning_rate = NAN);
    TRY(adam, use_adam, "learning rate", s.learning_rate = -1);
    TRY(adam, use_adam, "beta1", s.beta1 = 1);
    TRY(adam, use_adam, "beta2", s.beta2 = NAN);
    TRY(adam, use_adam, "epsilon", s.epsilon = NAN);
    TRY(adam, use_adam, "weight decay", s.weight_decay = -1);
    TRY(adam, use_adam, "least", s.least = INFINITY);
    assert_int_equal(wrong, 0);
}

/* ---- physics ---- */

static struct phys_path_settings newton(void)
{
    struct phys_path_settings s = phys_path_defaults(&pendulum);
    s.slices = 9;
    s.steps = 20;
    s.dt = .1;
    return s;
}

static enum ad_status use_newton(const struct phys_path_settings *s, struct ad_error *error)
{
    double path[16];
    for (int k = 0; k < 16; k++)
        path[k] = .01 * k;
    struct phys_path_info info;
    return phys_path_solve(phys_solver_find("newton", error), &pendulum, s, path, &info, error);
}

static enum ad_status use_descent(const struct phys_path_settings *s, struct ad_error *error)
{
    double path[16] = {0};
    struct phys_path_info info;
    path[8] = .1;
    return phys_path_solve(phys_solver_find("sgd", error), &pendulum, s, path, &info, error);
}

static void test_path(void **state)
{
    (void)state;
    wrong = 0;
    TRY(newton, use_newton, "", (void)s);
    TRY(newton, use_newton, "size", s.size = 8);
    TRY(newton, use_newton, "rule", s.rule = NULL);
    TRY(newton, use_newton, "slices", s.slices = 0);
    TRY(newton, use_newton, "slices", s.slices = SIZE_MAX);
    TRY(newton, use_newton, "time step", s.dt = 0);
    TRY(newton, use_newton, "time step", s.dt = NAN);
    TRY(newton, use_newton, "tolerance", s.tolerance = NAN);
    TRY(newton, use_newton, "tolerance", s.tolerance = -1);
    TRY(newton, use_newton, "held", s.hold = 6);
    TRY(newton, use_newton, "size", s.ends = &(struct phys_ends){0});
    TRY(newton, use_newton, "learning rate", s.adam_steps = 1, s.learning_rate = NAN);
    TRY(newton, use_descent, "learning rate", s.learning_rate = -1);
    TRY(newton, use_descent, "momentum", s.momentum = NAN);
    TRY(newton, use_descent, "momentum", s.momentum = 1);
    TRY(newton, use_descent, "energy weight", s.energy_weight = NAN);
    TRY(newton, use_newton, "mesh", s.mesh = (double[9]){0, 1, 1, 3, 4, 5, 6, 7, 8});
    assert_int_equal(wrong, 0);
}

static struct phys_continuation further(void)
{
    return (struct phys_continuation){
        .size = sizeof(struct phys_continuation), .name = "g", .from = 1, .to = 1.1};
}

static enum ad_status use_further(const struct phys_continuation *s, struct ad_error *error)
{
    struct phys_path_settings how = newton();
    double path[9];
    for (int k = 0; k < 9; k++)
        path[k] = .01 * k;
    struct phys_refined refined = {0};
    struct phys_continued continued = {0};
    phys_path_continue(&pendulum, &how, path, 0, 1e-3, s, &refined, &continued, error);
    phys_refined_free(&refined);
    phys_continued_free(&continued);
    return error->status;
}

static struct phys_simulation simulation(void)
{
    return (struct phys_simulation){.size = sizeof(struct phys_simulation),
                                    .integrator =
                                        phys_integrator_find("dop853", &(struct ad_error){0}),
                                    .t1 = .5,
                                    .rtol = 1e-6,
                                    .n_samples = 1};
}

static enum ad_status use_simulation(const struct phys_simulation *s, struct ad_error *error)
{
    struct phys_ode ode = {0};
    double y[2] = {.1, 0};
    struct phys_simulation_info info;
    phys_ode_lagrangian(&pendulum, &ode, error);
    phys_simulate(s, &ode, y, &info, error);
    phys_ode_free(&ode);
    return error->status;
}

static struct phys_motion_settings motion(void)
{
    return (struct phys_motion_settings){.size = sizeof(struct phys_motion_settings),
                                         .time = .5,
                                         .n_samples = 2,
                                         .no_reference = true};
}

static enum ad_status use_motion(const struct phys_motion_settings *s, struct ad_error *error)
{
    struct phys_motion_solution m = {0};
    phys_motion_solve(&pendulum, s, &m, error);
    phys_motion_solution_free(&m);
    return error->status;
}

static const struct phys_integrator *verlet(void)
{
    return phys_integrator_find("velocity-verlet", &(struct ad_error){0});
}

static void test_motion(void **state)
{
    (void)state;
    wrong = 0;
    TRY(further, use_further, "", (void)s);
    TRY(further, use_further, "size", s.size = 0);
    TRY(further, use_further, "name", s.name = NULL);
    TRY(further, use_further, "gg", s.name = "gg");
    TRY(further, use_further, "g", s.from = NAN);
    TRY(further, use_further, "g", s.to = NAN);
    TRY(simulation, use_simulation, "", (void)s);
    TRY(simulation, use_simulation, "size", s.size = 0);
    TRY(simulation, use_simulation, "integrator", s.integrator = NULL);
    TRY(simulation, use_simulation, "t0", s.t0 = NAN);
    TRY(simulation, use_simulation, "t1", s.t1 = INFINITY);
    TRY(simulation, use_simulation, "dt", s.dt = NAN);
    TRY(simulation, use_simulation, "dt", s.integrator = verlet());
    TRY(simulation, use_simulation, "dt", s.integrator = verlet(), s.dt = -1);
    TRY(simulation, use_simulation, "relative", s.rtol = NAN);
    TRY(simulation, use_simulation, "relative", s.rtol = 0);
    TRY(simulation, use_simulation, "absolute", s.atol = NAN);
    TRY(simulation, use_simulation, "absolute", s.atol = -1);
    TRY(simulation, use_simulation, "scale", s.scale = (double[]){1, 0});
    TRY(simulation, use_simulation, "min_step", s.min_step = NAN);
    TRY(simulation, use_simulation, "times", s.times = (double[]){7});
    TRY(simulation, use_simulation, "events", s.n_events = 1);
    TRY(motion, use_motion, "", (void)s);
    TRY(motion, use_motion, "size", s.size = 0);
    TRY(motion, use_motion, "time", s.time = NAN);
    TRY(motion, use_motion, "time", s.time = 0);
    TRY(motion, use_motion, "theta", s.q = (double[]){NAN});
    TRY(motion, use_motion, "error", s.error = NAN);
    TRY(motion, use_motion, "error", s.error = -1);
    TRY(motion, use_motion, "dt", s.dt = NAN);
    TRY(motion, use_motion, "dt", s.integrator = verlet(), s.dt = -1);
    TRY(motion, use_motion, "tolerance", s.tolerance = NAN);
    TRY(motion, use_motion, "tolerance", s.tolerance = -1);
    TRY(motion, use_motion, "crossings", s.n_crossings = 1);
    assert_int_equal(wrong, 0);
}

/* Velocities alone: the coordinates are the scene's start. */
static void test_velocities_alone(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_motion_settings s = motion();
    struct phys_motion_solution usual = {0}, m = {0};
    assert_int_equal(phys_motion_solve(&pendulum, &s, &usual, &error), AD_OK);
    s.v = (double[]){usual.x[1] + 1};
    assert_int_equal(phys_motion_solve(&pendulum, &s, &m, &error), AD_OK);
    assert_true(m.x[0] == usual.x[0] && m.x[1] == usual.x[1] + 1);
    phys_motion_solution_free(&usual);
    phys_motion_solution_free(&m);
}

static struct phys_lyapunov_settings lyapunov(void)
{
    return (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings),
                                           .t1 = 1,
                                           .tolerance = 1e-6,
                                           .known = 1e-10,
                                           .lost = 1};
}

static enum ad_status use_lyapunov(const struct phys_lyapunov_settings *s, struct ad_error *error)
{
    struct phys_ode ode = {0};
    double y[2] = {.1, 0};
    struct phys_lyapunov result;
    phys_ode_lagrangian(&pendulum, &ode, error);
    phys_lyapunov(&ode, y, s, &result, error);
    phys_ode_free(&ode);
    return error->status;
}

static void test_growth(void **state)
{
    (void)state;
    wrong = 0;
    TRY(lyapunov, use_lyapunov, "", (void)s);
    TRY(lyapunov, use_lyapunov, "size", s.size = 0);
    TRY(lyapunov, use_lyapunov, "t1", s.t1 = 0);
    TRY(lyapunov, use_lyapunov, "t0", s.t0 = NAN);
    TRY(lyapunov, use_lyapunov, "tolerance", s.tolerance = NAN);
    TRY(lyapunov, use_lyapunov, "scale", s.scale = (double[]){1, 0});
    TRY(lyapunov, use_lyapunov, "direction", s.direction = (double[]){0, 0});
    TRY(lyapunov, use_lyapunov, "known", s.known = NAN);
    TRY(lyapunov, use_lyapunov, "known", s.known = 0);
    TRY(lyapunov, use_lyapunov, "lost", s.lost = NAN);
    assert_int_equal(wrong, 0);
}
static int open_systems(void **state)
{
    struct ad_error error = {0};
    (void)state;
    return phys_system_open("pendulum", &pendulum, &error);
}

static int close_systems(void **state)
{
    (void)state;
    phys_system_close(&pendulum);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_optimiser), cmocka_unit_test(test_path),
        cmocka_unit_test(test_motion),    cmocka_unit_test(test_velocities_alone),
        cmocka_unit_test(test_growth),
    };
    return cmocka_run_group_tests(tests, open_systems, close_systems);
}
