/* All initial velocities of one coordinate, or along the one that constraints leave (multistart.h):
   a root of the miss between neighbours of other sign, which is bisected, and two where the miss
   comes near zero and back. The misses are found by all ranks. */
#include "multistart.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BISECTIONS = 30, SECTIONS = 20 };
static const double GOLDEN = 0.381966011250105;
static const double GRID = 1.02; /* ratio of neighbouring velocities */
static const double ALONG = 30;  /* natural speeds, of motions with constraints */

/* The miss along the direction that is left, or the momentum of one coordinate where the end is
   free; NaN where the motion is lost. */
static double miss_of(struct phys_multistart *s, double velocity)
{
    double p = (double)NAN, sum = 0;
    if (!phys_multistart_velocity(s, velocity) || !phys_multistart_shoot(s))
        return p;
    for (size_t k = 0; k < s->dof; k++)
        sum += s->along[s->dof + k] * phys_multistart_miss(s, k);
    if (!s->legendre)
        return sum;
    phys_legendre_momentum(s->legendre, s->y, s->y + 1, s->settings.dt * (double)(s->slices - 1),
                           &p, NULL);
    return p;
}

static enum ad_status bisect(struct phys_multistart *s, double low, double high, double miss_low,
                             struct ad_error *error)
{
    for (int k = 0; k < BISECTIONS && miss_low != 0; k++) {
        double middle = 0.5 * (low + high), here = miss_of(s, middle);
        if (!isfinite(here))
            return AD_OK;
        if ((here < 0) == (miss_low < 0))
            low = middle;
        else
            high = middle;
    }
    return phys_multistart_velocity(s, low) && phys_multistart_begin(s)
               ? phys_multistart_settle(s, error)
               : AD_OK;
}

/* Velocities v with misses of one sign, the middle one the least: two roots, where golden sections
   towards the least come to the other sign. */
static enum ad_status find_pair(struct phys_multistart *s, const double *v, const double *misses,
                                struct ad_error *error)
{
    double low = v[0], middle = v[1], high = v[2], least = fabs(misses[1]);
    for (int k = 0; k < SECTIONS; k++) {
        const bool right = high - middle > middle - low;
        const double at = middle + GOLDEN * ((right ? high : low) - middle), here = miss_of(s, at);
        if (!isfinite(here))
            return AD_OK;
        if ((here < 0) != (misses[1] < 0))
            return bisect(s, v[0], at, misses[0], error) == AD_OK ? bisect(s, at, v[2], here, error)
                                                                  : error->status;
        if (fabs(here) < least) {
            *(right ? &low : &high) = middle;
            middle = at;
            least = fabs(here);
        } else {
            *(right ? &high : &low) = at;
        }
    }
    return AD_OK;
}

static bool has_pair(const double *misses)
{
    for (size_t k = 0; k < 3; k += 2)
        if (!isfinite(misses[k]) || misses[1] == 0 || (misses[k] < 0) != (misses[1] < 0) ||
            fabs(misses[k]) < fabs(misses[1]))
            return false;
    return true;
}

struct sweep {
    struct phys_multistart *s;
    double range;
    int half;
};

/* Velocity k of 2 half + 1. */
static double velocity_of(const struct sweep *sweep, int k)
{
    const int from_zero = k - sweep->half;
    double size = sweep->s->speed * sweep->range * pow(GRID, fabs((double)from_zero) - sweep->half);
    return from_zero == 0 ? 0 : from_zero < 0 ? -size : size;
}

static enum ad_status find_miss(void *context, size_t k, void *miss, struct ad_error *error)
{
    const struct sweep *sweep = context;
    struct phys_multistart *s = sweep->s;
    *(double *)miss = (double)NAN;
    if (!s->solutions->interrupted && phys_multistart_goes_on(s))
        *(double *)miss = miss_of(s, velocity_of(sweep, (int)k));
    return error->status;
}

enum ad_status phys_multistart_sweep(struct phys_multistart *s, struct ad_error *error)
{
    const double range = s->left < s->dof ? ALONG : PHYS_MULTISTART_RANGE;
    const int half = (int)ceil(2 * log(range) / log(GRID)), n = 2 * half + 1;
    struct sweep sweep = {s, range, half};
    double v[3] = {0}, misses[3] = {NAN, NAN, NAN}; /* the last three */
    double *miss = malloc((size_t)n * sizeof *miss);
    if (!miss)
        ad_fail(error, AD_E_MEMORY, "out of memory for %d velocities", n);
    if (ad_ranks_agree(s->ranks, error) == AD_OK)
        ad_ranks_deal(s->ranks, (size_t)n, sizeof *miss, find_miss, &sweep, miss, error);
    for (int k = 0; k < n && error->status == AD_OK && phys_multistart_goes_on(s); k++) {
        memmove(v, v + 1, 2 * sizeof *v);
        memmove(misses, misses + 1, 2 * sizeof *misses);
        v[2] = velocity_of(&sweep, k);
        const double here = misses[2] = miss[k], before = misses[1];
        if (here == 0 ||
            (isfinite(before) && isfinite(here) && before != 0 && (here < 0) != (before < 0)))
            bisect(s, here == 0 ? v[2] : v[1], v[2], here == 0 ? 0 : before, error);
        else if (has_pair(misses))
            find_pair(s, v, misses, error);
    }
    free(miss);
    s->solutions->fastest = s->speed * range;
    return error->status;
}
