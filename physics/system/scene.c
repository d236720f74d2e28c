/* Opens scenes by name, and sets their parameters. */
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Degrees of freedom, bodies and dimensions follow from the parameters. */
static bool measure(struct phys_system *system)
{
    const struct phys_scene *scene = system->scene;
    size_t dof = scene->dof ? scene->dof : scene->dof_of(system->params);
    size_t dims = scene->dims ? scene->dims : scene->dims_of(system->params);
    if (!dof || !dims || dof % dims)
        return false;
    system->dof = dof;
    system->dims = dims;
    system->bodies = dof / dims;
    return true;
}

static bool is_file(const char *name)
{
    size_t n = strlen(name);
    return strchr(name, '/') || (n > 3 && strcmp(name + n - 3, ".so") == 0);
}

static enum ad_status find_scene(const char *name, struct phys_system *system,
                                 struct ad_error *error)
{
    if (is_file(name)) {
        system->close = phys_library_close;
        return phys_library_open(name, &system->library, &system->scene, error);
    }
    const char *names[PHYS_SCENES_MOST];
    size_t n = 0;
    for (; phys_scenes[n]; n++)
        names[n] = phys_scenes[n]->name;
    size_t k = phys_find("scene", name, n, names, error);
    if (k == n)
        return AD_E_ARGUMENT;
    system->scene = phys_scenes[k];
    return AD_OK;
}

/* A column of the motion is its name alone: t, energy, coordinates with and without v_ and
   reaction_, parameters and observables differ. */
static bool is_taken(const struct phys_system *system, size_t observable)
{
    const struct phys_scene *scene = system->scene;
    const char *name = scene->observables[observable].name;
    static const char *const prefixes[] = {"", "v_", "reaction_"};
    char coordinate[64];
    if (!strcmp(name, phys_time_name(system)) || !strcmp(name, "energy") || !strcmp(name, "error"))
        return true;
    for (size_t k = 0; k < observable; k++)
        if (!strcmp(name, scene->observables[k].name))
            return true;
    for (size_t k = 0; k < scene->n_params; k++)
        if (!strcmp(name, scene->params[k].name))
            return true;
    for (size_t k = 0; k < system->dof; k++) {
        phys_coordinate_name(system, k, coordinate, sizeof coordinate);
        for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++)
            if (!strncmp(name, prefixes[i], strlen(prefixes[i])) &&
                !strcmp(name + strlen(prefixes[i]), coordinate))
                return true;
    }
    return false;
}

static enum ad_status check_observables(const struct phys_system *system, struct ad_error *error)
{
    const struct phys_scene *scene = system->scene;
    for (size_t k = 0; k < scene->n_observables; k++) {
        const char *name = scene->observables[k].name;
        if (!*name || strlen(name) > 60 || strpbrk(name, ",\"=<>: "))
            return ad_fail(error, AD_E_INPUT,
                           "%s: an observable cannot be named '%.60s'; expected up to 60 letters, "
                           "without spaces and , \" = < > :",
                           scene->name, name);
        if (is_taken(system, k))
            return ad_fail(error, AD_E_INPUT,
                           "%s: observable %s has the name of a coordinate, a velocity, a "
                           "parameter, t, energy, error, or another observable; expected one of "
                           "its own",
                           scene->name, name);
    }
    return AD_OK;
}

/* Columns of a motion have one name each, of coordinates, their velocities and reactions, and what
   is beside them. */
static enum ad_status check_coordinates(const struct phys_system *system, struct ad_error *error)
{
    static const char *const taken[] = {"energy", "error", "row", "trial"};
    static const char *const prefixes[] = {"", "v_", "reaction_"};
    char a[64], b[64];
    const struct phys_scene *scene = system->scene;
    for (size_t k = 0; scene->coordinates && k < system->dof; k++) {
        const char *same = NULL;
        phys_coordinate_name(system, k, a, sizeof a);
        for (size_t j = 0; j < sizeof taken / sizeof *taken; j++)
            same = strcmp(a, taken[j]) ? same : "what stands beside coordinates in tables";
        if (!strcmp(a, "time") && !strcmp(phys_time_name(system), "time"))
            same = "the time, as another is called t";
        for (size_t j = 0; j < system->dof; j++)
            for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++) {
                phys_coordinate_name(system, j, b, sizeof b);
                if (j != k && !strncmp(a, prefixes[i], strlen(prefixes[i])) &&
                    !strcmp(a + strlen(prefixes[i]), b))
                    same = "another, or of its velocity or reaction";
            }
        if (same)
            return ad_fail(error, AD_E_INPUT,
                           "%s: coordinate %s has the name of %s; expected one of its own",
                           scene->name, a, same);
    }
    return AD_OK;
}

