/* The sine-Gordon field on a lattice of n sites over a length l, h = l/n apart:
       L = h sum of v_k^2/2 - (q_k+1 - q_k)^2 / (2 h^2) - (1 - cos q_k),
   that of phi_tt = phi_xx - sin phi to order h^2. The ends are free, or closed to a ring. It starts
   as a kink, 4 atan exp(g (x - u t)), g = 1/sqrt(1 - u^2), of energy 8 g and momentum 8 g u, or as
   a breather at rest, 4 atan(k/w sin(w t) / cosh(k x)), k = sqrt(1 - w^2), of energy 16 k
   (Rajaraman, Solitons and Instantons, section 2.5). In a ring the field of a kink is 2 pi higher
   behind it. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>

enum { FEWEST = 3, MOST = 1000000 };

struct field {
    double sites, length, speed, frequency, ring;
};

static const struct phys_param params[] = {
    {"sites", "1", "a whole number from 3 to 1000000", 80, offsetof(struct field, sites)},
    {"length", "1", "of the lattice", 20, offsetof(struct field, length)},
    {"speed", "1", "of the kink, in units of light's", 0.5, offsetof(struct field, speed)},
    {"frequency", "1", "of a breather, below 1; 0: a kink", 0, offsetof(struct field, frequency)},
    {"ring", "1", "1: the last site is next to the first", 0, offsetof(struct field, ring)},
};

static size_t sites_of(const void *p)
{
    const struct field *s = p;
    bool whole = s->sites >= FEWEST && s->sites <= MOST && floor(s->sites) == s->sites;
    bool inside = fabs(s->speed) < 1 && s->frequency >= 0 && s->frequency < 1 && s->length > 0;
    return whole && inside ? (size_t)s->sites : 0;
}

static ad_var spacing(const struct field *s) { return ad_div(PHYS_PARAM(s, length), s->sites); }

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct field *s = p;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, spacing(s)), ad_sum_rows(ad_square(v)));
}

/* The sum over bonds of dq weight, where dq is the difference of the field along a bond and weight
   that difference, or with `momentum` the sum of the velocities at its sites. */
static ad_var over_bonds(ad_var q, ad_var v, const struct field *s, bool momentum)
{
    const size_t n = sites_of(s);
    ad_var d = ad_sub(ad_slice_rows(q, 1, n - 1), ad_slice_rows(q, 0, n - 1));
    ad_var u = momentum ? ad_add(ad_slice_rows(v, 1, n - 1), ad_slice_rows(v, 0, n - 1)) : d;
    ad_var sum = ad_sum_rows(ad_mul(d, u));
    if (s->ring == 0)
        return sum;
    ad_var last = ad_sub(ad_row(q, 0), ad_row(q, n - 1));
    last = s->frequency == 0 ? ad_add(last, 2 * M_PI) : last;
    return ad_add(sum, ad_mul(last, momentum ? ad_add(ad_row(v, 0), ad_row(v, n - 1)) : last));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct field *s = p;
    (void)t;
    ad_var springs = ad_div(ad_mul(0.5, over_bonds(q, v, s, false)), spacing(s));
    return ad_add(springs, ad_mul(spacing(s), ad_sum_rows(ad_sub(1, ad_cos(q)))));
}

/* -integral of phi_t phi_x. */
static ad_var momentum(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)t;
    return ad_mul(-0.5, over_bonds(q, v, p, true));
}

static double place(const struct field *s, size_t site)
{
    return s->length * (((double)site + 0.5) / s->sites - 0.5);
}

/* The root of the integral of (q - phi)^2, phi being the solution on an endless line. 4 atan(exp y)
   is written as pi + 4 atan(tanh(y/2)), which does not overflow. */
static ad_var distance(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct field *s = p;
    const size_t n = sites_of(s);
    const double w = s->frequency, k = sqrt(1 - w * w), g = 1 / sqrt(1 - s->speed * s->speed);
    double *at = malloc(n * sizeof *at);
    (void)v;
    if (!at)
        return ad_refuse(q.tape, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n; i++)
        at[i] = w > 0 ? k / w / cosh(k * place(s, i)) : place(s, i);
    ad_var x = ad_const(q.tape, n, 1, at);
    free(at);
    ad_var tangent = w > 0 ? ad_mul(x, ad_sin(ad_mul(w, t)))
                           : ad_tanh(ad_mul(g / 2, ad_sub(x, ad_mul(s->speed, t))));
    ad_var off = ad_sub(ad_sub(q, w > 0 ? 0 : M_PI), ad_mul(4, ad_atan(tangent)));
    return ad_sqrt(ad_mul(spacing(s), ad_sum_rows(ad_square(off))));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct field *s = p;
    const size_t n = sites_of(s);
    const double w = s->frequency, k = sqrt(1 - w * w), g = 1 / sqrt(1 - s->speed * s->speed);
    (void)seed, (void)error;
    for (size_t i = 0; i < n; i++) {
        const double x = place(s, i);
        q[i] = w > 0 ? 0 : 4 * atan(exp(g * x));
        v[i] = w > 0 ? 4 * k / cosh(k * x) : -2 * g * s->speed / cosh(g * x);
    }
    return AD_OK;
}

static const struct phys_observable observables[] = {{"momentum", "1", momentum},
                                                     {"from_closed_form", "1", distance}};

const struct phys_scene phys_scene_sine_gordon = {
    PHYS_SCENE_OF(struct field),
    .name = "sine-gordon",
    .what = "a kink or breather of the sine-Gordon field on a lattice",
    .dof_of = sites_of,
    .dims = 1,
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.04,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
    .observables = observables,
    .n_observables = LENGTH(observables),
};
