/* The gradient of the mixture of normal distributions by hand, as ADBench's own in C, but block by
   block of points, whose numbers stay in the first caches, with loops over them innermost. */
#include "adbench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 64, MOST = 32 }; /* points; dimensions */

/* A component: its parameters, and sums over points for their derivatives. */
struct component {
    double q[MOST][MOST], mean[MOST], weight;
    double by_q[MOST][MOST], by_z[MOST], share;
};

/* y = x - mean and z = Q y of a block of points, and the logarithms of their densities. */
static void forward(const struct component *g, size_t d, double (*restrict x)[BLOCK],
                    double (*restrict y)[BLOCK], double (*restrict z)[BLOCK],
                    double *restrict density)
{
    for (size_t c = 0; c < BLOCK; c++)
        density[c] = g->weight;
    for (size_t i = 0; i < d; i++) {
        for (size_t c = 0; c < BLOCK; c++) {
            y[i][c] = x[i][c] - g->mean[i];
            z[i][c] = 0;
        }
        for (size_t j = 0; j <= i; j++)
            for (size_t c = 0; c < BLOCK; c++)
                z[i][c] += g->q[i][j] * y[j][c];
        for (size_t c = 0; c < BLOCK; c++)
            density[c] -= 0.5 * z[i][c] * z[i][c];
    }
}

/* Adds the sums of a block, where the component has these shares in the points. */
static void backward(struct component *g, size_t d, double (*restrict y)[BLOCK],
                     double (*restrict z)[BLOCK], const double *restrict share)
{
    for (size_t i = 0; i < d; i++) {
        double by[BLOCK], total = 0;
        for (size_t c = 0; c < BLOCK; c++) {
            by[c] = -share[c] * z[i][c];
            total += by[c];
        }
        g->by_z[i] += total;
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
#pragma omp simd reduction(+ : sum)
            for (size_t c = 0; c < BLOCK; c++)
                sum += by[c] * y[j][c];
            g->by_q[i][j] += sum;
        }
    }
    for (size_t c = 0; c < BLOCK; c++)
        g->share += share[c];
}

static struct component *components(const struct problem *p, size_t d, size_t k)
{
    struct component *all = calloc(k, sizeof *all);
    for (size_t m = 0; all && m < k; m++) {
        struct component *g = &all[m];
        g->weight = p->at[0][m];
        for (size_t i = 0, e = d; i < d; i++) {
            g->mean[i] = p->at[1][i * k + m];
            g->weight += p->at[2][i * k + m];
            g->q[i][i] = exp(p->at[2][i * k + m]);
            for (size_t j = 0; j < i; j++)
                g->q[i][j] = p->at[2][e++ * k + m];
        }
    }
    return all;
}

/* Densities of a block become shares of the components, which add up to 1; 0 beyond the points. */
static void normalise(size_t k, size_t points, double (*density)[BLOCK])
{
    for (size_t c = 0; c < BLOCK; c++) {
        double most = -INFINITY, sum = 0;
        for (size_t m = 0; m < k; m++)
            most = fmax(most, density[m][c]);
        for (size_t m = 0; m < k; m++)
            sum += density[m][c] = exp(density[m][c] - most);
        for (size_t m = 0; m < k; m++)
            density[m][c] = c < points ? density[m][c] / sum : 0;
    }
}

/* From the sums to the derivatives by alpha, means, and logarithms and entries of Q; a Wishart
   prior as in gmm.c. */
static void finish(const struct problem *p, const struct component *all, const size_t size[3],
                   double *gradient)
{
    const size_t d = size[0], k = size[1];
    double most = -INFINITY, sum = 0, *mean = gradient + k, *icf = mean + d * k;
    for (size_t m = 0; m < k; m++)
        most = fmax(most, p->at[0][m]);
    for (size_t m = 0; m < k; m++)
        sum += exp(p->at[0][m] - most);
    for (size_t m = 0; m < k; m++) {
        const struct component *g = &all[m];
        gradient[m] = g->share - (double)size[2] * exp(p->at[0][m] - most) / sum;
        for (size_t i = 0, e = d; i < d; i++) {
            double by_mean = 0;
            for (size_t r = i; r < d; r++)
                by_mean -= g->q[r][i] * g->by_z[r];
            mean[i * k + m] = by_mean;
            icf[i * k + m] = g->share + (g->by_q[i][i] + g->q[i][i]) * g->q[i][i];
            for (size_t j = 0; j < i; j++)
                icf[e++ * k + m] = g->by_q[i][j] + g->q[i][j];
        }
    }
}

void adbench_gmm_by_hand(const struct problem *p, const size_t size[3], double *gradient)
{
    const double *points = p->fixed;
    const size_t d = size[0], k = size[1], n = size[2];
    struct component *all = components(p, d, k);
    double(*x)[BLOCK] = calloc(d, sizeof *x), (*density)[BLOCK] = calloc(k, sizeof *density);
    double(*y)[BLOCK] = calloc(k * d, sizeof *y), (*z)[BLOCK] = calloc(k * d, sizeof *z);
    if (!all || !x || !density || !y || !z)
        abort();
    for (size_t first = 0; first < n; first += BLOCK) {
        const size_t count = n - first < BLOCK ? n - first : BLOCK;
        for (size_t i = 0; i < d; i++)
            memcpy(x[i], points + i * n + first, count * sizeof **x);
        for (size_t m = 0; m < k; m++)
            forward(&all[m], d, x, y + m * d, z + m * d, density[m]);
        normalise(k, count, density);
        for (size_t m = 0; m < k; m++)
            backward(&all[m], d, y + m * d, z + m * d, density[m]);
    }
    finish(p, all, size, gradient);
    free(all);
    free(x);
    free(density);
    free(y);
    free(z);
}
