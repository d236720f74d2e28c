/* Internals of autodiff, folder by folder in reading order; each folder has one header.

       autodiff.h, ops.def     the public interface (status.h, tape.h, operations.h, program.h); the
                               table of operations
       terms.h                 the table read otherwise than as recorded operations
       tape/       internal.h  recording appends nodes: record.c, simplify.c, structure.c, place.c;
                               refuse.c makes the error messages
       gradient/   sweep.h     a reverse sweep appends adjoints by the rules of the table, a
                               forward one tangents (tangent.c)
       compile/    graph.h     the graph of what the outputs need (graph.c), grouped into segments:
                               views.c, schedule.c, sink.c, accumulate.c
                   plan.h      passes over columns (passes.c, windows.c), memory (storage.c), tiles
                               and instructions (tiles.c, emit.c); compile.c runs all of it
       scan/       scan.h      loops: one step, compiled and run over and over; back by checkpoints
       exec/       program.h   the compiled program: segments of instructions over memory
                   exec.h      runs it tile by tile (exec.c, tile.c), or in passes (pass.c);
                               program.c: public functions
       direct/     direct.h    evaluates a recording node by node, without compiling
       series/     internal.h  power series of a recording, by the same table
       jacobian/   jacobian.h  sparse Jacobians: their pattern, and their program
       kernels/    kernels.h   the loops over lanes, for each type and instruction set
       native/     native.h    fused segments as machine code, by the system's C compiler

   Also: check.c, kink.c (comparison with differences), optim/ (descent), blas.c (OpenBLAS).

   This header declares the tape's memory, shared by recording, gradient and compiler. */
#ifndef AUTODIFF_INTERNAL_H
#define AUTODIFF_INTERNAL_H

#include "autodiff.h"

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

/* One recorded operation. What in[] and aux mean beyond inputs:
       input           in[0]: the input before it; 0: none
       constant        aux: first of its rows*cols doubles in `numbers`
       slice           in[1], in[2]: first row, first column
       gather, scatter, gather_cols, scatter_cols
                       aux: index list in `lists` (length, then row or column numbers)
       cumsum          aux: CUMSUM_ROWS, CUMSUM_REVERSED
       place           aux: part list in `lists` (count, then id, row, column of each)
       diff(_adjoint)  aux: scale in `numbers`; in[2]: repeat
       custom(_adjoint)
                       aux: number in `customs`
       factor, solve, logdet
                       aux: side of the matrices, SYSTEM_CHOLESKY, SYSTEM_TRANSPOSED
       matmul          aux: bit 0 transposes a, bit 1 transposes b
       scan(_adjoint)  in[1]: number of the loop; aux: operand list in `lists` (count, then of each
                       id, whether its adjoint is wanted, 0): those of the loop; and of the adjoint
                       the scan, and the seed of its value. The value is a row: one result, or
                       wanted adjoint, after the other */
struct node {
    uint16_t op;
    uint16_t flags;
    uint32_t rows, cols;
    uint32_t in[3];
    uint32_t aux;
};

enum { CUMSUM_ROWS = 1, CUMSUM_REVERSED = 2 };
enum { SYSTEM_SIDE = 0xffff, SYSTEM_CHOLESKY = 1 << 16, SYSTEM_TRANSPOSED = 1 << 17 };
/* NODE_PLAIN: a scalar that no identity of simplify.c looks into. NODE_NUMBER: a scalar constant
   that came as a number, shared by all operations that take it. */
enum { NODE_LABELLED = 1, NODE_HELD = 2, NODE_PLAIN = 4, NODE_NUMBER = 8 };

/* A user's own operation, as a tape and its programs keep it. */
enum { CUSTOM_INPUTS = 16, CUSTOM_NAME = 32 };
struct custom {
    struct ad_custom by; /* its name is NULL */
    char name[CUSTOM_NAME];
    uint32_t n, inputs; /* how many inputs; of so many rows together */
    uint32_t rows[CUSTOM_INPUTS];
};

struct label {
    uint32_t id;
    uint32_t text; /* offset in `texts` */
};

