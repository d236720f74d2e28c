/* The parts of `leastaction path`: options, setup (path_setup, and path_tolerance for --tol), run
   and record (path_record), output (path_write, path_picture). */
#ifndef APPS_PATH_PATH_H
#define APPS_PATH_PATH_H

#include "apps/options.h"
#include "apps/output/plot.h"
#include "apps/output/progress.h"
#include "apps/output/report.h"
#include "apps/scene_inputs.h"
#include "physics/ephemeris/horizons.h"
#include "physics/motion/motion.h"
#include "physics/physics.h"
#include "physics/stability/periodic.h"
#include "physics/io/hdf5_file.h"

struct path_options {
    struct common common;
    const char *solver, *rule, *init, *reference, *preset;
    const char *start, *end, *time;   /* the ends, and the time between them ... */
    const char *inputs;               /* of a model */
    const char *relate;               /* ... and relations between them */
    const char *follow;               /* --continue */
    const char *data, *from, *bodies; /* of the ephemeris */
    size_t slices, steps, every, days, dims, adam_steps, hold;
    double dt, learning_rate, momentum, noise, tolerance, grad_tolerance, energy_weight;
    const char *energy_loss, *ends;
    bool stop_at_reference, all, blocks, choreography;
    double energy;
};

/* History of a run, and paths on the way: to the run file as they come, a few for the picture. */
struct path_record {
    const struct path_run *run;
    phys_hdf5 *file; /* NULL: no --out */
    struct progress progress;
    size_t n;
    struct phys_path_figures *figures; /* [n], one a step, the start first */
    size_t frame_every, n_frames;
    size_t *frame_step;
    double *frames; /* [n_frames x dof x slices] */
    bool failed;    /* out of memory */
};

/* The settings of a run with all defaults resolved, and its results. Paths are [degree of the rule
 * dof x slices]; their first dof rows are the slices. */
struct path_run {
    const struct path_options *options;
    struct phys_system system;
    struct scene_inputs inputs;
    const struct phys_preset *preset; /* NULL: none asked for */
    const struct phys_solver *solver;
    struct phys_path_settings settings;
    struct phys_noise noise;          /* on the start; sigma 0: none */
    size_t every;                     /* steps from one stored path to the next */
    struct phys_ends ends;            /* what is free there; settings.ends */
    double *given;                    /* [dof x 2] ends of --start, --end; NaN: free. NULL: none */
    bool *moves;                      /* [2 x dof] which of them are free */
    double *relation;                 /* [..][2 dof + 1] of ends */
    struct phys_path_share share;     /* by blocks: what of it this rank has */
    double *reference, *start, *path; /* reference NULL: there is none ... */
    bool led_away;                    /* the discretised motion, so that the true one stands in */
    const char *reference_is;         /* ... or what it is */
    size_t n_tables;                  /* of --data, and what its first slice is in them */
    struct phys_horizons *tables;
    size_t first_epoch;
    struct phys_ode ode;             /* of all motions; settings.ode */
    struct phys_refined refined;     /* --tol; none else */
    bool along;                      /* ... on elements along the motion: else it is singular */
    struct phys_continuation follow; /* --continue; name NULL: none */
    char followed[64];               /* its name */
    struct phys_continued continued;
    struct path_record record;
    struct phys_path_found found;
    struct phys_periodic periodic;   /* --ends periodic; none else ... */
    double off;                      /* ... and how far from it the path is */
    struct phys_solutions solutions; /* --all, --energy; none else */
    double longest;                  /* time of theirs, where it is free */
    size_t chosen;
};

/* Everything up to the start: scene, parameters, rule, solver, span, reference path, start.
   Ends with path_run_free, whatever it returned. */
enum ad_status path_setup(const struct path_options *options, struct path_run *run,
                          struct ad_error *error);
