/* Calls of the library (jobs.h). */
#include "hnn/data/data.h"
#include "hnn/hnn.h"
#include "physics/motion/ensemble.h"
#include "physics/motion/solve.h"
#include "jobs.h"
#include "physics/physics.h"
#include "physics/stability/diagnostics.h"
#include "quantum/run.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/physics/systems.h"

#include <stdlib.h>
#include <string.h>

enum { DOF = 4, ROWS = 12 };

static const double time = 1, dt = 1.0 / (ROWS - 1);
static struct phys_system kepler, pendulum;
static double q[DOF], v[DOF], x[2 * DOF], t[ROWS], states[2 * DOF * ROWS], path[DOF * ROWS];

/* ---- a call, and what frees its results ---- */

#define JOB(name) static enum ad_status name(struct ad_error *error)

/* `result` is zero where `call` did not begin. */
#define OWNS(name, type, call, release)                                                            \
    JOB(name)                                                                                      \
    {                                                                                              \
        type result = {0};                                                                         \
        enum ad_status status = call;                                                              \
        release(&result);                                                                          \
        return status;                                                                             \
    }

JOB(motion_path)
{
    double to[DOF * ROWS];
    return phys_motion_path(&kepler, NULL, q, v, ROWS, dt, to, error);
}

JOB(published_path)
{
    double to[DOF * ROWS];
    phys_motion *motion;
    enum ad_status status = phys_motion_new(&kepler, &motion, error);
    memcpy(to, path, sizeof to);
    if (error->status == AD_OK)
        status = phys_first_slices(motion, q, v, ROWS, dt, false, to, error);
    if (error->status == AD_OK)
        status = phys_ode_path(motion, ROWS, dt, 1, to, error);
    phys_motion_free(motion);
    return status;
}

JOB(open_system)
{
    struct phys_system system;
    enum ad_status status = phys_system_open("threebody", &system, error);
    phys_system_close(&system);
    return status;
}

OWNS(canonical, struct phys_ode, phys_ode_canonical(&kepler, &result, error), phys_ode_free)
OWNS(variations, struct phys_ode, phys_ode_variations(&kepler, 2, &result, error), phys_ode_free)
OWNS(task_ode, struct phys_ode, hnn_task_ode(hnn_task_find("threebody", error), 0, &result, error),
     phys_ode_free)
OWNS(task_ode_of_angles, struct phys_ode,
     hnn_task_ode(hnn_task_find("double-pendulum", error), 0, &result, error), phys_ode_free)

JOB(path_solve)
{
    struct phys_path_settings how = phys_path_defaults(&kepler);
    struct phys_path_info info;
    double to[DOF * ROWS];
    memcpy(to, path, sizeof to);
    how.slices = ROWS;
    how.dt = dt;
    return phys_path_solve(phys_solver_find("newton", error), &kepler, &how, to, &info, error);
}

JOB(path_refine)
{
    struct phys_path_settings how = phys_path_defaults(&kepler);
    struct phys_refined result;
    how.rule = NULL;
    how.slices = ROWS;
    how.dt = dt;
    enum ad_status status = phys_path_refine(&kepler, &how, path, 0, 1e-6, &result, error);
    phys_refined_free(&result);
    return status;
}

static const struct phys_motion_settings moving = {
    .size = sizeof moving, .time = 1, .error = 1e-6, .n_samples = ROWS - 1};
OWNS(motion_solve, struct phys_motion_solution, phys_motion_solve(&kepler, &moving, &result, error),
     phys_motion_solution_free)
OWNS(reference, struct phys_reference,
     phys_reference(&kepler, q, v, ROWS, t, 0.1, NULL, NULL, &result, error), phys_reference_free)
JOB(conserved)
{
    struct phys_conserved result;
    return phys_conserved(&kepler, ROWS, states, t, &result, error);
}

static const char *const shape[] = {"e"};
static const double shapes[] = {0.1, 0.2, 0.3};
static const struct phys_ensemble_settings members = {.size = sizeof members,
                                                      .n = 2,
                                                      .n_columns = 1,
                                                      .names = shape,
                                                      .values = shapes,
                                                      .motion = &moving};
