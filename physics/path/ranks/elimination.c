/* Newton's system over ranks: each block of elements is eliminated in order of time until its two
   end slices are left, and the slices between blocks by a tree, as ad_ranks_sum has it: a node is
   a range of blocks, the first half as long as the largest power of two below the whole, and the
   rank of its first block joins its halves. What a rank does depends on its blocks alone.

   All ranks visit nodes in the same order, so that none waits for another in a circle. */
#include "elimination.h"
#include "autodiff/free.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Joints within blocks are kept up to so many numbers a rank; else made anew for the way back. */
static const size_t MOST_KEPT = (size_t)1 << 27;

enum { LEVELS = 64 }; /* of the tree, at most: a rank's joints with blocks of others */

/* ---- making ---- */

static size_t own_blocks(const struct phys_elimination *e) { return e->path->end - e->path->begin; }

/* Numbers of a joint, of all of them in a block, and between blocks. */
static size_t joint_numbers(const struct phys_elimination *e, size_t unknowns)
{
    return unknowns * phys_segment_side(e->joints.dof);
}

static size_t block_numbers(const struct phys_elimination *e)
{
    return e->path->blocks.length * joint_numbers(e, e->joints.dof + e->inner);
}

enum ad_status phys_elimination_new(struct phys_elimination *e, struct phys_ranked_path *path,
                                    struct ad_error *error)
{
    size_t dof = path->system->dof, inner = path->rows - dof, side = phys_segment_side(dof);
    *e = (struct phys_elimination){
        .path = path, .inner = inner, .numbers = phys_segment_numbers(dof)};
    bool made = phys_joints_new(&e->joints, dof, inner);
    size_t own = own_blocks(e);
    e->keeps = own <= MOST_KEPT / block_numbers(e);
    e->element = calloc((side + inner) * (side + inner), sizeof *e->element);
    e->segment = calloc((own + 1) * e->numbers, sizeof *e->segment);
    e->within = malloc((e->keeps ? own : 1) * block_numbers(e) * sizeof *e->within);
    e->between = malloc((own + LEVELS) * joint_numbers(e, dof) * sizeof *e->between);
    e->ends = malloc(own * 2 * dof * sizeof *e->ends);
    e->unknowns = malloc((7 * dof + 3 * inner) * sizeof *e->unknowns);
    e->nodes = e->unknowns ? e->unknowns + 3 * dof + inner : NULL;
    if (!made || !e->element || !e->segment || !e->within || !e->between || !e->ends ||
        !e->unknowns)
        ad_fail(error, AD_E_MEMORY, "out of memory for a share of %zu slices", path->columns);
    return ad_ranks_agree(path->ranks, error);
}

void phys_elimination_free(struct phys_elimination *e)
{
    AD_FREE(e->element, e->segment, e->within, e->between, e->ends, e->unknowns);
    phys_joints_free(&e->joints);
}

static double *segment_of(const struct phys_elimination *e, size_t block)
{
    return e->segment + (block - e->path->begin) * e->numbers;
}

static double *ends_of(const struct phys_elimination *e, size_t block)
{
    return e->ends + (block - e->path->begin) * 2 * e->joints.dof;
}

/* ---- blocks ---- */

/* Element k of the block loaded as the right side of a joint; adds to `rounding` the squares of |H|
   |x| times scale. */
static void fill_element(struct phys_elimination *e, size_t k, double *rounding)
{
    const struct phys_ranked_path *p = e->path;
    const struct phys_hessian *h = &p->hessian;
    const double *scale = p->scale, *g = h->gradient + k * h->side;
    const uint32_t *place = h->of->coupling.place;
    size_t rows = h->side + 1, n = h->dof;
    double *x = e->nodes, *sum = x + h->side, largest = e->largest;
    for (size_t c = 0; c < h->side; c++) {
        size_t node = k * h->table.degree + c / n;
        x[c] = fabs(p->block[(node % h->table.degree * n + c % n) * (h->elements + 1) +
                             node / h->table.degree]);
        sum[c] = 0;
    }
    for (size_t b = 0, c = 0; b <= h->table.degree; b++)
        for (size_t j = 0; j < n; j++, c++) {
            double *column = e->element + c * rows;
            for (size_t a = b, r = c; a <= h->table.degree; a++)
                for (size_t i = a == b ? j : 0; i < n; i++, r++) {
                    double entry = phys_hessian_entry(h, k, a, place[i], b, place[j]),
                           size = fabs(entry);
                    column[r] = entry * scale[i] * scale[j];
                    largest = fabs(column[r]) > largest ? fabs(column[r]) : largest;
                    sum[r] += size * x[c];
                    sum[c] += r > c ? size * x[r] : 0;
                }
            column[h->side] = g[c] * scale[j];
        }
    e->largest = largest;
    for (size_t c = 0; c < h->side; c++)
        *rounding += sum[c] * sum[c] * scale[c % n] * scale[c % n];
}

