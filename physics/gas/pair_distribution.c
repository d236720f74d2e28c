/* The pair distribution in a rectangle (order.h). Two random points in a rectangle a x b are at
   most r apart, r no longer than the shorter side, with probability
       P(r) = (pi r^2 a b - 4/3 r^3 (a + b) + r^4 / 2) / (a b)^2
   (M. G. Kendall and P. A. P. Moran, Geometrical Probability, 1963, section 2.27). */
#include "cell_list.h"
#include "order.h"

#include <math.h>
#include <string.h>

static double nearer_than(double r, const double sides[2])
{
    double area = sides[0] * sides[1], r2 = r * r;
    return (M_PI * r2 * area - 4 / 3.0 * r2 * r * (sides[0] + sides[1]) + 0.5 * r2 * r2) /
           (area * area);
}

enum ad_status phys_pair_distribution(size_t bodies, const double *x, const double sides[2],
                                      double reach, size_t bins, double *g, struct ad_error *error)
{
    if (AD_LACKS(error, x, sides, g))
        return error->status;
    struct phys_near near = {0};
    double width = reach / (double)bins, pairs = 0.5 * (double)bodies * (double)(bodies - 1);
    if (!(reach > 0) || reach > fmin(sides[0], sides[1]) || bins == 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "pair distribution: a reach of %g, expected more than 0 and no more than a "
                       "side, %g",
                       reach, fmin(sides[0], sides[1]));
    if (phys_near_pairs(bodies, x, reach, &near, error) == AD_OK) {
        memset(g, 0, bins * sizeof *g);
        for (size_t k = 0; k < near.n; k++) {
            const double *a = x + 2 * near.first[k], *b = x + 2 * near.second[k];
            size_t bin = (size_t)(hypot(a[0] - b[0], a[1] - b[1]) / width);
            if (bin < bins)
                g[bin]++;
        }
        for (size_t k = 0; k < bins; k++) {
            double low = (double)k * width;
            g[k] /= pairs * (nearer_than(low + width, sides) - nearer_than(low, sides));
        }
    }
    phys_near_free(&near);
    return error->status;
}
