/* Internals of the search for several stationary paths: starts (multistart.c), of one coordinate by
   velocity (multistart_sweep.c) and by energy (multistart_energy.c), of two and three by velocity
   (multistart_shots.c), solutions (solutions.c). */
#ifndef PHYSICS_PATH_ALL_MULTISTART_H
#define PHYSICS_PATH_ALL_MULTISTART_H

#include "physics/path/newton.h"
#include "physics/motion/motion.h"

#define PHYS_MULTISTART_RANGE 1e3 /* of speeds, around the one that is natural */

struct phys_multistart {
    const struct phys_system *system;
    struct phys_path_settings settings;
    struct phys_newton newton;
    const double *given;
    struct ad_ranks *ranks;       /* NULL: one */
    bool (*asked)(void *context); /* proceed, where ranks have to agree on it */
    size_t dof, slices, n;        /* n: numbers of a path with its inner nodes */
    size_t left;                  /* by constraints, of dof */
    struct phys_ode motion;
    double speed, span; /* natural scales of velocity and of the path */
    double *q, *v, *y, *path;
    double *along;   /* [2][dof] where one direction is left: that at either end */
    double *between; /* [dof x slices] whose ends a start is bent to: given, or its own */
    bool free_time;  /* settings.dt is that of the last motion */
    double longest;  /* time, where it is free */
    struct phys_derivatives of; /* for all of them */
    bool free;                  /* coordinates of the ends move ... */
    phys_legendre *legendre;    /* ... the last one of one alone: p(T) is swept; else NULL */
    struct phys_path_info info; /* of the last solution */
    size_t led;                 /* starts that led to a stationary path */
    bool taken;                 /* the last motion has a path of the grid */
    struct phys_solutions *solutions;
};

/* Whether the caller lets it go on. */
bool phys_multistart_goes_on(struct phys_multistart *s);
/* The same, agreed by ranks, which have none of their own in between. */
bool phys_multistart_agree(struct phys_multistart *s, struct ad_error *error);
/* Newton from s->path; what does not converge is no solution, and no error: s->led counts what
 * does.
 */
enum ad_status phys_multistart_solve(struct phys_multistart *s, struct ad_error *error);
/* From s->path, slices alone: Newton, and keeps the solution. */
enum ad_status phys_multistart_settle(struct phys_multistart *s, struct ad_error *error);
/* Puts the motion from s->q with velocity s->v into s->path, and its end into s->y; false if it is
   lost. */
bool phys_multistart_shoot(struct phys_multistart *s);
/* Of coordinate k of that motion. */
double phys_multistart_miss(const struct phys_multistart *s, size_t k);
/* That motion, bent to what is given of the ends; false if it is lost or ends far away. */
bool phys_multistart_begin(struct phys_multistart *s);
/* One coordinate, or one direction that constraints leave: velocities up to `fastest` either way,
   dense near zero, with zero among them. */
enum ad_status phys_multistart_sweep(struct phys_multistart *s, struct ad_error *error);
/* Keeps the solution in s->path, unless it is known. */
enum ad_status phys_multistart_keep(struct phys_multistart *s, struct ad_error *error);
/* Two and three coordinates: counts the motion from s->v as one that the grid does not resolve. */
enum ad_status phys_multistart_unresolved(struct phys_multistart *s, struct ad_error *error);
/* Leaves out what the grid alone made; the rest by energy. */
void phys_multistart_sort(struct phys_multistart *s);
/* Makes settings and s->newton those of a motion of this duration. */
enum ad_status phys_multistart_over(struct phys_multistart *s, double time, struct ad_error *error);
/* Makes the motion in s->path stationary and keeps it, s->taken: it did not lead
   elsewhere. begun: room [dof x slices]. */
enum ad_status phys_multistart_take(struct phys_multistart *s, double *begun,
                                    struct ad_error *error);
/* Two and three coordinates: motions that begin with any velocity. */
enum ad_status phys_multistart_shots(struct phys_multistart *s, uint64_t seed,
                                     struct ad_error *error);
/* Motions by their energies. False: it is another kind of question. */
bool phys_multistart_energies(struct phys_multistart *s, struct ad_error *error);
/* Of one direction left by constraints: `along`; v at speed x along it at the start. False: the
   ends are no places of a motion. Without constraints: the only coordinate. (constrained.c) */
bool phys_multistart_directions(struct phys_multistart *s);
bool phys_multistart_velocity(struct phys_multistart *s, double x);
/* v becomes the nearest that constraints allow at the start. */
bool phys_multistart_turn(struct phys_multistart *s, double *v);
/* Largest difference of a and b [n]. */

#endif
