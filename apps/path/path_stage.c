/* One level of --tol (path_stage.h). */
#include "path_stage.h"
#include "apps/interrupt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double near = 1e-2; /* of the path's size: as close as to be the same path */

static bool go_on(void *context, const struct phys_path_step *step)
{
    (void)context;
    (void)step;
    return !interrupted();
}

void stage_free(struct stage *stage)
{
    free(stage->start);
    free(stage->path);
    *stage = (struct stage){.distance = (double)NAN};
}

static void set_ends(const struct refinement *r, struct stage *stage)
{
    size_t n = stage->grid.slices;
    for (size_t k = 0; k < r->run->system.dof; k++) {
        stage->start[k * n] = r->ends[2 * k];
        stage->start[k * n + n - 1] = r->ends[2 * k + 1];
    }
}

bool stage_settled(const struct refinement *r, const struct stage *stage)
{
    return stage->path && stage->distance <= near * r->size;
}

static enum ad_status begin(struct refinement *r, struct stage *stage,
                            struct phys_path_settings *settings, struct ad_error *error)
{
    size_t dof = r->run->system.dof, slices = stage->grid.slices;
    bool settled = stage_settled(r, &r->before);
    stage->start =
        settled ? phys_path_resample(&r->before.grid, r->before.path, &stage->grid, dof, error)
                : phys_path_resample(&r->given, r->run->start, &stage->grid, dof, error);
    size_t bytes = stage->grid.rule->degree * dof * slices * sizeof *stage->path;
    stage->path = stage->start ? malloc(bytes) : NULL;
    if (!stage->path)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", slices);
    set_ends(r, stage);
    memcpy(stage->path, stage->start, bytes);
    settings->rule = stage->grid.rule;
    settings->slices = slices;
    settings->dt = stage->grid.dt;
    settings->adam_steps = stage->adam_steps = settled ? 0 : settings->adam_steps;
    return AD_OK;
}

enum ad_status stage_solve(struct refinement *r, struct path_level *level, struct ad_error *error)
{
    struct phys_path_settings settings = r->run->settings;
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    settings.progress = go_on;
    if (begin(r, &r->here, &settings, error) != AD_OK)
        return error->status;
    phys_path_solve(r->run->solver, &r->run->system, &settings, r->here.path, &info, &lost);
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE)
        return ad_fail(error, lost.status, "%s", lost.message);
    if (info.stop == PHYS_STOP_INTERRUPTED)
        return ad_fail(error, AD_E_ACCURACY, "interrupted at %zu elements of %s", level->elements,
                       level->rule->name);
    level->seconds = info.seconds;
    level->found = lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING;
    return AD_OK;
}
