/* The spectrum of a path, from its Hessian. */
#ifndef PHYSICS_PATH_SPECTRUM_H
#define PHYSICS_PATH_SPECTRUM_H

#include "internal.h"
#include "physics/path/constrained/surface.h"

/* Of h->mass, which it destroys: positive or negative definite at all points, else indefinite from
   `time` on, the first point where it is not. (legendre_condition.c) */
enum phys_definite phys_hessian_definite(struct phys_hessian *h, double *time);
/* The Hessian takes from the settings which coordinates move at the ends, and the mesh. */
void phys_hessian_settings(struct phys_hessian *h, const struct phys_path_settings *settings);
/* Of a spectrum: all but its smallest eigenvalues to rounding, and these, which then are added to
 * it.
 */
enum phys_spectrum_parts { PHYS_KIND = 1, PHYS_EIGENVALUES = 2 };
/* As phys_path_spectrum, of any rule and grid h was made for; h keeps nothing of it. On a surface
   (NULL: there is none) whose Hessian it is, among paths that keep to it. */
enum ad_status phys_hessian_spectrum(struct phys_hessian *h, struct phys_surface *surface,
                                     enum phys_spectrum_parts parts, const double *path,
                                     struct phys_spectrum *spectrum, struct ad_error *error);
/* Whether the Hessian h of a rule of higher order has, at the same path, no eigenvalue between
   halves of those of the spectrum next to zero, and as many below. False where it cannot be known.
   `filled`: it is that of the path already. */
bool phys_hessian_confirms(struct phys_hessian *h, struct phys_surface *surface, const double *path,
                           bool filled, const struct phys_spectrum *spectrum,
                           struct ad_error *error);

#endif
