/* Room, recording and factors of Newton's method for one grid (newton.h). */
#include "newton.h"
#include "spectrum.h"

#include <stdlib.h>
#include <unistd.h>

/* Refuses problems that need more than half of the memory. */
static enum ad_status check_memory(const struct phys_system *system,
                                   const struct phys_path_settings *settings, double bytes,
                                   struct ad_error *error)
{
    const double small = 1e7; /* every machine has it, and the question takes longer than a path */
    long pages = bytes < small ? 0 : sysconf(_SC_PHYS_PAGES);
    double memory = (double)pages * (double)sysconf(_SC_PAGESIZE);
    if (pages <= 0 || bytes <= 0.5 * memory)
        return AD_OK;
    return ad_fail(
        error, AD_E_ARGUMENT,
        "newton: second derivatives of %zu coordinates at %zu slices take about %.3g GB, "
        "expected half of the memory, %.3g GB, or less; try solver lbfgs or adam, or "
        "fewer coordinates or slices",
        system->dof, settings->slices, 1e-9 * bytes, 0.5e-9 * memory);
}

/* Action and gradient from a recording of the path, or with the Hessian's from L at its points. */
static enum ad_status record(struct phys_newton *s, const struct phys_system *system,
                             struct phys_derivatives *of, struct ad_error *error)
{
    const struct phys_path_settings *settings = &s->settings;
    size_t slices = settings->slices;
    double dt = settings->dt;
    bool over = of || settings->mesh;
    if (!over && phys_path_program_new(&s->path, system, settings, NULL, error) != AD_OK)
        return error->status;
    if (of)
        phys_hessian_over(&s->hessian, of, settings->rule, slices, dt, error);
    else
        phys_hessian_new(&s->hessian, system, settings->rule, slices, dt,
                         over ? NULL : &s->path.action, error);
    if (over && error->status == AD_OK)
        phys_path_program_over(&s->path, system, settings, &s->hessian, error);
    return error->status;
}

enum ad_status phys_newton_new(struct phys_newton *s, const struct phys_system *system,
                               const struct phys_path_settings *settings,
                               struct phys_derivatives *of, struct ad_error *error)
{
    size_t hold = settings->hold ? settings->hold : 1;
    double bodies = system->scene->per_body ? (double)system->bodies : 1;
    *s = (struct phys_newton){.settings = *settings,
                              .unit = settings->dt * (double)settings->slices * bodies};
    s->settings.reference = NULL;
    if (settings->energy_weight != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "newton: energy weight %g, expected 0: it finds the stationary path of the "
                       "action itself",
                       settings->energy_weight);
    /* at least: an entry of each pair of nodes */
    const double dof = (double)system->dof, nodes = (double)settings->rule->degree + 1;
    const double entries = sizeof(double) * nodes * nodes * dof * (double)settings->slices;
    if (check_memory(system, settings, entries, error) != AD_OK)
        return error->status;
    if (record(s, system, of, error) != AD_OK)
        return error->status;
    phys_hessian_settings(&s->hessian, settings);
    if (phys_surface_new(system, &s->hessian, &s->path.surface, error) != AD_OK)
        return error->status;
    struct phys_surface *surface = s->path.surface;
    phys_ends_of_surface(surface, &s->tangent_ends);
    if (phys_newton_system_new(&s->band, surface ? &surface->tangent : &s->hessian, hold, error) !=
            AD_OK ||
        (surface && phys_newton_system_new(&s->whole, &s->hessian, hold, error) != AD_OK))
        return error->status;
    const double bytes = (double)phys_hessian_size(&s->hessian) * sizeof(double) +
                         phys_newton_system_bytes(&s->band);
    if (check_memory(system, settings, bytes, error) != AD_OK)
        return error->status;
    if (surface)
        s->settings.adam_steps = 0;
    s->hessian.proceed = settings->proceed;
    s->hessian.context = settings->context;
    if (settings->native && !of)
        phys_derivatives_native(s->hessian.of);
    s->gradient = malloc(5 * s->path.n * sizeof *s->gradient);
    if (!s->gradient)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->before = s->gradient + s->path.n;
    s->step = s->before + s->path.n;
    s->tangent = s->step + s->path.n;
    s->at = s->tangent + s->path.n;
    return AD_OK;
}

void phys_newton_free(struct phys_newton *s)
{
    free(s->gradient);
    phys_newton_system_free(&s->band);
    phys_newton_system_free(&s->whole);
    phys_surface_free(s->path.surface);
    phys_hessian_free(&s->hessian);
    phys_path_program_free(&s->path);
    *s = (struct phys_newton){0};
}
