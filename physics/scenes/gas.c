/* A gas of Lennard-Jones bodies in the plane, all of the same mass:
       V = strength sum over pairs of (s/r)^12 - (s/r)^6,  r^2 = d^2 + softening.
   It starts from a jittered lattice, thin and cold enough that no two bodies meet: beyond a
   collision the true path is a saddle of the action, which no descent holds. The published one
   starts at rest from random positions, some of them overlapping, cuts V off at a clamp and adds a
   line below cap_radius instead: both break the law and its gradient, and are off unless set. */
#include "../internal.h"
#include "../random.h"

#include <math.h>

enum { DIMS = 2, MOST_BODIES = 4096 };

struct gas {
    double bodies, m, strength, sigma, softening;
    double spacing, jitter, speed, random_start, box;
    double clamp, cap_radius, cap_slope;
};

static const struct phys_param params[] = {
    {"bodies", "1", "number of bodies, a whole number from 2 to 4096", 50,
     offsetof(struct gas, bodies)},
    {"m", "1", "mass of each", 1, offsetof(struct gas, m)},
    {"strength", "1", "four times the depth of the well", 1e-4, offsetof(struct gas, strength)},
    {"sigma", "1", "distance where V changes sign", 0.04, offsetof(struct gas, sigma)},
    {"softening", "1", "added to r^2", 1e-6, offsetof(struct gas, softening)},
    {"spacing", "1", "distance of neighbours in the starting lattice", 0.1,
     offsetof(struct gas, spacing)},
    {"jitter", "1", "random part of it, as a share of the spacing", 0.1,
     offsetof(struct gas, jitter)},
    {"speed", "1", "standard deviation of a velocity component at the start", 3e-4,
     offsetof(struct gas, speed)},
    {"random_start", "1", "1: start anywhere in a box instead of a lattice", 0,
     offsetof(struct gas, random_start)},
    {"box", "1", "side of that box", 0.2, offsetof(struct gas, box)},
    {"clamp", "1", "largest energy of a pair; 0: none", 0, offsetof(struct gas, clamp)},
    {"cap_radius", "1", "below it a line is added to V; 0: never", 0,
     offsetof(struct gas, cap_radius)},
    {"cap_slope", "1", "slope of that line", 1e-3, offsetof(struct gas, cap_slope)},
};

static size_t bodies_of(const struct gas *s)
{
    bool whole = s->bodies >= 2 && s->bodies <= MOST_BODIES && floor(s->bodies) == s->bodies;
    return whole ? (size_t)s->bodies : 0;
}

static size_t dof_of(const void *p) { return DIMS * bodies_of(p); }

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct gas *s = p;
    (void)q, (void)t;
    return ad_mul(0.5 * s->m, ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct gas *s = p;
    (void)v, (void)t;
    ad_var square = phys_pair_squares(q, bodies_of(s), DIMS, s->softening);
    ad_var u = ad_div(s->sigma * s->sigma, square);
    ad_var u3 = ad_mul(ad_square(u), u);
    ad_var shape = ad_sub(ad_square(u3), u3);
    if (s->clamp > 0)
        shape = ad_min(shape, s->clamp / s->strength);
    ad_var total = ad_mul(s->strength, ad_sum_rows(shape));
    if (s->cap_radius > 0) {
        ad_var inside = ad_relu(ad_sub(s->cap_radius, ad_sqrt(square)));
        total = ad_add(total, ad_mul(s->cap_slope, ad_sum_rows(inside)));
    }
    return total;
}

static void place_lattice(const struct gas *s, struct phys_random *random, size_t n, double *q)
{
    size_t side = (size_t)ceil(sqrt((double)n));
    for (size_t b = 0; b < n; b++) {
        q[DIMS * b] = (double)(b % side);
        q[DIMS * b + 1] = (double)(b / side);
    }
    for (size_t k = 0; k < DIMS * n; k++) {
        double shift = s->jitter * (phys_random_uniform(random) - 0.5);
        q[k] = 0.5 + s->spacing * (q[k] - 0.5 * (double)(side - 1) + shift);
    }
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct gas *s = p;
    size_t n = bodies_of(s);
    struct phys_random random;
    (void)error;
    phys_random_seed(&random, seed);
    if (s->random_start == 0)
        place_lattice(s, &random, n, q);
    for (size_t k = 0; k < DIMS * n; k++) {
        if (s->random_start != 0)
            q[k] = 0.5 + s->box * (phys_random_uniform(&random) - 0.5);
        v[k] = s->speed * phys_random_normal(&random);
    }
    return AD_OK;
}

static const struct phys_setting published[] = {
    {"random_start", 1}, {"speed", 0}, {"clamp", 1e-4}, {"cap_radius", 0.04}, {"cap_slope", 1e-3}};

static const struct phys_preset paper = {
    .slices = 100,
    .dt = 0.2,
    .steps = 500,
    .learning_rate = 3e-5,
    .damping = 0.99,
    .euler_start = true,
    .noise = {.sigma = 8e-3, .clip = 1},
    .set = published,
    .n_set = LENGTH(published),
};

const struct phys_scene phys_scene_gas = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "gas",
    .what = "a gas of Lennard-Jones bodies in the plane",
    .dof_of = dof_of,
    .dims = DIMS,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .params = params,
    .n_params = LENGTH(params),
    .params_bytes = sizeof(struct gas),
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.2,
    .start = start,
    .per_body = true,
    .picture = PHYS_PICTURE_PLANE,
    .paper = &paper,
};
