/* Every root of an end map (end_map.h) in a ball or shell of velocities, by boxes that are divided
   until the map is close to linear on them; where the roots are no points, families of them. */
#ifndef PHYSICS_PATH_ALL_COVERING_H
#define PHYSICS_PATH_ALL_COVERING_H

#include "autodiff/ranks.h"
#include "end_map.h"

struct phys_end_root {
    double w[PHYS_END_MAP_DOF];
    size_t dimension;   /* of the family that it belongs to, 0: it is isolated */
    size_t family;      /* the index of a root of its family; its own where isolated */
    unsigned coverings; /* bit k: covering k led to it, or to its family */
};
struct phys_end_roots {
    size_t n;
    struct phys_end_root *root;
};

struct phys_covering {
    struct phys_end_map *map;
    double inner, outer;          /* speeds |w|: the shell to cover */
    bool bounded;                 /* roots beyond `outer` are left out, and that at 0 */
    unsigned number;              /* of the covering */
    uint64_t seed;                /* of the directions of the boxes' edges, and of their places */
    size_t steps;                 /* of motions: the covering ends at map->steps of them */
    struct phys_end_roots *roots; /* found so far, by any covering */
    /* Called as the search goes on: what to do with new roots. */
    enum ad_status (*found)(void *context, struct ad_error *error);
    /* Before boxes are dealt out among ranks: whether to go on, agreed by them. NULL: no ranks. */
    bool (*agree)(void *context, struct ad_error *error);
    void *context;
    struct ad_ranks *ranks; /* that divide boxes together; NULL: one */
    /* Results: the volume of boxes that were still to be divided, relative to the shell's, and
       whether it is because of `steps`; map->proceed, too, ends it. */
    double undecided;
    bool exhausted;
};
/* Adds what it finds to c->roots. AD_E_MEMORY. */
enum ad_status phys_cover(struct phys_covering *c, struct ad_error *error);
/* Adds the root that Newton's method finds from w, which becomes it. The dimension of its family,
   0: it is isolated; -1: there is none. */
int phys_cover_near(struct phys_covering *c, double *w, struct ad_error *error);

#endif
