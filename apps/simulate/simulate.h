/* The parts of `leastaction simulate`: what is asked made definite (simulate_setup,
   simulate_ephemeris), a setting chosen for --tol (simulate_choose), run and measured
   (simulate_run), and written (simulate_report, simulate_write, simulate_picture). */
#ifndef APPS_SIMULATE_H
#define APPS_SIMULATE_H

#include "ephemeris_models.h"
#include "gas_order.h"
#include "apps/options.h"
#include "apps/output/plot.h"
#include "apps/output/report.h"
#include "apps/output/result.h"
#include "simulate_event.h"
#include "simulate_diagnostics.h"
#include "physics/motion/motion.h"
#include "physics/io/hdf5_file.h"

struct simulate_options {
    struct common common;
    const char *integrator, *data, *from, *rough, *until;
    struct texts events;
    double dt, tolerance, time, horizon;
    size_t every, samples, days;
    bool no_reference, reverse;
    struct settings set;
};

/* One setting that --tol tried. */
struct simulate_trial {
    const struct phys_integrator *integrator;
    double setting;               /* dt, or the tolerance of a step */
    double estimate;              /* of the largest error over the run; NaN: unknown */
    size_t evaluations, searched; /* of the setting; of all other runs */
    bool chosen;
};

enum {
    SIMULATE_TRIALS = 2,
    SIMULATE_FEW = 100 /* bodies; with more, what costs the square of their number is left out: the
                          reference, the closest approach, momenta, the outlook */
};

/* A run made definite. */
struct simulate_run {
    const struct simulate_options *options;
    struct phys_system system;
    const struct phys_integrator *integrator; /* NULL: --tol is to choose */
    struct phys_ode ode; /* in the form that suits the integrator, once it is known */
    double *q, *v;       /* [dof] start */
    double time;
    double dt, tolerance; /* of the steps, once known */
    size_t n_trials;
    struct simulate_trial trial[SIMULATE_TRIALS];
    struct event_questions questions;
    struct ephemeris_tables tables;      /* n 0: none asked for */
    const struct ephemeris_model *model; /* of those tried, when --tol was to choose one; or NULL */
    size_t n_tried, chosen;
    struct ephemeris_errors tried[EPHEMERIS_MODELS];
};

static inline bool simulate_few(const struct simulate_run *run)
{
    return run->system.bodies <= SIMULATE_FEW;
}

/* Scene, parameters, integrator, start. Ends with simulate_free, whatever it returned. */
enum ad_status simulate_setup(const struct simulate_options *options, struct simulate_run *run,
                              struct ad_error *error);
void simulate_free(struct simulate_run *run);
/* The field in the form that suits an integrator: y = (q, p) for those that are symplectic in
   conjugate coordinates where the scene does not separate, else (q, v). */
enum ad_status simulate_ode(const struct simulate_run *run,
                            const struct phys_integrator *integrator, struct phys_ode *ode,
                            struct ad_error *error);
/* Settings of a run with `integrator`, whose dt or step tolerance is `setting`. scale [2 dof] is
   filled with the sizes that tolerances refer to. */
enum ad_status simulate_settings(const struct simulate_run *run,
                                 const struct phys_integrator *integrator, double setting,
                                 const struct phys_ode *ode, const double *y, double *scale,
                                 struct phys_simulation *settings, struct ad_error *error);

/* With --tol, finds a setting of dop853, gauss5 or the integrator given whose estimate of the error
   is under it: integrator, dt or tolerance, trials. */
enum ad_status simulate_choose(struct simulate_run *run, struct ad_error *error);

/* The setting that --tol chose erred by `error`, which is more: a tighter one; false if there is
 * none.
 */
bool simulate_tighten(struct simulate_run *run, double error);

/* With --data: the system from the tables, or, with --tol, the least model (run->model), which
   decides start and integrator too. */
enum ad_status simulate_ephemeris(struct simulate_run *run, struct ad_error *error);
/* Its steps, where --dt does not say: so short that integration errs by --tol km, or by a hundredth
   of the model's error. */
enum ad_status simulate_ephemeris_steps(struct simulate_run *run, struct ad_error *error);
void simulate_ephemeris_free(struct simulate_run *run);

/* Samples of a motion: time, coordinates and velocities. */
struct simulate_samples {
    const struct phys_ode *ode;
    size_t dof, n, room;
    double *t;      /* [n] */
    double *x;      /* [n][2 dof]: q, then v */
    double *energy; /* [n]; NaN where it is not known */
    bool failed;    /* out of memory */
    bool (*progress)(void *context, double t);
    void *context;
};

struct simulate_result {
    struct phys_simulation_info info;
    struct simulate_samples samples;
    double *distance; /* [n] from the reference, NaN where it is not known; NULL: none */
    double error, error_end, reversal;
    struct {
        bool known;
        struct ephemeris_distances in_all, model, integration;
    } tables; /* with tables: of the run from them, of its model from them, of the run from its
               * model
               */
    /* Of the reference: uncertainty, how far from the start it comes back to, from when on it is
       not known (INFINITY: it is all known; NaN: there is none), the longest time between two looks
       at the forces, size of the coordinates. */
    double reference_uncertainty, reference_reversal, known_until, seen, size;
    struct phys_closest closest;
    struct event_answers events;
    bool keeps_energy;
    struct phys_conserved conserved;
    struct simulate_outlook outlook;
    struct gas_orders gas;
};

/* Runs, measures, compares. Ends with simulate_result_free, whatever it returned. */
enum ad_status simulate_run(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error);
void simulate_result_free(struct simulate_result *result);
/* Distances of the samples, one a day, from the tables: of the model followed tightly, and of the
   run from that. */
enum ad_status simulate_ephemeris_compare(const struct simulate_run *run,
                                          struct simulate_result *result, struct ad_error *error);
/* AD_E_ACCURACY where the run misses what --tol asks. */
enum ad_status simulate_ephemeris_judge(const struct simulate_run *run,
                                        const struct simulate_result *result,
                                        struct ad_error *error);
/* The sample callback; context is struct simulate_samples. */
bool simulate_sample(void *samples, double t, const double *y);
void simulate_samples_free(struct simulate_samples *samples);

/* ---- writing ---- */

void simulate_report(const struct simulate_run *run, const struct simulate_result *result,
                     struct report *report);
/* The models that --data --tol tried; distances from the tables. */
void simulate_ephemeris_report_models(const struct simulate_run *run, struct report *report);
void simulate_ephemeris_report(const struct simulate_run *run, const struct simulate_result *result,
                               struct report *report);
/* A row a sample: t, coordinates, velocities. */
void simulate_write_csv(const struct simulate_run *run, const struct simulate_result *result,
                        FILE *out);
enum ad_status simulate_file(const struct simulate_run *run, const struct simulate_result *result,
                             const struct report *report, phys_runfile *file,
                             struct ad_error *error);
void simulate_picture(const struct simulate_run *run, const struct simulate_result *result,
                      struct plot *plot);

#endif
