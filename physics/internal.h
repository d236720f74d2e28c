/* Shared by the files of this folder alone. */
#ifndef PHYSICS_INTERNAL_H
#define PHYSICS_INTERNAL_H

#include "physics.h"

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

/* Hands a tape's error, if it has one, on to `error`. */
static inline enum ad_status phys_tape_status(const ad_tape *tape, struct ad_error *error)
{
    const struct ad_error *e = ad_tape_error(tape);
    return e->status == AD_OK ? AD_OK : ad_fail(error, e->status, "%s", e->message);
}

/* Refuses what was not given: an argument of NULL, or what a search that failed returned. An error
   that is already held stays. */
static inline bool phys_lacks(const void *given, const char *what, struct ad_error *error)
{
    return !given && ad_fail(error, AD_E_ARGUMENT, "got no %s (NULL)", what) != AD_OK;
}
static inline bool phys_lacks_scene(const struct phys_system *system, struct ad_error *error)
{
    return (!system || !system->scene) &&
           ad_fail(error, AD_E_ARGUMENT, "got a system without scene; expected an open one") !=
               AD_OK;
}

/* The struct phys_scene that a shared object exports; *library is for phys_library_close. */
enum ad_status phys_library_open(const char *file, void **library, const struct phys_scene **scene,
                                 struct ad_error *error);
void phys_library_close(void *library);
/* The file is a shared object and as long as it says it is. To map more of a file than there is
   ends in a signal, and the system's loader does not look. */
bool phys_library_is_whole(const char *file);
/* What is wrong with a scene from outside, or NULL. */
const char *phys_scene_flaw(const struct phys_scene *scene);
/* A system of a scene without flaw, with default parameters: the end of phys_system_open. */
enum ad_status phys_system_begin(struct phys_system *system, const struct phys_scene *scene,
                                 struct ad_error *error);

/* The system that a motion was made of. */
const struct phys_system *phys_motion_system(const phys_motion *motion);
/* The masses are constant and the accelerations depend on q and t alone. */
bool phys_motion_separates(phys_motion *motion);
/* Why its forces are interpreted (ad_native_note). */
const char *phys_motion_interpreted(const phys_motion *motion);
/* L_vv [dof x dof] at q, v [dof x 1] and t. */
ad_var phys_record_mass(const struct phys_system *system, ad_var q, ad_var v, ad_var t);

/* The name of component k of a state: a coordinate, or `what` (velocity, momentum) of one. */
void phys_state_name(const struct phys_system *system, size_t k, const char *what, char *name,
                     size_t size);

/* Whether y depends on none of x[0..n-1], whatever their values: its derivatives, looked at through
   fixed irregular weights, fold to zero when compiled. False where that cannot be found out. */
bool phys_is_independent(ad_tape *tape, ad_var y, size_t n, const ad_var x[]);

/* The built-in scenes. */
enum { PHYS_SCENES_MOST = 64 };
#define SCENE(name) extern const struct phys_scene phys_scene_##name;
#include "physics/scenes/scenes.def"
#undef SCENE

/* The action rules; the Gauss rules end with one without a name. */
#define RULE(name) extern const struct phys_rule phys_rule_##name;
#include "physics/action/rules.def"
#undef RULE
extern const struct phys_rule phys_rules_gauss[];

/* The solvers of paths. */
#define SOLVER(name) extern const struct phys_solver phys_solver_##name;
#include "physics/path/solvers.def"
#undef SOLVER

#endif
