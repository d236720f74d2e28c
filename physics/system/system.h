/* Scenes and systems. A scene is one const struct: a Lagrangian with its parameters, units and
   defaults. A system is a scene with parameter values. Paths are [dof x slices], row-major: row k
   is coordinate k over time.

   Numbers are in the units that a scene names. Errors: AD_E_ARGUMENT for NULL and numbers out of
   range, AD_E_MEMORY, and those named. Threads: calls may run at once unless they change one
   system or tape; callbacks of scenes must allow that. */
#ifndef PHYSICS_SYSTEM_SYSTEM_H
#define PHYSICS_SYSTEM_SYSTEM_H

#include "autodiff/autodiff.h"

AD_HEADER_BEGIN

/* L for all time slices at once. q, v: [dof x n] (row k is coordinate k), t: [1 x n]; returns
   [1 x n]. Slice i of the result may depend on slice i of the inputs only. */
typedef ad_var phys_lagrangian(ad_var q, ad_var v, ad_var t, const void *params);
/* H for all samples at once. q, p: [dof x n], t: [1 x n]; returns [1 x n]. */
typedef ad_var phys_hamiltonian(ad_var q, ad_var p, ad_var t, const void *params);
/* Holonomic constraints of all time slices at once: [n_constraints x n], 0 where they hold. */
typedef ad_var phys_constraint(ad_var q, ad_var t, const void *params);

/* Differences of all pairs of bodies as rows. q: [bodies*dims x n], body b in rows b*dims ...;
   d[k], k < dims, becomes [pairs x n] with x_k(i) - x_k(j) for i < j in lexicographic order, pairs
   = bodies*(bodies-1)/2. Uses gathers, no node per pair. AD_E_ARGUMENT for fewer than two bodies.
 */
void phys_pair_differences(ad_var q, size_t bodies, size_t dims, ad_var d[]);
/* Squared distances of all pairs plus `softening`: [pairs x n], in the same order. */
ad_var phys_pair_squares(ad_var q, size_t bodies, size_t dims, double softening);
/* The same two functions for the pairs (first[k], second[k]) only. */
void phys_listed_differences(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                             const uint32_t second[], ad_var d[]);
ad_var phys_listed_squares(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                           const uint32_t second[], double softening);

/* A parameter of a scene; `offset` is the position of its double in the scene's params struct. */
struct phys_param {
    const char *name, *unit, *what;
    double value; /* default */
    size_t offset;
};

/* In a callback: member m of its params struct as a value of the tape. A constant, and a variable
   where derivatives with respect to that parameter, or changes of it, are asked. The plain double
   params->m goes on working, as a constant. */
#define PHYS_PARAM(params, m) phys_param(&(params)->m)
ad_var phys_param(const double *at); /* *at [1]; {0} outside of a callback that records L */

/* A parameter by name. */
struct phys_setting {
    const char *name;
    double value;
};

/* The noisy start of the published code, relative to the ODE path: sigma times a standard normal
   number clipped at +-clip (0: not clipped) is added to all but the first and last three slices;
   then all but the first and last `margin` slices become scale*x + shift (margin 0: none). */
struct phys_noise {
    double sigma, clip;
    bool around_zero; /* the path between its end slices is zero before the noise */
    size_t margin;
    double scale, shift;
    size_t quiet_bodies; /* number of leading bodies without noise */
};

/* The published setting of a scene (Nature's Cost Function, arXiv 2303.02115). */
struct phys_preset {
    size_t slices, steps;
    double dt, learning_rate;
    double energy_weight; /* penalty on the change of total energy; 0: none */
    double damping;       /* velocity factor of each step of the ODE path; 1: none */
    bool euler_start;     /* the second slice is q + v dt; else the motion at dt */
    struct phys_noise noise;
    const struct phys_setting *set; /* parameters that differ from the defaults */
    size_t n_set;
};

/* A function of the motion that reports follow: [1 x n], as L is. */
struct phys_observable {
    const char *name, *unit;
    phys_lagrangian *value;
};

