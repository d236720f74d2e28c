/* For physics/ only: argument checks, scenes from shared objects. */
#ifndef PHYSICS_SYSTEM_INTERNAL_H
#define PHYSICS_SYSTEM_INTERNAL_H

#include "physics/io/names.h"
#include "system.h"

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

/* Copies a tape's error, if it has one, to `error`. */
static inline enum ad_status phys_tape_status(const ad_tape *tape, struct ad_error *error)
{
    const struct ad_error *e = ad_tape_error(tape);
    return e->status == AD_OK ? AD_OK : ad_fail(error, e->status, "%s", e->message);
}

/* Copies want of memory, where other errors `e` of a trial only say no. */
static inline enum ad_status phys_keep_memory(const struct ad_error *e, struct ad_error *error)
{
    return e->status == AD_E_MEMORY ? ad_fail(error, e->status, "%s", e->message) : AD_OK;
}

/* The struct phys_scene that a shared object exports; *library is for phys_library_close. */
enum ad_status phys_library_open(const char *file, void **library, const struct phys_scene **scene,
                                 struct ad_error *error);
void phys_library_close(void *library);
/* True if the file is a complete shared object. Mapping beyond the end of a truncated one would
   raise a signal, and the system's loader does not check. */
bool phys_library_is_complete(const char *file);
/* The defect of a scene from outside, or NULL. */
const char *phys_scene_flaw(const struct phys_scene *scene);
/* A system of a checked scene with default parameters: the end of phys_system_open. */
enum ad_status phys_system_begin(struct phys_system *system, const struct phys_scene *scene,
                                 struct ad_error *error);

/* Parameters that PHYS_PARAM gives as variables vars[n], by their places which[n] in the scene's
   table; taken[k] becomes true where one is. Of this thread; all zero: none. Returns those before.
 */
struct phys_variables {
    const struct phys_system *system;
    size_t n;
    const size_t *which;
    const ad_var *vars;
    bool *taken;
};
struct phys_variables phys_variables_bind(struct phys_variables variables);
/* Around what records on `tape` for a system: what PHYS_PARAM asks. */
void phys_recording_begin(const struct phys_system *system, ad_tape *tape);
void phys_recording_end(void);
/* A parameter's place in the scene's table; SIZE_MAX: AD_E_ARGUMENT names the nearest. */
size_t phys_param_find(const struct phys_system *system, const char *name, struct ad_error *error);
double *phys_param_value(const struct phys_system *system, size_t k);
/* AD_E_ARGUMENT, with the reason, for a parameter without derivatives (phys_param_use). */
enum ad_status phys_param_refuse(const struct phys_system *system, const char *name,
                                 struct ad_error *error);

/* Records H [1 x n] of a scene that is given by it. AD_E_SHAPE if it returns another shape. */
ad_var phys_system_hamiltonian(const struct phys_system *system, ad_var q, ad_var p, ad_var t);

/* AD_E_ARGUMENT for a scene with forces that are not in L, of which `what` ("paths") knows nothing.
 */
enum ad_status phys_refuse_forces(const struct phys_system *system, const char *what,
                                  struct ad_error *error);
/* The same for constraints. */
enum ad_status phys_refuse_constraints(const struct phys_system *system, const char *what,
                                       struct ad_error *error);

/* phys_scenes has at most so many. */
enum { PHYS_SCENES_MOST = 64 };

/* Whether L is recorded alike with the values of a and of b, where n parameters are variables: no
   condition on them comes out otherwise. */
bool phys_params_keep_form(const struct phys_system *a, const struct phys_system *b, size_t n,
                           const char *const names[], struct ad_error *error);

#endif
