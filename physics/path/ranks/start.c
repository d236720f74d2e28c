/* Starts of paths over ranks (path_ranks.h). Every rank follows the whole motion, as there is no
   way to begin in its middle, and keeps its share of it. */
#include "blocks.h"
#include "autodiff/free.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double TOLERANCE = 1e-13; /* of a step of the motion */

struct sampler {
    const struct phys_path_settings *settings;
    struct phys_path_share share;
    struct phys_rule_table table;
    size_t dof, next;     /* number of the sample to come */
    double *path;         /* share; NULL: the ends alone */
    double *before;       /* [2 dof] the sample before */
    double *first, *last; /* [dof] ends of the motion */
};

/* Inner nodes of the element before sample y, on the cubic by both ends' places and velocities. */
static void place_nodes(const struct sampler *s, size_t column, const double *y)
{
    const double dt = s->settings->dt, *x = s->before;
    for (size_t a = 1; a < s->table.degree; a++) {
        double u = s->table.node[a], w = 1 - u;
        for (size_t d = 0; d < s->dof; d++)
            s->path[(a * s->dof + d) * s->share.slices + column] =
                w * w * (1 + 2 * u) * x[d] + u * u * (1 + 2 * w) * y[d] +
                dt * u * w * (w * x[s->dof + d] - u * y[s->dof + d]);
    }
}

static bool take_sample(void *context, double t, const double *y)
{
    struct sampler *s = context;
    size_t i = s->next++, first = s->share.first, dof = s->dof;
    (void)t;
    if (s->path && i >= first && i < first + s->share.slices) {
        for (size_t d = 0; d < dof; d++)
            s->path[d * s->share.slices + i - first] = y[d];
        if (i > first)
            place_nodes(s, i - first - 1, y);
    }
    memcpy(s->before, y, 2 * dof * sizeof *y);
    memcpy(i ? s->last : s->first, y, dof * sizeof *y);
    return true;
}

/* proceed has the caller's context. */
static bool goes_on(void *context)
{
    const struct sampler *s = context;
    return !s->settings->proceed || s->settings->proceed(s->settings->context);
}

static enum ad_status follow(struct sampler *s, const struct phys_system *system, uint64_t seed,
                             struct ad_error *error)
{
    const struct phys_scene *scene = system->scene;
    const struct phys_path_settings *settings = s->settings;
    struct phys_ode ode = {0};
    struct phys_simulation_info info = {0};
    struct phys_simulation how =
        phys_simulation_of(phys_integrator_find("dop853", error), TOLERANCE,
                           (double)(settings->slices - 1) * settings->dt);
    double *q = malloc(4 * s->dof * sizeof *q), *v = q ? q + s->dof : NULL, *y = q ? v + s->dof : q;
    how.n_samples = s->path ? settings->slices - 1 : 1;
    how.sample = take_sample;
    how.context = s;
    how.proceed = goes_on;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!scene->start)
        ad_fail(error, AD_E_ARGUMENT, "scene %s has no motion to begin with; give both ends",
                scene->name);
    else if (scene->start(system->params, seed, q, v, error) == AD_OK &&
             phys_ode_for(system, how.integrator, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, 0, q, v, y, error) == AD_OK &&
             phys_simulate(&how, &ode, y, &info, error) == AD_OK &&
             info.stop == PHYS_SIMULATION_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted at t = %g", info.t);
    phys_ode_free(&ode);
    free(q);
    return error->status;
}

/* Adds a line from `first` to `last` [dof each] to the share. */
static void add_line(const struct sampler *s, const double *first, const double *last)
{
    const double elements = (double)(s->settings->slices - 1);
    for (size_t row = 0; row < s->table.degree * s->dof; row++)
        for (size_t i = 0; i < s->share.slices; i++) {
            double at = (double)(s->share.first + i) + s->table.node[row / s->dof];
            double u = at / elements, w = 1 - u;
            size_t d = row % s->dof;
            s->path[row * s->share.slices + i] += w * first[d] + u * last[d];
        }
}

static enum ad_status begin(struct sampler *s, const struct phys_system *system, uint64_t seed,
                            bool line, const double *ends, struct ad_error *error)
{
    double *path = s->path, *first = s->first, *last = s->last;
    const size_t dof = s->dof, n = s->table.degree * dof * s->share.slices;
    memset(path, 0, n * sizeof *path);
    memset(first, 0, 2 * dof * sizeof *first);
    s->path = line ? NULL : path;
    if (!(line && ends) && follow(s, system, seed, error) != AD_OK)
        return error->status;
    s->path = path;
    for (size_t d = 0; d < dof && (line || ends); d++) { /* a line between them, or by the rest */
        first[d] = ends ? ends[2 * d] - (line ? 0 : first[d]) : first[d];
        last[d] = ends ? ends[2 * d + 1] - (line ? 0 : last[d]) : last[d];
    }
    if (line || ends)
        add_line(s, first, last);
    for (size_t d = 0; d < dof && ends; d++) { /* to the last bit */
        if (s->share.first == 0)
            path[d * s->share.slices] = ends[2 * d];
        if (s->share.first + s->share.slices == s->settings->slices)
            path[(d + 1) * s->share.slices - 1] = ends[2 * d + 1];
    }
    for (size_t row = dof; row < s->table.degree * dof; row++) /* unused, but finite */
        path[(row + 1) * s->share.slices - 1] = path[(row % dof + 1) * s->share.slices - 1];
    return AD_OK;
}

enum ad_status phys_path_ranks_start(struct ad_ranks *ranks, const struct phys_system *system,
                                     const struct phys_path_settings *settings, uint64_t seed,
                                     bool line, const double *ends, double *path,
                                     struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, settings, path) ||
        (ranks && ad_ranks_check(ranks, error) != AD_OK))
        return error->status;
    PHYS_OWN_PATH(settings, error);
    struct sampler s = {.settings = settings, .dof = system->dof, .path = path};
    if (AD_LACKS(error, settings->rule) ||
        phys_path_share(ranks, ranks ? ranks->rank : 0, settings->slices, &s.share, error) != AD_OK)
        return error->status;
    settings->rule->fill(settings->rule, &s.table);
    s.before = malloc(4 * s.dof * sizeof *s.before);
    if (s.before) {
        s.first = s.before + 2 * s.dof;
        s.last = s.first + s.dof;
        begin(&s, system, seed, line, ends, error);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    free(s.before);
    return ad_ranks_agree(ranks, error);
}
