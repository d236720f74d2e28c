/* Models of the motion of the inner planets, and the choice of the simplest one that is accurate
   enough (models.h). */
#include "models.h"
#include "ephemeris.h"
#include "physics/lagrangian/euler_lagrange.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DAY = 86400, HOUR = 3600, EARTH = 3, PAPER_DAY = 148, PAPER_YEAR = 365 };

static const char bodies[] = "sun,mercury,venus,earth,mars";

static const char *const planets[PHYS_EPHEMERIS_PLANETS] = {"mercury", "venus", "earth", "mars"};

/* Where the Moon is not a body of its own its mass is on the Earth. */
static const double gm_moon = 4.902800066e12;

const struct phys_ephemeris_model phys_ephemeris_models[PHYS_EPHEMERIS_MODELS] = {
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
     .setting = PHYS_EPHEMERIS_TIGHT},
    {.name = "and a rough Jupiter",
     .adds = "the pull of Jupiter, on the Sun above all",
     .integrator = "dop853",
     .setting = PHYS_EPHEMERIS_TIGHT,
     .rough = "jupiter"},
    {.name = "and a rough Moon",
     .adds = "the Earth's monthly swing about their common centre",
     .integrator = "dop853",
     .setting = PHYS_EPHEMERIS_TIGHT,
     .rough = "jupiter,moon"},
    {.name = "and relativity",
     .adds = "the advance of Mercury's perihelion",
     .integrator = "dop853",
     .setting = PHYS_EPHEMERIS_TIGHT,
     .rough = "jupiter,moon",
     .relativity = true},
    {.name = "and a rough Saturn",
     .adds = "the pull of Saturn",
     .integrator = "dop853",
     .setting = PHYS_EPHEMERIS_TIGHT,
     .rough = "jupiter,moon,saturn",
     .relativity = true},
};

const char *phys_ephemeris_planet(size_t planet)
{
    return planet < PHYS_EPHEMERIS_PLANETS ? planets[planet] : NULL;
}

/* ---- tables ---- */

enum ad_status phys_ephemeris_tables_read(const char *folder, const char *from, size_t days,
                                          struct phys_ephemeris_tables *tables,
                                          struct ad_error *error)
{
    if (AD_LACKS(error, tables))
        return error->status;
    *tables = (struct phys_ephemeris_tables){.days = days};
    if (phys_horizons_folder(folder, bodies, &tables->n, &tables->table, error) != AD_OK)
        return error->status;
    const struct phys_horizons *table = tables->table;
    if (from && phys_horizons_epoch(table, from, &tables->first, error) != AD_OK)
        return error->status;
    if (!from && table->n >= PAPER_YEAR)
        tables->first = table->n - PAPER_YEAR + PAPER_DAY;
    if (tables->first >= table->n || days >= table->n - tables->first)
        return ad_fail(error, AD_E_INPUT,
                       "%s: %zu days from index %zu need %zu epochs, there are %zu", folder, days,
                       tables->first, tables->first + days + 1, table->n);
    double step = (table->jd[1] - table->jd[0]) * DAY;
    if (fabs(step - DAY) > 1e-3)
        return ad_fail(error, AD_E_INPUT, "%s: epochs are %.9g s apart, expected a day", folder,
                       step);
    return AD_OK;
}

void phys_ephemeris_tables_free(struct phys_ephemeris_tables *tables)
{
    if (!tables)
        return;
    for (size_t k = 0; k < tables->n; k++)
        phys_horizons_free(&tables->table[k]);
    free(tables->table);
    *tables = (struct phys_ephemeris_tables){0};
}

/* ---- a model made definite ---- */

static enum ad_status set_published(struct phys_system *system, struct ad_error *error)
{
    const struct phys_preset *paper = system->scene->paper;
    return phys_system_set_all(system, paper->n_set, paper->set, error);
}

static enum ad_status set_measured(const struct phys_ephemeris_model *model,
                                   const struct phys_ephemeris_tables *tables,
                                   struct phys_system *system, struct ad_error *error)
{
    double G = phys_system_get(system, "G"), gm = tables->table[EARTH].gm;
    if (!model->rough || !strstr(model->rough, "moon"))
        phys_system_set(system, "mass_earth", (gm + gm_moon) / G, error);
    return phys_system_set(system, "relativity", model->relativity, error);
}

