/* Passes while they are sought: passes.c finds groups that form one, windows.c gives them memory.
 */
#ifndef AUTODIFF_COMPILE_PASSES_H
#define AUTODIFF_COMPILE_PASSES_H

#include "plan.h"

/* Values that share one memory, by its owner. */
struct owner {
    uint32_t first, last;   /* groups that write or read it */
    uint32_t before, after; /* columns that are read beyond a block */
    bool fixed;             /* in memory in any case */
    uint32_t at, placed;    /* row of the window; 1 + first group of the pass it was placed for */
};

struct passes {
    struct plan *plan;
    struct graph *g;
    struct owner *owners;
    uint32_t first, end, cols; /* groups of the pass that is sought, and its columns */
    uint32_t margin;           /* of its blocks */
};

static inline uint32_t owner_of(const struct graph *g, uint32_t i)
{
    while (g->values[i].flags & VALUE_BORROWED)
        i = g->host[i];
    return i;
}

static inline uint32_t larger(uint32_t a, uint32_t b) { return a > b ? a : b; }

/* A product that adds the columns up. */
static inline bool adds_columns(const struct value *v)
{
    return v->op == AD_OP_matmul && v->aux & MATMUL_TB;
}

/* Its memory holds a block of columns at a time. */
static inline bool is_window(const struct passes *s, uint32_t o)
{
    const struct owner *owner = &s->owners[o];
    return s->g->values[o].cols == s->cols && !owner->fixed && owner->first >= s->first &&
           owner->last < s->end;
}

/* Divides the pass into blocks and gives its values windows; false where that gains nothing. */
bool ad_make_windows(struct passes *passes);

#endif
