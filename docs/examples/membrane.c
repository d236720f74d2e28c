/* Masses on a square lattice, between springs to their four neighbours and a rim that is held, with
   a quartic potential at each. The lowest mode of columns x rows masses swings with frequency
   2 sqrt(k/m) sqrt(sin^2(pi/(2 (columns + 1))) + sin^2(pi/(2 (rows + 1)))). */
#include <physics/physics.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

struct membrane {
    double columns, rows, m, k, beta, amplitude;
};

static const struct phys_param parameters[] = {
    {"columns", "", "masses in a row", 20, offsetof(struct membrane, columns)},
    {"rows", "", "how many", 20, offsetof(struct membrane, rows)},
    {"m", "kg", "mass", 1, offsetof(struct membrane, m)},
    {"k", "N/m", "stiffness", 1, offsetof(struct membrane, k)},
    {"beta", "N/m^3", "of the quartic potential", 0, offsetof(struct membrane, beta)},
    {"amplitude", "m", "of the lowest mode, at the start", 1, offsetof(struct membrane, amplitude)},
};

static bool whole(double x) { return x >= 2 && x <= 1000 && x == floor(x); }

static size_t dof_of(const void *params)
{
    const struct membrane *p = params;
    return whole(p->columns) && whole(p->rows) ? (size_t)(p->columns * p->rows) : 0;
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct membrane *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_sum_rows(ad_square(v)));
}

/* Differences of masses `apart` in their order. */
static ad_var between(ad_var q, size_t n, size_t apart)
{
    return ad_sub(ad_slice_rows(q, apart, n - apart), ad_slice_rows(q, 0, n - apart));
}

/* A constant [n x 1]: of k, whether the masses k and k + 1 are neighbours, or how many neighbours
   of k are rim. */
static ad_var weights(ad_var q, size_t n, size_t columns, bool rim)
{
    double *w = malloc(n * sizeof *w);
    for (size_t k = 0; w && k < n; k++) {
        const bool last = (k + 1) % columns == 0;
        w[k] = rim ? (k % columns == 0) + last + (k < columns) + (k + columns >= n) : !last;
    }
    ad_var x = ad_const(q.tape, rim ? n : n - 1, 1, w);
    free(w);
    return x;
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct membrane *p = params;
    const size_t n = dof_of(p), columns = (size_t)p->columns;
    (void)v, (void)t;
    ad_var beside = ad_mul(weights(q, n, columns, false), ad_square(between(q, n, 1)));
    ad_var above = ad_square(between(q, n, columns)), own = ad_square(q);
    ad_var springs = ad_add(ad_add(ad_sum_rows(beside), ad_sum_rows(above)),
                            ad_sum_rows(ad_mul(weights(q, n, columns, true), own)));
    return ad_add(ad_mul(ad_mul(0.5, PHYS_PARAM(p, k)), springs),
                  ad_mul(ad_mul(0.25, PHYS_PARAM(p, beta)), ad_sum_rows(ad_square(own))));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct membrane *p = params;
    const size_t n = dof_of(p), columns = (size_t)p->columns;
    (void)seed, (void)error;
    for (size_t k = 0; k < n; k++) {
        const double x = (double)(k % columns + 1) / (p->columns + 1);
        const double y = (double)(k / columns + 1) / (p->rows + 1);
        q[k] = p->amplitude * sin(M_PI * x) * sin(M_PI * y);
        v[k] = 0;
    }
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "membrane",
    .what = "a membrane of masses and springs",
    .dof_of = dof_of,
    .dims = 1,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct membrane),
    .kinetic = kinetic,
    .potential = potential,
    .slices = 20,
    .dt = 0.1,
    .start = start,
};
