/* Callbacks that several scenes share (common.h). */
#include "common.h"

#include <string.h>

static enum ad_status start(const double *given, size_t dof, double *q, double *v)
{
    memcpy(q, given, dof * sizeof *q);
    memcpy(v, given + dof, dof * sizeof *v);
    return AD_OK;
}

enum ad_status phys_start_1(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)seed, (void)error;
    return start(p, 1, q, v);
}

enum ad_status phys_start_2(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)seed, (void)error;
    return start(p, 2, q, v);
}

enum ad_status phys_start_3(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)seed, (void)error;
    return start(p, 3, q, v);
}

ad_var phys_particle_kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct phys_particle *s = p;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, m)), ad_square(v));
}

ad_var phys_damped(ad_var L, ad_var c, ad_var t)
{
    double rate = 1;
    return ad_constant_value(c, &rate) && rate == 0 ? L : ad_mul(ad_exp(ad_mul(c, t)), L);
}

ad_var phys_centre_kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)q, (void)t, (void)p;
    return ad_mul(0.5, ad_sum_rows(ad_square(v)));
}

ad_var phys_centre_potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const double *gm = p;
    (void)v, (void)t;
    return ad_div(ad_neg(phys_param(gm)), ad_sqrt(ad_sum_rows(ad_square(q))));
}
