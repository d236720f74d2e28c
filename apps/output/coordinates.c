/* Coordinates of a system in a picture (coordinates.h). */
#include "coordinates.h"

#include <math.h>

void coordinates_begin(struct coordinates *view, const struct phys_system *system,
                       struct range time)
{
    const struct phys_scene *scene = system->scene;
    const struct range none = {INFINITY, -INFINITY};
    if (scene->picture == PHYS_PICTURE_PLANE && system->dims >= 2)
        *view = (struct coordinates){.n = system->bodies,
                                     .step = system->dims,
                                     .plane = true,
                                     .x = {"x", scene->unit, none, 0},
                                     .y = {"y", scene->unit, none, 0}};
    else
        *view = (struct coordinates){
            .n = system->dof,
            .step = 1,
            .x = {"t", scene->time_unit, time, 0},
            .y = {scene->picture == PHYS_PICTURE_ANGLES ? "angle" : "coordinate", scene->unit, none,
                  0}};
}

void coordinates_widen(struct coordinates *view, size_t samples, const double *x, size_t stride,
                       size_t next)
{
    for (size_t i = 0; i < samples; i++)
        for (size_t c = 0; c < view->n; c++) {
            const double *at = x + i * next + c * view->step * stride;
            if (view->plane)
                range_widen(&view->x.range, *at);
            range_widen(&view->y.range, at[view->plane ? stride : 0]);
        }
}

void coordinates_panel(struct coordinates *view, struct figure *figure)
{
    struct axis *x = &view->x, *y = &view->y;
    y->range = range_with_margins(y->range, 0.04, 0.04);
    if (view->plane)
        x->range = range_with_margins(x->range, 0.04, 0.04);
    x->power = range_exponent(x->range);
    y->power = range_exponent(y->range);
    if (view->plane)
        x->power = y->power = x->power > y->power ? x->power : y->power;
    figure_panel(figure,
                 &(struct panel){
                     .across = *x, .up = *y, .equal = view->plane, .key = KEY_ABOVE " width -2"});
}

void coordinates_draw(const struct coordinates *view, struct figure *figure, size_t c,
                      const char *which, const struct style *style, const char *title)
{
    size_t column = 2 + c * view->step;
    figure_draw(figure, style, title, "data %s using ($%zu/1e%d):($%zu/1e%d)", which,
                view->plane ? column : 1, view->x.power, column + view->plane, view->y.power);
}