OWNS(ensemble, struct phys_ensemble, phys_ensemble_solve(&kepler, &members, &result, error),
     phys_ensemble_free)

static const struct phys_fit_data data = {.size = sizeof data, .n = ROWS, .t = t, .x = states};
static const char *const mass[] = {"gm"};
static const struct phys_fit_settings fitting = {
    .size = sizeof fitting, .n_free = 1, .free = mass, .tries = 1};
OWNS(fit, struct phys_fit, phys_fit_solve(&kepler, &data, &fitting, &result, error), phys_fit_free)

OWNS(equilibria, struct phys_equilibria, phys_equilibria_find(&pendulum, NULL, &result, error),
     phys_equilibria_free)
static const struct phys_periodic_settings closing = {
    .size = sizeof closing, .x = x, .period = 6.28};
OWNS(periodic, struct phys_periodic, phys_periodic_find(&kepler, &closing, &result, error),
     phys_periodic_free)

JOB(transition)
{
    double to[4 * DOF * DOF], off[4 * DOF * DOF];
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 1};
    return phys_transition(&kepler, x, &how, to, off, error);
}

JOB(check_gradient)
{
    struct ad_check report;
    const struct phys_points at = {.size = sizeof at, .n = ROWS, .q = path, .v = path, .t = t};
    return phys_check_gradient(&kepler, &at, 2, 1e-6, 10, &report, error);
}

JOB(observe)
{
    struct hnn_observations result;
    const struct hnn_task *task = hnn_task_find("spring", error);
    struct hnn_sampling s = task->published;
    s.trials = s.points = 2;
    enum ad_status status = hnn_task_observe(task, &s, 1, &result, error);
    hnn_observations_free(&result);
    return status;
}

JOB(model)
{
    hnn_model *made = NULL;
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 2);
    struct phys_ode ode = {0};
    double rate[4 * ROWS];
    s.hidden[0] = s.hidden[1] = 3;
    enum ad_status status = hnn_model_new(&s, &made, error);
    if (error->status == AD_OK)
        status = hnn_model_evaluate(made, ROWS, states, rate, NULL, error);
    if (error->status == AD_OK)
        status = hnn_model_ode(made, &ode, error);
    phys_ode_free(&ode);
    hnn_model_free(made);
    return status;
}

JOB(mass_of_a_network)
{
    hnn_model *made = NULL;
    struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, 2);
    struct hnn_mass result;
    s.hidden[0] = s.hidden[1] = 3;
    enum ad_status status = hnn_model_new(&s, &made, error);
    if (error->status == AD_OK)
        status = hnn_model_mass(made, ROWS, states, &result, error);
    hnn_model_free(made);
    return status;
}

JOB(training)
{
    hnn_model *made = NULL;
    hnn_trainer *trainer = NULL;
    enum hnn_stop stop;
    struct hnn_settings s = hnn_defaults(HNN_BASELINE, 2);
    struct hnn_training how = hnn_training_defaults();
    const struct hnn_samples train = {.n = ROWS, .x = states, .target = states}, test = {0};
    s.hidden[0] = s.hidden[1] = 3;
    how.steps = 2;
    enum ad_status status = hnn_model_new(&s, &made, error);
    if (error->status == AD_OK)
        status = hnn_trainer_new(made, &how, &train, &test, &trainer, error);
    if (error->status == AD_OK)
        status = hnn_trainer_run(trainer, &stop, error);
    hnn_trainer_free(trainer);
    hnn_model_free(made);
    return status;
}

static ad_var quadratic(void *context, ad_var w, ad_var z)
{
    (void)context;
    return ad_mul(ad_slice_cols(w, 0, 1), ad_sum_rows(ad_square(z)));
}

JOB(own_network)
{
    hnn_model *made = NULL, *read = NULL;
    const struct path file = files_temporary("own.h5");
    const struct hnn_network network = {
        .name = "own", .size = 1, .start = (double[]){0.5}, .record = quadratic};
    const struct hnn_settings s = {.size = sizeof s,
                                   .kind = HNN_HAMILTONIAN,
                                   .dof = 1,
                                   .precision = AD_F64,
                                   .network = &network};
    enum ad_status status = hnn_model_new(&s, &made, error);
    if (error->status == AD_OK)
        status = hnn_model_save(made, file.text, NULL, error);
    if (error->status == AD_OK)
        status = hnn_model_load_network(file.text, &network, &read, error);
    hnn_model_free(made);
    hnn_model_free(read);
    return status;
}

