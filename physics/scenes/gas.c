/* A gas of Lennard-Jones bodies of equal mass in the plane:
       V = strength sum over pairs of (s/r)^12 - (s/r)^6,  r^2 = d^2 + softening.
   It starts from a jittered lattice, dilute and cold enough that no two bodies meet: beyond a
   collision the true path is a saddle of the action, which no descent finds. The published scene
   starts at rest from random, partly overlapping positions, and replaces V by a clamped value and a
   line below cap_radius; both change the law and its gradient, and are off unless set.

   Friction: dissipative motion follows from a Lagrangian with a growing factor (Caldirola and
   Kanai), so damped paths are stationary, too:
       L = exp(friction t) (T - V)   gives   m a = -V_q - friction m v.
   Walls are springs: V = walls/2 times the squared distances of bodies outside the square. */
#include "gas.h"
#include "scenes.h"
#include "physics/io/random.h"

#include <math.h>

enum { DIMS = PHYS_GAS_DIMS };

static const struct phys_param params[] = {
    {"bodies", "1", "number of bodies, a whole number from 2 to 20000", 50,
     offsetof(struct gas, bodies)},
    {"m", "1", "mass of each", 1, offsetof(struct gas, m)},
    {"strength", "1", "four times the depth of the well", 1e-4, offsetof(struct gas, strength)},
    {"sigma", "1", "distance where V changes sign", 0.04, offsetof(struct gas, sigma)},
    {"softening", "1", "added to r^2", 1e-6, offsetof(struct gas, softening)},
    {"cutoff", "sigma", "beyond it pairs do not interact, and V is shifted to 0 there; 0: none", 0,
     offsetof(struct gas, cutoff)},
    {"friction", "1", "velocities fall by this share in a unit of time", 0,
     offsetof(struct gas, friction)},
    {"walls", "1", "stiffness of the walls about where it starts; 0: none", 0,
     offsetof(struct gas, walls)},
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
    bool whole = s->bodies >= 2 && s->bodies <= PHYS_GAS_MOST && floor(s->bodies) == s->bodies;
    return whole && s->cutoff >= 0 && s->walls >= 0 ? (size_t)s->bodies : 0;
}

static size_t dof_of(const void *p) { return DIMS * bodies_of(p); }

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct gas *s = p;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, m)), ad_sum_rows(ad_square(v)));
}

ad_var phys_gas_interaction(ad_var square, const struct gas *s)
{
    ad_var sigma = PHYS_PARAM(s, sigma);
    square = ad_add(square, PHYS_PARAM(s, softening));
    ad_var u = ad_div(ad_mul(sigma, sigma), square), u3 = ad_mul(ad_square(u), u);
    ad_var shape = ad_sub(ad_square(u3), u3);
    if (s->cutoff > 0) {
        ad_var far = ad_div(1, ad_cube(ad_square(PHYS_PARAM(s, cutoff))));
        shape = ad_select(ad_gt(u3, far), ad_sub(shape, ad_sub(ad_square(far), far)), 0);
    }
    if (s->clamp > 0)
        shape = ad_min(shape, ad_div(PHYS_PARAM(s, clamp), PHYS_PARAM(s, strength)));
    ad_var V = ad_mul(PHYS_PARAM(s, strength), shape);
    if (s->cap_radius > 0)
        V = ad_add(V, ad_mul(PHYS_PARAM(s, cap_slope),
                             ad_relu(ad_sub(PHYS_PARAM(s, cap_radius), ad_sqrt(square)))));
    return V;
}

ad_var phys_gas_walls(ad_var q, const struct gas *s)
{
    ad_var side = s->random_start != 0 ? PHYS_PARAM(s, box)
                                       : ad_mul(PHYS_PARAM(s, spacing), ceil(sqrt(s->bodies)));
    ad_var outside = ad_relu(ad_sub(ad_abs(ad_sub(q, 0.5)), ad_mul(0.5, side)));
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, walls)), ad_sum_rows(ad_square(outside)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct gas *s = p;
    (void)v, (void)t;
    ad_var square = phys_pair_squares(q, bodies_of(s), DIMS, 0);
    ad_var V = ad_sum_rows(phys_gas_interaction(square, s));
    return s->walls > 0 ? ad_add(V, phys_gas_walls(q, s)) : V;
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct gas *s = p;
    ad_var L = ad_sub(kinetic(q, v, t, p), potential(q, v, t, p));
    return s->friction == 0 ? L : ad_mul(ad_exp(ad_mul(PHYS_PARAM(s, friction), t)), L);
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
    PHYS_SCENE_OF(struct gas),
    .name = "gas",
    .what = "a gas of Lennard-Jones bodies in the plane",
    .dof_of = dof_of,
    .dims = DIMS,
    PHYS_PURE_NUMBERS,
    .lagrangian = lagrangian,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.2,
    .start = start,
    .per_body = true,
    .picture = PHYS_PICTURE_PLANE,
    .paper = &paper,
    .ode = phys_gas_ode,
};
