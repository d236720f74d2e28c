/* Scenes and systems. A scene is a Lagrangian with its parameters, units and defaults, one const
   struct; a system is a scene with values. Paths are [dof x slices], row-major: row k is coordinate
   k over time. */
#ifndef PHYSICS_SYSTEM_H
#define PHYSICS_SYSTEM_H

#include "autodiff/autodiff.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* L for all time slices at once. q, v: [dof x n] (row k is coordinate k), t: [1 x n]; returns
   [1 x n]. Slice i of the result may depend on slice i of the inputs only. */
typedef ad_var phys_lagrangian(ad_var q, ad_var v, ad_var t, const void *params);

/* Differences of all pairs of bodies as rows. q: [bodies*dims x n], body b holds rows b*dims ...;
   d[k], k < dims, becomes [pairs x n] with x_k(i) - x_k(j) for i < j in lexicographic order,
   pairs = bodies*(bodies-1)/2. Gathers, no node per pair. Needs two bodies: AD_E_ARGUMENT. */
void phys_pair_differences(ad_var q, size_t bodies, size_t dims, ad_var d[]);
/* Squares of the distances of all pairs plus `softening`: [pairs x n], in the same order. */
ad_var phys_pair_squares(ad_var q, size_t bodies, size_t dims, double softening);
/* The same for the pairs (first[k], second[k]) alone. */
void phys_listed_differences(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                             const uint32_t second[], ad_var d[]);
ad_var phys_listed_squares(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                           const uint32_t second[], double softening);

/* A named number of a scene: `offset` is where its double lies in the scene's params struct. */
struct phys_param {
    const char *name, *unit, *what;
    double value; /* default */
    size_t offset;
};

/* A parameter by name. */
struct phys_setting {
    const char *name;
    double value;
};

/* How the published code draws its noisy start around the ODE path: sigma times a standard normal
   number clipped at +-clip (0: not clipped) is added to all but the first and last three slices;
   then all but the first and last `margin` slices become scale*x + shift (margin 0: none do). */
struct phys_noise {
    double sigma, clip;
    bool around_zero; /* the path between its end slices is zero before the noise */
    size_t margin;
    double scale, shift;
    size_t quiet_bodies; /* the first so many bodies carry none */
};

/* The published setting of a scene, all of it (Nature's Cost Function, arXiv 2303.02115). */
struct phys_preset {
    size_t slices, steps;
    double dt, learning_rate;
    double energy_weight; /* penalty on the change of total energy; 0: none */
    double damping;       /* velocity factor of each step of the ODE path; 1: none */
    bool euler_start;     /* second slice is q + v dt; false: where the motion is after dt */
    struct phys_noise noise;
    const struct phys_setting *set; /* parameters that differ from the defaults */
    size_t n_set;
};

enum phys_picture {
    PHYS_PICTURE_TIME,  /* each coordinate against time */
    PHYS_PICTURE_PLANE, /* bodies in the plane of their first two coordinates */
    PHYS_PICTURE_ANGLES /* a chain of rods: angles from the vertical */
};

/* A scene records operations by their numbers and holds struct ad_var: one built with another table
   of operations, or before a change of ad_var or of a callback, is refused. Such a change raises
   the number before the plus by 0x100. */
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
    size_t (*dof_of)(const void *params); /* 0: the parameters make no system */
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
    /* Start: coordinates and velocities [dof] at t = 0, drawn from `seed` where they are random. */
    enum ad_status (*start)(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);
    bool per_body; /* reports divide means by the number of bodies */
    enum phys_picture picture;
    const struct phys_preset *paper; /* NULL: not in the paper */
    /* The stationary path in closed form [dof x slices], its ends the scene's; NULL: the motion
       from the start gives the ends. For scenes that are no initial-value problem. */
    enum ad_status (*between)(const void *params, size_t slices, double *path,
                              struct ad_error *error);
    bool free_time; /* the end time is free: paths are those of energy 0 */
    /* The motion from a start by equations of the scene's own (phys_ode_lagrangian); NULL: by the
       Euler-Lagrange equations. */
    enum ad_status (*ode)(const struct phys_system *system, struct phys_ode *ode,
                          struct ad_error *error);
};

/* Built-in scenes, a NULL-terminated table. */
extern const struct phys_scene *const phys_scenes[];

/* A scene with parameter values: what every computation starts from. */
struct phys_system {
    const struct phys_scene *scene;
    size_t dof, bodies, dims; /* dof = bodies * dims */
    void *params;             /* owned; scene->params_bytes */
    void *library;            /* shared object of a scene from outside, or NULL */
};

/* By name, or by the path of a shared object (anything with a slash or ending in .so), with default
   parameters. Unknown names: AD_E_ARGUMENT, naming the nearest; a shared object that is none of
   ours: AD_E_INPUT, saying why. Ends with phys_system_close, after a failure too. */
enum ad_status phys_system_open(const char *name, struct phys_system *system,
                                struct ad_error *error);
/* The same for a scene of the caller's own, linked to its program; it must outlive the system.
   AD_E_INPUT says what a scene lacks. */
enum ad_status phys_system_make(const struct phys_scene *scene, struct phys_system *system,
                                struct ad_error *error);
void phys_system_close(struct phys_system *system);
/* Sets a parameter by name and updates dof. Unknown names are refused, naming the nearest; so are
   values that are not finite or make no system: AD_E_ARGUMENT, and the parameter keeps its value.
 */
enum ad_status phys_system_set(struct phys_system *system, const char *name, double value,
                               struct ad_error *error);
/* Sets n parameters in their order, up to the first that is refused. */
enum ad_status phys_system_set_all(struct phys_system *system, size_t n,
                                   const struct phys_setting set[], struct ad_error *error);
double phys_system_get(const struct phys_system *system, const char *name); /* NaN: no such name */
/* Writes the name of coordinate k. */
void phys_coordinate_name(const struct phys_system *system, size_t k, char *name, size_t size);

/* L [1 x n] of a system, from its scene's callbacks. What they return is checked: AD_E_SHAPE. */
ad_var phys_system_lagrangian(const struct phys_system *system, ad_var q, ad_var v, ad_var t);
/* Kinetic and potential energy [1 x n]: the scene's own, or, where its L does not split, E = v L_v
   - L taken apart as (E + L)/2 and (E - L)/2. */
void phys_system_energies(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                          ad_var *kinetic, ad_var *potential);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