JOB(all_paths)
{
    struct phys_solutions result;
    struct phys_path_settings how = phys_path_defaults(&pendulum);
    double line[ROWS];
    for (size_t i = 0; i < ROWS; i++)
        line[i] = 0.1 * (double)i;
    how.slices = ROWS;
    how.dt = dt;
    enum ad_status status = phys_path_all(&pendulum, &how, line, 0, 1, &result, error);
    phys_solutions_free(&result);
    return status;
}

static enum ad_status packet_by(const char *method, struct ad_error *error)
{
    const struct qm_gaussian packet = {0.1, 0.5, 0};
    const struct qm_slice slice = {
        .size = sizeof slice, .system = &pendulum, .grid = {-3, 3, 32}, .dt = 0.1, .hbar = 1};
    struct qm_run_result result;
    const struct qm_run_settings how = {.size = sizeof how,
                                        .slice = &slice,
                                        .method = qm_method_find(method, error),
                                        .steps = 2,
                                        .every = 1,
                                        .packets = 1,
                                        .packet = &packet};
    enum ad_status status = qm_run(&how, &result, error);
    qm_run_free(&result);
    return status;
}
JOB(packet_by_kernel) { return packet_by("kernel", error); }
JOB(packet_by_fft) { return packet_by("fft", error); }
JOB(packet_by_differences) { return packet_by("crank-nicolson", error); }

const struct job jobs[] = {
    {"open", open_system, 16},
    {"motion path", motion_path, 16},
    {"published", published_path, 16},
    {"canonical", canonical, 16},
    {"variations", variations, 16},
    {"task ode", task_ode, 16},
    {"angles", task_ode_of_angles, 16},
    {"path solve", path_solve, 16},
    {"refine", path_refine, 16},
    {"motion", motion_solve, 16},
    {"reference", reference, 16},
    {"conserved", conserved, 16},
    {"ensemble", ensemble, 16},
    {"fit", fit, 16},
    {"equilibria", equilibria, 16},
    {"periodic", periodic, 16},
    {"transition", transition, 16},
    {"check", check_gradient, 16},
    {"observe", observe, 16},
    {"model", model, 16},
    {"training", training, 16},
    {"mass", mass_of_a_network, 16},
    {"network", own_network, 250},
    {"all paths", all_paths, 16},
    {"kernel", packet_by_kernel, 16},
    {"fft", packet_by_fft, 16},
    {"differences", packet_by_differences, 16},
    {NULL, NULL, 0},
};

void jobs_to_the_centre(void)
{
    memset(q, 0, sizeof q);
    memset(x, 0, sizeof x);
    memset(path, 0, sizeof path);
    memset(states, 0, sizeof states);
}

int jobs_open(void **state)
{
    struct ad_error error = {0};
    if (files_setup(state) != 0)
        return -1;
    setenv("LEASTACTION_NATIVE", "0", 1); /* its sources are allocated by libc, and not counted */
    kepler = system_opened("kepler");
    pendulum = system_opened("pendulum");
    system_start(&kepler, 1, q, v);
    memcpy(x, q, 2 * sizeof *q);
    memcpy(x + 2, v, 2 * sizeof *v);
    const struct phys_motion_settings how = {.size = sizeof how,
                                             .time = time,
                                             .tolerance = 1e-12,
                                             .n_samples = ROWS - 1,
                                             .no_reference = true};
    struct phys_motion_solution m;
    if (phys_motion_solve(&kepler, &how, &m, &error) != AD_OK || m.n != ROWS)
        return -1;
    memcpy(t, m.t, sizeof t);
    memcpy(states, m.x, 4 * ROWS * sizeof *states);
    for (size_t i = 0; i < 2 * ROWS; i++)
        path[i] = m.x[i % ROWS * 4 + i / ROWS];
    phys_motion_solution_free(&m);
    return 0;
}

int jobs_close(void **state)
{
    phys_system_close(&kepler);
    phys_system_close(&pendulum);
    return files_teardown(state);
}
