/* Two bodies in the plane, bound by a spring; what acts on them besides is given by parameters: a
   uniform field, a spring to the origin, a drive of the binding spring, a wind that rises with t.
 */
#include <physics/physics.h>

#include <stddef.h>

struct numbers {
    double field, centre, drive, wind;
};

static const struct phys_param params[] = {
    {"field", "1", "force along y", 0, offsetof(struct numbers, field)},
    {"centre", "1", "stiffness to the origin", 0, offsetof(struct numbers, centre)},
    {"drive", "1", "share of the binding stiffness that swings", 0,
     offsetof(struct numbers, drive)},
    {"wind", "1", "force along x that grows with t", 0, offsetof(struct numbers, wind)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)q, (void)t, (void)p;
    return ad_mul(0.5, ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct numbers *n = p;
    (void)v;
    ad_var bound = phys_pair_squares(q, 2, 2, 0);
    if (n->drive != 0)
        bound = ad_mul(ad_add(1, ad_mul(n->drive, ad_sin(t))), bound);
    ad_var outer = ad_mul(0.5 * n->centre, ad_sum_rows(ad_square(q)));
    ad_var along_y = ad_mul(-n->field, ad_add(ad_row(q, 1), ad_row(q, 3)));
    ad_var V = ad_add(ad_add(bound, outer), along_y);
    if (n->wind != 0)
        V = ad_sub(V, ad_mul(ad_mul(n->wind, t), ad_add(ad_row(q, 0), ad_row(q, 2))));
    return V;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    static const double x[] = {1, 0.2, -0.7, 0.1}, u[] = {0.3, 0.8, 0.1, -0.5};
    (void)p, (void)seed, (void)error;
    for (size_t k = 0; k < 4; k++) {
        q[k] = x[k];
        v[k] = u[k];
    }
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "driven",
    .what = "two bodies under forces from outside",
    .dof = 4,
    .dims = 2,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .params = params,
    .n_params = sizeof params / sizeof *params,
    .params_bytes = sizeof(struct numbers),
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.1,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
