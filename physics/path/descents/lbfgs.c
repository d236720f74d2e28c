/* Descent of the action by limited-memory BFGS (autodiff/lbfgs.h). */
#include "physics/path/path_program.h"
#include "autodiff/lbfgs.h"

#include <stdlib.h>
#include <string.h>

struct descent {
    struct phys_path_program path;
    struct phys_path_step at; /* where it was evaluated last */
    size_t number;            /* of the step under way */
    double *x, *g;            /* [n] each, one block */
    ad_lbfgs *method;
};

static double evaluate(void *context, double *x, double *g)
{
    struct descent *d = context;
    memcpy(d->path.x, x, d->path.n * sizeof *x);
    d->at = phys_path_program_run(&d->path, d->number);
    memcpy(g, d->path.g, d->path.n * sizeof *g);
    return d->at.objective;
}

/* One step. False, and the path where it was, if the objective falls no further. */
static bool improve(struct descent *d)
{
    double value = d->at.objective;
    d->number = d->at.step + 1;
    if (ad_lbfgs_step(d->method, evaluate, d, d->path.settings->learning_rate, d->x, d->g, &value))
        return true;
    d->number--;
    evaluate(d, d->x, d->g);
    return false;
}

static enum ad_status iterate(struct descent *d, double *path, struct phys_path_info *info,
                              struct ad_error *error)
{
    const size_t bytes = d->path.n * sizeof *d->x;
    enum phys_stop stop = 0;
    memcpy(d->x, d->path.x, bytes);
    evaluate(d, d->x, d->g);
    for (;;) {
        if (phys_path_program_finite(&d->path, &d->at, error) != AD_OK)
            return error->status;
        if (!stop)
            stop = phys_path_program_report(&d->path, &d->at);
        if (stop)
            break;
        if (d->at.grad_norm == 0)
            stop = PHYS_STOP_ROUNDING;
        else if (!improve(d))
            stop = PHYS_STOP_STALLED;
    }
    phys_path_program_end(&d->path, stop, &d->at, path, info);
    return AD_OK;
}

static enum ad_status solve(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    struct descent d = {0};
    if (phys_path_program_new(&d.path, system, settings, path, error) == AD_OK &&
        phys_path_program_adam(&d.path, NULL, NULL, error) == AD_OK) {
        d.method = ad_lbfgs_new(d.path.n);
        d.x = malloc(2 * d.path.n * sizeof *d.x);
        d.g = d.x ? d.x + d.path.n : NULL;
        if (d.method && d.x)
            iterate(&d, path, info, error);
        else
            ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    ad_lbfgs_free(d.method);
    free(d.x);
    phys_path_program_free(&d.path);
    return error->status;
}

const struct phys_solver phys_solver_lbfgs = {
    "lbfgs", "descent of the action by limited-memory BFGS", solve, false};
