/* For physics/path/refine/ only. */
#ifndef PHYSICS_PATH_REFINE_INTERNAL_H
#define PHYSICS_PATH_REFINE_INTERNAL_H

#include "physics/path/newton.h"
#include "physics/path/path_units.h"

enum { PHYS_FINEST = 1 << 14 }; /* elements */
/* Levels that find several paths from the guess: the next goes on with one. */
enum { PHYS_CLIMB_PARTED = 5 };

/* The path of a level. */
struct phys_stage {
    struct phys_grid grid;
    double *start, *path, *mesh;
    double distance; /* from the level before, or of high order from a finer one; NaN: none */
    bool apart;      /* its elements are not those of the level before, halved */
};

struct phys_climb {
    const struct phys_system *system;
    const double *guess; /* on the grid `given` */
    struct phys_grid given;
    size_t adam_steps, placed;                /* placed: how often the elements were */
    double time, tolerance, ends_error, size; /* size: the path's largest coordinate */
    double *approach;                         /* the guess, where it is another than that given */
    double *unit;                             /* [dof]: of the last path found (path_units.h) */
    struct phys_stage before, here;
    struct phys_newton newton; /* of c->here, unless the time is free */
    bool sparing;              /* of steps of Adam, where Newton's method converges without */
    bool rough;                /* levels are not settled to rounding, but the last */
    bool high;                 /* rungs of high order */
    bool parted;  /* ... hold another path than those before: more elements are needed */
    bool doubted; /* some did: a motion must exist near the path */
    struct phys_refined *to;
    struct ad_error lost; /* why the last level has no path */
};

/* ---- one level (level.c) ---- */

/* Of the path's size: as close as to be the same path. */
#define PHYS_CLIMB_NEAR 1e-2

/* Near enough to the level before to be the same path. */
static inline bool phys_climb_settled(const struct phys_climb *c, const struct phys_stage *stage)
{
    return stage->path && stage->distance <= PHYS_CLIMB_NEAR * c->size;
}

static inline bool phys_climb_free_time(const struct phys_climb *c)
{
    return c->to->settings->ends && c->to->settings->ends->free_time;
}

/* Elements of c->here: placed by the level before, or its own, or those given, divided. */
enum ad_status phys_climb_mesh(struct phys_climb *c, struct ad_error *error);
/* The path of c->here. A level whose path is not found is none to compare with. */
enum ad_status phys_climb_solve(struct phys_climb *c, struct phys_level *level,
                                struct ad_error *error);

/* Another guess, on the grid of c->given by a rule, and c->to->approach what it is (approach.c);
   c->approach is NULL where there is none. AD_E_ACCURACY where it is interrupted. */
enum ad_status phys_climb_approach(struct phys_climb *c, const struct phys_rule *rule,
                                   struct ad_error *error);

/* ---- its error (error.c) ---- */

/* Errors that no refinement removes: that of the ends, and rounding in every element. */
double phys_climb_rounding(const struct phys_climb *c, size_t elements);
/* Distance of c->here from the level before, at the slices of both, and its error by that. */
void phys_climb_estimate(struct phys_climb *c, struct phys_level *level, struct ad_error *error);
/* Whether the error of c->here is small enough, also by the rule of higher order. Between conjugate
   ends all levels may agree on a path that the grid alone holds. */
bool phys_climb_verified(struct phys_climb *c, struct phys_level *level, struct ad_error *error);
/* The distances do not fall any more, and are small. */
bool phys_climb_at_rounding(const struct phys_climb *c, const struct phys_level *level);

#endif