void path_run_free(struct path_run *run);
/* An uninitialised path of a run, for the caller to free; NULL: out of memory. */
double *path_new(const struct path_run *run, struct ad_error *error);
/* A path from a file of text with a row for each slice, [dof x slices]; its columns are the
   coordinates by name, or in their order, and the time t is checked where there is one. */
double *path_read(const struct path_run *run, const char *file, struct ad_error *error);
/* The first or last row of such a file, of any number of rows: x [dof]. */
enum ad_status path_read_end(const struct path_run *run, const char *file, bool last, double *x,
                             struct ad_error *error);

/* Bodies and dimensions of the ephemeris, from the tables of --data if given; these then set span
   and time step, and `observed` [dof x slices] is what they say (else NULL). The options of the
   ephemeris are refused with any other scene. */
enum ad_status path_ephemeris(const struct path_options *options, struct path_run *run,
                              double **observed, struct ad_error *error);

/* AD_E_ACCURACY where the path found is not the one of the tables, but another stationary path
   between the same ends. */
enum ad_status path_ephemeris_judge(const struct path_run *run, struct ad_error *error);

/* Start, reference and room for the path of a run whose settings are made; takes `observed`. Ends
   path_setup. (path_start.c) */
enum ad_status path_start(struct path_run *run, double *observed, struct ad_error *error);
/* Whether the start is a line: by default, without a preset and tables. */
bool path_from_line(const struct path_options *options);
/* Whether it is what tables say: by default, with --data and without a preset. */
bool path_from_tables(const struct path_options *options);
/* Whether the start is read from a file. */
bool path_from_file(const struct path_options *options);

/* ---- ends (path_ends.c) ---- */

/* Whether --time free was given. */
bool path_time_is_free(const struct path_options *options);
/* --start, --end and --time: fills run->ends and run->given, and the time step, once rule, slices
   and time step are chosen. */
enum ad_status path_ends(struct path_run *run, struct ad_error *error);
/* Index of the coordinate called so. */
size_t path_coordinate(const struct path_run *run, const char *name, struct ad_error *error);
/* --relate: fills the relations of run->ends. (path_relations.c) */
enum ad_status path_relations(struct path_run *run, struct ad_error *error);
/* Puts run->start, a path [dof x slices] unless it is a line (`line`), between run->given. */
enum ad_status path_meet_ends(struct path_run *run, bool line, struct ad_error *error);
/* The coordinates and the time that were free, as found. */
void path_report_ends(const struct path_run *run, struct report *report);

/* ---- periodic paths (path_periodic.c) ---- */

/* Whether --ends periodic was given, and whether it goes with the other options. */
bool path_is_periodic(const struct path_options *options);
enum ad_status path_periodic_check(const struct path_run *run, struct ad_error *error);
/* How many times the time of the path the period is: 1, or of a choreography the bodies. */
size_t path_shares(const struct path_run *run);
/* Room for the ends, all free; then, with a start, the relations that close them. */
enum ad_status path_periodic_ends(struct path_run *run, struct ad_error *error);
void path_periodic_relate(struct path_run *run);
/* From run->path a stationary path, from that the periodic motion near it, which becomes the
   reference, and run->path, with its period; `info` of the former. AD_E_ACCURACY: there is none. */
enum ad_status path_periodic_solve(struct path_run *run, struct phys_path_info *info,
                                   struct ad_error *error);
/* How far from that motion run->path is, once it is stationary again; its steps began with info. */
enum ad_status path_periodic_compare(struct path_run *run, const struct phys_path_info *info,
                                     struct ad_error *error);
/* With --tol: doubles the elements until the path is near enough to the motion. */
enum ad_status path_periodic_refine(struct path_run *run, struct ad_error *error);
enum ad_status path_periodic_judge(const struct path_run *run, struct ad_error *error);
void path_periodic_report(const struct path_run *run, struct report *report);

/* ---- refining (path_tolerance.c) ---- */

static const double PATH_TIGHTEST = 1e-13; /* of the motion that gives ends and reference */