/* Eliminates a block up to its ends, with joints to `solved`. */
static void eliminate_block(struct phys_elimination *e, size_t b, double *solved, double *rounding)
{
    struct phys_ranked_path *p = e->path;
    double start = phys_ranked_load(p, b), *whole = segment_of(e, b);
    phys_hessian_at(&p->hessian, p->block, start);
    for (size_t k = 0; k < p->hessian.elements; k++) {
        fill_element(e, k, rounding);
        phys_segment_join(&e->joints, k ? whole : NULL, e->element, NULL, e->inner, whole, solved);
        solved += joint_numbers(e, (k ? e->joints.dof : 0) + e->inner);
    }
}

static double *joints_of(const struct phys_elimination *e, size_t b)
{
    return e->within + (e->keeps ? (b - e->path->begin) * block_numbers(e) : 0);
}

/* Steps of the nodes of a block, from those of its ends; its column k is that of its slice k and of
   the inner nodes behind. */
static void expand_block(struct phys_elimination *e, size_t b, double *step)
{
    struct phys_ranked_path *p = e->path;
    size_t dof = e->joints.dof, unknowns = dof + e->inner;
    double none = 0, *joint = joints_of(e, b), *x = e->unknowns, *ends = x + unknowns;
    if (!e->keeps)
        eliminate_block(e, b, joint, &none);
    size_t from = phys_block_first(&p->blocks, b) - p->first;
    size_t elements = phys_block_first(&p->blocks, b + 1) - p->first - from;
    memcpy(ends, ends_of(e, b), 2 * dof * sizeof *ends);
    for (size_t k = elements; k-- > 0;) {
        double *first = k ? x : x + dof;
        size_t n = k ? unknowns : e->inner;
        phys_segment_expand(dof, n, joint + (k ? joint_numbers(e, k * unknowns - dof) : 0), ends,
                            first);
        if (k == 0)
            memcpy(x, ends, dof * sizeof *x);
        for (size_t row = 0; row < unknowns; row++)
            step[row * p->columns + from + k] = p->scale[row % dof] * x[row];
        memcpy(ends + dof, x, dof * sizeof *x);
    }
}

/* ---- the tree ---- */

static size_t middle(size_t first, size_t last)
{
    size_t half = 1;
    while (2 * half < last - first)
        half *= 2;
    return first + half;
}

static bool has_part(const struct phys_elimination *e, size_t first, size_t last)
{
    return first < e->path->end && last > e->path->begin;
}

/* The rank that has a block. */
static size_t rank_of(const struct phys_ranked_path *p, size_t block)
{
    size_t low = 0, high = p->ranks ? p->ranks->count : 1;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        *(ad_ranks_first(p->ranks, p->blocks.count, mid) <= block ? &low : &high) = mid;
    }
    return low;
}

/* A node of the tree: its halves, and the ranks that have them. */
struct node {
    size_t middle, first_rank, second_rank;
    bool first, second; /* whether this rank has them */
};

static struct node node_of(const struct phys_elimination *e, size_t first, size_t last)
{
    const struct ad_ranks *ranks = e->path->ranks;
    size_t rank = ranks ? ranks->rank : 0;
    struct node n = {.middle = middle(first, last)};
    n.first_rank = rank_of(e->path, first);
    n.second_rank = rank_of(e->path, n.middle);
    n.first = n.first_rank == rank;
    n.second = n.second_rank == rank;
    return n;
}

