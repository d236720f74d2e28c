/* The action of a path and its gradient as one program, for all solvers (path_program.h). */
#include "path_program.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double RAN_AWAY = 1e100; /* gradients of the start */

/* ---- making ---- */

void phys_path_free_columns(const struct phys_path_settings *settings, size_t k, size_t *first,
                            size_t *count)
{
    size_t hold = settings->hold ? settings->hold : 1, slices = settings->slices;
    *first = k == 0 ? hold : hold - 1;
    *count = k == 0 ? slices - 2 * hold : slices - 2 * hold + 1;
}

/* The same where coordinates of an end move. */
static ad_var hold_given(const struct phys_path_settings *settings, size_t dof, ad_var g)
{
    size_t slices = settings->slices, n = ad_rows(g) * slices;
    double *moves = malloc(n * sizeof *moves);
    if (!moves)
        return ad_refuse(g.tape, AD_E_MEMORY, "out of memory for a path of %zu slices", slices);
    for (size_t k = 0; k < n; k++)
        moves[k] = 1;
    for (size_t d = 0; d < dof; d++)
        for (size_t end = 0; end < 2; end++)
            moves[d * slices + end * (slices - 1)] = phys_end_moves(settings->ends, end, d);
    ad_var mask = ad_const(g.tape, ad_rows(g), slices, moves);
    free(moves);
    return ad_select(mask, g, 0.0);
}

/* The gradient with zeros where the path is held. */
static ad_var hold_ends(const struct phys_path_settings *settings, size_t dof, ad_var g)
{
    if (phys_free_ends(settings))
        return hold_given(settings, dof, g);
    size_t degree = settings->rule->degree, first, count;
    ad_var part[2];
    size_t row[2] = {0, dof}, col[2];
    for (size_t k = 0; k < 2 && k < degree; k++) {
        phys_path_free_columns(settings, k, &first, &count);
        size_t rows = k == 0 ? dof : (degree - 1) * dof;
        part[k] = ad_slice_cols(ad_slice_rows(g, row[k], rows), first, count);
        col[k] = first;
    }
    return ad_place(g.tape, ad_rows(g), ad_cols(g), degree > 1 ? 2 : 1, part, row, col);
}

static enum ad_status record(struct phys_path_program *p, struct ad_error *error)
{
    const struct phys_path_settings *s = p->settings;
    struct phys_action *a = &p->action;
    ad_var g;
    phys_action_record(p->tape, p->system, s->rule, s->slices, s->dt,
                       s->energy_local ? 0 : s->energy_weight, a);
    if (s->energy_local && s->energy_weight != 0)
        phys_action_hold_energy(a, s->energy_weight);
    if (ad_grad(a->objective, 1, &a->path, &g) != AD_OK)
        return phys_tape_status(p->tape, error);
    p->whole_gradient = g;
    p->gradient = ad_label(hold_ends(s, p->system->dof, g), "gradient");
    p->norm = ad_sqrt(ad_sum(ad_square(p->gradient)));
    ad_var out[] = {a->objective, a->action, a->action_mean, a->kinetic_mean, a->potential_mean,
                    p->gradient,  p->norm,   a->first_energy /* for a penalty alone */};
    size_t n = LENGTH(out) - (s->energy_weight == 0);
    if (ad_compile(p->tape, n, out, &p->program) != AD_OK)
        return phys_tape_status(p->tape, error);
    return AD_OK;
}

static double value(const struct phys_path_program *p, ad_var x)
{
    double y;
    ad_get(p->program, x, &y);
    return y;
}

static struct phys_path_figures figures(const struct phys_path_step *at)
{
    return (struct phys_path_figures){.action = at->action,
                                      .action_mean = at->action_mean,
                                      .kinetic_mean = at->kinetic_mean,
                                      .potential_mean = at->potential_mean,
                                      .objective = at->objective,
                                      .grad_norm = at->grad_norm};
}

enum ad_status phys_path_program_new(struct phys_path_program *p, const struct phys_system *system,
                                     const struct phys_path_settings *settings, const double *path,
                                     struct ad_error *error)
{
    *p = (struct phys_path_program){.system = system,
                                    .settings = settings,
                                    .tape = ad_tape_new(AD_F64),
                                    .n = settings->rule->degree * system->dof * settings->slices,
                                    .nearest_at = (double)INFINITY,
                                    .started = ad_now()};
    if (settings->reference)
        p->nearest = malloc(p->n * sizeof *p->nearest);
    if (!p->tape || (settings->reference && !p->nearest))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_end_space_new(&p->ends, settings->ends, system->dof, error) != AD_OK ||
        record(p, error) != AD_OK)
        return error->status;
    ad_set_threads(p->program, settings->threads > 1 ? settings->threads : 1);
    p->x = ad_data(p->program, p->action.path);
    p->g = ad_data(p->program, p->gradient);
    if (settings->native)
        ad_native_lazy(p->program);
    if (path)
        phys_path_program_start(p, path);
    return AD_OK;
}

