/* A compiled program, and the steps that make it: graph -> schedule -> plan. */
#ifndef AUTODIFF_PROGRAM_H
#define AUTODIFF_PROGRAM_H

#include "internal.h"
#include "kernels.h"

/* ---- graph: what the outputs need (graph.c) ---- */

enum value_flags {
    VALUE_CONSTANT = 1, /* the same in every run */
    VALUE_OUTPUT = 2,
    VALUE_VIEW = 4,      /* reads another value's memory; has none of its own */
    VALUE_STORED = 8,    /* lies in memory, not in a tile */
    VALUE_BORROWED = 16, /* lies in the memory of its host */
    VALUE_MERGED = 32,   /* a sum whose terms add into its memory: nothing is left to do */
    VALUE_NEGATED = 64,  /* a sink that subtracts */
    VALUE_ADDS = 128,    /* a product that adds to what lies in its memory */
    VALUE_HELD = 256     /* depends on held inputs and constants alone; so do all constants */
};

/* One live node; in[] and aux as in struct node, in[] renumbered. */
struct value {
    uint16_t op;
    uint16_t flags;
    uint32_t rows, cols;
    uint32_t in[3];
    uint32_t aux;
    uint32_t node; /* on the tape */
};

/* Where element (r, c) of a value lies: base + off + (row(r)*rs + c*cs) elements, with row(r) = r,
   or lists[list - 1 + r] if there is a list. Strides of 0 repeat. While compiling, off counts
   elements from the start of `root`; in the program it counts bytes from the base. */
struct loc {
    size_t off;
    uint32_t root, list, rs;
    uint8_t base, cs;
};

enum { BASE_MEMORY, BASE_TILE };

/* Names an input or output; sorted by node. */
struct port {
    uint32_t node, value;
    bool input;
};

/* A run of values that one segment computes. */
struct group {
    uint32_t first, count; /* in `order` */
};

struct graph {
    const ad_tape *tape;
    struct value *values;
    size_t n, max;
    struct loc *locs; /* per value, then copies' sources and broadcast operands */
    size_t n_locs, max_locs;
    struct port *ports;
    size_t n_ports;
    uint32_t *lists; /* row numbers of gathers and scatters */
    size_t n_lists, max_lists;
    uint32_t *renumber; /* node -> value, while compiling */
    uint32_t *order, *group_of;
    uint32_t *host; /* of borrowed values: whose memory they lie in */
    struct group *groups;
    size_t n_groups, n_constant_groups, n_held_groups; /* held: constants among them */
};

bool ad_graph_build(struct graph *graph, const ad_tape *tape, size_t n_out, const ad_var out[]);
bool ad_graph_schedule(struct graph *graph);
/* Moves values to later levels where they need no memory then. False when out of memory. */
bool ad_graph_postpone(const struct graph *graph, uint32_t *level);
bool ad_graph_merge(struct graph *graph);
void ad_graph_release(struct graph *graph);

static inline bool is_leaf(const struct value *v)
{
    return v->op == AD_OP_input || v->op == AD_OP_constant;
}

/* Sums and scatters: they end a segment's tile program by adding into memory. */
static inline bool is_sink(uint16_t op)
{
    return op == AD_OP_sum || op == AD_OP_sum_rows || op == AD_OP_sum_cols || op == AD_OP_scatter;
}

/* Reads neighbouring columns. */
static inline bool is_stencil(uint16_t op) { return op == AD_OP_diff || op == AD_OP_diff_adjoint; }

/* Alone in its segment. */
static inline bool is_alone(uint16_t op)
{
    return op == AD_OP_place || op == AD_OP_transpose || op == AD_OP_matmul;
}

static inline uint32_t n_inputs(const struct value *v)
{
    return v->op == AD_OP_place ? 0 : ad_ops[v->op].arity;
}

/* The location operand k of v is read from: before broadcasting. */
static inline const struct loc *operand_loc(const struct graph *g, const struct value *v,
                                            uint32_t k)
{
    bool copied_view = v->op == AD_OP_copy && v->in[1];
    return &g->locs[copied_view ? v->in[1] : v->in[k]];
}

/* Operand k of v is a value of v's own iteration space, read lane by lane. */
static inline bool reads_in_step(const struct graph *g, const struct value *v, uint32_t k)
{
    if (is_alone(v->op) || is_stencil(v->op) || (v->op == AD_OP_copy && v->in[1]))
        return false;
    const struct value *x = &g->values[v->in[k]];
    bool same = is_sink(v->op) || (x->rows == v->rows && x->cols == v->cols);
    return same && !(x->flags & (VALUE_VIEW | VALUE_MERGED)) && !is_leaf(x) && !is_alone(x->op) &&
           !is_sink(x->op);
}

