/* Paths of scenes with constraints; an error fails the test. */
#ifndef TESTS_PHYSICS_PATH_CONSTRAINED_PATH_H
#define TESTS_PHYSICS_PATH_CONSTRAINED_PATH_H

#include "tests/physics/motion/constrained.h"

struct constrained_path {
    struct phys_system system;
    struct phys_path_settings settings;
    struct phys_path_found found;
    double *path;
};

/* On a straight line between the ends q0, q1, off the constraints, in a time T. */
struct constrained_path constrained_path(const struct phys_scene *scene, const char *rule,
                                         size_t slices, double T, const double *q0,
                                         const double *q1);
enum ad_status constrained_path_find(struct constrained_path *r, struct ad_error *error);
/* That it is found. */
void constrained_path_found(struct constrained_path *r);
void constrained_path_end(struct constrained_path *r);

#endif
