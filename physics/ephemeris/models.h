/* Models of the motion of the inner planets, from coarse to fine, and the distance of each from
   Horizons tables:

       struct phys_ephemeris_tables tables;
       struct phys_ephemeris_choice choice;
       phys_ephemeris_tables_read("horizons", NULL, 65, &tables, &error);
       phys_ephemeris_least(&tables, 1000, &choice, &error);  the simplest within 1000 km
       ... phys_ephemeris_models[choice.chosen].name, choice.off[choice.chosen].worst ...
       phys_ephemeris_tables_free(&tables);

   Positions are relative to the Sun, at epochs a day apart.

   Units are AU and days, distances km where named so. Errors: AD_E_ARGUMENT, AD_E_INPUT and
   AD_E_IO of tables, AD_E_MEMORY. Threads: calls may run at once on different motions. */
#ifndef PHYSICS_EPHEMERIS_MODELS_H
#define PHYSICS_EPHEMERIS_MODELS_H

#include "horizons.h"
#include "physics/motion/motion.h"

AD_HEADER_BEGIN

enum { PHYS_EPHEMERIS_PLANETS = 4, PHYS_EPHEMERIS_MODELS = 8 };

/* Tolerance of a step at which dop853 errs by less than a hundredth of any model. */
#define PHYS_EPHEMERIS_TIGHT 1e-14

/* ---- tables ---- */

/* The Sun, Mercury, Venus, Earth and Mars, at the days + 1 epochs from number `first` on. */
struct phys_ephemeris_tables {
    size_t n;
    struct phys_horizons *table; /* [n] */
    size_t first, days;
};
/* Reads the tables of a folder. from: index or date, NULL: the published span. AD_E_INPUT where the
   span is not in the tables or epochs are no day apart. Ends with phys_ephemeris_tables_free,
   whatever it returned. */
enum ad_status phys_ephemeris_tables_read(const char *folder, const char *from, size_t days,
                                          struct phys_ephemeris_tables *tables,
                                          struct ad_error *error);
void phys_ephemeris_tables_free(struct phys_ephemeris_tables *tables);
const char *phys_ephemeris_planet(size_t planet); /* its name; NULL: none */

/* ---- tracks ---- */

/* The Sun and the planets at n epochs: coordinate k at epoch i, in m, is x[k * row + i * column].
 */
struct phys_ephemeris_track {
    size_t dims, n, row, column;
    double *x;
    size_t evaluations; /* of the forces */
    double seconds;
};
/* Largest distances in km, over the epochs that two tracks have. */
struct phys_ephemeris_distances {
    double km[PHYS_EPHEMERIS_PLANETS];
    double worst; /* of all */
    size_t worst_planet;
};
void phys_ephemeris_track_free(struct phys_ephemeris_track *track);
/* Positions from tables. Free *track with phys_ephemeris_track_free in any case, as every filled
   track. */
enum ad_status phys_ephemeris_track_tables(const struct phys_ephemeris_tables *tables, size_t dims,
                                           struct phys_ephemeris_track *track,
                                           struct ad_error *error);
/* Distance of a planet in two tracks, in km. */
double phys_ephemeris_apart(const struct phys_ephemeris_track *a,
                            const struct phys_ephemeris_track *b, size_t epoch, size_t planet);
struct phys_ephemeris_distances phys_ephemeris_compare(const struct phys_ephemeris_track *a,
                                                       const struct phys_ephemeris_track *b);

/* ---- motions ---- */

/* An ephemeris system at its start, and its integration; setting is dt in s, or the tolerance of a
   step. */
struct phys_ephemeris_motion {
    struct phys_system system;
    const struct phys_integrator *integrator;
    double setting;
    double *q, *v; /* [dof], one block */
};
enum ad_status phys_ephemeris_follow(const struct phys_ephemeris_motion *motion, size_t days,
                                     struct phys_ephemeris_track *track, struct ad_error *error);
/* Follow a motion over a number of days; the second by another kind of method, so finely that only
   rounding remains. Free *track with phys_ephemeris_track_free in any case. */
enum ad_status phys_ephemeris_follow_tightly(const struct phys_ephemeris_motion *motion,
                                             size_t days, struct phys_ephemeris_track *track,
                                             struct ad_error *error);
/* Chooses the step motion->setting of a method with fixed steps: a day is halved until the
   integration error is under km, or (NaN) under a hundredth of the model's own error, or half the
   step would cost too much. */
enum ad_status phys_ephemeris_choose_step(struct phys_ephemeris_motion *motion,
                                          const struct phys_ephemeris_tables *tables, double km,
                                          struct ad_error *error);

/* ---- models ---- */

struct phys_ephemeris_model {
    const char *name, *adds; /* adds: what it does better than the one before */
    bool published;          /* masses, plane and start as in arXiv 2303.02115 */
    const char *integrator;
    double setting;    /* dt in s, or the tolerance of a step */
    const char *rough; /* bodies without a table, or NULL */
    bool relativity;
};
/* By increasing number of effects; from the third on each is more accurate than the one before. */
extern const struct phys_ephemeris_model phys_ephemeris_models[PHYS_EPHEMERIS_MODELS];

/* Opens a model at the start of the tables' span. Free with phys_ephemeris_motion_close in any
   case. */
enum ad_status phys_ephemeris_motion_open(const struct phys_ephemeris_model *model,
                                          const struct phys_ephemeris_tables *tables,
                                          struct phys_ephemeris_motion *motion,
                                          struct ad_error *error);
void phys_ephemeris_motion_close(struct phys_ephemeris_motion *motion);

/* Follows a model over the tables' span and measures its distance from them. Free *track with
   phys_ephemeris_track_free in any case. */
enum ad_status phys_ephemeris_measure(const struct phys_ephemeris_model *model,
                                      const struct phys_ephemeris_tables *tables,
                                      struct phys_ephemeris_track *track,
                                      struct phys_ephemeris_distances *off, struct ad_error *error);

/* The models tried, up to the first with an error of at most km: the fewest bodies and effects, and
   among equals the fewest evaluations of the forces. */
struct phys_ephemeris_choice {
    size_t n;      /* tried */
    size_t chosen; /* n: none is good enough */
    struct phys_ephemeris_distances off[PHYS_EPHEMERIS_MODELS];
    size_t evaluations[PHYS_EPHEMERIS_MODELS]; /* of the forces */
};
/* Tries models until one is accurate to km. AD_E_ACCURACY, naming the best, if none is. */
enum ad_status phys_ephemeris_least(const struct phys_ephemeris_tables *tables, double km,
                                    struct phys_ephemeris_choice *choice, struct ad_error *error);

AD_HEADER_END
#endif
