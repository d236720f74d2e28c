/* The inverse of the kinetic part (kinetic.h). With stiffness k it is, between slices,

     k (-x[i-1] + 2 x[i] - x[i+1]) = r[i],   x[0] = x[N] = 0,

   so that k x[i] = i s - W[i] with W[i+1] = W[i] + A[i], A[i] = A[i-1] + r[i], and s = W[N] / N.
   Sums A and W of a block follow from those of its elements alone and those before it, so that
   blocks are summed by all ranks at once, and only their totals one after the other.

   Inner nodes are eliminated element by element: where they carry no force they lie on the line
   between the slices, so that their forces are shared by both ends as by a lever. */
#include "kinetic.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PROBE = 1e-6; /* of the largest coordinate */

void phys_kinetic_free(struct phys_kinetic *k) { AD_FREE(k->stiffness, k->sums, k->slope); }

/* ---- the matrix of an element ---- */

static double entry(const struct phys_rule_table *t, size_t a, size_t b)
{
    double sum = 0;
    for (size_t p = 0; p < t->points; p++)
        sum += t->weight[p] * t->v[p][a] * t->v[p][b];
    return sum;
}

/* By Gauss and Jordan, without pivots, as the matrix is positive definite. */
static void invert_inner(struct phys_kinetic *k)
{
    const size_t n = k->table.degree - 1;
    double m[PHYS_RULE_MOST][PHYS_RULE_MOST];
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            m[a][b] = entry(&k->table, a + 1, b + 1);
            k->inverse[a][b] = a == b;
        }
    for (size_t p = 0; p < n; p++)
        for (size_t a = 0; a < n; a++) {
            const double factor = a == p ? 1 - 1 / m[p][p] : m[a][p] / m[p][p];
            for (size_t b = 0; b < n; b++) {
                m[a][b] -= factor * m[p][b];
                k->inverse[a][b] -= factor * k->inverse[p][b];
            }
        }
}

/* ---- stiffness ---- */

/* The probe: nodes move to and fro in turn, but for the ends. */
static double sign_of(const struct phys_ranked_path *p, size_t a, size_t column)
{
    const size_t slice = p->first + column, degree = p->settings->rule->degree;
    if (a == 0 && (slice == 0 || slice == p->blocks.elements))
        return 0;
    return (slice * degree + a) % 2 ? -1 : 1;
}

/* That matrix times the probe, times the probe: of all elements. */
static double probe_square(const struct phys_kinetic *k)
{
    const size_t n = k->table.degree;
    double inner = 0, first = 0, last = 0;
    for (size_t a = 0; a <= n; a++)
        for (size_t b = 0; b <= n; b++) {
            const double e = (a + b) % 2 ? -entry(&k->table, a, b) : entry(&k->table, a, b);
            inner += e;
            first += a && b ? e : 0;
            last += a < n && b < n ? e : 0;
        }
    return (double)(k->path->blocks.elements - 2) * inner + first + last;
}

static enum ad_status add_probed(void *context, size_t b, double *sum, struct ad_error *error)
{
    const struct phys_kinetic *k = context;
    const struct phys_ranked_path *p = k->path;
    const size_t from = phys_block_first(&p->blocks, b) - p->first, dof = p->system->dof;
    const size_t to = phys_block_first(&p->blocks, b + 1) - p->first;
    memset(sum, 0, dof * sizeof *sum);
    for (size_t row = 0; row < p->rows; row++)
        for (size_t i = from; i < to; i++)
            sum[row % dof] += sign_of(p, row / dof, i) *
                              (k->probed[row * p->columns + i] - k->gradient[row * p->columns + i]);
    return error->status;
}