/* ---- program ---- */

enum instruction_kind {
    DO_ELEMENTWISE,
    DO_DIFF,
    DO_DIFF_ADJOINT,
    DO_SUM, /* partial sums in double */
    DO_SUM_COLS,
    DO_ADD_ROWS, /* adds tile rows into rows of the result: sums over rows, scatters */
    DO_PLACE,
    DO_TRANSPOSE,
    DO_MATMUL
};

/* loc[0]: result; loc[1..3]: operands. Sinks: loc[3] is their number. diff: loc[2] numbers its
   scale in `numbers`, loc[3] tells repeat. matmul: loc[3] holds the bits below. place: parts
   loc[1] .. loc[1]+loc[2]. */
enum { MATMUL_TA = 1, MATMUL_TB = 2, MATMUL_ADDS = 4 };

struct instruction {
    ad_kernel *run;
    uint8_t kind, n_in;
    bool flat;      /* a tile is contiguous for every operand */
    uint32_t value; /* which one it computes */
    uint32_t loc[4];
};

struct sink {
    uint8_t kind;
    uint32_t instruction;
    uint32_t rows, cols; /* of the result */
    size_t partial;      /* offset of the private copies of the chunks */
    size_t stride;       /* bytes of one copy */
};

struct part {
    uint32_t loc, rows, cols;
    uint32_t row, col; /* where it goes */
};

/* A segment compiled to machine code (native.h) for rows [row, row_end), columns [col, col_end) of
   chunk number `chunk`. */
typedef void ad_native_run(char *memory, const uint32_t *lists, size_t chunk, size_t row,
                           size_t row_end, size_t col, size_t col_end);

struct segment {
    ad_native_run *native; /* NULL: the instructions are interpreted */
    uint32_t first, count; /* instructions */
    uint32_t rows, cols;   /* iteration space */
    uint32_t tile_rows, tile_cols;
    uint32_t chunks; /* fixed by the sizes alone, so that threads change no result */
    bool by_rows;    /* chunks split rows, else columns */
    bool fused;
    bool clear; /* place: parts do not cover the result */
    uint32_t first_sink, n_sinks;
    uint32_t first_call, n_calls; /* segments of few tiles */
};

/* A kernel call with all addresses known; run NULL: a is the instruction to run, on the tile that
   begins at row n. */
struct call {
    ad_kernel *run;
    size_t n;
    void *o;
    const void *a, *b, *c;
};

/* Values of a segment that share its tiles lie in slots of so many bytes. */
static inline size_t ad_slot_bytes(size_t element, const struct segment *s)
{
    return ((size_t)s->tile_rows * s->tile_cols * element + 63) / 64 * 64;
}

struct check;
struct native;

struct ad_program {
    enum ad_type type;
    size_t element;
    const struct ad_kernels *kernels;
    struct value *values; /* shapes and operations, for reports */
    size_t n_values;
    struct loc *locs;
    struct instruction *instructions;
    size_t n_instructions;
    struct segment *segments;
    size_t n_segments, n_constant_segments, n_held_segments;
    struct sink *sinks;
    size_t n_sinks;
    struct part *parts;
    size_t n_parts;
    struct call *calls;
    size_t n_calls;
    double *numbers;
    size_t n_numbers;
    uint32_t *lists;
    size_t n_lists;
    struct port *ports;
    size_t n_ports;
    char **labels; /* of labelled values: parallel to label_values */
    uint32_t *label_values;
    size_t n_labels;
    char *memory; /* values */
    char *tiles;  /* of the first thread, and of the others */
    char *more_tiles;
    size_t memory_bytes, tile_bytes;
    size_t threads;
    bool has_matmul;
    struct native *native;       /* NULL: interpreted */
    struct ad_error interpreted; /* why */
    double saved, price;         /* seconds, by what ran so far; 0: no matter (native.h) */
};

enum ad_status ad_program_plan(struct graph *graph, struct ad_program **program,
                               struct ad_error *error);
/* Runs segments [first, last); with `check`, keeps the earliest value that is not finite. */
void ad_program_execute(ad_program *program, size_t first, size_t last, struct check *check);
/* The same for segments that are not the program's own. */
void ad_execute_segments(const ad_program *program, const struct segment *segments, size_t n,
                         struct check *check);

#endif
