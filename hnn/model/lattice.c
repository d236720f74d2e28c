/* Chains of equal sites: one network for all of them (M. Cranmer et al., arXiv 2003.04630, section
   4 learn a wave so). Sites are columns: row-major, n rows of samples are n * samples columns. */
#include "internal.h"

static ad_var flat(ad_var rows) { return ad_reshape(rows, 1, ad_rows(rows) * ad_cols(rows)); }

/* Row k to each site's neighbour: +1, the next one; -1, the previous one. At a wall there is 0. */
static ad_var neighbour(const hnn_model *model, ad_var q, int to)
{
    size_t n = ad_rows(q);
    ad_var beyond = ad_row(q, to > 0 ? 0 : n - 1);
    if (model->settings.lattice == HNN_FIXED_ENDS)
        beyond = ad_mul(0.0, beyond);
    if (n == 1)
        return beyond;
    ad_var rest = ad_slice_rows(q, to > 0, n - 1);
    return ad_concat_rows(2, to > 0 ? (ad_var[]){rest, beyond} : (ad_var[]){beyond, rest});
}

/* What sites have, one column each: (q, p or v, q_next - q), where the first wall is a site, too.
 */
static ad_var sites(const hnn_model *model, ad_var x)
{
    size_t n = model->settings.dof;
    ad_var q = ad_slice_rows(x, 0, n), p = ad_slice_rows(x, n, n), next = neighbour(model, q, 1);
    if (model->settings.lattice == HNN_FIXED_ENDS) {
        ad_var wall = ad_mul(0.0, ad_row(q, 0));
        next = ad_concat_rows(2, (ad_var[]){ad_row(q, 0), next});
        q = ad_concat_rows(2, (ad_var[]){wall, q});
        p = ad_concat_rows(2, (ad_var[]){wall, p});
    }
    return ad_concat_rows(3, (ad_var[]){flat(q), flat(p), flat(ad_sub(next, q))});
}

/* In the units of the network: (value - centre)/scale, of which `rows` are there. */
static ad_var normalised(const hnn_model *model, ad_var site)
{
    const struct hnn_scaling *s = &model->scaling;
    const size_t n = model->settings.dof, from[] = {0, n, 2 * n, 2 * n};
    double centre[4], inverse[4];
    if (!s->centre)
        return site;
    for (size_t k = 0; k < ad_rows(site); k++) {
        centre[k] = s->centre[from[k]];
        inverse[k] = 1 / s->scale[from[k]];
    }
    return ad_mul(ad_sub(site, ad_const(site.tape, ad_rows(site), 1, centre)),
                  ad_const(site.tape, ad_rows(site), 1, inverse));
}

static ad_var network(const hnn_model *model, ad_var parameters, ad_var site)
{
    return hnn_record_network(model, &model->net[0], parameters, normalised(model, site));
}

/* Columns of sites back to rows. */
static ad_var rows_of(ad_var columns, ad_var x)
{
    return ad_reshape(columns, ad_rows(columns) * ad_cols(columns) / ad_cols(x), ad_cols(x));
}

ad_var hnn_lattice_sum(const hnn_model *model, ad_var parameters, ad_var x)
{
    return ad_sum_rows(rows_of(network(model, parameters, sites(model, x)), x));
}

ad_var hnn_lattice_rates(const hnn_model *model, ad_var parameters, ad_var x)
{
    size_t n = model->settings.dof;
    ad_var q = ad_slice_rows(x, 0, n), p = ad_slice_rows(x, n, n);
    ad_var site[] = {flat(q), flat(p), flat(ad_sub(neighbour(model, q, 1), q)),
                     flat(ad_sub(neighbour(model, q, -1), q))};
    return rows_of(network(model, parameters, ad_concat_rows(4, site)), x);
}

/* M a = L_q - L_vq v as in field.c, L_vv being diagonal: of each site l(q, v, d), d = q_next - q,
   M = l_vv and (L_vq v) = l_vq v + l_vd (v_next - v). */
ad_var hnn_lattice_lagrangian(const hnn_model *model, ad_var parameters, ad_var x,
                              struct hnn_record *r)
{
    const struct hnn_scaling *s = &model->scaling;
    size_t n = model->settings.dof;
    ad_var v = ad_slice_rows(x, n, n), site = sites(model, x), speed = ad_row(site, 1);
    double unit = s->scale ? 1 / (s->scale[n] * s->scale[n]) : 1;
    ad_var l = ad_add(ad_mul(0.5 * unit, ad_square(speed)), network(model, parameters, site));
    l = s->energy == 1 ? l : ad_mul(s->energy, l);
    ad_var L = ad_label(ad_sum_rows(rows_of(l, x)), "L");
    ad_var p = ad_row(hnn_gradient(l, site), 1), second = hnn_gradient(p, site);
    ad_var rates = sites(model, ad_concat_rows(2, (ad_var[]){v, ad_mul(0.0, v)}));
    ad_var along = ad_add(ad_mul(ad_row(second, 0), ad_row(rates, 0)),
                          ad_mul(ad_row(second, 2), ad_row(rates, 2)));
    ad_var M = rows_of(ad_row(second, 1), x);
    along = rows_of(along, x);
    size_t wall = ad_rows(M) - n;
    M = ad_label(ad_slice_rows(M, wall, n), "L_vv");
    ad_var push = ad_sub(ad_slice_rows(hnn_gradient(L, x), 0, n), ad_slice_rows(along, wall, n));
    r->field = ad_concat_rows(2, (ad_var[]){v, ad_div(push, M)});
    r->energy = ad_label(ad_sub(ad_sum_rows(rows_of(ad_mul(p, speed), x)), L), "H");
    return M;
}
