/* Positions of the Sun and the planets over time, from tables or from a motion (models.h). */
#include "models.h"

#include <math.h>
#include <stdlib.h>

enum { DAY = 86400, BODIES = PHYS_EPHEMERIS_PLANETS + 1, MOST_EVALUATIONS = 500000 };

/* Of the model's error; a smaller error of integration is not seen in the distance from tables. */
static const double unseen_share = 0.01;

static enum ad_status begin(size_t dims, size_t rows, size_t columns,
                            struct phys_ephemeris_track *track, struct ad_error *error)
{
    *track = (struct phys_ephemeris_track){.dims = dims, .row = columns, .column = 1};
    track->x = calloc(rows * columns, sizeof *track->x);
    return track->x ? AD_OK : ad_fail(error, AD_E_MEMORY, "out of memory for %zu epochs", columns);
}

void phys_ephemeris_track_free(struct phys_ephemeris_track *track)
{
    if (!track)
        return;
    free(track->x);
    *track = (struct phys_ephemeris_track){0};
}

enum ad_status phys_ephemeris_track_tables(const struct phys_ephemeris_tables *tables, size_t dims,
                                           struct phys_ephemeris_track *track,
                                           struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, track) || AD_LACKS(error, tables))
        return error->status;
    if (begin(dims, BODIES * dims, tables->days + 1, track, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < BODIES * dims; k++)
        for (size_t i = 0; i <= tables->days; i++)
            track->x[k * track->row + i] =
                tables->table[k / dims].position[3 * (tables->first + i) + k % dims];
    track->n = tables->days + 1;
    return AD_OK;
}

/* Coordinate k of a planet, seen from the Sun, which is the first body. */
static double seen(const struct phys_ephemeris_track *track, size_t epoch, size_t planet, size_t k)
{
    const double *x = track->x + epoch * track->column;
    return x[((planet + 1) * track->dims + k) * track->row] - x[k * track->row];
}

double phys_ephemeris_apart(const struct phys_ephemeris_track *a,
                            const struct phys_ephemeris_track *b, size_t epoch, size_t planet)
{
    double sum = 0;
    if (!a || !b)
        return NAN;
    for (size_t k = 0; k < a->dims; k++)
        sum += pow(seen(a, epoch, planet, k) - seen(b, epoch, planet, k), 2);
    return sqrt(sum) / 1e3;
}

struct phys_ephemeris_distances phys_ephemeris_compare(const struct phys_ephemeris_track *a,
                                                       const struct phys_ephemeris_track *b)
{
    struct phys_ephemeris_distances found = {0};
    for (size_t i = 0; a && b && i < a->n && i < b->n; i++)
        for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++) {
            double km = phys_ephemeris_apart(a, b, i, p);
            found.km[p] = fmax(found.km[p], km);
            if (km > found.worst) {
                found.worst = km;
                found.worst_planet = p;
            }
        }
    return found;
}

/* ---- a motion followed ---- */

enum ad_status phys_ephemeris_follow(const struct phys_ephemeris_motion *motion, size_t days,
                                     struct phys_ephemeris_track *track, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, track) || AD_LACKS(error, motion, motion->integrator))
        return error->status;
    struct phys_ode ode = {0};
    struct phys_simulation_info info = {0};
    size_t dof = motion->system.dof;
    bool adaptive = motion->integrator->adaptive;
    const struct phys_simulation settings = {.size = sizeof settings,
                                             .integrator = motion->integrator,
                                             .t1 = (double)days * DAY,
                                             .n_samples = days,
                                             .dt = adaptive ? 0 : motion->setting,
                                             .rtol = adaptive ? motion->setting : 0};
    double *y = malloc(2 * dof * sizeof *y);
    if (begin(motion->system.dims, dof, days + 1, track, error) != AD_OK || !y)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_ode_for(&motion->system, motion->integrator, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, 0, motion->q, motion->v, y, error) == AD_OK)
        phys_trajectory(&settings, &ode, y, dof, days + 1, track->x, &info, error);
    track->n = info.samples;
    track->evaluations = info.evaluations;
    track->seconds = info.seconds;
    phys_ode_free(&ode);
    free(y);
    return error->status;
}

/* Steps of gauss5 of a day are a fourteenth of the Moon's radian, where its error is below
   rounding; a method of its kind is compared with dop853. */
enum ad_status phys_ephemeris_follow_tightly(const struct phys_ephemeris_motion *motion,
                                             size_t days, struct phys_ephemeris_track *track,
                                             struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, track) || AD_LACKS(error, motion, motion->integrator))
        return error->status;
    struct phys_ephemeris_motion tight = *motion;
    bool explicit = motion->integrator->adaptive || !motion->integrator->symmetric ||
                    motion->integrator->separable;
    tight.integrator = phys_integrator_find(explicit ? "gauss5" : "dop853", error);
    tight.setting = explicit ? DAY : PHYS_EPHEMERIS_TIGHT;
    return phys_ephemeris_follow(&tight, days, track, error);
}

/* ---- steps ---- */

/* Halves the step until every planet stays within km of the tight track. */
static enum ad_status halve(struct phys_ephemeris_motion *motion, size_t days,
                            const struct phys_ephemeris_track *tight,
                            const double km[PHYS_EPHEMERIS_PLANETS], struct ad_error *error)
{
    double halvings = 0, ratio = INFINITY;
    for (;;) {
        struct phys_ephemeris_track track;
        struct ad_error lost = {0};
        motion->setting = DAY / pow(2, halvings);
        phys_ephemeris_follow(motion, days, &track, &lost);
        size_t evaluations = track.evaluations;
        struct phys_ephemeris_distances off = phys_ephemeris_compare(&track, tight);
        ratio = lost.status == AD_OK ? 0 : INFINITY;
        for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++)
            ratio = fmax(ratio, off.km[p] / km[p]);
        phys_ephemeris_track_free(&track);
        if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
            return ad_fail(error, lost.status, "%s", lost.message);
        double more = fmin(log2(ratio) / (double)motion->integrator->order, 3);
        more = fmax(floor(more), 1);
        if (ratio <= 1 || (double)evaluations * pow(2, more) > MOST_EVALUATIONS)
            return AD_OK;
        halvings += more;
    }
}

enum ad_status phys_ephemeris_choose_step(struct phys_ephemeris_motion *motion,
                                          const struct phys_ephemeris_tables *tables, double km,
                                          struct ad_error *error)
{
    if (AD_LACKS(error, motion, tables))
        return error->status;
    struct phys_ephemeris_track table = {0}, tight = {0};
    if (phys_ephemeris_track_tables(tables, motion->system.dims, &table, error) == AD_OK &&
        phys_ephemeris_follow_tightly(motion, tables->days, &tight, error) == AD_OK) {
        struct phys_ephemeris_distances model = phys_ephemeris_compare(&tight, &table);
        for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++)
            model.km[p] = isnan(km) ? unseen_share * model.km[p] : km;
        halve(motion, tables->days, &tight, model.km, error);
    }
    phys_ephemeris_track_free(&table);
    phys_ephemeris_track_free(&tight);
    return error->status;
}
