/* Models of the inner planets' motion, coarse to fine, and how far each stays from the tables. */
#ifndef APPS_EPHEMERIS_MODELS_H
#define APPS_EPHEMERIS_MODELS_H

#include "physics/ephemeris/horizons.h"
#include "physics/physics.h"

enum { EPHEMERIS_PLANETS = 4, EPHEMERIS_MODELS = 8, EPHEMERIS_DAYS = 65 };

/* Tolerance of a step at which dop853 errs by less than a hundredth of any model. */
#define EPHEMERIS_TIGHT 1e-14

/* Observed: the Sun, Mercury, Venus, Earth and Mars, from epoch `first` on. */
struct ephemeris_tables {
    size_t n;
    struct phys_horizons *table;
    size_t first, days;
};

/* Reads the tables of a folder, a day from epoch to epoch. from: index or date, NULL: the published
   span; days: OPTION_NO_COUNT for all of that. Ends with ephemeris_tables_close, whatever it
   returned. */
enum ad_status ephemeris_tables_open(const char *folder, const char *from, size_t days,
                                     struct ephemeris_tables *tables, struct ad_error *error);
void ephemeris_tables_close(struct ephemeris_tables *tables);

struct ephemeris_model {
    const char *name, *adds; /* adds: what it does better than the one before */
    bool published;          /* masses, plane and start as in arXiv 2303.02115 */
    const char *integrator;
    double setting;    /* dt in s, or the tolerance of a step */
    const char *rough; /* bodies without a table, or NULL */
    bool relativity;
};
/* By what they take into account; from the third on each errs less than the one before. */
extern const struct ephemeris_model ephemeris_models[EPHEMERIS_MODELS];

/* A model at the start of the tables' span. */
struct ephemeris_motion {
    struct phys_system system;
    const struct phys_integrator *integrator;
    double setting;
    double *q, *v; /* [dof], one block */
};
enum ad_status ephemeris_motion_open(const struct ephemeris_model *model,
                                     const struct ephemeris_tables *tables,
                                     struct ephemeris_motion *motion, struct ad_error *error);
void ephemeris_motion_close(struct ephemeris_motion *motion);

/* Planets seen from the Sun, a day from epoch to epoch, in the dimensions of a model. */
struct ephemeris_track {
    size_t dims, n; /* epochs */
    double *x;      /* [n][EPHEMERIS_PLANETS][dims] in m */
    size_t evaluations;
    double seconds;
};
/* Each ends with ephemeris_track_free, whatever it returned. */
enum ad_status ephemeris_track_tables(const struct ephemeris_tables *tables, size_t dims,
                                      struct ephemeris_track *track, struct ad_error *error);
/* Of samples (t [n], x [n] rows of `stride` numbers, coordinates first), up to the first that is
   not at its epoch. */
enum ad_status ephemeris_track_samples(size_t dims, size_t days, size_t n, const double *t,
                                       const double *x, size_t stride,
                                       struct ephemeris_track *track, struct ad_error *error);
enum ad_status ephemeris_follow(const struct ephemeris_motion *motion, size_t days,
                                struct ephemeris_track *track, struct ad_error *error);
/* The same model and start by another method than the motion's, so finely that its error is that
   of rounding. */
enum ad_status ephemeris_follow_tightly(const struct ephemeris_motion *motion, size_t days,
                                        struct ephemeris_track *track, struct ad_error *error);
void ephemeris_track_free(struct ephemeris_track *track);
/* Distance in km of a planet in two tracks. */
double ephemeris_apart(const struct ephemeris_track *a, const struct ephemeris_track *b,
                       size_t epoch, size_t planet);

/* Largest distances over the epochs that both tracks have. */
struct ephemeris_distances {
    double km[EPHEMERIS_PLANETS];
    double worst; /* of all */
    size_t worst_planet;
};
struct ephemeris_distances ephemeris_compare(const struct ephemeris_track *a,
                                             const struct ephemeris_track *b);

/* Halves a fixed step, from a day on, until every planet stays within km [EPHEMERIS_PLANETS] of the
   tight track, or half of it would cost too much; motion->setting. */
enum ad_status ephemeris_choose_step(struct ephemeris_motion *motion, size_t days,
                                     const struct ephemeris_track *tight,
                                     const double km[EPHEMERIS_PLANETS], struct ad_error *error);

/* A model against the tables. */
struct ephemeris_errors {
    size_t days;
    double *km; /* [EPHEMERIS_PLANETS][days + 1] */
    struct ephemeris_distances most;
    size_t evaluations;
    double seconds;
};
const char *ephemeris_planet(size_t planet); /* its name */
/* Runs a model. Ends with ephemeris_errors_free. */
enum ad_status ephemeris_measure(const struct ephemeris_model *model,
                                 const struct ephemeris_tables *tables,
                                 struct ephemeris_errors *errors, struct ad_error *error);
void ephemeris_errors_free(struct ephemeris_errors *errors);

#endif
