/* Scenes from shared objects that export leastaction_scene; the only file that loads scene code.
   Everything a scene needs is checked here. */
#include "internal.h"
#include "physics/io/utf8.h"

#include <dlfcn.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define SYMBOL "leastaction_scene"
enum { PARAMS_MOST = 1 << 30 };

static bool parameters_fit(const struct phys_scene *s)
{
    for (size_t k = 0; k < s->n_params; k++)
        if (!s->params[k].name || s->params[k].offset > s->params_bytes ||
            s->params_bytes - s->params[k].offset < sizeof(double) ||
            s->params[k].offset % _Alignof(double) != 0)
            return false;
    return s->params_bytes < PARAMS_MOST;
}

/* They go to terminals, pictures and files. */
static bool strings_are_printable(const struct phys_scene *s)
{
    const char *const texts[] = {s->name, s->what, s->unit, s->time_unit, s->energy_unit};
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        if (!phys_utf8_is_printable(texts[k]))
            return false;
    for (size_t k = 0; s->coordinates && k < s->dof; k++)
        if (s->coordinates[k] && !phys_utf8_is_printable(s->coordinates[k]))
            return false;
    for (size_t k = 0; k < s->n_constraints; k++)
        if (!s->constraints[k] || !phys_utf8_is_printable(s->constraints[k]))
            return false;
    for (size_t k = 0; k < s->n_observables; k++)
        if (!s->observables[k].name || !s->observables[k].value ||
            !phys_utf8_is_printable(s->observables[k].name) ||
            (s->observables[k].unit && !phys_utf8_is_printable(s->observables[k].unit)))
            return false;
    for (size_t k = 0; k < s->n_params; k++)
        if (!phys_utf8_is_printable(s->params[k].name) ||
            (s->params[k].unit && !phys_utf8_is_printable(s->params[k].unit)) ||
            (s->params[k].what && !phys_utf8_is_printable(s->params[k].what)))
            return false;
    return true;
}

/* Version and size come first: they say whether the rest of the struct can be read at all. */
const char *phys_scene_flaw(const struct phys_scene *s)
{
    if (s->version != PHYS_SCENE_VERSION)
        return "made for another version of leastaction (version is not PHYS_SCENE_VERSION)";
    if (s->size != sizeof *s)
        return "made for another version of leastaction (size is not sizeof(struct phys_scene))";
    if (!s->name || !s->what)
        return "without name or description";
    if (!s->unit || !s->time_unit || !s->energy_unit)
        return "without units";
    if (!s->dof && !s->dof_of)
        return "without degrees of freedom";
    if (!s->dims && !s->dims_of)
        return "without dims, the coordinates of one body";
    if (!s->lagrangian && !(s->kinetic && s->potential))
        return "without a Lagrangian (or kinetic and potential energy)";
    if (s->ode && (s->dissipation || s->forces))
        return "with forces beside equations of motion of its own, which know nothing of them";
    if (s->free_time && (s->dissipation || s->forces || s->constraint))
        return "with forces, or constraints, whose time is free: its paths are of L alone";
    if (s->ode && s->constraint)
        return "with constraints beside equations of motion of its own, which know nothing of them";
    if (s->hamiltonian && (s->ode || s->constraint))
        return "with a Hamiltonian beside constraints or equations of motion of its own";
    if (!s->constraint != !s->n_constraints || (s->constraint && !s->constraints))
        return "with constraints but no callback, number or names of them";
    if (s->n_observables && !s->observables)
        return "with observables but no table of them";
    if (!s->start)
        return "without a start";
    if (s->slices < 3 || !(s->dt > 0) || !isfinite(s->dt))
        return "with fewer than 3 slices or a time step that is not positive";
    if ((s->n_params && !s->params) || !parameters_fit(s))
        return "with parameters that do not lie in its params struct";
    if (!strings_are_printable(s))
        return "with control characters, or bytes that are not UTF-8, in a name, unit or "
               "description";
    return NULL;
}

enum ad_status phys_library_open(const char *file, void **library, const struct phys_scene **scene,
                                 struct ad_error *error)
{
    /* A bare name would be looked for in the system's library folders. */
    char path[4096];
    int length = snprintf(path, sizeof path, "%s%s", strchr(file, '/') ? "" : "./", file);
    if (length < 0 || (size_t)length >= sizeof path)
        return ad_fail(error, AD_E_INPUT, "the path of the scene is too long");
    if (access(path, R_OK) != 0)
        return ad_fail(error, AD_E_INPUT, "%s: cannot be read: %s; expected a scene in a .so", file,
                       strerror(errno));
    if (!phys_library_is_complete(path))
        return ad_fail(error, AD_E_INPUT, "%s: not a scene: expected a complete shared object",
                       file);
    *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!*library)
        return ad_fail(error, AD_E_INPUT, "%s: not a scene: %s", file, dlerror());
    *scene = dlsym(*library, SYMBOL);
    if (!*scene)
        return ad_fail(error, AD_E_INPUT,
                       "%s: not a scene: expected it to export const struct phys_scene " SYMBOL,
                       file);
    const char *wrong = phys_scene_flaw(*scene);
    if (wrong)
        return ad_fail(error, AD_E_INPUT, "%s: a scene %s", file, wrong);
    return AD_OK;
}

void phys_library_close(void *library)
{
    if (library)
        dlclose(library);
}