enum phys_picture {
    PHYS_PICTURE_TIME,  /* each coordinate against time */
    PHYS_PICTURE_PLANE, /* bodies in the plane of their first two coordinates */
    PHYS_PICTURE_ANGLES /* a chain of rods: angles from the vertical */
};

/* The version of struct phys_scene. A scene records operations by number and contains struct
   ad_var, so one built with another table of operations, ad_var or callback type is refused. Such a
   change increases the number before the plus by 0x100. */
#define PHYS_SCENE_VERSION (0x300 + AD_N_OPS)

struct phys_system;
struct phys_ode;

/* One scene: one file, one const struct. A scene outside the tree is a shared object exporting
   `const struct phys_scene leastaction_scene`. */
struct phys_scene {
    uint32_t version; /* PHYS_SCENE_VERSION */
    uint32_t size;    /* sizeof(struct phys_scene) */
    const char *name, *what;

    size_t dof;                           /* 0: dof_of(params) */
    size_t (*dof_of)(const void *params); /* 0: the parameters are invalid together */
    size_t dims;                          /* coordinates of one body; 0: dims_of(params) */
    size_t (*dims_of)(const void *params);
    const char *const *coordinates; /* dof names; NULL: x1 y1 (z1) x2 ... */
    const char *(*body_name)(const void *params, size_t body); /* x_NAME for x1; NULL: numbers */
    const char *unit, *time_unit, *energy_unit;

    const struct phys_param *params; /* table of n_params */
    size_t n_params, params_bytes;   /* bytes of the params struct */

    phys_lagrangian *lagrangian;          /* NULL: kinetic - potential */
    phys_lagrangian *kinetic, *potential; /* [1 x n] each; NULL where L does not split */

    size_t slices; /* default span */
    double dt;
    /* The start: coordinates and velocities [dof] at t = 0, random ones drawn from `seed`. */
    enum ad_status (*start)(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);
    bool per_body; /* reports divide means by the number of bodies */
    enum phys_picture picture;
    const struct phys_preset *paper; /* NULL: not in the paper */
    /* The stationary path in closed form [dof x slices], between the scene's ends; NULL: the motion
       from the start gives the ends. For scenes that are not initial-value problems. */
    enum ad_status (*between)(const void *params, size_t slices, double *path,
                              struct ad_error *error);
    bool free_time; /* the end time is free: paths are those of energy 0 */
    /* The scene's own equations of motion (for phys_ode_lagrangian); NULL: the Euler-Lagrange
       equations. */
    enum ad_status (*ode)(const struct phys_system *system, struct phys_ode *ode,
                          struct ad_error *error);
    /* What no Lagrangian gives, or NULL: d/dt L_v = L_q + Q - D_v with Rayleigh's function D
       [1 x n] and generalised forces Q [dof x n]. Motion alone has them; paths, equilibria and
       waves refuse such a scene. */
    phys_lagrangian *dissipation, *forces;
    /* Of point masses under 1/r attraction, and whatever else is weak: G m of each body, for
       wisdom-holman. NULL: not known. */
    void (*gm)(const void *params, double gm[]);
    /* Constraints g(q, t) = 0, or NULL, with their names: M a = ... + G^T lambda, G = g_q. Motion
       and paths between given ends have them. */
    phys_constraint *constraint;
    const char *const *constraints; /* [n_constraints] */
    size_t n_constraints;
    const struct phys_observable *observables; /* table of n_observables */
    size_t n_observables;
    /* H, where the scene is given by it and L is its Legendre transform; NULL: by L. Motion is then
       computed in (q, p), where no step solves for the momenta that belong to velocities. */
    phys_hamiltonian *hamiltonian;
};

/* Built-in scenes, a NULL-terminated table. */
extern const struct phys_scene *const phys_scenes[];

