/* The columns of an ensemble: systems and starts of its members (ensemble_run.h). */
#include "autodiff/free.h"
#include "ensemble_run.h"
#include "physics/io/names.h"
#include "solving.h"

#include <math.h>
#include <string.h>

enum { NAME = 64 };

static bool is_parameter(const struct phys_scene *scene, const char *name, size_t *which)
{
    for (*which = 0; *which < scene->n_params; ++*which)
        if (strcmp(scene->params[*which].name, name) == 0)
            return true;
    return false;
}

static enum ad_status no_column(const struct phys_system *system, const char *name,
                                struct ad_error *error)
{
    const struct phys_scene *scene = system->scene;
    const size_t states = 2 * system->dof, all = states + scene->n_params;
    char(*text)[NAME] = malloc(all * sizeof *text);
    const char **names = malloc(all * sizeof *names);
    for (size_t k = 0; text && names && k < all; k++) {
        memcpy(text[k], "v_", 3);
        phys_coordinate_name(system, k % system->dof, text[k] + (k < system->dof ? 0 : 2),
                             NAME - 2);
        names[k] = k < states ? text[k] : scene->params[k - states].name;
    }
    if (text && names)
        phys_find("coordinate, velocity (v_...) or parameter", name, all, names, error);
    AD_FREE(text, names);
    return error->status == AD_OK ? ad_fail(error, AD_E_MEMORY, "out of memory") : error->status;
}

static enum ad_status find_column(const struct phys_system *system, const char *name,
                                  struct ensemble_column *column, struct ad_error *error)
{
    char coordinate[NAME];
    const bool velocity = strncmp(name, "v_", 2) == 0;
    bool found = is_parameter(system->scene, name, &column->which);
    column->kind = ENSEMBLE_PARAMETER;
    for (size_t k = 0; k < 2 * system->dof; k++) {
        phys_coordinate_name(system, k % system->dof, coordinate, sizeof coordinate);
        if ((k >= system->dof && !velocity) ||
            strcmp(coordinate, k < system->dof ? name : name + 2) != 0)
            continue;
        if (found)
            return ad_fail(error, AD_E_ARGUMENT,
                           "column '%s': both a coordinate and a parameter of %s", name,
                           system->scene->name);
        *column = (struct ensemble_column){ENSEMBLE_STATE, k};
        found = true;
    }
    return found ? AD_OK : no_column(system, name, error);
}

enum ad_status phys_ensemble_columns(struct ensemble_task *task, struct ad_error *error)
{
    const struct phys_ensemble_settings *s = task->settings;
    for (size_t c = 0; c < s->n_columns; c++) {
        struct ensemble_column *column = &task->columns[c];
        if (AD_LACKS(error, s->names[c]) ||
            find_column(task->ensemble->system, s->names[c], column, error) != AD_OK)
            return error->status;
        task->has_parameters |= column->kind == ENSEMBLE_PARAMETER;
        for (size_t b = 0; b < c; b++)
            if (task->columns[b].kind == column->kind && task->columns[b].which == column->which)
                return ad_fail(error, AD_E_ARGUMENT, "column '%s': twice, columns %zu and %zu",
                               s->names[c], b + 1, c + 1);
    }
    return AD_OK;
}

enum ad_status phys_ensemble_system(const struct ensemble_task *task, size_t member,
                                    struct phys_system *system, struct ad_error *error)
{
    const struct phys_system *given = task->ensemble->system;
    const struct phys_ensemble_settings *s = task->settings;
    struct ad_error cause = {0};
    if (phys_system_make(given->scene, system, error) != AD_OK)
        return error->status;
    memcpy(system->params, given->params, given->scene->params_bytes);
    system->dof = given->dof;
    system->bodies = given->bodies;
    system->dims = given->dims;
    for (size_t c = 0; c < s->n_columns; c++)
        if (task->columns[c].kind == ENSEMBLE_PARAMETER)
            phys_system_set(system, s->names[c], s->values[member * s->n_columns + c], &cause);
    if (cause.status != AD_OK)
        return ad_fail(error, cause.status, "row %zu: %.300s", member + 1, cause.message);
    if (system->dof != given->dof)
        return ad_fail(error, AD_E_ARGUMENT,
                       "row %zu: %zu coordinates; expected %zu as of the other members", member + 1,
                       system->dof, given->dof);
    return AD_OK;
}

enum ad_status phys_ensemble_starts(const struct ensemble_task *task, struct ad_error *error)
{
    const struct phys_ensemble_settings *s = task->settings;
    struct phys_ensemble *e = task->ensemble;
    const size_t states = 2 * e->dof;
    for (size_t i = 0; i < e->n && error->status == AD_OK; i++) {
        struct phys_system own = {0};
        double *start = e->start + states * i;
        if (i > 0 && !task->has_parameters)
            memcpy(start, e->start, states * sizeof *start);
        else if (phys_ensemble_system(task, i, &own, error) == AD_OK)
            phys_motion_start(&own, s->motion->seed, NULL, NULL, start, error);
        phys_system_close(&own);
    }
    for (size_t i = 0; i < e->n; i++)
        for (size_t c = 0; c < s->n_columns; c++) {
            const double value = s->values[i * s->n_columns + c];
            if (!isfinite(value))
                return ad_fail(error, AD_E_ARGUMENT, "row %zu: %s = %g; expected a finite number",
                               i + 1, s->names[c], value);
            if (task->columns[c].kind == ENSEMBLE_STATE)
                e->start[states * i + task->columns[c].which] = value;
        }
    return error->status;
}
