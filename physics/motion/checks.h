/* All checks of a scene's Lagrangian, along its motion. */
#ifndef PHYSICS_MOTION_CHECKS_H
#define PHYSICS_MOTION_CHECKS_H

#include "physics/lagrangian/check.h"

AD_HEADER_BEGIN

struct phys_checks {
    bool passed;                      /* all checks passed */
    struct ad_error no_path;          /* why there is no motion; the points then lie on a line */
    struct ad_error not_finite;       /* phys_check_finite; if it fails, no other check is made */
    struct ad_error energies;         /* phys_check_energies */
    struct ad_check gradient, second; /* phys_check_gradient of order 1 and 2 */
    struct phys_locality locality;
    const char *kink;      /* phys_check_kinks; NULL, too, where slices are not local */
    double mass_condition; /* largest lower bound at the points; NaN where slices are not local */
};
/* Checks the slices, dt apart, of the motion from the scene's start (all but the last), with the
   velocities of the rule left. tolerance and entries as in phys_check_gradient. A failed check is
   not an error; AD_E_ARGUMENT for under 3 slices or an invalid dt or tolerance, AD_E_MEMORY. */
enum ad_status phys_check_scene(const struct phys_system *system, uint64_t seed, size_t slices,
                                double dt, double tolerance, size_t entries,
                                struct phys_checks *checks, struct ad_error *error);

AD_HEADER_END
#endif
