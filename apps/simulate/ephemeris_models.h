/* Models of the inner planets' motion, coarse to fine, and how far each stays from the tables. */
#ifndef APPS_EPHEMERIS_MODELS_H
#define APPS_EPHEMERIS_MODELS_H

#include "physics/ephemeris/horizons.h"
#include "physics/motion/motion.h"

enum { EPHEMERIS_PLANETS = 4, EPHEMERIS_MODELS = 8, EPHEMERIS_DAYS = 65 };

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

/* Distances of the planets from the tables, both seen from the Sun, in the dimensions of the
   model. */
struct ephemeris_errors {
    size_t days;
    double *km;                     /* [EPHEMERIS_PLANETS][days + 1] */
    double most[EPHEMERIS_PLANETS]; /* over the days */
    double worst;                   /* of all */
    size_t worst_planet;
    size_t evaluations;
    double seconds;
};
const char *ephemeris_planet(size_t planet); /* its name */
/* The distance in km of one planet at one epoch from q [dof], of which the first bodies are those
   of the tables. */
double ephemeris_distance(const struct ephemeris_tables *tables, size_t dims, const double *q,
                          size_t planet, size_t day);
/* Runs a model. Ends with ephemeris_errors_free. */
enum ad_status ephemeris_measure(const struct ephemeris_model *model,
                                 const struct ephemeris_tables *tables,
                                 struct ephemeris_errors *errors, struct ad_error *error);
void ephemeris_errors_free(struct ephemeris_errors *errors);

#endif
