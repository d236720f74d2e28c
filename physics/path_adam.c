/* Descent of the action by Adam (Kingma, Ba, ICLR 2015), as published: the two end slices are held
   by a gradient of zero there, everything else moves. A step is one run of the program and one step
   of the optimiser on the program's own storage; it allocates nothing. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct descent {
    const struct phys_system *system;
    const struct phys_path_settings *settings;
    ad_tape *tape;
    ad_program *program;
    ad_optimiser *optimiser;
    struct phys_action action;
    ad_var gradient, norm;
    double *x, *g;      /* path and its gradient, the program's storage */
    double in_progress; /* seconds in the caller's progress function */
};

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- making ---- */

/* The gradient with zeros at the end slices. */
static ad_var hold_ends(ad_var g)
{
    size_t inner = ad_cols(g) - 2;
    ad_var part = ad_slice_cols(g, 1, inner);
    return ad_place(g.tape, ad_rows(g), inner + 2, 1, &part, (size_t[]){0}, (size_t[]){1});
}

static enum ad_status record(struct descent *d, struct ad_error *error)
{
    const struct phys_path_settings *s = d->settings;
    struct phys_action *a = &d->action;
    ad_var g;
    if (phys_action_record(d->tape, d->system, s->rule, s->slices, s->dt, s->energy_weight, a) !=
            AD_OK ||
        ad_grad(a->objective, 1, &a->path, &g) != AD_OK)
        return phys_tape_status(d->tape, error);
    d->gradient = ad_label(hold_ends(g), "gradient");
    d->norm = ad_sqrt(ad_sum(ad_square(d->gradient)));
    ad_var out[] = {a->objective,      a->action,       a->action_mean, a->kinetic_mean,
                    a->potential_mean, a->first_energy, d->gradient,    d->norm};
    if (ad_compile(d->tape, LENGTH(out), out, &d->program) != AD_OK)
        return phys_tape_status(d->tape, error);
    return AD_OK;
}

static enum ad_status descent_new(struct descent *d, const double *path, struct ad_error *error)
{
    const struct phys_path_settings *s = d->settings;
    d->tape = ad_tape_new(AD_F64);
    if (!d->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (record(d, error) != AD_OK)
        return error->status;
    struct ad_optimiser_settings adam = ad_optimiser_defaults(AD_ADAM);
    adam.learning_rate = s->learning_rate;
    d->optimiser = ad_optimiser_new(&adam, AD_F64, d->system->dof * s->slices);
    if (!d->optimiser)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_set_threads(d->program, s->threads > 1 ? s->threads : 1);
    ad_set(d->program, d->action.path, path);
    d->x = ad_data(d->program, d->action.path);
    d->g = ad_data(d->program, d->gradient);
    return AD_OK;
}

static void descent_free(struct descent *d)
{
    ad_optimiser_free(d->optimiser);
    ad_program_free(d->program);
    ad_tape_free(d->tape);
}

/* ---- stopping at values that are not finite ---- */

static bool first_nonfinite(const double *x, size_t dof, size_t slices, size_t *k, size_t *i)
{
    for (*i = 0; *i < slices; ++*i)
        for (*k = 0; *k < dof; ++*k)
            if (!isfinite(x[*k * slices + *i]))
                return true;
    return false;
}

static enum ad_status stop_nonfinite(struct descent *d, size_t step, struct ad_error *error)
{
    size_t slices = d->settings->slices, k, i;
    struct ad_error node = {0};
    char name[64] = "";
    if (ad_run_checked(d->program, &node) == AD_OK)
        ad_fail(&node, AD_E_NONFINITE, "a sum over the path is not finite");
    const char *what = "path";
    bool found = first_nonfinite(d->x, d->system->dof, slices, &k, &i);
    if (!found) {
        what = "gradient";
        found = first_nonfinite(d->g, d->system->dof, slices, &k, &i);
    }
    if (!found)
        return ad_fail(error, AD_E_NONFINITE, "step %zu: %s", step, node.message);
    phys_coordinate_name(d->system, k, name, sizeof name);
    return ad_fail(error, AD_E_NONFINITE, "step %zu: %s; the %s first at slice %zu, coordinate %s",
                   step, node.message, what, i, name);
}

/* ---- descending ---- */

static double value(const struct descent *d, ad_var x)
{
    double y;
    ad_get(d->program, x, &y);
    return y;
}

static struct phys_path_step measure(const struct descent *d, size_t step)
{
    return (struct phys_path_step){.step = step,
                                   .path = d->x,
                                   .action = value(d, d->action.action),
                                   .action_mean = value(d, d->action.action_mean),
                                   .kinetic_mean = value(d, d->action.kinetic_mean),
                                   .potential_mean = value(d, d->action.potential_mean),
                                   .objective = value(d, d->action.objective),
                                   .grad_norm = value(d, d->norm)};
}

static bool carry_on(struct descent *d, const struct phys_path_step *at)
{
    const struct phys_path_settings *s = d->settings;
    if (!s->progress)
        return true;
    double before = seconds();
    bool on = s->progress(s->context, at);
    d->in_progress += seconds() - before;
    return on;
}

/* 0 while there is more to do. */
static enum phys_stop stop_reason(struct descent *d, const struct phys_path_step *at,
                                  double start_norm)
{
    if (!carry_on(d, at))
        return PHYS_STOP_INTERRUPTED;
    if (d->settings->tolerance > 0 && at->grad_norm <= d->settings->tolerance * start_norm)
        return PHYS_STOP_TOLERANCE;
    return at->step == d->settings->steps ? PHYS_STOP_STEPS : 0;
}

static enum ad_status descend(struct descent *d, struct phys_path_info *info,
                              struct ad_error *error)
{
    double start_norm = 0, start_energy;
    ad_run(d->program);
    start_energy = value(d, d->action.first_energy);
    ad_set(d->program, d->action.start_energy, &start_energy);
    for (size_t step = 0;; step++) {
        ad_run(d->program);
        struct phys_path_step at = measure(d, step);
        if (!isfinite(at.objective) || !isfinite(at.grad_norm))
            return stop_nonfinite(d, step, error);
        if (step == 0)
            start_norm = at.grad_norm;
        info->stop = stop_reason(d, &at, start_norm);
        if (info->stop) {
            *info = (struct phys_path_info){.stop = info->stop,
                                            .steps = step,
                                            .action = at.action,
                                            .action_mean = at.action_mean,
                                            .kinetic_mean = at.kinetic_mean,
                                            .potential_mean = at.potential_mean,
                                            .grad_norm = at.grad_norm};
            return AD_OK;
        }
        ad_optimiser_step(d->optimiser, d->x, d->g);
    }
}

static enum ad_status solve(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    double started = seconds();
    struct descent d = {.system = system, .settings = settings};
    if (descent_new(&d, path, error) == AD_OK && descend(&d, info, error) == AD_OK) {
        memcpy(path, d.x, system->dof * settings->slices * sizeof *path);
        info->seconds = seconds() - started - d.in_progress;
    }
    descent_free(&d);
    return error->status;
}

const struct phys_solver phys_solver_adam = {
    "adam", "descent of the action by Adam, the ends held, as published", solve};
