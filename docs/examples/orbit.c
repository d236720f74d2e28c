/* A planet in the plane under the attraction k/r + b/r^2. With b = 0 the vector of Laplace, Runge
   and Lenz, A = p x L - m k r/|r|, points to the perihelion for ever; with b it turns with it,
   while L_z stays. */
#include <physics/physics.h>
#include <stddef.h>

struct orbit {
    double m, k, b;
};

static const struct phys_param parameters[] = {
    {"m", "", "mass", 1, offsetof(struct orbit, m)},
    {"k", "", "strength of the attraction", 1, offsetof(struct orbit, k)},
    {"b", "", "of its part in 1/r^2", 0, offsetof(struct orbit, b)},
};

static ad_var radius(ad_var q) { return ad_sqrt(ad_sum_rows(ad_square(q))); }

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct orbit *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct orbit *p = params;
    (void)v, (void)t;
    ad_var r = radius(q);
    return ad_neg(ad_add(ad_div(PHYS_PARAM(p, k), r), ad_div(PHYS_PARAM(p, b), ad_square(r))));
}

static ad_var angular_momentum(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct orbit *p = params;
    (void)t;
    ad_var turn = ad_sub(ad_mul(ad_row(q, 0), ad_row(v, 1)), ad_mul(ad_row(q, 1), ad_row(v, 0)));
    return ad_mul(PHYS_PARAM(p, m), turn);
}

/* m p L sideways, less m k along r. */
static ad_var lenz(ad_var q, ad_var v, ad_var t, const struct orbit *p, size_t k)
{
    ad_var across = ad_mul(k ? -1.0 : 1.0, ad_row(v, 1 - k)), m = PHYS_PARAM(p, m);
    ad_var turn = ad_mul(across, angular_momentum(q, v, t, p));
    return ad_mul(m, ad_sub(turn, ad_mul(PHYS_PARAM(p, k), ad_div(ad_row(q, k), radius(q)))));
}

static ad_var lenz_x(ad_var q, ad_var v, ad_var t, const void *params)
{
    return lenz(q, v, t, params, 0);
}

static ad_var lenz_y(ad_var q, ad_var v, ad_var t, const void *params)
{
    return lenz(q, v, t, params, 1);
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    q[1] = 0.2;
    v[0] = 0.1;
    v[1] = 0.8;
    return AD_OK;
}

static const char *const coordinates[] = {"x", "y"};
static const struct phys_observable observables[] = {
    {"L_z", "", angular_momentum}, {"A_x", "", lenz_x}, {"A_y", "", lenz_y}};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "orbit",
    .what = "a planet under 1/r and 1/r^2",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "",
    .time_unit = "",
    .energy_unit = "",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct orbit),
    .kinetic = kinetic,
    .potential = potential,
    .observables = observables,
    .n_observables = sizeof observables / sizeof *observables,
    .slices = 400,
    .dt = 0.05,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
