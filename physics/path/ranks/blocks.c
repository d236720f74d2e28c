/* Blocks of a path over ranks (blocks.h). A block is evaluated alone, from its own part of the
   path, so that its numbers do not depend on which rank has it. */
#include "blocks.h"
#include "autodiff/free.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Elements of a block, at most and at least, and blocks that paths of few elements have. */
enum { LONGEST = 128, SHORTEST = 4, SHARES = 64 };
enum { PASSES = 4 }; /* over a path by Newton's method, about */

struct phys_blocks phys_blocks_of(size_t elements)
{
    size_t length = elements / SHARES;
    length = length < SHORTEST ? SHORTEST : length > LONGEST ? LONGEST : length;
    return (struct phys_blocks){elements, length, (elements + length - 1) / length};
}

size_t phys_block_first(const struct phys_blocks *b, size_t block)
{
    return block < b->count ? block * b->length : b->elements;
}

enum ad_status phys_path_share(const struct ad_ranks *ranks, size_t rank, size_t slices,
                               struct phys_path_share *share, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, share))
        return error->status;
    size_t count = ranks ? ranks->count : 1;
    if (slices < 3 || rank >= count)
        return ad_fail(error, AD_E_ARGUMENT,
                       "rank %zu of %zu, %zu slices; expected a rank below their number and 3 "
                       "slices or more",
                       rank, count, slices);
    const struct phys_blocks blocks = phys_blocks_of(slices - 1);
    if (count > blocks.count)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%zu ranks for a path of %zu slices, which has %zu blocks; expected at most "
                       "as many ranks as blocks; try fewer ranks",
                       count, slices, blocks.count);
    share->first = phys_block_first(&blocks, ad_ranks_first(ranks, blocks.count, rank));
    share->slices =
        phys_block_first(&blocks, ad_ranks_first(ranks, blocks.count, rank + 1)) - share->first + 1;
    return AD_OK;
}

enum ad_status phys_ranked_check(const struct phys_system *system,
                                 const struct phys_path_settings *s,
                                 const struct phys_solver *solver, struct ad_error *error)
{
    const char *name = solver->name;
    static const char *const solvers[] = {"newton", "lbfgs", "adam", "sgd"};
    bool known = false;
    for (size_t k = 0; k < sizeof solvers / sizeof *solvers; k++)
        known |= strcmp(name, solvers[k]) == 0;
    if (!known)
        return ad_fail(error, AD_E_ARGUMENT,
                       "solver %s over ranks; expected newton, lbfgs, adam or sgd", name);
    if (s->rule->repeat)
        return ad_fail(error, AD_E_ARGUMENT,
                       "rule %s over ranks; expected one that counts each slice once",
                       s->rule->name);
    if (s->hold > 1 || s->ends || s->mesh || s->reference || s->compare || s->start_momentum ||
        s->energy_weight != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "hold, ends, mesh, reference, compare, start_momentum or energy_weight over "
                       "ranks; expected none of them");
    if (phys_refuse_constraints(system, "paths over ranks", error) != AD_OK)
        return error->status;
    return phys_refuse_forces(system, "paths over ranks", error);
}

static enum ad_status allocate(struct phys_ranked_path *p, bool second, struct ad_error *error)
{
    const struct phys_path_settings *s = p->settings;
    size_t dof = p->system->dof, points = s->rule->degree * p->blocks.length;
    struct phys_derivatives *of = calloc(1, sizeof *of);
    p->hessian.own = of;
    p->block = malloc(p->rows * (p->blocks.length + 1) * sizeof *p->block);
    p->scale = malloc(4 * dof * sizeof *p->scale);
    p->ends = p->scale ? p->scale + dof : NULL;
    if (p->columns <= SIZE_MAX / sizeof *p->g / p->rows)
        p->g = malloc(p->rows * p->columns * sizeof *p->g);
    if (!of || !p->block || !p->scale || !p->g)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a share of %zu slices", p->columns);
    for (size_t d = 0; d < dof; d++)
        p->scale[d] = 1;
    points = points < LONGEST ? points : LONGEST;
    if ((second ? phys_derivatives_new(of, p->system, points, NULL, error)
                : phys_derivatives_first_new(of, p->system, points, error)) == AD_OK)
        phys_hessian_over(&p->hessian, of, s->rule, p->blocks.length + 1, s->dt, error);
    p->hessian.own = of;
    return error->status;
}

