/* Models of the inner planets' motion (ephemeris_models.h). */
#include "ephemeris_models.h"

#include <stdlib.h>
#include <string.h>

enum { DAY = 86400, HOUR = 3600, EARTH = 3 };

static const char *const planets[EPHEMERIS_PLANETS] = {"mercury", "venus", "earth", "mars"};

/* Where the Moon is not a body of its own its mass is on the Earth. */
static const double gm_moon = 4.902800066e12;

const struct ephemeris_model ephemeris_models[EPHEMERIS_MODELS] = {
    {.name = "published (2D, semi-implicit Euler, 1 day)",
     .adds = "x and y alone, rounded masses",
     .published = true,
     .integrator = "semi-implicit",
     .setting = DAY},
    {.name = "3D Verlet, 1 day, measured GM",
     .adds = "the third dimension, masses, a method of second order",
     .integrator = "velocity-verlet",
     .setting = DAY},
    {.name = "3D Verlet, 1 hour",
     .adds = "shorter steps",
     .integrator = "velocity-verlet",
     .setting = HOUR},
    {.name = "3D Dormand-Prince 8",
     .adds = "a method whose own error is nothing here",
     .integrator = "dop853",
     .setting = EPHEMERIS_TIGHT},
    {.name = "and a rough Jupiter",
     .adds = "the pull of Jupiter, on the Sun above all",
     .integrator = "dop853",
     .setting = EPHEMERIS_TIGHT,
     .rough = "jupiter"},
    {.name = "and a rough Moon",
     .adds = "the Earth's monthly swing about their common centre",
     .integrator = "dop853",
     .setting = EPHEMERIS_TIGHT,
     .rough = "jupiter,moon"},
    {.name = "and relativity",
     .adds = "the advance of Mercury's perihelion",
     .integrator = "dop853",
     .setting = EPHEMERIS_TIGHT,
     .rough = "jupiter,moon",
     .relativity = true},
    {.name = "and a rough Saturn",
     .adds = "the pull of Saturn",
     .integrator = "dop853",
     .setting = EPHEMERIS_TIGHT,
     .rough = "jupiter,moon,saturn",
     .relativity = true},
};

const char *ephemeris_planet(size_t planet) { return planets[planet]; }

/* ---- a model made definite ---- */

static enum ad_status set_published(struct phys_system *system, struct ad_error *error)
{
    const struct phys_preset *paper = system->scene->paper;
    return phys_system_set_all(system, paper->n_set, paper->set, error);
}

static enum ad_status set_measured(const struct ephemeris_model *model,
                                   const struct ephemeris_tables *tables,
                                   struct phys_system *system, struct ad_error *error)
{
    double G = phys_system_get(system, "G"), gm = tables->table[EARTH].gm;
    if (!model->rough || !strstr(model->rough, "moon"))
        phys_system_set(system, "mass_earth", (gm + gm_moon) / G, error);
    return phys_system_set(system, "relativity", model->relativity, error);
}

/* The published path has its first two slices from the tables: the start from which a step of
   semi-implicit Euler, v += a dt; x += v dt, leads from one to the other. */
static enum ad_status start_as_published(const struct ephemeris_tables *tables,
                                         struct ephemeris_motion *motion, struct ad_error *error)
{
    size_t dims = motion->system.dims, dof = motion->system.dof;
    phys_motion *law;
    if (phys_motion_new(&motion->system, &law, error) != AD_OK)
        return error->status;
    double *a = malloc(dof * sizeof *a);
    if (!a)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        phys_motion_acceleration(law, motion->q, motion->v, 0, a, error);
    for (size_t k = 0; k < dof && error->status == AD_OK; k++) {
        const double *x = tables->table[k / dims].position + 3 * tables->first + k % dims;
        motion->v[k] = (x[3] - x[0]) / DAY - a[k] * DAY;
    }
    free(a);
    phys_motion_free(law);
    return error->status;
}

enum ad_status ephemeris_motion_open(const struct ephemeris_model *model,
                                     const struct ephemeris_tables *tables,
                                     struct ephemeris_motion *motion, struct ad_error *error)
{
    struct phys_system *system = &motion->system;
    *motion = (struct ephemeris_motion){
        .integrator = phys_integrator_find(model->integrator, error), .setting = model->setting};
    if (phys_system_open("ephemeris", system, error) != AD_OK)
        return error->status;
    if (model->published)
        set_published(system, error);
    else
        set_measured(model, tables, system, error);
    if (error->status != AD_OK ||
        phys_ephemeris_use(system, tables->n, tables->table, tables->first, tables->days + 1,
                           system->dims, NULL, error) != AD_OK)
        return error->status;
    if (model->rough &&
        phys_ephemeris_add(system, model->rough, tables->table->jd[tables->first], error) != AD_OK)
        return error->status;
    motion->q = malloc(2 * system->dof * sizeof *motion->q);
    if (!motion->q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    motion->v = motion->q + system->dof;
    if (system->scene->start(system->params, 0, motion->q, motion->v, error) == AD_OK &&
        model->published)
        start_as_published(tables, motion, error);
    return error->status;
}

void ephemeris_motion_close(struct ephemeris_motion *motion)
{
    free(motion->q);
    phys_system_close(&motion->system);
    *motion = (struct ephemeris_motion){0};
}

/* ---- against the tables ---- */

enum ad_status ephemeris_measure(const struct ephemeris_model *model,
                                 const struct ephemeris_tables *tables,
                                 struct ephemeris_errors *errors, struct ad_error *error)
{
    struct ephemeris_motion motion;
    struct ephemeris_track track = {0}, seen = {0};
    size_t columns = tables->days + 1;
    *errors = (struct ephemeris_errors){.days = tables->days};
    errors->km = calloc(EPHEMERIS_PLANETS * columns, sizeof *errors->km);
    if (!errors->km)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (ephemeris_motion_open(model, tables, &motion, error) == AD_OK &&
        ephemeris_follow(&motion, tables->days, &track, error) == AD_OK &&
        ephemeris_track_tables(tables, motion.system.dims, &seen, error) == AD_OK) {
        for (size_t i = 0; i < EPHEMERIS_PLANETS * columns; i++)
            errors->km[i] = ephemeris_apart(&track, &seen, i % columns, i / columns);
        errors->most = ephemeris_compare(&track, &seen);
        errors->evaluations = track.evaluations;
        errors->seconds = track.seconds;
    }
    ephemeris_track_free(&track);
    ephemeris_track_free(&seen);
    ephemeris_motion_close(&motion);
    return error->status;
}

void ephemeris_errors_free(struct ephemeris_errors *errors)
{
    free(errors->km);
    *errors = (struct ephemeris_errors){0};
}
