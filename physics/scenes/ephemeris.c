/* Sun and planets under Newton's law, V = -sum over pairs of G m_i m_j / r, in SI units, and,
   optionally, relativistic corrections. A mass is the measured GM over G, unless it is set: GM is
   known to ten digits, G to five. */
#include "scenes.h"
#include "attraction.h"
#include "ephemeris.h"

#define MASS(k, name)                                                                              \
    {                                                                                              \
        "mass_" name, "kg", "mass; 0: measured GM over G", 0, offsetof(struct ephemeris, mass[k])  \
    }

static const struct phys_param params[] = {
    {"G", "m^3/(kg s^2)", "gravitational constant (CODATA 2018)", 6.67430e-11,
     offsetof(struct ephemeris, G)},
    {"dims", "1", "2: x and y only; 3", 3, offsetof(struct ephemeris, dims)},
    {"relativity", "1", "1: with the first post-Newtonian terms", 0,
     offsetof(struct ephemeris, relativity)},
    MASS(0, "sun"),
    MASS(1, "mercury"),
    MASS(2, "venus"),
    MASS(3, "earth"),
    MASS(4, "mars"),
};

size_t phys_ephemeris_count(const struct ephemeris *ephemeris)
{
    return ephemeris->n ? ephemeris->n : PHYS_EPHEMERIS_BODIES;
}

const struct ephemeris_body *phys_ephemeris_body(const struct ephemeris *ephemeris, size_t k)
{
    return ephemeris->n ? &ephemeris->body[k] : &phys_ephemeris_bodies[k];
}

/* NULL: none. */
static const double *set_mass(const struct ephemeris *s, size_t k)
{
    for (size_t j = 0; j < PHYS_EPHEMERIS_BODIES; j++)
        if (phys_ephemeris_bodies[j].id == phys_ephemeris_body(s, k)->id && s->mass[j] != 0)
            return &s->mass[j];
    return NULL;
}

static ad_var mass(const struct ephemeris *s, size_t k)
{
    const double *set = set_mass(s, k);
    return set ? phys_param(set) : ad_div(phys_ephemeris_body(s, k)->gm, PHYS_PARAM(s, G));
}

static size_t dims_of(const void *p)
{
    const struct ephemeris *s = p;
    return (s->dims == 2 || s->dims == 3) && s->G > 0 ? (size_t)s->dims : 0;
}

static size_t dof_of(const void *p) { return dims_of(p) * phys_ephemeris_count(p); }

static const char *body_name(const void *p, size_t k) { return phys_ephemeris_body(p, k)->name; }

static void masses(const struct ephemeris *s, ad_var m[])
{
    for (size_t k = 0; k < phys_ephemeris_count(s); k++)
        m[k] = mass(s, k);
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    ad_var m[PHYS_EPHEMERIS_MOST];
    (void)q, (void)t;
    masses(p, m);
    return phys_attraction_kinetic(v, phys_ephemeris_count(p), dims_of(p), m);
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct ephemeris *s = p;
    ad_var m[PHYS_EPHEMERIS_MOST];
    (void)v, (void)t;
    masses(s, m);
    return phys_attraction_potential(q, phys_ephemeris_count(s), dims_of(s), m, PHYS_PARAM(s, G));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct ephemeris *s = p;
    ad_var m[PHYS_EPHEMERIS_MOST];
    ad_var L = ad_sub(kinetic(q, v, t, p), potential(q, v, t, p));
    if (s->relativity == 0)
        return L;
    masses(s, m);
    return ad_add(
        L, phys_post_newtonian(q, v, phys_ephemeris_count(s), dims_of(s), m, PHYS_PARAM(s, G)));
}

static void gm(const void *p, double values[])
{
    const struct ephemeris *s = p;
    for (size_t k = 0; k < phys_ephemeris_count(s); k++) {
        const double *set = set_mass(s, k);
        values[k] = set ? s->G * *set : phys_ephemeris_body(s, k)->gm;
    }
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    size_t dims = dims_of(p), dof = dof_of(p);
    (void)seed, (void)error;
    for (size_t k = 0; k < dof; k++) {
        q[k] = phys_ephemeris_body(p, k / dims)->position[k % dims];
        v[k] = phys_ephemeris_body(p, k / dims)->velocity[k % dims];
    }
    return AD_OK;
}

static const struct phys_setting published[] = {
    {"G", 6.67e-11},         {"dims", 2},
    {"mass_sun", 1.99e30},   {"mass_mercury", 3.3e23},
    {"mass_venus", 4.87e24}, {"mass_earth", 5.97e24},
    {"mass_mars", 6.42e23},
};

static const struct phys_preset paper = {
    .slices = 65,
    .dt = 86400,
    .steps = 500,
    .learning_rate = 1e9,
    .damping = 1,
    .noise = {.sigma = 2e10, .clip = 1, .quiet_bodies = 1},
    .set = published,
    .n_set = LENGTH(published),
};

const struct phys_scene phys_scene_ephemeris = {
    PHYS_SCENE_OF(struct ephemeris),
    .name = "ephemeris",
    .what = "the Sun and the inner planets from " PHYS_EPHEMERIS_DATE ", or bodies from tables",
    .dof_of = dof_of,
    .dims_of = dims_of,
    .body_name = body_name,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .lagrangian = lagrangian,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 65,
    .dt = 86400,
    .start = start,
    .gm = gm,
    .per_body = true,
    .picture = PHYS_PICTURE_PLANE,
    .paper = &paper,
};
