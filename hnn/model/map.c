/* SympNets: a map of (q, p) over a time dt composed of gradient modules, each of which is
   symplectic: p += dt K^T (a . s(K q + b)), then q likewise (P. Jin, Z. Zhang, A. Zhu, Y. Tang, G.
   E. Karniadakis, "SympNets", Neural Networks 132 (2020) 166, arXiv 2001.03750, equation 16). */
#include "internal.h"

#include <math.h>

enum { BLOCKS = 3 }; /* of a module: K, b, a */

/* dt K^T (a . s(K x + b)) [n x samples]. */
static ad_var module(const hnn_model *model, ad_var parameters, size_t k, ad_var x, ad_var dt)
{
    ad_var K = hnn_record_block(model, parameters, BLOCKS * k);
    ad_var b = hnn_record_block(model, parameters, BLOCKS * k + 1);
    ad_var a = ad_reshape(hnn_record_block(model, parameters, BLOCKS * k + 2), ad_rows(K), 1);
    ad_var h = model->activation->record(ad_add(ad_matmul(K, false, x, false), b));
    return ad_mul(dt, ad_matmul(K, true, ad_mul(a, h), false));
}

/* Units [2n] of q and p whose product is the same for all coordinates, so that the map is
   symplectic in x, too; and 1 over the unit of time. */
static double units(const hnn_model *model, double *unit)
{
    size_t n = model->settings.dof;
    const double *scale = model->scaling.scale;
    double product = 0;
    for (size_t k = 0; k < n; k++)
        product += log(scale[k] * scale[n + k]) / (double)n;
    for (size_t k = 0; k < 2 * n; k++)
        unit[k] = scale[k] * sqrt(exp(product) / (scale[k % n] * scale[n + k % n]));
    return model->scaling.energy / exp(product);
}

ad_var hnn_record_map(const hnn_model *model, ad_var parameters, ad_var x, ad_var dt, bool back)
{
    if (!model || model->settings.kind != HNN_SYMPNET || ad_rows(x) != hnn_states(model))
        return x.tape ? ad_refuse(x.tape, AD_E_ARGUMENT, "a map: expected a sympnet and its states")
                      : x;
    size_t n = model->settings.dof, modules = model->settings.layers;
    const bool scaled = model->scaling.centre != NULL;
    double unit[2 * HNN_SYMPNET_MOST];
    ad_var centre = x, size = x;
    if (scaled) {
        dt = ad_mul(units(model, unit), dt);
        centre = ad_const(x.tape, 2 * n, 1, model->scaling.centre);
        size = ad_const(x.tape, 2 * n, 1, unit);
        x = ad_div(ad_sub(x, centre), size);
    }
    ad_var half[2] = {ad_slice_rows(x, 0, n), ad_slice_rows(x, n, n)};
    for (size_t i = 0; i < modules; i++) {
        size_t k = back ? modules - 1 - i : i, to = k % 2 ? 0 : 1;
        ad_var change = module(model, parameters, k, half[1 - to], dt);
        half[to] = back ? ad_sub(half[to], change) : ad_add(half[to], change);
    }
    x = ad_concat_rows(2, half);
    return scaled ? ad_add(ad_mul(x, size), centre) : x;
}
