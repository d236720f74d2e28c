/* Log-likelihood of a mixture of normal distributions, with a Wishart prior. A component's inverse
   covariance is Q' Q, Q lower triangular with the diagonal exp(q) and rows of l below it. */
#include "adbench.h"

#include <math.h>
#include <stdlib.h>

static const double gamma_prior = 1, m_prior = 0;

/* log of the multivariate gamma function. */
static double log_gamma(double a, size_t d)
{
    double s = 0.25 * (double)(d * (d - 1)) * log(M_PI);
    for (size_t j = 1; j <= d; j++)
        s += lgamma(a + 0.5 * (1 - (double)j));
    return s;
}

void adbench_gmm(struct problem *p, const size_t size[3])
{
    const size_t d = size[0], k = size[1], n = size[2], below = d * (d - 1) / 2;
    ad_var points = adbench_constant(p, d, n, 1, 0, 1.5);
    ad_var alpha = adbench_input(p, k, 1, 2, 0, 1), mean = adbench_input(p, d, k, 3, 0, 1);
    ad_var icf = adbench_input(p, d + below, k, 4, 0, 0.5);
    ad_var q = ad_slice_rows(icf, 0, d), l = ad_slice_rows(icf, d, below), scale = ad_exp(q);
    uint32_t *to = malloc((d + below) * sizeof *to), *of = malloc(k * d * sizeof *of);
    uint32_t *entry = malloc(k * d * d * sizeof *entry);
    if (!to || !of || !entry)
        abort();
    for (size_t i = 0, e = d; i < d; i++) {
        to[i] = (uint32_t)(i * d + i);
        for (size_t j = 0; j < i; j++)
            to[e++] = (uint32_t)(i * d + j);
    }
    for (size_t r = 0; r < k * d; r++) {
        of[r] = (uint32_t)(r % k);
        for (size_t j = 0; j < d; j++)
            entry[r * d + j] = (uint32_t)((r / k * d + j) * k + r % k);
    }
    /* first rows of all Q, then second rows, ...: k*d x d; Q (x - mean) = Q x - Q mean */
    ad_var all = ad_scatter_rows(ad_concat_rows(2, (ad_var[]){scale, l}), to, d * d);
    all = ad_gather_cols(ad_reshape(all, 1, k * d * d), k * d * d, entry);
    all = ad_reshape(all, k * d, d);
    ad_var shift = ad_sum_cols(ad_mul(all, ad_gather_rows(ad_transpose(mean), k * d, of)));
    ad_var z = ad_sub(ad_matmul(all, false, points, false), shift);
    ad_var each = ad_mul(-0.5, ad_scatter_rows(ad_square(z), of, k)); /* k x n */
    ad_var weight = ad_add(alpha, ad_transpose(ad_sum_rows(q)));      /* k x 1 */
    ad_var data = ad_sum(ad_log_sum_exp_rows(ad_add(each, weight)));
    ad_var prior = ad_sub(ad_mul(0.5 * gamma_prior * gamma_prior,
                                 ad_add(ad_sum(ad_square(scale)), ad_sum(ad_square(l)))),
                          ad_mul(m_prior, ad_sum(q)));
    const double nu = (double)d + m_prior + 1;
    const double constant =
        -0.5 * (double)(n * d) * log(2 * M_PI) -
        (double)k * (nu * (double)d * (log(gamma_prior) - 0.5 * log(2)) - log_gamma(0.5 * nu, d));
    p->y = ad_add(ad_add(ad_sub(data, ad_mul((double)n, ad_log_sum_exp_rows(alpha))), prior),
                  constant);
    free(to);
    free(of);
    free(entry);
}