void phys_path_program_place(struct phys_path_program *p, const double *path)
{
    memcpy(p->x, path, p->n * sizeof *path);
    phys_end_space_meet_path(&p->ends, p->settings->slices, p->x);
}

void phys_path_program_start(struct phys_path_program *p, const double *path)
{
    phys_path_program_place(p, path);
    if (p->settings->energy_weight != 0) {
        ad_run(p->program);
        double start_energy = value(p, p->action.first_energy);
        ad_set(p->program, p->action.start_energy, &start_energy);
    }
    struct phys_path_step start = phys_path_program_run(p, 0);
    p->start = figures(&start);
    p->start_norm = start.grad_norm;
}

void phys_path_program_free(struct phys_path_program *p)
{
    if (p->hessian)
        free(p->x);
    ad_program_free(p->program);
    ad_program_free(p->measures);
    ad_tape_free(p->tape);
    phys_end_space_free(&p->ends);
    free(p->nearest);
}

/* ---- stopping at values that are not finite ---- */

static bool first_nonfinite(const double *x, size_t rows, size_t slices, size_t *k, size_t *i)
{
    for (*i = 0; *i < slices; ++*i)
        for (*k = 0; *k < rows; ++*k)
            if (!isfinite(x[*k * slices + *i]))
                return true;
    return false;
}

static enum ad_status stop_nonfinite(struct phys_path_program *p, size_t step,
                                     struct ad_error *error)
{
    size_t slices = p->settings->slices, rows = p->n / slices, k, i;
    struct ad_error node = {0};
    char name[64] = "";
    if (p->hessian || ad_run_checked(p->program, &node) == AD_OK)
        ad_fail(&node, AD_E_NONFINITE, "a sum over the path is not finite");
    const char *what = "path";
    bool found = first_nonfinite(p->x, rows, slices, &k, &i);
    if (!found) {
        what = "gradient";
        found = first_nonfinite(p->g, rows, slices, &k, &i);
    }
    if (!found)
        return ad_fail(error, AD_E_NONFINITE, "step %zu: %s", step, node.message);
    phys_coordinate_name(p->system, k % p->system->dof, name, sizeof name);
    return ad_fail(error, AD_E_NONFINITE, "step %zu: %s; the %s first at slice %zu, coordinate %s",
                   step, node.message, what, i, name);
}

enum ad_status phys_path_stays(size_t step, double norm, double start, struct ad_error *error)
{
    if (!(start > 0 && norm > RAN_AWAY * start))
        return AD_OK;
    return ad_fail(error, AD_E_NONFINITE,
                   "step %zu: |gradient| %.3g, %.3g at the start: the path ran away, as where the "
                   "action has no least value",
                   step, norm, start);
}

enum ad_status phys_path_program_finite(struct phys_path_program *p,
                                        const struct phys_path_step *at, struct ad_error *error)
{
    if (!isfinite(at->objective) || !isfinite(at->grad_norm))
        return stop_nonfinite(p, at->step, error);
    return phys_path_stays(at->step, at->grad_norm, p->start_norm, error);
}

/* ---- running ---- */

static struct phys_path_step run(struct phys_path_program *p, size_t step)
{
    if (p->hessian)
        return phys_path_points_run(p, step);
    ad_run(p->program);
    return (struct phys_path_step){.step = step,
                                   .path = p->x,
                                   .action = value(p, p->action.action),
                                   .action_mean = value(p, p->action.action_mean),
                                   .kinetic_mean = value(p, p->action.kinetic_mean),
                                   .potential_mean = value(p, p->action.potential_mean),
                                   .objective = value(p, p->action.objective),
                                   .grad_norm = value(p, p->norm)};
}

struct phys_path_step phys_path_program_run(struct phys_path_program *p, size_t step)
{
    p->found.step = step;
    if (p->found.path && memcmp(p->ran, p->x, p->n * sizeof *p->x) == 0)
        return p->found;
    struct phys_path_step at = run(p, step);
    if (p->surface)
        at.grad_norm = phys_surface_gradient(p->surface, p->x, p->g);
    if (p->ends.n > 0)
        at.grad_norm = phys_end_space_gradient(&p->ends, p->settings->slices, p->n, p->g);
    if (p->ran) {
        memcpy(p->ran, p->x, p->n * sizeof *p->x);
        p->found = at;
    }
    return at;
}

