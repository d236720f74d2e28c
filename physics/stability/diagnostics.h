/* How far a motion is to be believed: steps that are too long, energy that is not kept, masses that
   are nearly singular, an error as large as the motion, and the horizon of a chaotic one. */
#ifndef PHYSICS_STABILITY_DIAGNOSTICS_H
#define PHYSICS_STABILITY_DIAGNOSTICS_H

#include "physics/motion/solve.h"
#include "stability.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PHYS_DIAGNOSIS_WARNINGS = 7 };

struct phys_diagnosis {
    size_t n_warnings;
    char warning[PHYS_DIAGNOSIS_WARNINGS][512];
    double mass_condition; /* a lower bound of that of L_vv along the motion; 0: not looked at */
    bool has_horizon;
    struct phys_lyapunov chaos;
    double error_before; /* largest distance from the reference before the horizon; NaN: unknown */
};

/* Of a motion that phys_motion_solve found or lost on the way; *error is then what it said, and
   stays. known: size of a difference of the start whose growth is followed until it is
   PHYS_MOTION_LOST sizes of the motion; 0: it is not. */
enum ad_status phys_motion_diagnose(const struct phys_motion_settings *settings,
                                    const struct phys_motion_solution *solution, double known,
                                    struct phys_diagnosis *diagnosis, struct ad_error *error);
/* As many digits of x as a spread leaves: the last is where the spread begins. */
double phys_known_digits(double x, double spread);

#ifdef __cplusplus
}
#endif
#endif
