/* A symmetric top under gravity. */
#include <physics/physics.h>
#include <stddef.h>
struct par {
    double I1;
    double I3;
    double mgl;
    double spin;
};
static const struct phys_param parameters[] = {
    {"I1", "", "inertia", 1.0, offsetof(struct par, I1)},
    {"I3", "", "inertia along the axis", 0.5, offsetof(struct par, I3)},
    {"mgl", "", "weight", 1.0, offsetof(struct par, mgl)},
    {"spin", "", "psi rate", 10.0, offsetof(struct par, spin)},
};
static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct par *p = params;
    (void)p;
    ad_var th = ad_row(q, 0), pr = ad_row(v, 1);
    ad_var s = ad_add(ad_row(v, 2), ad_mul(pr, ad_cos(th)));
    return ad_add(ad_mul(0.5 * p->I1, ad_add(ad_square(ad_row(v, 0)),
                                             ad_mul(ad_square(ad_sin(th)), ad_square(pr)))),
                  ad_mul(0.5 * p->I3, ad_square(s)));
}
static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct par *p = params;
    (void)p;
    return ad_mul(p->mgl, ad_cos(ad_row(q, 0)));
}
static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct par *p = params;
    (void)p;
    q[0] = 0.5;
    q[1] = 0;
    q[2] = 0;
    v[0] = 0;
    v[1] = 0.0;
    v[2] = p->spin;
    return AD_OK;
}
static const char *const coordinates[] = {"theta", "phi", "psi"};
const struct phys_scene leastaction_scene = {.version = PHYS_SCENE_VERSION,
                                             .size = sizeof(struct phys_scene),
                                             .name = "top",
                                             .what = "heavy symmetric top, Euler angles",
                                             .dof = 3,
                                             .dims = 1,
                                             .coordinates = coordinates,
                                             .unit = "rad",
                                             .time_unit = "s",
                                             .energy_unit = "J",
                                             .params = parameters,
                                             .n_params = 4,
                                             .params_bytes = sizeof(struct par),
                                             .kinetic = kinetic,
                                             .potential = potential,
                                             .slices = 201,
                                             .dt = 0.05,
                                             .start = start};