/* A scene with parameter values. */
struct phys_system {
    const struct phys_scene *scene;
    size_t dof, bodies, dims; /* dof = bodies * dims */
    void *params;             /* owned; scene->params_bytes */
    void *library; /* what a scene from outside needs, such as a shared object, or NULL */
    void (*close)(void *library); /* ends it; NULL: nothing does */
    void *reserved[1];            /* NULL: room for what later releases add */
};

/* Opens a scene by name, or by the path of a shared object (anything with a slash or ending in
   .so), with default parameters. Unknown names: AD_E_ARGUMENT, naming the nearest; a file that is
   no scene: AD_E_INPUT with the reason. Close with phys_system_close in any case. */
enum ad_status phys_system_open(const char *name, struct phys_system *system,
                                struct ad_error *error);
/* Opens a scene of the caller's own, linked to its program; it must outlive the system. AD_E_INPUT
   names what the scene lacks. */
enum ad_status phys_system_make(const struct phys_scene *scene, struct phys_system *system,
                                struct ad_error *error);
void phys_system_close(struct phys_system *system);
/* Sets a parameter by name and updates dof. AD_E_ARGUMENT for unknown names, naming the nearest,
   and for values that are not finite or make the parameters invalid together; the parameter then
   keeps its value. */
enum ad_status phys_system_set(struct phys_system *system, const char *name, double value,
                               struct ad_error *error);
/* Sets parameters set [n] in order, up to the first that is refused. */
enum ad_status phys_system_set_all(struct phys_system *system, size_t n,
                                   const struct phys_setting set[], struct ad_error *error);
double phys_system_get(const struct phys_system *system, const char *name); /* NaN: unknown name */
/* Writes the name of coordinate k. */
void phys_coordinate_name(const struct phys_system *system, size_t k, char *name, size_t size);
/* The name of a column of time: t, or time where a coordinate is called t. */
const char *phys_time_name(const struct phys_system *system);

/* Records L [1 x n] of a system from its scene's callbacks. AD_E_SHAPE if they return another
   shape. */
ad_var phys_system_lagrangian(const struct phys_system *system, ad_var q, ad_var v, ad_var t);
/* The same with parameters names[n] as variables p[n], each a scalar or a row [1 x n]: changing
   them needs no recording, and derivatives with respect to them come from the tape. AD_E_ARGUMENT
   names one that phys_param_use does not find to be a variable. */
ad_var phys_system_lagrangian_of(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                                 size_t n, const char *const names[], const ad_var p[]);
enum phys_param_use {
    PHYS_PARAM_VARIABLE, /* L has it by PHYS_PARAM alone, or not at all */
    PHYS_PARAM_PLAIN,    /* as a plain number or in a condition: a constant */
    PHYS_PARAM_MIXED,    /* both: a derivative would lack a part */
    PHYS_PARAM_FIXED     /* it changes the coordinates, or numbers next to it are no values of it */
};
/* How L uses a parameter: recordings are compared whose plain numbers differ. On errors,
   PHYS_PARAM_FIXED. */
enum phys_param_use phys_param_use(const struct phys_system *system, const char *name,
                                   struct ad_error *error);
/* Whether the scene has forces that are not in L. */
bool phys_system_has_forces(const struct phys_system *system);
/* Records force + Q - D_v, or `force` [dof x n] itself where the scene has neither. AD_E_SHAPE if a
   callback returns another shape. */
ad_var phys_system_add_forces(const struct phys_system *system, ad_var force, ad_var q, ad_var v,
                              ad_var t);
/* Records g [n_constraints x n] of a scene that has constraints, and its observable k [1 x n].
   AD_E_SHAPE as above. */
ad_var phys_system_constraint(const struct phys_system *system, ad_var q, ad_var t);
ad_var phys_system_observable(const struct phys_system *system, size_t k, ad_var q, ad_var v,
                              ad_var t);
/* Records kinetic and potential energy [1 x n]: the scene's own, or, where its L does not split, (E
   + L)/2 and (E - L)/2 with E = v L_v - L. Returns L, recorded with them. */
ad_var phys_system_energies(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                            ad_var *kinetic, ad_var *potential);

AD_HEADER_END
#endif
