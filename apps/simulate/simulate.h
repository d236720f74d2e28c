/* The parts of `leastaction simulate`: setup (cmd_simulate, simulate_ephemeris), output
   (simulate_report, simulate_write, simulate_picture, gas_picture); many motions
   (simulate_ensemble). */
#ifndef APPS_SIMULATE_SIMULATE_H
#define APPS_SIMULATE_SIMULATE_H

#include "apps/options.h"
#include "apps/output/plot.h"
#include "apps/output/report.h"
#include "apps/scene_inputs.h"
#include "physics/ephemeris/models.h"
#include "physics/gas/order.h"
#include "physics/io/hdf5_file.h"
#include "physics/motion/ensemble.h"
#include "physics/stability/diagnostics.h"
#include "physics/stability/family.h"

struct simulate_options {
    struct common common;
    const char *integrator, *data, *from, *rough, *until, *section, *section_axes, *by, *ensemble,
        *hold, *follow, *inputs;
    struct texts events;
    double dt, tolerance, time, horizon, periodic, cross;
    size_t every, samples, days, lyapunov, mode;
    bool no_reference, reverse, sensitivity, choreography;
};

enum { SIMULATE_PARAMETERS = 64 };

enum { SIMULATE_NAME = 72 };

/* The crossings of a surface that are no touches. */
struct simulate_section {
    size_t number;  /* of its event, from 1; 0: not asked for */
    size_t axis[2]; /* of the picture: columns of a row; 0: chosen by the points */
    size_t n, touches;
    /* [n][3 + 2 dof]: row of the ensemble, from 1; t, q, v; the error of the coordinates there,
       NaN: not known. */
    double *row;
    double accuracy; /* --tol, or a thousandth of the largest coordinate */
    size_t known;    /* points before the error of their motion exceeds that, ... */
    double lost;     /* ... and the time of the first that is not; NaN: all are */
};

/* A run: what is asked, and what was found. */
struct simulate_run {
    const struct simulate_options *options;
    struct phys_system system;
    struct scene_inputs inputs;
    struct phys_motion_settings settings;
    struct phys_crossing *crossings; /* [settings.n_crossings] */
    struct simulate_section section;
    struct phys_motion_solution motion;
    struct phys_diagnosis diagnosis;
    double *exponents, *change;    /* [options->lyapunov]; NULL: none */
    struct phys_periodic periodic; /* period NaN, or 0: not asked for */
    struct phys_family family;     /* of which that is the last, or n 0 */
    char along[64];                /* what it is followed in, */
    double to;                     /* and until where */
    double *sensitivity;           /* [2][2 dof][2 dof] the matrix, its uncertainty; NULL: none */
    size_t n_by; /* parameters with derivatives; the matrix [2][2 dof][n_by], or NULL */
    const char *by[SIMULATE_PARAMETERS];
    char *by_text;
    double *by_parameters;
    bool *cyclic; /* [dof], of coordinates: their momenta, and how much these change */
    double *kept; /* [2][dof] */
    /* Of forces outside of L: at the end, the largest |energy - start - work|, and what the work
       may be off by; NaN: not known. */
    double work, balance, work_unknown;
    /* [n][dof] of constraints, NULL: there are none; the largest of each coordinate; how far the
       samples are off, in coordinates and velocities. */
    double *reactions, *reaction_most, residual[2];
    double *observed; /* [n_observables][n], NULL: there are none */
    bool has_order;   /* a gas */
    struct phys_gas_order order_start, order_end;

    struct phys_ephemeris_tables tables;      /* n 0: none asked for */
    const struct phys_ephemeris_model *model; /* chosen for --tol, or NULL */
    struct phys_ephemeris_choice choice;
    double *start; /* [2 dof] of the model */
    struct {
        bool known;
        struct phys_ephemeris_distances in_all, model, integration;
    } off; /* of the run from the tables, of its model from them, of the run from its model */
};

/* What the library refused, behind the option that asked for it. */
static inline enum ad_status simulate_refuse(const char *option, const struct ad_error *cause,
                                             struct ad_error *error)
{
    return ad_fail(error, cause->status, "%s%.400s", option, cause->message);
}

