/* Interpolation of a path between its slices: the polynomials of its rule, or cubics. */
#ifndef PHYSICS_PATH_PATH_NODES_H
#define PHYSICS_PATH_PATH_NODES_H

#include "internal.h"

struct phys_path_nodes {
    size_t degree, dof, slices, n; /* n = degree * (slices - 1) + 1 */
    double *x, *time;              /* [dof x n], [n]: slice i is node i * degree */
    double *memory;
};

/* Of path [s*dof x slices] on a grid; cubics through the slices where its rule has a degree under
   `least` (0 or 3). Ends with phys_path_nodes_free, whatever it returned. */
enum ad_status phys_path_nodes_new(struct phys_path_nodes *nodes, size_t dof,
                                   const struct phys_grid *grid, size_t least, const double *path,
                                   struct ad_error *error);
void phys_path_nodes_free(struct phys_path_nodes *nodes);
/* q and v [dof] at time t; v may be NULL. */
void phys_path_nodes_at(const struct phys_path_nodes *nodes, double t, double *q, double *v);

#endif
