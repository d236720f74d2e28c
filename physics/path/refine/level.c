/* One level of a refinement: its elements, its start, and its path. */
#include "internal.h"
#include "autodiff/free.h"
#include "physics/path/ends.h"
#include "physics/path/mesh.h"

#include <stdlib.h>
#include <string.h>

enum { UNPLACED = 64 }; /* even elements that should do to tell where the path is steep */
/* Times that elements are placed anew: a path that asks for more is singular. */
enum { MOST_PLACED = 4 };
static const double WORTH = 3; /* times fewer elements, for which they are placed anew */

enum ad_status phys_climb_mesh(struct phys_climb *c, struct ad_error *error)
{
    const struct phys_stage *before = &c->before;
    const struct phys_grid *from = before->path ? &before->grid : &c->given;
    struct phys_stage *here = &c->here;
    size_t dof = c->system->dof, n = here->grid.slices;
    double gain = 0;
    if (before->path && (phys_climb_settled(c, before) || n > UNPLACED) && from->rule->degree > 1 &&
        !c->system->scene->between)
        phys_mesh_place(from, before->path, c->unit, dof, 0, NULL, &gain, error);
    here->apart = gain > WORTH && !before->apart &&
                  2 * (n - 1) <= PHYS_FINEST; /* the next is compared with it */
    c->to->singular = here->apart && c->placed++ == MOST_PLACED;
    if (c->to->singular)
        return ad_fail(
            error, AD_E_ACCURACY,
            "error %g is out of reach: the path is singular, as at a collision, or "
            "nearly: %zu elements placed where it is steep do not resolve it; try another "
            "start, or other ends",
            c->tolerance, from->slices - 1);
    if (here->apart && !(here->mesh = malloc(n * sizeof *here->mesh)))
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    else if (here->apart)
        phys_mesh_place(from, before->path, c->unit, dof, n - 1, here->mesh, &gain, error);
    else if (from->mesh)
        here->mesh = phys_mesh_divide(from->mesh, from->slices, n, error);
    here->grid.mesh = here->mesh;
    return error->status;
}

/* Start and settings of c->here, whose grid is set: from the level before (`again`), or from the
   guess. */
static enum ad_status begin(struct phys_climb *c, bool again, struct ad_error *error)
{
    struct phys_stage *stage = &c->here;
    struct phys_path_settings *settings = c->to->settings;
    size_t dof = c->system->dof, n = stage->grid.slices, m = c->given.slices;
    struct phys_grid from = again ? c->before.grid : c->given;
    from.dt = stage->grid.dt * (double)(n - 1) / (double)(from.slices - 1); /* a free time is new */
    AD_FREE(stage->start, stage->path);
    stage->path = NULL;
    stage->start =
        phys_path_resample(&from, again ? c->before.path : c->guess, &stage->grid, dof, error);
    size_t bytes = stage->grid.rule->degree * dof * n * sizeof *stage->path;
    stage->path = stage->start ? malloc(bytes) : NULL;
    if (!stage->path)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    for (size_t k = 0; k < dof; k++)
        for (size_t end = 0; end < 2; end++)
            if (!phys_end_moves(settings->ends, end, k))
                stage->start[k * n + end * (n - 1)] = c->guess[k * m + end * (m - 1)];
    memcpy(stage->path, stage->start, bytes);
    settings->rule = stage->grid.rule;
    settings->slices = n;
    settings->dt = stage->grid.dt;
    settings->mesh = stage->grid.mesh;
    settings->adam_steps = again ? 0 : c->adam_steps;
    return AD_OK;
}

/* Once two levels agree on which path it is, or where several from the guess did not. */
static bool goes_on(const struct phys_climb *c)
{
    return phys_climb_settled(c, &c->before) || (c->before.path && c->to->n > PHYS_CLIMB_PARTED);
}

/* From the level before also where Newton's method converges from there to a path nearby. */
static enum ad_status solve(struct phys_climb *c, struct phys_path_info *info,
                            struct ad_error *error)
{
    struct phys_path_settings *settings = c->to->settings;
    struct phys_newton *newton = &c->newton;
    const bool on = goes_on(c), tried = !on && c->sparing && c->before.path;
    phys_newton_free(newton);
    if (begin(c, on || tried, error) != AD_OK ||
        phys_path_check(&phys_solver_newton, c->system, settings, c->here.path, info, &c->lost) !=
            AD_OK ||
        phys_newton_new(newton, c->system, settings, c->to->of, &c->lost) != AD_OK ||
        (tried && !phys_newton_converges(newton, c->here.path) && begin(c, false, error) != AD_OK))
        return error->status;
    newton->settings.adam_steps = settings->adam_steps;
    newton->sparing = c->sparing;
    newton->rough = c->rough;
    phys_newton_solve(newton, c->here.path, info, &c->lost);
    return AD_OK;
}

enum ad_status phys_climb_solve(struct phys_climb *c, struct phys_level *level,
                                struct ad_error *error)
{
    struct phys_path_info info = {0};
    struct phys_path_settings *settings = c->to->settings;
    const bool free_time = phys_climb_free_time(c);
    c->lost = (struct ad_error){0};
    if ((free_time ? begin(c, goes_on(c), error) : solve(c, &info, error)) != AD_OK)
        return error->status;
    if (free_time)
        phys_newton_free_time(c->system, settings, c->to->of, settings->ends->energy, c->here.path,
                              &info, &c->lost);
    const struct ad_error lost = c->lost;
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE &&
        !(free_time && lost.status == AD_E_ACCURACY))
        return ad_fail(error, lost.status, "%s", lost.message);
    if (info.stop == PHYS_STOP_INTERRUPTED)
        return ad_fail(error, AD_E_ACCURACY, "interrupted at %zu elements of %s", level->elements,
                       level->rule->name);
    level->seconds = info.seconds;
    level->found = lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING;
    if (level->found)
        c->here.grid.dt = settings->dt;
    return AD_OK;
}
