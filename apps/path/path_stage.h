/* A level of --tol: a path on one grid, made stationary, and what the climb over the levels knows.
 */
#ifndef APPS_PATH_STAGE_H
#define APPS_PATH_STAGE_H

#include "path.h"

/* A solved level. */
struct stage {
    struct phys_grid grid;
    double *start, *path;
    size_t adam_steps;
    double distance; /* from the level before; NaN: none to compare with */
};

struct refinement {
    struct path_run *run;
    struct phys_grid given; /* of run->start */
    double time, size;      /* the path's largest coordinate */
    double *ends;           /* [dof x 2] */
    double ends_error;      /* of the motion that gave them */
    struct stage before, here;
};

void stage_free(struct stage *stage);
/* Near enough to the level before to be the same path. */
bool stage_settled(const struct refinement *r, const struct stage *stage);
/* Solves r->here, whose grid is set, from the level before once two agree on which answer it is,
   else from the start given. A level whose path is not found is none to compare with. */
enum ad_status stage_solve(struct refinement *r, struct path_level *level, struct ad_error *error);

#endif
