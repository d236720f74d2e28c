/* Paths for the tests of ranks (path_jobs.h). */
#include "path_jobs.h"
#include "tests/close.h"
#include "tests/physics/systems.h"

#include <stdlib.h>

const struct path_task path_tasks[PATH_TASKS] = {
    {"pendulum", "left", 100, 0, 0.3, false},        {"pendulum", "gauss3", 30, 4, 0.1, false},
    {"dblpend", "midpoint", 101, 0, 0.02, false},    {"threebody", "gauss2", 61, 0.5, 0.001, false},
    {"sine-gordon", "gauss2", 21, 0.2, 0.001, true},
};

void path_job_copy_share(const struct path_job *j, const struct phys_path_share *s, double *share,
                         double *whole, bool back)
{
    size_t dof = j->system.dof, n = j->settings.slices;
    for (size_t row = 0; row < j->rows; row++)
        for (size_t i = 0; i + (row >= dof) < s->slices; i++) {
            double *in = share + row * s->slices + i, *out = whole + row * n + s->first + i;
            *(back ? out : in) = *(back ? in : out);
        }
}

void path_job_work(void *context, struct ad_ranks *ranks)
{
    struct path_job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct phys_path_share share;
    if (phys_path_share(ranks, rank, j->settings.slices, &share, error) != AD_OK)
        return;
    double *path = calloc(2 * j->rows * share.slices, sizeof *path);
    double *gradient = path + j->rows * share.slices;
    path_job_copy_share(j, &share, path, (double *)j->start, false);
    phys_path_ranks_gradient(ranks, &j->system, &j->settings, path, gradient, &j->figures[rank],
                             error);
    phys_path_ranks_solve(ranks, j->solver, &j->system, &j->settings, path, &j->info[rank], error);
    phys_path_ranks_spectrum(ranks, &j->system, &j->settings, path, &j->spectrum[rank], error);
    path_job_copy_share(j, &share, path, j->path, true);
    path_job_copy_share(j, &share, gradient, j->gradient, true);
    free(path);
}

struct path_job path_job_of(const struct path_task *task, const char *solver)
{
    struct path_job j = {.system = system_opened(task->scene)};
    struct ad_error error = {0};
    if (task->ring) {
        system_set(&j.system, "sites", 10);
        system_set(&j.system, "ring", 1);
    }
    j.solver = phys_solver_find(solver, &error);
    j.settings = phys_path_defaults(&j.system);
    j.settings.rule = phys_rule_find(task->rule, &error);
    j.settings.slices = task->slices;
    j.settings.dt = task->dt > 0 ? task->dt : j.settings.dt;
    j.settings.steps = 40;
    j.rows = j.settings.rule->degree * j.system.dof;
    size_t n = j.rows * task->slices;
    double *start = malloc(3 * n * sizeof *start);
    j.path = start + n;
    j.gradient = j.path + n;
    enum phys_motion_of which;
    assert_int_equal(phys_path_motion(&j.system, &j.settings, NULL, 1, start, &which, &error),
                     AD_OK);
    for (size_t d = 0; d < j.system.dof; d++)
        for (size_t i = 0; i < task->slices; i++) {
            double s = (double)i / (double)(task->slices - 1);
            start[d * task->slices + i] += task->bend * s * (1 - s) * (double)(d + 1);
        }
    phys_rule_interpolate(j.settings.rule, j.system.dof, task->slices, start);
    j.start = start;
    return j;
}

void path_job_free(struct path_job *j)
{
    free((double *)j->start);
    phys_system_close(&j->system);
}

double path_job_apart(const struct path_job *j, const double *a, const double *b)
{
    size_t slices = j->settings.slices;
    double most = 0;
    for (size_t k = 0; k < j->rows * slices; k++)
        if (k < j->system.dof * slices || (k + 1) % slices != 0)
            most = fmax(most, fabs(a[k] - b[k]));
    return most;
}