/* A loop: its body, a copy of a recording, and what nodes of the body are. */
struct loop {
    ad_tape *body;
    size_t steps, checkpoints;      /* 0: as many as the default memory holds */
    bool (*proceed)(void *context); /* NULL: not asked */
    void *context;
    uint32_t n_state, n_in, n_shared, n_out;
    uint32_t *ids;       /* states, ins, shared; then next states, outs */
    uint32_t tangent_of; /* 1 + the loop it was made from, ... */
    uint8_t *along;      /* ... along these operands of that loop */
    struct scan *run;    /* direct evaluation */
    struct scan_adjoint *adjoint;
};

#define BLOCK_BITS 12 /* nodes come in blocks: growing never copies them */
#define BLOCK_SIZE (1u << BLOCK_BITS)
/* The first ones singly, the others by 2 MB: the first of each group owns its memory. */
enum { SINGLE_BLOCKS = 16, GROUPED_BLOCKS = (1 << 21) / (sizeof(struct node) << BLOCK_BITS) };

enum { RECENT_NUMBERS = 64 };
enum { AD_FREED_TAPES = 64 }; /* kept to refuse their variables; a power of 2 */

struct ad_tape {
    enum ad_type type;
    bool freed;
    uint32_t recording; /* number of the recording, kept in handles */
    struct ad_error error;
    uint32_t n_scalars;  /* nodes before the first of another shape */
    uint32_t last_input; /* 0: none */
    struct node **blocks;
    size_t n_nodes, n_blocks, max_blocks;
    double *numbers; /* constants */
    size_t n_numbers, max_numbers;
    uint32_t *lists; /* index and part lists */
    size_t n_lists, max_lists;
    struct custom *customs;
    size_t n_customs, max_customs;
    struct label *labels;
    size_t n_labels, max_labels;
    char *texts;
    size_t n_texts, max_texts;
    uint32_t recent[RECENT_NUMBERS]; /* nodes of numbers, by a hash; any id where there is none */
    struct ad_direct *direct;        /* memory of direct evaluation; NULL before the first */
    struct loop *loops;
    size_t n_loops, max_loops;
};

/* Direct evaluation's memory of a tape (direct/): forgets the nodes; frees everything; its size.
 * Take NULL.
 */
void ad_direct_reset(struct ad_direct *direct);
void ad_direct_free(struct ad_direct *direct);
size_t ad_direct_bytes(const struct ad_direct *direct);
/* And with its loops (scan/). */
void ad_scan_free(struct scan *scan);
void ad_scan_adjoint_free(struct scan_adjoint *adjoint);

static inline struct node *node_at(const ad_tape *tape, uint32_t id)
{
    return &tape->blocks[id >> BLOCK_BITS][id & (BLOCK_SIZE - 1)];
}

static inline size_t node_size(const struct node *n) { return (size_t)n->rows * n->cols; }

static inline size_t type_bytes(enum ad_type type)
{
    return type == AD_F32 ? sizeof(float) : sizeof(double);
}

/* Alignment of memory that vectors read: the widest vector, one cache line. */
enum { ALIGNMENT = 64 };