/* Sends what this rank has of the second half to the rank of the first, or the other way. */
static void hand_over(struct phys_elimination *e, const struct node *n, bool up, double *data,
                      size_t numbers, struct ad_error *error)
{
    bool sends = up ? n->second : n->first, receives = up ? n->first : n->second;
    size_t bytes = numbers * sizeof *data;
    if (sends == receives)
        return;
    if (sends)
        ad_ranks_exchange(e->path->ranks, up ? n->first_rank : n->second_rank, data, AD_NO_RANK,
                          NULL, bytes, error);
    else
        ad_ranks_exchange(e->path->ranks, AD_NO_RANK, NULL, up ? n->second_rank : n->first_rank,
                          data, bytes, error);
}

/* Joins the blocks from `first` to before `last`. */
static void join(struct phys_elimination *e, size_t first, size_t last, struct ad_error *error)
{
    if (!has_part(e, first, last) || last - first == 1)
        return;
    struct node n = node_of(e, first, last);
    join(e, first, n.middle, error);
    join(e, n.middle, last, error);
    double *second = segment_of(e, n.second ? n.middle : e->path->end);
    hand_over(e, &n, true, second, e->numbers, error);
    if (n.first)
        phys_segment_join(&e->joints, segment_of(e, first), second,
                          phys_segment_counts(e->joints.dof, second), 0, segment_of(e, first),
                          e->between + joint_numbers(e, e->joints.dof) * e->joined++);
}

/* From the steps of the ends of the first block, which are those of the node's, those of the ends
   of all blocks: in the reverse order of joints. */
static void part(struct phys_elimination *e, size_t first, size_t last, struct ad_error *error)
{
    if (!has_part(e, first, last) || last - first == 1)
        return;
    size_t dof = e->joints.dof;
    struct node n = node_of(e, first, last);
    double *room = e->unknowns, *second = n.second ? ends_of(e, n.middle) : room;
    if (n.first) {
        double *ends = ends_of(e, first);
        phys_segment_expand(dof, dof, e->between + joint_numbers(e, dof) * --e->joined, ends,
                            second);
        memcpy(second + dof, ends + dof, dof * sizeof *ends);
        memcpy(ends + dof, second, dof * sizeof *ends);
    }
    hand_over(e, &n, false, second, 2 * dof, error);
    part(e, n.middle, last, error);
    part(e, first, n.middle, error);
}

/* ---- the whole ---- */

static enum ad_status eliminate_next(void *context, size_t b, double *values,
                                     struct ad_error *error)
{
    struct phys_elimination *e = context;
    values[0] = 0;
    eliminate_block(e, b, joints_of(e, b), values);
    return error->status;
}

enum ad_status phys_eliminate(struct phys_elimination *e, double shift, struct ad_error *error)
{
    struct ad_ranks *ranks = e->path->ranks;
    size_t blocks = e->path->blocks.count;
    double counts[2], sum;
    e->joints.shift = shift;
    e->largest = 0;
    e->joined = 0;
    if (ad_ranks_sum(ranks, blocks, 1, eliminate_next, e, &sum, error) == AD_OK)
        join(e, 0, blocks, error);
    memcpy(counts, phys_segment_counts(e->joints.dof, e->segment), sizeof counts);
    ad_ranks_broadcast(ranks, 0, counts, sizeof counts, error);
    e->rounding = DBL_EPSILON * sqrt(sum);
    e->negative = (size_t)counts[0];
    e->singular = counts[1] > 0;
    return error->status;
}

enum ad_status phys_elimination_step(struct phys_elimination *e, double *step,
                                     struct ad_error *error)
{
    struct phys_ranked_path *p = e->path;
    size_t dof = e->joints.dof, last = p->columns - 1;
    memset(e->ends, 0, 2 * dof * sizeof *e->ends);
    part(e, 0, p->blocks.count, error);
    for (size_t b = p->begin; b < p->end; b++)
        expand_block(e, b, step);
    for (size_t row = 0; row < p->rows; row++)
        step[row * p->columns + last] =
            row < dof ? p->scale[row] * ends_of(e, p->end - 1)[dof + row] : 0;
    return error->status;
}
