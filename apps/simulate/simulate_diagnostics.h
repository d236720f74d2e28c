/* How far a simulation is to be believed: steps that are too long, energy that is not kept, and the
   horizon of a chaotic motion. */
#ifndef APPS_SIMULATE_DIAGNOSTICS_H
#define APPS_SIMULATE_DIAGNOSTICS_H

#include "apps/output/report.h"
#include "physics/stability/stability.h"

struct simulate_run;
struct simulate_result;

enum { SIMULATE_WARNINGS = 7 };

/* Where a difference, in units of the motion's size, is too large to speak of a prediction. */
static const double simulate_lost = 0.1;

struct simulate_outlook {
    size_t n_warnings;
    char warning[SIMULATE_WARNINGS][512];
    double mass_condition; /* a lower bound of that of L_vv along the run; 0: not looked at */
    bool has_horizon;      /* --horizon */
    struct phys_lyapunov chaos;
    double
        error_before; /* largest distance from the reference before the horizon; NaN: no reference
                       */
};

/* Judges a run, also one that did not get through (*error says so), and prints its warnings to
   standard error unless --quiet. */
void simulate_outlook(const struct simulate_run *run, struct simulate_result *result,
                      struct ad_error *error);
/* AD_E_ACCURACY where the measured error is more than --tol asked of the whole motion. */
enum ad_status simulate_miss(const struct simulate_run *run, const struct simulate_result *result,
                             struct ad_error *error);
void simulate_outlook_report(const struct simulate_run *run, const struct simulate_outlook *outlook,
                             struct report *report);

#endif
