/* The gradient of the action of a scene of hand.h at any number of slices, or of bodies. */
#ifndef APPS_BENCH_MEASURE_SIZED_GRADIENT_H
#define APPS_BENCH_MEASURE_SIZED_GRADIENT_H

#include "physics/physics.h"

struct sized_gradient {
    int scene;
    size_t slices;
    struct phys_system system;
    ad_tape *tape;
    ad_var path, gradient; /* [dof x slices] */
    ad_var objective;
};

/* Records it; `bodies` 0: those of the scene. Ends with sized_gradient_close, whatever it returned.
 */
enum ad_status sized_gradient_open(int scene, size_t bodies, size_t slices,
                                   struct sized_gradient *s, struct ad_error *error);
void sized_gradient_close(struct sized_gradient *s);
/* A program for it, which the caller frees; and the path of sized_gradient_path set in n of them.
 */
enum ad_status sized_gradient_compile(struct sized_gradient *s, ad_program **program,
                                      struct ad_error *error);
enum ad_status sized_gradient_set(const struct sized_gradient *s, size_t n,
                                  ad_program *const programs[n], struct ad_error *error);

/* A path of a scene, x [dof x slices]: bodies around the points of a lattice (angles: around zero),
   wide enough that none collide; and how wide they swing. */
void sized_gradient_path(int scene, size_t dof, size_t slices, double *x);
double sized_gradient_swing(int scene);

#endif