/* Whether --tol was given, and whether it goes with the other options. */
bool path_wants_tolerance(const struct path_options *options);
enum ad_status path_check_tolerance(const struct path_run *run, struct ad_error *error);
/* Of a run that is set up, makes one of the coarsest setting whose estimated error is under --tol:
   its rule, slices, start and reference. AD_E_ACCURACY where there is none. */
enum ad_status path_refine(struct path_run *run, struct ad_error *error);
/* The estimate of the setting chosen; NaN without --tol. */
double path_estimate(const struct path_run *run);
/* What was tried and chosen; nothing without --tol. */
void path_report_levels(const struct path_run *run, struct report *report);

/* ---- continuation (path_continue.c) ---- */

/* Reads --continue, if there is one, and sets its parameter to the last value. */
enum ad_status path_continuation(struct path_run *run, struct ad_error *error);
void path_report_continued(const struct path_run *run, struct report *report);

/* The scene's motion, or its closed form, by steps whose relative error is under the tolerance:
   path [dof x slices]. (path_start.c) */
enum ad_status path_motion(const struct path_run *run, size_t slices, double dt, double tolerance,
                           double *path, struct ad_error *error);
/* ---- by blocks, on ranks (path_blocks.c) ---- */

/* Whether the path is found by fixed blocks of slices: on many ranks, or with --blocks. */
bool path_by_blocks(const struct path_options *options);
/* Refuses options that such a run does not look at. */
enum ad_status path_blocks_check(const struct path_options *options, struct ad_error *error);
/* This rank's share of the start, in run->path; ends path_setup. */
enum ad_status path_blocks_start(struct path_run *run, struct ad_error *error);
/* Finds and writes it. Returns the exit status. */
int path_blocks_run(const struct path_options *options, struct ad_error *error);
/* Its results (path_report.c). */
void path_report_blocks(const void *run, struct report *report);

/* ---- recording (path_record.c) ---- */

/* `pictures`: keep frames. `file` may be NULL. */
void path_record_begin(struct path_record *record, const struct path_run *run, phys_hdf5 *file,
                       bool pictures);
/* The progress callback of a solver; context is the record. */
bool path_record_step(void *record, const struct phys_path_step *step);
/* Within a step, or a search for all paths. */
bool path_record_proceed(void *record);
void path_record_free(struct path_record *record);

/* What kind of path it is (path_verdict.c). */
void path_report_kind(const struct path_run *run, struct report *report);

/* ---- several solutions (path_solutions.c) ---- */

/* Whether --all or --energy was given. */
bool path_wants_all(const struct path_options *options);
/* Fills solutions, and run->path with the chosen one. */
enum ad_status path_find_all(struct path_run *run, struct ad_error *error);
void path_report_solutions(const struct path_run *run, struct report *report);

/* ---- judging (path_diagnostics.c) ---- */

/* Warns, on standard error unless --quiet, of a descent that moves away from the stationary path.
 */
void path_diagnose(const struct path_run *run);
/* Adds to an error what to try where values ceased to be finite, or are not finite at the start. */
void path_diagnose_lost(const struct path_run *run, struct ad_error *error);

/* ---- writing ---- */

/* Mean square of the distance from the reference; NaN: there is none. */
double path_mse(const struct path_run *run, const double *path);
/* The name of a reason to stop. */
const char *path_stop_name(enum phys_stop stop);
/* Of a struct path_run, for outputs_run. The CSV has a row a slice under a line of names: t, then
   the coordinates. */
void path_report(const void *run, struct report *report);
void path_write_csv(const void *run, FILE *out);
void path_write_titles(const struct path_run *run, FILE *out);
enum ad_status path_picture(const void *run, struct plot *plot, struct ad_error *error);
/* What is known before the run; the rest, after it. */
enum ad_status path_file_begin(const struct path_run *run, phys_hdf5 *file, struct ad_error *error);
enum ad_status path_file(const void *run, phys_hdf5 *file, struct ad_error *error);

#endif
