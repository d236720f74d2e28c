/* Newton's system of a path over ranks. */
#ifndef PHYSICS_PATH_RANKS_ELIMINATION_H
#define PHYSICS_PATH_RANKS_ELIMINATION_H

#include "blocks.h"
#include "segment.h"

struct phys_elimination {
    struct phys_ranked_path *path;
    struct phys_joints joints;
    size_t inner, numbers; /* unknowns inside an element; numbers of a segment */
    bool keeps;            /* all joints within blocks, not those of one at a time */
    double *element;       /* room: one with its inner unknowns, and the gradient */
    double *segment;       /* [blocks of this rank][numbers], and one received */
    double *within;        /* joints within blocks, or within one */
    double *between;       /* joints between blocks */
    size_t joined;         /* how many of the latter */
    double *ends;          /* [blocks of this rank][2 dof]: steps of their ends */
    double *nodes;         /* room: [2][2 dof + inner] of an element */
    double *unknowns;      /* room: of a joint */
    /* Of the last elimination: the norm of what rounding makes of the gradient times scale, eps |H|
       |path| element by element; the largest entry of this rank's part of the matrix; */
    double rounding, largest;
    size_t negative; /* ... how many eigenvalues are; */
    bool singular;   /* ... whether a pivot was zero, or a number is not finite */
};

/* Ends with phys_elimination_free, whatever it returned. */
enum ad_status phys_elimination_new(struct phys_elimination *e, struct phys_ranked_path *path,
                                    struct ad_error *error);
void phys_elimination_free(struct phys_elimination *e);
/* Eliminates D^-1 H D^-1 less a shift at path->path, D^-1 = path->scale: `negative`, `singular`. */
enum ad_status phys_eliminate(struct phys_elimination *e, double shift, struct ad_error *error);
/* Of the elimination: Newton's step, of the shape of the share; 0 where the path is held. */
enum ad_status phys_elimination_step(struct phys_elimination *e, double *step,
                                     struct ad_error *error);
#endif