/* The published path has its first two slices from the tables: the start from which a step of
   semi-implicit Euler, v += a dt; x += v dt, leads from one to the other. */
static enum ad_status start_as_published(const struct phys_ephemeris_tables *tables,
                                         struct phys_ephemeris_motion *motion,
                                         struct ad_error *error)
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

enum ad_status phys_ephemeris_motion_open(const struct phys_ephemeris_model *model,
                                          const struct phys_ephemeris_tables *tables,
                                          struct phys_ephemeris_motion *motion,
                                          struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, motion) || AD_LACKS(error, model, tables))
        return error->status;
    struct phys_system *system = &motion->system;
    *motion = (struct phys_ephemeris_motion){
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

void phys_ephemeris_motion_close(struct phys_ephemeris_motion *motion)
{
    if (!motion)
        return;
    free(motion->q);
    phys_system_close(&motion->system);
    *motion = (struct phys_ephemeris_motion){0};
}

/* ---- against the tables ---- */

enum ad_status phys_ephemeris_measure(const struct phys_ephemeris_model *model,
                                      const struct phys_ephemeris_tables *tables,
                                      struct phys_ephemeris_track *track,
                                      struct phys_ephemeris_distances *off, struct ad_error *error)
{
    struct phys_ephemeris_motion motion;
    struct phys_ephemeris_track seen = {0};
    if (AD_LACKS_RESULT(error, track) || AD_LACKS(error, off))
        return error->status;
    if (phys_ephemeris_motion_open(model, tables, &motion, error) == AD_OK &&
        phys_ephemeris_follow(&motion, tables->days, track, error) == AD_OK &&
        phys_ephemeris_track_tables(tables, track->dims, &seen, error) == AD_OK)
        *off = phys_ephemeris_compare(track, &seen);
    phys_ephemeris_track_free(&seen);
    phys_ephemeris_motion_close(&motion);
    return error->status;
}

/* ---- the least model ---- */

static bool same_content(const struct phys_ephemeris_model *a, const struct phys_ephemeris_model *b)
{
    bool same_bodies =
        a->rough && b->rough ? strcmp(a->rough, b->rough) == 0 : a->rough == b->rough;
    return same_bodies && a->relativity == b->relativity;
}

static enum ad_status out_of_reach(const struct phys_ephemeris_choice *choice, double km,
                                   struct ad_error *error)
{
    size_t best = 0;
    for (size_t k = 1; k < choice->n; k++)
        if (choice->off[k].worst < choice->off[best].worst)
            best = k;
    return ad_fail(error, AD_E_ACCURACY,
                   "%g km: none of the models comes so near; the best (%s) is %.3g km off, at %s; "
                   "fewer days bring it nearer",
                   km, phys_ephemeris_models[best].name, choice->off[best].worst,
                   planets[choice->off[best].worst_planet]);
}

enum ad_status phys_ephemeris_least(const struct phys_ephemeris_tables *tables, double km,
                                    struct phys_ephemeris_choice *choice, struct ad_error *error)
{
    const struct phys_ephemeris_model *models = phys_ephemeris_models, *found = NULL;
    if (AD_LACKS(error, choice))
        return error->status;
    *choice = (struct phys_ephemeris_choice){.chosen = PHYS_EPHEMERIS_MODELS};
    for (size_t k = 0; k < PHYS_EPHEMERIS_MODELS; k++) {
        struct phys_ephemeris_track track;
        if (found && !same_content(found, &models[k]))
            break;
        phys_ephemeris_measure(&models[k], tables, &track, &choice->off[k], error);
        choice->evaluations[choice->n++] = track.evaluations;
        phys_ephemeris_track_free(&track);
        if (error->status != AD_OK)
            return error->status;
        if (choice->off[k].worst <= km &&
            (!found || choice->evaluations[k] < choice->evaluations[choice->chosen])) {
            choice->chosen = k;
            found = &models[k];
        }
    }
    return found ? AD_OK : out_of_reach(choice, km, error);
}