/* Machine code by the work of the whole path, not of this rank's share, and from the first block
   on, as it rounds otherwise than the interpreter. */
static enum ad_status choose_code(struct phys_ranked_path *p, struct ad_error *error)
{
    const struct phys_derivatives *of = p->hessian.of;
    const double passes = of->second ? PASSES : (double)p->settings->steps;
    const double runs = passes * (double)p->blocks.count;
    if (!p->settings->native)
        return AD_OK;
    if (ad_native_ranks(p->ranks, of->first, runs, error) == AD_OK && of->second)
        ad_native_ranks(p->ranks, of->second, runs * (double)of->coupling.colours, error);
    return error->status;
}

enum ad_status phys_ranked_new(struct phys_ranked_path *p, struct ad_ranks *ranks,
                               const struct phys_system *system,
                               const struct phys_path_settings *settings, bool second,
                               struct ad_error *error)
{
    struct phys_path_share share;
    size_t rank = ranks ? ranks->rank : 0;
    *p = (struct phys_ranked_path){.ranks = ranks, .system = system, .settings = settings};
    char task[200];
    snprintf(task, sizeof task, "%s of %zu coordinates, rule %s, %zu slices %.17g apart",
             system->scene->name, system->dof, settings->rule->name, settings->slices,
             settings->dt);
    if (phys_path_share(ranks, rank, settings->slices, &share, error) == AD_OK &&
        ad_ranks_same(ranks, "path", task, error) == AD_OK) {
        p->blocks = phys_blocks_of(settings->slices - 1);
        p->begin = ad_ranks_first(ranks, p->blocks.count, rank);
        p->end = ad_ranks_first(ranks, p->blocks.count, rank + 1);
        p->rows = settings->rule->degree * system->dof;
        p->columns = share.slices;
        p->first = share.first;
        allocate(p, second, error);
    }
    return ad_ranks_agree(ranks, error) == AD_OK ? choose_code(p, error) : error->status;
}

void phys_ranked_free(struct phys_ranked_path *p)
{
    phys_hessian_free(&p->hessian);
    AD_FREE(p->block, p->g, p->scale);
}

double phys_ranked_load(struct phys_ranked_path *p, size_t b)
{
    struct phys_hessian *h = &p->hessian;
    size_t from = phys_block_first(&p->blocks, b),
           n = phys_block_first(&p->blocks, b + 1) - from + 1;
    h->elements = n - 1;
    h->points = h->table.points * h->elements;
    for (size_t row = 0; row < p->rows; row++)
        memcpy(p->block + row * n, p->path + row * p->columns + from - p->first,
               n * sizeof *p->block);
    return (double)from * p->settings->dt;
}

enum ad_status phys_ranked_scale(struct phys_ranked_path *p, struct ad_error *error)
{
    size_t dof = p->system->dof;
    if (p->begin == 0) {
        double start = phys_ranked_load(p, 0);
        phys_hessian_at(&p->hessian, p->block, start);
        for (size_t d = 0; d < dof; d++) {
            double s = p->hessian.stiffness[d];
            p->scale[d] = s > 0 && isfinite(s) ? 1 / sqrt(s) : 1;
        }
    }
    return ad_ranks_broadcast(p->ranks, 0, p->scale, dof * sizeof *p->scale, error);
}

/* ---- gradient ---- */

/* Where node `node` of the share has coordinate d. */
static double *at_node(const struct phys_ranked_path *p, double *x, size_t node, size_t d)
{
    size_t degree = p->settings->rule->degree;
    return x + (node % degree * p->system->dof + d) * p->columns + node / degree;
}