static inline size_t aligned(size_t bytes)
{
    return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

struct op_info {
    const char *name;
    uint8_t arity;
    bool elementwise;
};
extern const struct op_info ad_ops[AD_N_OPS];

static inline bool ad_is_custom(uint16_t op)
{
    return op == AD_OP_custom || op == AD_OP_custom_adjoint;
}

/* What an operation reads is in its list: three numbers each, an id first. */
static inline bool has_operand_list(uint16_t op)
{
    return op < AD_OP_copy && (op == AD_OP_place || op == AD_OP_scan || op == AD_OP_scan_adjoint);
}

/* The inputs of a node. */
static inline size_t n_inputs(const ad_tape *tape, const struct node *n)
{
    return has_operand_list(n->op) ? tape->lists[n->aux] : ad_ops[n->op].arity;
}

static inline uint32_t input_of(const ad_tape *tape, const struct node *n, size_t k)
{
    return has_operand_list(n->op) ? tape->lists[n->aux + 1 + 3 * k] : n->in[k];
}

/* Makes room for `more` further elements of `size` bytes; false when memory is exhausted. */
bool ad_reserve(void **array, size_t n, size_t *max, size_t more, size_t size);

/* malloc and calloc, for arrays of many megabytes that are written from end to end. */
void *ad_allocate_large(size_t bytes);
void *ad_allocate_zeroed(size_t n, size_t size);

/* A copy of a tape on which the same node numbers name the same values; NULL when out of memory. */
ad_tape *ad_tape_copy(const ad_tape *tape);

/* The handle of a node. */
static inline ad_var ad_at(ad_tape *tape, uint32_t id)
{
    return (ad_var){tape, id, tape->recording};
}
/* The handle that a refused operation returns: node 0 of the tape that keeps the error, if any. */
static inline ad_var ad_refused(ad_tape *tape) { return tape ? ad_at(tape, 0) : (ad_var){0}; }
/* x belongs to the current recording of its tape. */
static inline bool ad_is_current(ad_var x)
{
    return x.tape && x.recording == x.tape->recording && x.id < x.tape->n_nodes;
}

/* ---- errors of recording (refuse.c) ---- */

/* Functions that are recorded as other operations but named in errors; numbered after enum ad_op.
 */
#define AD_COMPOSITES(X)                                                                           \
    X(concat_rows)                                                                                 \
    X(concat_cols)                                                                                 \
    X(max_rows)                                                                                    \
    X(max_cols)                                                                                    \
    X(min_rows)                                                                                    \
    X(min_cols)                                                                                    \
    X(arg_max_rows)                                                                                \
    X(arg_max_cols)                                                                                \
    X(log_sum_exp_rows)                                                                            \
    X(log_sum_exp_cols)                                                                            \
    X(softmax_rows)                                                                                \
    X(softmax_cols)                                                                                \
    X(inverse)                                                                                     \
    X(product)                                                                                     \
    X(mean)                                                                                        \
    X(dot)                                                                                         \
    X(hold)                                                                                        \
    X(label)                                                                                       \
    X(grad)                                                                                        \
    X(vjp)                                                                                         \
    X(jvp)                                                                                         \
    X(jacobian)                                                                                    \
    X(series)                                                                                      \
    X(compile)                                                                                     \
    X(check)
#define AD_COMPOSITE(name) AD_COMPOSITE_##name,
enum { AD_COMPOSITES_FOLLOW = AD_N_OPS - 1, AD_COMPOSITES(AD_COMPOSITE) };
#undef AD_COMPOSITE

/* True if op can be recorded on x[0..n-1]: all current, on one tape without an error. Otherwise the
   tape keeps an error, and *none is the handle to return. */
bool ad_operands(unsigned op, size_t n, const ad_var x[], ad_var *none);
/* True if x[0..n-1], called `what` in the error, belong to the tape's current recording. */
bool ad_all_on(ad_tape *tape, unsigned op, const char *what, size_t n, const ad_var x[]);
/* Keeps an error of op in the tape, with its place in the recording and its operands x[0..n-1]. */
ad_var ad_refuse_operands(ad_tape *tape, enum ad_status status, unsigned op, size_t n,
                          const ad_var x[], const char *format, ...)
    __attribute__((format(printf, 6, 7)));

/* Rows and columns fit BLAS's int, and a tile beyond the last fits uint32_t; bytes fit size_t. */
static inline bool ad_is_shape(size_t rows, size_t cols)
{
    return rows && cols && rows <= INT32_MAX && cols <= INT32_MAX &&
           (uint64_t)rows * cols <= (uint64_t)1 << 46;
}
/* True if op on x[0..n-1] may have this shape; otherwise keeps an error in the tape. */
bool ad_shape_fits(ad_tape *tape, unsigned op, size_t n, const ad_var x[], size_t rows,
                   size_t cols);
/* The common shape of x[0..n-1]; false, with an error of op, if they do not broadcast. */
bool ad_broadcasts(unsigned op, size_t n, const ad_var x[], uint32_t *rows, uint32_t *cols);

/* ---- recording ---- */

/* Appends a node after checking its shape; on failure keeps an error and returns node 0. */
ad_var ad_append(ad_tape *tape, struct node node);
/* A scalar constant without a handle: one node serves many operations. */
ad_var ad_number(ad_tape *tape, double value);
/* Append numbers or list entries; return the offset of the first, UINT32_MAX when out of memory. */
uint32_t ad_append_numbers(ad_tape *tape, size_t n, const double *values);
uint32_t ad_append_list(ad_tape *tape, size_t n, const uint32_t *values);

/* Records op on n arguments of one tape without simplification. */
ad_var ad_elementwise(ad_tape *tape, enum ad_op op, size_t n, const ad_var *in);
/* c x, with nested constant factors folded. */
ad_var ad_scale(ad_var x, double c);
/* A simplified form of a binary operation in *y; false if there is none. The first for numbers,
   constants on the tape included, and at most one value; the second for any two values. */
bool ad_simplify_numbers(ad_tape *tape, enum ad_op op, ad_arg a, ad_arg b, ad_var *y);
bool ad_simplify(enum ad_op op, ad_var a, ad_var b, ad_var *y);

/* ---- loops (tape/scan.c) ---- */

static inline uint32_t loop_operands(const struct loop *l)
{
    return l->n_state + l->n_in + l->n_shared;
}
static inline uint32_t loop_results(const struct loop *l) { return l->n_state + l->n_out; }
/* Shape outside the body of what ids[k] is inside: as many blocks of columns as there are steps, or
   one. */
static inline uint32_t loop_rows(const struct loop *l, uint32_t k)
{
    return node_at(l->body, l->ids[k])->rows;
}
static inline size_t loop_cols(const struct loop *l, uint32_t k)
{
    bool in = k >= l->n_state && k < l->n_state + l->n_in;
    bool out = k >= loop_operands(l) + l->n_state;
    return node_at(l->body, l->ids[k])->cols * (in || out ? l->steps : 1);
}
static inline size_t loop_size(const struct loop *l, uint32_t k)
{
    return loop_rows(l, k) * loop_cols(l, k);
}
/* Adds a loop to the tape, which takes it, or frees it when out of memory; its number, or
   UINT32_MAX. What depends on shared inputs alone is marked to be computed once. */
uint32_t ad_append_loop(ad_tape *tape, struct loop loop);
/* Records op, scan or scan_adjoint, of loop number `loop`; `wanted` (NULL: none) as in the node. */
ad_var ad_append_scan(ad_tape *tape, enum ad_op op, uint32_t loop, size_t n,
                      const ad_var operands[], const uint8_t wanted[]);
void ad_loops_free(ad_tape *tape);
bool ad_loops_copy(ad_tape *copy, const ad_tape *tape);

/* Cumulative sum, flags as in the node. */
ad_var ad_cumulative(ad_var x, unsigned flags);

/* Linear systems (systems.c), per column: the solution from a given factor; the error of a
   singular column of a factor; a unit matrix; u v^T with n rows and m columns; a x, a transposed or
   not. */
ad_var ad_solve_factored(ad_var a, ad_var factor, ad_var b, uint32_t aux);
enum ad_status ad_name_singular(struct ad_error *error, uint32_t node, uint32_t aux, size_t col);
ad_var ad_each_unit(ad_tape *tape, size_t n, size_t cols);
ad_var ad_each_outer(ad_var u, ad_var v, size_t n, size_t m);
ad_var ad_each_product(ad_var a, ad_var x, size_t n, size_t m, bool transposed);

struct ad_text;
/* Adds shape and label of a value of the tape to a text, or the nearest label before it. Returns
   whether there is one. */
bool ad_describe(struct ad_text *text, ad_var x);

/* ---- differences (check.c, kink.c) ---- */

/* y as a function of one entry of one input. */
struct ad_section {
    ad_program *program;
    const double *y;
    double *x;
};

/* y at x; x is restored. */
double ad_section_value(const struct ad_section *section, double x);
/* True if the slope of y jumps by more than `least` within h of x; *mean is the mean slope there.
 */
bool ad_kink_near(const struct ad_section *section, double h, double least, double *mean);

#endif