static enum ad_status find_stiffness(struct phys_kinetic *k, double share, const double *x,
                                     double *room, struct ad_error *error)
{
    struct phys_ranked_path *p = k->path;
    const size_t n = p->rows * p->columns, dof = p->system->dof;
    struct phys_ranked_sums sums;
    double largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmin(largest, -fabs(x[i]));
    if (ad_ranks_least(p->ranks, 1, &largest, error) != AD_OK)
        return error->status;
    const double step = largest < 0 ? -PROBE * largest : PROBE;
    for (size_t row = 0; row < p->rows; row++)
        for (size_t i = 0; i < p->columns; i++)
            room[row * p->columns + i] = x[row * p->columns + i] + step * sign_of(p, row / dof, i);
    p->path = room;
    if (phys_ranked_gradient(p, &sums, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i < n; i++)
        room[i] = share * p->g[i];
    k->probed = room;
    if (ad_ranks_sum(p->ranks, p->blocks.count, dof, add_probed, k, k->stiffness, error) != AD_OK)
        return error->status;
    double stiffest = 0;
    for (size_t d = 0; d < dof; d++)
        stiffest = fmax(stiffest, k->stiffness[d]); /* NaN counts as none */
    for (size_t d = 0; d < dof; d++) {
        double s = k->stiffness[d] > 0 ? k->stiffness[d] : stiffest;
        k->stiffness[d] = s > 0 && isfinite(s) ? s / (step * probe_square(k)) : 1;
    }
    memcpy(p->scale, k->stiffness, dof * sizeof *p->scale);
    return AD_OK;
}

enum ad_status phys_kinetic_new(struct phys_kinetic *k, struct phys_ranked_path *p, double share,
                                const double *x, const double *g, double *room,
                                struct ad_error *error)
{
    const size_t dof = p->system->dof;
    *k = (struct phys_kinetic){.path = p, .gradient = g};
    p->settings->rule->fill(p->settings->rule, &k->table);
    invert_inner(k);
    k->stiffness = malloc(dof * sizeof *k->stiffness);
    k->slope = malloc(dof * sizeof *k->slope);
    k->sums = malloc((p->end - p->begin + 1) * 2 * dof * sizeof *k->sums);
    if (!k->stiffness || !k->slope || !k->sums)
        ad_fail(error, AD_E_MEMORY, "out of memory for a share of %zu slices", p->columns);
    return ad_ranks_agree(p->ranks, error) == AD_OK ? find_stiffness(k, share, x, room, error)
                                                    : error->status;
}

/* ---- solving ---- */

/* Elements from `from` to before `to` of coordinate d, beginning with A and W in sum; to `x` [to -
   from] the places of their first slices, unless it is NULL. */
static void sum_elements(const struct phys_kinetic *k, size_t d, size_t from, size_t to,
                         const double *r, double sum[2], double *x)
{
    const struct phys_ranked_path *p = k->path;
    const size_t step = p->system->dof * p->columns; /* from a node to the next one */
    double A = sum[0], W = sum[1];
    for (size_t i = from; i < to; i++) {
        const double *at = r + d * p->columns + i;
        double left = at[0], right = 0;
        for (size_t a = 1; a < k->table.degree; a++) {
            left += (1 - k->table.node[a]) * at[a * step];
            right += k->table.node[a] * at[a * step];
        }
        if (x)
            x[i - from] = ((double)(p->first + i) * k->slope[d] - W) / k->stiffness[d];
        A += p->first + i ? left : 0;
        W += A;
        A += right;
    }
    sum[0] = A;
    sum[1] = W;
}

/* Totals of this rank's blocks, [block][2][dof], become what is before each of them. */
static enum ad_status join_sums(struct phys_kinetic *k, struct ad_error *error)
{
    struct phys_ranked_path *p = k->path;
    const size_t dof = p->system->dof, rank = p->ranks ? p->ranks->rank : 0;
    const size_t last = p->ranks ? p->ranks->count - 1 : 0, own = p->end - p->begin;
    double *before = k->sums + own * 2 * dof;
    memset(before, 0, 2 * dof * sizeof *before);
    if (rank > 0)
        ad_ranks_exchange(p->ranks, AD_NO_RANK, NULL, rank - 1, before, 2 * dof * sizeof *before,
                          error);
    for (size_t b = 0; b < own; b++)
        for (size_t d = 0; d < dof; d++) {
            double *sum = k->sums + (b * dof + d) * 2, *all = before + 2 * d;
            const double A = sum[0], W = sum[1];
            const double elements = (double)(phys_block_first(&p->blocks, p->begin + b + 1) -
                                             phys_block_first(&p->blocks, p->begin + b));
            sum[0] = all[0];
            sum[1] = all[1];
            all[1] += elements * all[0] + W;
            all[0] += A;
        }
    if (rank < last)
        ad_ranks_exchange(p->ranks, rank + 1, before, AD_NO_RANK, NULL, 2 * dof * sizeof *before,
                          error);
    for (size_t d = 0; d < dof; d++)
        k->slope[d] = before[2 * d + 1] / (double)p->blocks.elements;
    return ad_ranks_broadcast(p->ranks, last, k->slope, dof * sizeof *k->slope, error);
}

/* Inner nodes of coordinate d, from its slices. */
static void place_inner(const struct phys_kinetic *k, size_t d, double *x)
{
    const struct phys_ranked_path *p = k->path;
    const size_t n = k->table.degree - 1, step = p->system->dof * p->columns;
    double r[PHYS_RULE_MOST];
    for (size_t i = 0; i + 1 < p->columns; i++) {
        double *at = x + d * p->columns + i;
        for (size_t a = 0; a < n; a++)
            r[a] = at[(a + 1) * step] / k->stiffness[d];
        for (size_t a = 0; a < n; a++) {
            const double u = k->table.node[a + 1];
            double *node = at + (a + 1) * step;
            *node = (1 - u) * at[0] + u * at[1];
            for (size_t b = 0; b < n; b++)
                *node += k->inverse[a][b] * r[b];
        }
    }
}

enum ad_status phys_kinetic_solve(struct phys_kinetic *k, double *r, struct ad_error *error)
{
    struct phys_ranked_path *p = k->path;
    const size_t dof = p->system->dof;
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t b = p->begin; b < p->end; b++)
            for (size_t d = 0; d < dof; d++) {
                const size_t from = phys_block_first(&p->blocks, b) - p->first;
                const size_t to = phys_block_first(&p->blocks, b + 1) - p->first;
                double *sum = k->sums + ((b - p->begin) * dof + d) * 2;
                double *x = r + d * p->columns + from;
                if (pass == 0)
                    sum[0] = sum[1] = 0;
                sum_elements(k, d, from, to, r, sum, pass ? x : NULL);
            }
        if (pass == 0 && join_sums(k, error) != AD_OK)
            return error->status;
    }
    const double *after = k->sums + (p->end - p->begin) * 2 * dof;
    for (size_t d = 0; d < dof; d++) { /* the last slice, of the next rank as well */
        const size_t last = p->first + p->columns - 1;
        r[(d + 1) * p->columns - 1] =
            last == p->blocks.elements
                ? 0
                : ((double)last * k->slope[d] - after[2 * d + 1]) / k->stiffness[d];
        place_inner(k, d, r);
    }
    return AD_OK;
}
