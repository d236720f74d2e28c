/* All checks of a Lagrangian, along its motion or at given points.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
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
    /* Negative eigenvalues of L_vv, fewest and most at the points: 0, 0 is positive definite.
       SIZE_MAX: singular at a point, or slices are not local. */
    size_t negative_least, negative_most;
};
/* All checks at points of the caller's choice, NULL: on the motion from the scene's start, at its
   own slices. tolerance: error of a derivative relative to the largest of its input; 0: 1e-6, where
   a wrong term shows and rounding of differences does not. A failed check is not an error but
   checks->passed. Errors as of phys_check_scene. */
enum ad_status phys_check_all(const struct phys_system *system, const struct phys_points *at,
                              double tolerance, struct phys_checks *checks, struct ad_error *error);
/* The report as lines of text, a check each, as snprintf: at most `size` bytes with the closing 0,
   and returns the length of all. NULL and 0 to ask for the length. */
size_t phys_checks_text(const struct phys_system *system, const struct phys_checks *checks,
                        char *text, size_t size);
/* "q theta" for row k of q over v over t; "several coordinates" for SIZE_MAX. */
void phys_check_row_name(const struct phys_system *system, size_t k, char *name, size_t size);
/* Checks the slices, dt apart, of the motion from the scene's start (all but the last), with the
   velocities of the rule left. tolerance and entries as in phys_check_gradient. A failed check is
   not an error; AD_E_ARGUMENT for under 3 slices or an invalid dt or tolerance, AD_E_MEMORY. */
enum ad_status phys_check_scene(const struct phys_system *system, uint64_t seed, size_t slices,
                                double dt, double tolerance, size_t entries,
                                struct phys_checks *checks, struct ad_error *error);

AD_HEADER_END
#endif
