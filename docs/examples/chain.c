/* Springs and masses in a row between two walls, with the cubic term of Fermi, Pasta, Ulam and
   Tsingou. The lowest mode of n masses swings with frequency 2 sqrt(k/m) sin(pi/(2 (n + 1))). */
#include <physics/physics.h>
#include <math.h>
#include <stddef.h>

struct chain {
    double masses, m, k, alpha, amplitude;
};

static const struct phys_param parameters[] = {
    {"masses", "", "how many", 1000, offsetof(struct chain, masses)},
    {"m", "kg", "mass", 1, offsetof(struct chain, m)},
    {"k", "N/m", "stiffness", 1, offsetof(struct chain, k)},
    {"alpha", "N/m^2", "of the cubic term", 0, offsetof(struct chain, alpha)},
    {"amplitude", "m", "of the lowest mode, at the start", 1, offsetof(struct chain, amplitude)},
};

static size_t dof_of(const void *params)
{
    const struct chain *p = params;
    bool right = p->masses >= 2 && p->masses <= 1e4 && p->masses == floor(p->masses);
    return right ? (size_t)p->masses : 0;
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct chain *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_sum_rows(ad_square(v)));
}

/* k d^2/2 + alpha d^3/3 of springs stretched by the rows of d. */
static ad_var springs(ad_var d, const struct chain *p)
{
    ad_var cubic = ad_mul(ad_div(PHYS_PARAM(p, alpha), 3), d);
    return ad_sum_rows(ad_mul(ad_square(d), ad_add(ad_mul(0.5, PHYS_PARAM(p, k)), cubic)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct chain *p = params;
    size_t n = dof_of(p);
    (void)v, (void)t;
    ad_var between = ad_sub(ad_slice_rows(q, 1, n - 1), ad_slice_rows(q, 0, n - 1));
    ad_var walls = ad_add(springs(ad_row(q, 0), p), springs(ad_neg(ad_row(q, n - 1)), p));
    return ad_add(springs(between, p), walls);
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct chain *p = params;
    (void)seed, (void)error;
    size_t n = dof_of(p);
    for (size_t k = 0; k < n; k++) {
        q[k] = p->amplitude * sin(M_PI * (double)(k + 1) / (double)(n + 1));
        v[k] = 0;
    }
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "chain",
    .what = "a chain of springs",
    .dof_of = dof_of,
    .dims = 1,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct chain),
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.5,
    .start = start,
};
