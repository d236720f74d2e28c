/* Positions of the planets from the Sun at every epoch: of the tables, of a model, of a run
   (ephemeris_models.h). */
#include "ephemeris_models.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DAY = 86400, MOST_EVALUATIONS = 500000 };

static enum ad_status begin(size_t dims, size_t days, struct ephemeris_track *track,
                            struct ad_error *error)
{
    *track = (struct ephemeris_track){.dims = dims};
    track->x = calloc((days + 1) * EPHEMERIS_PLANETS * dims, sizeof *track->x);
    return track->x ? AD_OK : ad_fail(error, AD_E_MEMORY, "out of memory");
}

void ephemeris_track_free(struct ephemeris_track *track)
{
    free(track->x);
    *track = (struct ephemeris_track){0};
}

static double *row(const struct ephemeris_track *track, size_t epoch, size_t planet)
{
    return track->x + (epoch * EPHEMERIS_PLANETS + planet) * track->dims;
}

static void add(struct ephemeris_track *track, const double *q)
{
    for (size_t p = 0; p < EPHEMERIS_PLANETS; p++)
        for (size_t k = 0; k < track->dims; k++)
            row(track, track->n, p)[k] = q[(p + 1) * track->dims + k] - q[k];
    track->n++;
}

enum ad_status ephemeris_track_tables(const struct ephemeris_tables *tables, size_t dims,
                                      struct ephemeris_track *track, struct ad_error *error)
{
    double q[(EPHEMERIS_PLANETS + 1) * 3];
    if (begin(dims, tables->days, track, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i <= tables->days; i++) {
        for (size_t k = 0; k < (EPHEMERIS_PLANETS + 1) * dims; k++)
            q[k] = tables->table[k / dims].position[3 * (tables->first + i) + k % dims];
        add(track, q);
    }
    return AD_OK;
}

enum ad_status ephemeris_track_samples(size_t dims, size_t days, size_t n, const double *t,
                                       const double *x, size_t stride,
                                       struct ephemeris_track *track, struct ad_error *error)
{
    if (begin(dims, days, track, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i < n && i <= days && fabs(t[i] - (double)i * DAY) < 1; i++)
        add(track, x + i * stride);
    return AD_OK;
}

double ephemeris_apart(const struct ephemeris_track *a, const struct ephemeris_track *b,
                       size_t epoch, size_t planet)
{
    double sum = 0;
    for (size_t k = 0; k < a->dims; k++)
        sum += pow(row(a, epoch, planet)[k] - row(b, epoch, planet)[k], 2);
    return sqrt(sum) / 1e3;
}

struct ephemeris_distances ephemeris_compare(const struct ephemeris_track *a,
                                             const struct ephemeris_track *b)
{
    struct ephemeris_distances found = {0};
    for (size_t i = 0; i < a->n && i < b->n; i++)
        for (size_t p = 0; p < EPHEMERIS_PLANETS; p++) {
            double km = ephemeris_apart(a, b, i, p);
            found.km[p] = fmax(found.km[p], km);
            if (km > found.worst) {
                found.worst = km;
                found.worst_planet = p;
            }
        }
    return found;
}

/* ---- a model followed ---- */

static bool take(void *track, double t, const double *y)
{
    (void)t;
    add(track, y);
    return true;
}

enum ad_status ephemeris_follow(const struct ephemeris_motion *motion, size_t days,
                                struct ephemeris_track *track, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct phys_simulation_info info = {0};
    size_t dof = motion->system.dof;
    double *y = malloc(4 * dof * sizeof *y), *scale = y ? y + 2 * dof : NULL;
    bool adaptive = motion->integrator->adaptive;
    struct phys_simulation settings = {.integrator = motion->integrator,
                                       .t1 = (double)days * DAY,
                                       .n_samples = days,
                                       .sample = take,
                                       .context = track,
                                       .scale = scale,
                                       .dt = adaptive ? 0 : motion->setting,
                                       .rtol = adaptive ? motion->setting : 0,
                                       .atol = adaptive ? motion->setting : 0};
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (begin(motion->system.dims, days, track, error) == AD_OK &&
        (motion->integrator->lagrangian ? phys_ode_canonical : phys_ode_lagrangian)(
            &motion->system, &ode, error) == AD_OK &&
        phys_ode_enter(&ode, 0, motion->q, motion->v, y, error) == AD_OK &&
        phys_typical_sizes(&ode, 0, y, scale, error) == AD_OK)
        phys_simulate(&settings, &ode, y, &info, error);
    track->evaluations = info.evaluations;
    track->seconds = info.seconds;
    phys_ode_free(&ode);
    free(y);
    return error->status;
}

/* Steps of gauss5 of a day are a fourteenth of the Moon's radian, where its error is below
   rounding; a method of its kind is compared with dop853. */
enum ad_status ephemeris_follow_tightly(const struct ephemeris_motion *motion, size_t days,
                                        struct ephemeris_track *track, struct ad_error *error)
{
    struct ephemeris_motion tight = *motion;
    bool explicit = motion->integrator->adaptive || !motion->integrator->symmetric ||
                    motion->integrator->separable;
    tight.integrator = phys_integrator_find(explicit ? "gauss5" : "dop853", error);
    tight.setting = explicit ? DAY : EPHEMERIS_TIGHT;
    return ephemeris_follow(&tight, days, track, error);
}

/* ---- steps ---- */

enum ad_status ephemeris_choose_step(struct ephemeris_motion *motion, size_t days,
                                     const struct ephemeris_track *tight,
                                     const double km[EPHEMERIS_PLANETS], struct ad_error *error)
{
    double halvings = 0;
    for (;;) {
        struct ephemeris_track track;
        motion->setting = DAY / pow(2, halvings);
        struct ad_error lost = {0};
        ephemeris_follow(motion, days, &track, &lost);
        size_t evaluations = track.evaluations;
        struct ephemeris_distances off = ephemeris_compare(&track, tight);
        double ratio = lost.status == AD_OK ? 0 : INFINITY;
        for (size_t p = 0; p < EPHEMERIS_PLANETS; p++)
            ratio = fmax(ratio, off.km[p] / km[p]);
        ephemeris_track_free(&track);
        if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
            return ad_fail(error, lost.status, "%s", lost.message);
        if (ratio <= 1)
            return AD_OK;
        double more = fmin(log2(ratio) / (double)motion->integrator->order, 3);
        more = fmax(floor(more), 1);
        if ((double)evaluations * pow(2, more) > MOST_EVALUATIONS)
            return AD_OK;
        halvings += more;
    }
}
