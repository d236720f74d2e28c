/* Sums over blocks by a fixed tree. A node of the tree is a range of blocks: one block, or two
   ranges, the first as long as the largest power of two below the whole. Each rank first makes the
   nodes that are wholly its own, so that none waits for another in between; then the ranks of two
   halves join them, the first block's owner keeping the sum. */
#include "ranks.h"
#include "autodiff/free.h"

#include <stdlib.h>

struct tree {
    struct ad_ranks *ranks;        /* NULL: alone */
    size_t blocks, n, first, last; /* [first, last): this rank's */
    ad_ranks_block *block;
    void *context;
    double *room; /* [levels x n], one right half a level */
    double *own;  /* [nodes x n], those wholly this rank's, in order */
    size_t nodes, taken;
    struct ad_error *error;
};

static size_t middle(size_t first, size_t last)
{
    size_t half = 1;
    while (2 * half < last - first)
        half *= 2;
    return first + half;
}

static bool is_own(const struct tree *t, size_t first, size_t last)
{
    return first >= t->first && last <= t->last;
}
static bool has_part(const struct tree *t, size_t first, size_t last)
{
    return first < t->last && last > t->first;
}

static void add(const struct tree *t, const double *right, double *sum)
{
    for (size_t i = 0; i < t->n; i++)
        sum[i] += right[i];
}

static void add_blocks(const struct tree *t, size_t first, size_t last, double *room, double *sum)
{
    if (t->error->status != AD_OK)
        return;
    if (last - first == 1) {
        t->block(t->context, first, sum, t->error);
        return;
    }
    size_t mid = middle(first, last);
    add_blocks(t, first, mid, room + t->n, sum);
    add_blocks(t, mid, last, room + t->n, room);
    add(t, room, sum);
}

/* Calls of `visit` for the nodes that are wholly this rank's, in order. */
static void each_own(struct tree *t, size_t first, size_t last,
                     void (*visit)(struct tree *t, size_t first, size_t last))
{
    if (!has_part(t, first, last))
        return;
    if (is_own(t, first, last)) {
        visit(t, first, last);
        return;
    }
    size_t mid = middle(first, last);
    each_own(t, first, mid, visit);
    each_own(t, mid, last, visit);
}

static void count_node(struct tree *t, size_t first, size_t last)
{
    (void)first, (void)last;
    t->nodes++;
}

static void make_node(struct tree *t, size_t first, size_t last)
{
    add_blocks(t, first, last, t->room, t->own + t->n * t->taken++);
}

/* The rank of a block, the inverse of ad_ranks_first. */
static size_t owner(const struct tree *t, size_t block)
{
    size_t low = 0, high = t->ranks->count;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        *(ad_ranks_first(t->ranks, t->blocks, mid) <= block ? &low : &high) = mid;
    }
    return low;
}

static void join(struct tree *t, size_t first, size_t last, double *room, double *sum)
{
    if (!has_part(t, first, last))
        return;
    if (is_own(t, first, last)) {
        memcpy(sum, t->own + t->n * t->taken++, t->n * sizeof *sum);
        return;
    }
    size_t mid = middle(first, last), to = owner(t, first), from = owner(t, mid);
    size_t me = t->ranks->rank, bytes = t->n * sizeof *sum;
    join(t, first, mid, room + t->n, sum);
    join(t, mid, last, room + t->n, room);
    if (to != from && me == from)
        ad_ranks_exchange(t->ranks, to, room, AD_NO_RANK, NULL, bytes, t->error);
    if (to != from && me == to)
        ad_ranks_exchange(t->ranks, AD_NO_RANK, NULL, from, room, bytes, t->error);
    if (me == to)
        add(t, room, sum);
}

static size_t levels(size_t blocks)
{
    size_t n = 1;
    while (blocks > 1) {
        blocks -= blocks / 2;
        n++;
    }
    return n;
}

enum ad_status ad_ranks_sum(struct ad_ranks *ranks, size_t blocks, size_t n, ad_ranks_block *block,
                            void *context, double *sum, struct ad_error *error)
{
    if (AD_LACKS(error, block, sum) || (ranks && ad_ranks_check(ranks, error) != AD_OK))
        return error->status;
    memset(sum, 0, n * sizeof *sum);
    if (blocks == 0)
        return AD_OK;
    size_t rank = ranks ? ranks->rank : 0;
    struct tree t = {.ranks = ranks,
                     .blocks = blocks,
                     .n = n,
                     .first = ad_ranks_first(ranks, blocks, rank),
                     .last = ad_ranks_first(ranks, blocks, rank + 1),
                     .block = block,
                     .context = context,
                     .error = error};
    bool alone = !ranks || ranks->count == 1;
    if (!alone)
        each_own(&t, 0, blocks, count_node);
    t.room = malloc(levels(blocks) * n * sizeof *t.room + 1);
    t.own = malloc(t.nodes * n * sizeof *t.own + 1);
    if (!t.room || !t.own)
        ad_fail(error, AD_E_MEMORY, "out of memory for a sum of %zu blocks", blocks);
    else if (alone)
        add_blocks(&t, 0, blocks, t.room, sum);
    else
        each_own(&t, 0, blocks, make_node);
    if (!alone && ad_ranks_agree(ranks, error) == AD_OK) {
        t.taken = 0;
        join(&t, 0, blocks, t.room, sum);
        ad_ranks_broadcast(ranks, owner(&t, 0), sum, n * sizeof *sum, error);
    }
    AD_FREE(t.room, t.own);
    return error->status;
}
