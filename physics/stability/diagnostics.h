/* Reliability of a motion: steps that are too long, energy not conserved, nearly singular masses,
   an error as large as the motion, and the horizon of predictability of a chaotic one.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_STABILITY_DIAGNOSTICS_H
#define PHYSICS_STABILITY_DIAGNOSTICS_H

#include "physics/motion/solve.h"
#include "stability.h"

AD_HEADER_BEGIN

enum { PHYS_DIAGNOSIS_WARNINGS = 8 };

/* A motion whose forces are faster than itself, and steps of gauss3 that follow it. */
struct phys_stiffness {
    double rate;        /* fastest of the forces, at some samples; 0: the motion is not stiff */
    double times;       /* the motion's own, |a| / |v|: geometric mean */
    double dt;          /* of gauss3 */
    size_t evaluations; /* that it took */
    double distance;    /* of its coordinates from this motion, largest */
};

struct phys_diagnosis {
    size_t n_warnings;
    char warning[PHYS_DIAGNOSIS_WARNINGS][512];
    double mass_condition; /* a lower bound of that of L_vv along the motion; 0: not looked at */
    bool has_horizon;
    struct phys_lyapunov chaos;
    struct phys_stiffness stiff; /* adaptive methods */
    double error_before; /* largest distance from the reference before the horizon; NaN: unknown */
};

/* Diagnoses a motion that phys_motion_solve returned, complete or not; *error is its error, and
   unchanged. known: size of an initial difference whose growth is followed until it reaches
   PHYS_MOTION_LOST sizes of the motion; 0: not followed. */
enum ad_status phys_motion_diagnose(const struct phys_motion_settings *settings,
                                    const struct phys_motion_solution *solution, double known,
                                    struct phys_diagnosis *diagnosis, struct ad_error *error);
/* x printed with as many digits as a spread leaves significant. */
double phys_known_digits(double x, double spread);

AD_HEADER_END
#endif