/* Cyclic coordinates, work, forces of constraints and observables. */
enum ad_status simulate_measure(struct simulate_run *run, struct ad_error *error);

/* --ensemble: reads the table, runs and writes. */
enum ad_status simulate_ensemble(struct simulate_run *run, struct ad_error *error);

/* With --data: system, start, method and steps from the tables, and, with --tol, of the least
   model. */
enum ad_status simulate_ephemeris(struct simulate_run *run, struct ad_error *error);
void simulate_ephemeris_free(struct simulate_run *run);
/* Distances of the samples, one a day, from the tables: of the model followed tightly, and of the
   run from that. */
enum ad_status simulate_ephemeris_compare(struct simulate_run *run, struct ad_error *error);
/* AD_E_ACCURACY where the run misses what --tol asks. */
enum ad_status simulate_ephemeris_judge(const struct simulate_run *run, struct ad_error *error);

/* --periodic: the start becomes that of the periodic motion near it, or, with --continue, of the
   last one of its family (simulate_periodic.c). */
enum ad_status simulate_periodic(struct simulate_run *run, struct ad_error *error);
void simulate_periodic_free(struct simulate_run *run);

/* --continue (simulate_family.c): reads NAME=TO or NAME=FROM:TO, which sets the parameter to FROM
   before there is a start. */
enum ad_status simulate_family_read(struct simulate_run *run, struct ad_error *error);
/* Follows the family from x, period; AD_E_ACCURACY where it does
   not lead to the value asked for; what is written. The CSV has a row a motion. */
enum ad_status simulate_family(struct simulate_run *run, const double *x, double period,
                               struct ad_error *error);
enum ad_status simulate_family_judge(const struct simulate_run *run, struct ad_error *error);
void simulate_family_report(const struct simulate_run *run, struct report *report);
void simulate_family_csv(const struct simulate_run *run, FILE *out);
enum ad_status simulate_family_file(const struct simulate_run *run, phys_hdf5 *file,
                                    struct ad_error *error);
enum ad_status simulate_family_picture(const struct simulate_run *run, struct plot *plot,
                                       struct ad_error *error);

/* Name of quantity k [SIMULATE_NAME]: coordinates, velocities, energy, t. */
void simulate_quantity(const struct phys_system *system, size_t k, char *name);

/* --section (simulate_section.c, section_picture.c): the axes asked for; the points of the motion,
   or of many; AD_E_ACCURACY where there are none; what is written. The CSV has a row a point. */
enum ad_status simulate_section_axes(struct simulate_run *run, struct ad_error *error);
enum ad_status simulate_section(struct simulate_run *run, const struct phys_ensemble *many,
                                struct ad_error *error);
enum ad_status simulate_section_judge(const struct simulate_run *run, struct ad_error *error);
void simulate_section_report(const struct simulate_run *run, struct report *report);
void simulate_section_csv(const struct simulate_run *run, FILE *out);
void simulate_section_file(const struct simulate_run *run, phys_hdf5 *file);
enum ad_status simulate_section_picture(const struct simulate_run *run, struct plot *plot,
                                        struct ad_error *error);

/* Derivatives of the end, with --sensitivity (simulate_sensitivity.c). */
enum ad_status simulate_sensitivity(struct simulate_run *run, struct ad_error *error);
void simulate_sensitivity_free(struct simulate_run *run);
void simulate_report_sensitivity(const struct simulate_run *run, struct report *report);

/* ---- writing ---- */

/* Of a struct simulate_run, for outputs_run. The CSV has a row a sample: t, coordinates,
 * velocities.
 */
void simulate_report(const void *run, struct report *report);
void simulate_write_csv(const void *run, FILE *out);
enum ad_status simulate_file(const void *run, phys_hdf5 *file, struct ad_error *error);
enum ad_status simulate_picture(const void *run, struct plot *plot, struct ad_error *error);
/* The models that --data --tol tried; distances from the tables. */
void simulate_ephemeris_report_models(const struct simulate_run *run, struct report *report);
void simulate_ephemeris_report(const struct simulate_run *run, struct report *report);
/* Bodies by their number of neighbours; g at the start and at the end; order against time. */
enum ad_status simulate_gas_picture(const struct simulate_run *run, struct plot *plot,
                                    struct ad_error *error);

#endif
