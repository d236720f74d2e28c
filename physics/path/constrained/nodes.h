/* For physics/path/constrained/ only: normals and tangents of constraints at one node. */
#ifndef PHYSICS_PATH_CONSTRAINED_NODES_H
#define PHYSICS_PATH_CONSTRAINED_NODES_H

#include "surface.h"

/* Where coordinate d of node j lies in a path of so many coordinates; when the node is; q of it. */
size_t phys_surface_place(const struct phys_surface *s, size_t dof, size_t j, size_t d);
double phys_surface_time(const struct phys_surface *s, size_t j);
void phys_surface_get(const struct phys_surface *s, const double *path, size_t j, double *q);
/* Whether node j is at an end; coordinate d of it moves; some coordinate of it does. */
bool phys_surface_at_end(const struct phys_surface *s, size_t j);
bool phys_surface_moves(const struct phys_surface *s, size_t j, size_t d);
bool phys_surface_some_move(const struct phys_surface *s, size_t j);

/* Takes off x its part along the m orthonormal rows of Q; twice, for rounding. */
void phys_take_off(size_t dof, size_t m, const double *Q, double *x);
/* G and Q at q of node j. False: its rows depend on each other. */
bool phys_surface_normals(struct phys_surface *s, size_t j, const double *q);
/* The same of the coordinates that move there: G and Q are 0 beside them, and in rows that depend
   on others, which those that are given keep. Returns how many rows are left; 0 of an end that is
   given. */
size_t phys_surface_free_normals(struct phys_surface *s, size_t j, const double *q);
/* Rows that Q, of so many normals, leaves free: of the unit vectors the one of which most is left,
   again and again. Those that are too many at an end are 0. */
void phys_surface_tangents(struct phys_surface *s, size_t j, size_t normals, double *Z);

#endif
