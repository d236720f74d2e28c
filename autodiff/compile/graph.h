/* The graph of values that the outputs need. graph.c builds it, views.c finds views, schedule.c and
   sink.c group values into segments, order.c orders these, accumulate.c sums in place; the files of
   plan.h assign memory.
 */
#ifndef AUTODIFF_COMPILE_GRAPH_H
#define AUTODIFF_COMPILE_GRAPH_H

#include "autodiff/exec/program.h"

/* Values that one segment computes, consecutive in `order`. */
struct group {
    uint32_t first, count; /* in `order` */
    /* Groups of a pass have its number, not 0, its number of blocks of columns and the width of its
       windows; and the columns that they compute beyond a block. */
    uint32_t pass, blocks, width;
    uint32_t before, after;
    uint32_t margin, adds, turn; /* as in struct segment */
};

enum { KNOWN_LISTS = 64 };

struct graph {
    const ad_tape *tape;
    struct value *values;
    uint32_t *nodes; /* of the values, on the tape */
    size_t n;
    struct loc *locs; /* one per value, then sources of copies and broadcast operands */
    size_t n_locs, max_locs;
    struct port *ports;
    size_t n_ports;
    uint32_t *lists; /* row numbers of gathers and scatters */
    size_t n_lists, max_lists;
    struct known_list {
        uint32_t first, n;
    } known_lists[KNOWN_LISTS]; /* by a hash; n 0: none */
    uint32_t *renumber;         /* node -> value; UINT32_MAX: no output needs it */
    uint32_t *order, *group_of;
    uint32_t *host;     /* for borrowed values: the value whose memory holds them */
    bool has[AD_N_OPS]; /* operations that occur, copies of views excepted */
    struct group *groups;
    size_t n_groups, n_constant_groups, n_held_groups; /* held: includes the constant ones */
};

/* The passes, in this order; each returns false when out of memory. */
bool ad_graph_build(struct graph *graph, const ad_tape *tape, size_t n_out, const ad_var out[]);
bool ad_graph_find_views(struct graph *graph);
bool ad_graph_schedule(struct graph *graph);
/* Part of scheduling: sinks values to the level of their first use where that needs no memory. */
bool ad_graph_sink(const struct graph *graph, uint32_t *level);
/* Part of scheduling: orders the groups for passes over columns. */
bool ad_graph_order(struct graph *graph);
/* Columns of a block for which the other two matrices of a product are as large as v. */
static inline uint32_t ad_least_block(const struct value *v)
{
    return (uint32_t)((double)v->rows * v->cols / ((double)v->rows + v->cols));
}
/* The columns of the passes that v has a place in: its own, or those that it adds up; 0: none. */
uint32_t ad_pass_columns(const struct graph *graph, const struct value *v);
bool ad_graph_accumulate(struct graph *graph);
void ad_graph_release(struct graph *graph);

/* ---- kinds of values ---- */

/* Sets of structural operations, which precede the elementwise ones in the table. */
#define OP_BIT(name) (UINT32_C(1) << AD_OP_##name)
#define IN_SET(op, set) ((op) < AD_OP_copy && (UINT32_C(1) << (op) & (set)))

static inline bool is_leaf(const struct value *v)
{
    return v->op == AD_OP_input || v->op == AD_OP_constant;
}

/* Sums and scatters: they end the instructions of a tile by accumulating into memory. */
static inline bool is_sink(uint16_t op)
{
    return IN_SET(op, OP_BIT(sum) | OP_BIT(sum_rows) | OP_BIT(sum_cols) | OP_BIT(scatter));
}

/* Reads neighbouring columns. */
static inline bool is_stencil(uint16_t op)
{
    return IN_SET(op, OP_BIT(diff) | OP_BIT(diff_adjoint));
}

/* Forms a segment of its own. */
static inline bool is_alone(uint16_t op)
{
    return IN_SET(op, OP_BIT(place) | OP_BIT(transpose) | OP_BIT(matmul) | OP_BIT(gather_cols) |
                          OP_BIT(scatter_cols) | OP_BIT(cumsum) | OP_BIT(factor) | OP_BIT(solve) |
                          OP_BIT(logdet) | OP_BIT(scan) | OP_BIT(scan_adjoint) | OP_BIT(custom) |
                          OP_BIT(custom_adjoint));
}

/* There is a sum, scatter or product that others could accumulate onto. */
static inline bool may_accumulate(const struct graph *g)
{
    return g->has[AD_OP_sum_rows] || g->has[AD_OP_scatter] || g->has[AD_OP_matmul];
}

/* No instruction computes it: a leaf or a view. */
static inline bool is_given(const struct value *v) { return is_leaf(v) || (v->flags & VALUE_VIEW); }

/* ---- operands ---- */

/* Entry k of the operand list of v. Of a place operation: its node, row and column. */
static inline const uint32_t *place_part(const struct graph *g, const struct value *v, size_t k)
{
    return g->tape->lists + v->aux + 1 + 3 * k;
}

static inline size_t n_operands(const struct graph *g, const struct value *v)
{
    return has_operand_list(v->op) ? g->tape->lists[v->aux] : ad_ops[v->op].arity;
}

static inline uint32_t operand(const struct graph *g, const struct value *v, size_t k)
{
    return has_operand_list(v->op) ? g->renumber[place_part(g, v, k)[0]] : v->in[k];
}

/* The location operand k of v is read from, before broadcasting. */
static inline const struct loc *operand_loc(const struct graph *g, const struct value *v, size_t k)
{
    if (v->op > AD_OP_copy)
        return &g->locs[v->in[k]];
    bool copied_view = v->op == AD_OP_copy && v->in[1];
    return &g->locs[copied_view ? v->in[1] : operand(g, v, k)];
}

/* The value in whose memory operand k of v lies. */
static inline uint32_t operand_root(const struct graph *g, const struct value *v, size_t k)
{
    const bool own = v->op > AD_OP_copy && !(g->values[v->in[k]].flags & VALUE_VIEW);
    return own ? v->in[k] : operand_loc(g, v, k)->root;
}

/* Adds a location that belongs to no value: the source of a copy, a broadcast operand. */
bool ad_graph_add_loc(struct graph *graph, struct loc loc, uint32_t *index);

/* x at l is contiguous and row-major. */
static inline bool is_contiguous(const struct value *x, const struct loc *l)
{
    return !l->list && (l->cs == 1 || x->cols == 1) && (l->rs == x->cols || x->rows == 1);
}

/* Operand k of v has v's iteration space and is read lane by lane. */
static inline bool reads_in_step(const struct graph *g, const struct value *v, size_t k)
{
    if (v->op > AD_OP_copy && g->values[v->in[k]].op > AD_OP_copy) { /* most are */
        const struct value *x = &g->values[v->in[k]];
        return x->rows == v->rows && x->cols == v->cols &&
               !(x->flags & (VALUE_VIEW | VALUE_ACCUMULATED));
    }
    if (is_alone(v->op) || is_stencil(v->op) || (v->op == AD_OP_copy && v->in[1]))
        return false;
    const struct value *x = &g->values[v->in[k]];
    bool same = is_sink(v->op) || (x->rows == v->rows && x->cols == v->cols);
    return same && !is_given(x) && !(x->flags & VALUE_ACCUMULATED) && !is_alone(x->op) &&
           !is_sink(x->op);
}

#endif