static bool carry_on(struct phys_path_program *p, const struct phys_path_step *at)
{
    const struct phys_path_settings *s = p->settings;
    if (!s->progress)
        return true;
    double before = ad_now();
    bool on = s->progress(s->context, at);
    p->in_progress += ad_now() - before;
    return on;
}

/* Keeps the path if it is the nearest to the reference so far; true when none nearer has come for
   long. */
static bool past_reference(struct phys_path_program *p, size_t step)
{
    size_t n = p->system->dof * p->settings->slices;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (p->x[k] - p->settings->reference[k]) * (p->x[k] - p->settings->reference[k]);
    if (sum < p->nearest_at) {
        p->nearest_at = sum;
        p->nearest_step = step;
        memcpy(p->nearest, p->x, p->n * sizeof *p->x);
    }
    return step >= p->nearest_step + PHYS_PATIENCE;
}

enum phys_stop phys_path_program_report(struct phys_path_program *p,
                                        const struct phys_path_step *at)
{
    const struct phys_path_settings *s = p->settings;
    if (!carry_on(p, at))
        return PHYS_STOP_INTERRUPTED;
    if (s->tolerance > 0 && at->grad_norm <= s->tolerance * p->start_norm)
        return PHYS_STOP_TOLERANCE;
    if (p->nearest && past_reference(p, at->step))
        return PHYS_STOP_REFERENCE;
    return at->step == s->steps ? PHYS_STOP_STEPS : 0;
}

/* Mean and drift of the energy along `path`, and its start's momentum, from the same recording. */
static void measure_path(struct phys_path_program *p, const double *path,
                         struct phys_path_info *info)
{
    struct phys_action *a = &p->action;
    double most = 0;
    if (p->hessian) {
        memcpy(p->x, path, p->n * sizeof *path); /* not that of compare */
        if (p->settings->start_momentum)
            p->found.path = NULL; /* the Hessian's gradient may be of another path */
        phys_path_program_run(p, 0);
        phys_path_points_measure(p, info);
        return;
    }
    info->energy_mean = info->energy_drift = NAN;
    if (!p->measures &&
        ad_compile(p->tape, 3, (ad_var[]){a->energy, a->energy_mean, p->whole_gradient},
                   &p->measures) != AD_OK)
        return;
    ad_program *program = p->measures;
    ad_set(program, a->path, path);
    ad_run(program);
    ad_get(program, a->energy_mean, &info->energy_mean);
    const double *E = ad_data(program, a->energy);
    for (size_t i = 1; i < ad_cols(a->energy); i++)
        most = fmax(most, fabs(E[i] - E[0]));
    info->energy_drift = E[0] != 0 ? most / fabs(E[0]) : most;
    const double *g = ad_data(program, p->whole_gradient);
    const struct phys_path_settings *settings = p->settings;
    double bodies = p->system->scene->per_body ? (double)p->system->bodies : 1;
    for (size_t k = 0; settings->start_momentum && k < p->system->dof; k++)
        settings->start_momentum[k] =
            -g[k * settings->slices] * settings->dt * (double)settings->slices * bodies;
}

static struct phys_path_figures compare(struct phys_path_program *p, const double *path)
{
    if (!path)
        return (struct phys_path_figures){NAN, NAN, NAN, NAN, NAN, NAN};
    memcpy(p->x, path, p->n * sizeof *path);
    struct phys_path_step at = phys_path_program_run(p, 0);
    return figures(&at);
}

void phys_path_program_end(struct phys_path_program *p, enum phys_stop stop,
                           const struct phys_path_step *at, double *path,
                           struct phys_path_info *info)
{
    struct phys_path_step found = *at;
    if (p->nearest && stop != PHYS_STOP_INTERRUPTED && p->nearest_step < at->step) {
        memcpy(p->x, p->nearest, p->n * sizeof *p->x);
        found = phys_path_program_run(p, p->nearest_step);
        stop = PHYS_STOP_REFERENCE;
    }
    memcpy(path, p->x, p->n * sizeof *p->x);
    phys_end_space_meet_path(&p->ends, p->settings->slices, path); /* after many steps, too */
    *info = (struct phys_path_info){.stop = stop,
                                    .steps = found.step,
                                    .seconds = ad_now() - p->started - p->in_progress,
                                    .action = found.action,
                                    .action_mean = found.action_mean,
                                    .kinetic_mean = found.kinetic_mean,
                                    .potential_mean = found.potential_mean,
                                    .grad_norm = found.grad_norm,
                                    .start = p->start};
    measure_path(p, path, info);
    info->compared = compare(p, p->settings->compare);
    snprintf(info->interpreted, sizeof info->interpreted, "%s",
             ad_native_note(p->hessian ? p->hessian->of->first : p->program));
    info->native = !*info->interpreted;
    p->started = ad_now(); /* of another path by this recording */
    p->in_progress = 0;
}