static enum ad_status evaluate_block(void *context, size_t b, double *values,
                                     struct ad_error *error)
{
    struct phys_ranked_path *p = context;
    struct phys_hessian *h = &p->hessian;
    double start = phys_ranked_load(p, b);
    size_t node = (phys_block_first(&p->blocks, b) - p->first) * h->table.degree;
    phys_hessian_gradient_at(h, p->block, start);
    for (size_t e = 0; e < h->elements; e++, node += h->table.degree)
        for (size_t k = 0; k < h->side; k++)
            *at_node(p, p->g, node + k / h->dof, k % h->dof) += h->gradient[e * h->side + k];
    if (b == 0)
        p->energy = h->energy;
    p->range[0] = fmin(p->range[0], h->least);
    p->range[1] = fmax(p->range[1], h->most);
    values[0] = h->action;
    values[1] = h->kinetic;
    return error->status;
}

/* Adds the neighbours' parts to the gradient at the slices shared with them. */
static enum ad_status exchange_ends(struct phys_ranked_path *p, struct ad_error *error)
{
    size_t dof = p->system->dof, last = p->columns - 1, bytes = dof * sizeof(double);
    size_t rank = p->ranks ? p->ranks->rank : 0;
    size_t before = rank > 0 ? rank - 1 : AD_NO_RANK;
    size_t behind = p->ranks && rank + 1 < p->ranks->count ? rank + 1 : AD_NO_RANK;
    double *sent[2] = {p->ends, p->ends + dof}, *received = p->ends + 2 * dof;
    for (size_t d = 0; d < dof; d++) {
        sent[0][d] = p->g[d * p->columns];
        sent[1][d] = p->g[d * p->columns + last];
    }
    for (size_t side = 0; side < 2; side++) {
        size_t to = side ? behind : before, from = side ? before : behind;
        ad_ranks_exchange(p->ranks, to, sent[side], from, received, bytes, error);
        for (size_t d = 0; d < dof && from != AD_NO_RANK; d++)
            p->g[d * p->columns + (side ? 0 : last)] += received[d];
    }
    for (size_t d = 0; d < dof; d++) { /* held at the ends of the path; else the next loop has it */
        if (before == AD_NO_RANK)
            p->g[d * p->columns] = 0;
        if (behind == AD_NO_RANK)
            p->g[d * p->columns + last] = 0;
    }
    return error->status;
}

/* Products of p->factor in a block, plain and times scale. */
static enum ad_status multiply_block(void *context, size_t b, double *values,
                                     struct ad_error *error)
{
    struct phys_ranked_path *p = context;
    size_t from = phys_block_first(&p->blocks, b) - p->first;
    size_t to = phys_block_first(&p->blocks, b + 1) - p->first;
    values[0] = values[1] = 0;
    for (size_t row = 0; row < p->rows; row++) {
        double sum = 0, scale = p->scale[row % p->system->dof];
        for (size_t i = row * p->columns + from; i < row * p->columns + to; i++)
            sum += p->factor[0][i] * p->factor[1][i];
        values[0] += sum;
        values[1] += scale * scale * sum;
    }
    return error->status;
}

enum ad_status phys_ranked_products(struct phys_ranked_path *p, const double *a, const double *b,
                                    double sums[2], struct ad_error *error)
{
    p->factor[0] = a;
    p->factor[1] = b;
    return ad_ranks_sum(p->ranks, p->blocks.count, 2, multiply_block, p, sums, error);
}

enum ad_status phys_ranked_range(struct phys_ranked_path *p, double range[2],
                                 struct ad_error *error)
{
    range[1] = -range[1];
    ad_ranks_least(p->ranks, 2, range, error);
    range[1] = -range[1];
    return error->status;
}

enum ad_status phys_ranked_gradient(struct phys_ranked_path *p, struct phys_ranked_sums *sums,
                                    struct ad_error *error)
{
    double of_L[2], squares[2];
    size_t blocks = p->blocks.count;
    memset(p->g, 0, p->rows * p->columns * sizeof *p->g);
    p->range[0] = (double)INFINITY;
    p->range[1] = -(double)INFINITY;
    if (ad_ranks_sum(p->ranks, blocks, 2, evaluate_block, p, of_L, error) != AD_OK ||
        exchange_ends(p, error) != AD_OK ||
        phys_ranked_products(p, p->g, p->g, squares, error) != AD_OK)
        return error->status;
    *sums = (struct phys_ranked_sums){of_L[0], of_L[1], squares[0], squares[1]};
    return AD_OK;
}