enum ad_status phys_system_begin(struct phys_system *system, const struct phys_scene *scene,
                                 struct ad_error *error)
{
    system->scene = scene;
    system->params = calloc(1, scene->params_bytes + 1);
    if (!system->params)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < scene->n_params; k++)
        *phys_param_value(system, k) = scene->params[k].value;
    if (!measure(system))
        return ad_fail(error, AD_E_INPUT, "%s: the default parameters are invalid", scene->name);
    return check_coordinates(system, error) == AD_OK ? check_observables(system, error)
                                                     : error->status;
}

enum ad_status phys_system_open(const char *name, struct phys_system *system,
                                struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, system) || AD_LACKS(error, name))
        return error->status;
    enum ad_status status = find_scene(name, system, error);
    return status == AD_OK ? phys_system_begin(system, system->scene, error) : status;
}

enum ad_status phys_system_make(const struct phys_scene *scene, struct phys_system *system,
                                struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, system))
        return error->status;
    const char *flaw = scene ? phys_scene_flaw(scene) : "is missing (NULL)";
    return flaw ? ad_fail(error, AD_E_INPUT, "a scene %s", flaw)
                : phys_system_begin(system, scene, error);
}

void phys_system_close(struct phys_system *system)
{
    if (!system)
        return;
    free(system->params);
    if (system->close)
        system->close(system->library);
    *system = (struct phys_system){0};
}

enum ad_status phys_system_set(struct phys_system *system, const char *name, double value,
                               struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene))
        return error->status;
    const struct phys_scene *scene = system->scene;
    const size_t k = phys_param_find(system, name, error);
    if (k == SIZE_MAX)
        return AD_E_ARGUMENT;
    if (!isfinite(value))
        return ad_fail(error, AD_E_ARGUMENT, "%s: %s is %g, expected a finite number", scene->name,
                       name, value);
    double before = *phys_param_value(system, k);
    *phys_param_value(system, k) = value;
    if (measure(system))
        return AD_OK;
    *phys_param_value(system, k) = before;
    return ad_fail(error, AD_E_ARGUMENT, "%s: invalid %s = %g (%s)", scene->name, name, value,
                   scene->params[k].what);
}

enum ad_status phys_system_set_all(struct phys_system *system, size_t n,
                                   const struct phys_setting set[], struct ad_error *error)
{
    if (n > 0 && AD_LACKS(error, set))
        return error->status;
    for (size_t k = 0; k < n; k++)
        if (phys_system_set(system, set[k].name, set[k].value, error) != AD_OK)
            return error->status;
    return AD_OK;
}

double phys_system_get(const struct phys_system *system, const char *name)
{
    for (size_t k = 0; system && system->scene && name && k < system->scene->n_params; k++)
        if (strcmp(system->scene->params[k].name, name) == 0)
            return *phys_param_value(system, k);
    return (double)NAN;
}

void phys_coordinate_name(const struct phys_system *system, size_t k, char *name, size_t size)
{
    if (!name)
        return;
    if (!system || k >= system->dof) {
        snprintf(name, size, "?");
        return;
    }
    const struct phys_scene *scene = system->scene;
    size_t body = k / system->dims, axis = k % system->dims;
    if (scene->coordinates)
        snprintf(name, size, "%s", scene->coordinates[k]);
    else if (axis > 2)
        snprintf(name, size, "q%zu", k + 1);
    else if (scene->body_name)
        snprintf(name, size, "%c_%s", "xyz"[axis], scene -> body_name(system->params, body));
    else
        snprintf(name, size, "%c%zu", "xyz"[axis], body + 1);
}

const char *phys_time_name(const struct phys_system *system)
{
    char name[64];
    for (size_t k = 0; system && system->scene && system->scene->coordinates && k < system->dof;
         k++) {
        phys_coordinate_name(system, k, name, sizeof name);
        if (!strcmp(name, "t"))
            return "time";
    }
    return "t";
}
