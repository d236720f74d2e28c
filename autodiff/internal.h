/* Inside of autodiff, in the order in which it reads; each folder has one header of its own.

       autodiff.h, ops.def     what a user sees; the one table of operations
       tape/       internal.h  operations append nodes: record.c, simplify.c, structure.c, place.c;
                               what they refuse, and how they say so: refuse.c
       gradient/   sweep.h     a reverse sweep appends adjoints, by the rules of the table; a
                               forward one tangents (tangent.c)
       compile/    graph.h     what the outputs need (graph.c), cut into groups: views.c,
                               schedule.c, sink.c, accumulate.c
                   plan.h      given memory (storage.c), tiles and instructions (tiles.c, emit.c);
                               compile.c has all passes one after the other
       exec/       program.h   what comes out: segments of instructions over a block of memory
                   exec.h      runs them tile by tile (exec.c, tile.c); program.c is the outside
       direct/     direct.h    or all of that is left out: values and adjoints node by node
       jacobian/   jacobian.h  sparse Jacobians: their pattern, found on the tape, and their program
       kernels/    kernels.h   the loops over lanes, for each type and instruction set
       native/     native.h    fused segments as machine code, by the system's C compiler

   Beside that road: check.c, kink.c (differences), optim/ (descent), blas.c (OpenBLAS and LAPACK).

   Here: the tape's memory, shared by recording, gradient and compiler. */
#ifndef AUTODIFF_INTERNAL_H
#define AUTODIFF_INTERNAL_H

#include "autodiff.h"

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

/* One recorded operation. What in[] and aux mean beyond inputs:
       constant        aux: first of its rows*cols doubles in `numbers`
       slice           in[1], in[2]: first row, first column
       gather, scatter, gather_cols, scatter_cols
                       aux: index list in `lists` (length, then row or column numbers)
       cumsum          aux: CUMSUM_ROWS, CUMSUM_REVERSED
       place           aux: part list in `lists` (count, then id, row, column of each)
       diff(_adjoint)  aux: scale in `numbers`; in[2]: repeat
       factor, solve, logdet
                       aux: side of the matrices, SYSTEM_CHOLESKY, SYSTEM_TRANSPOSED
       matmul          aux: bit 0 transposes a, bit 1 transposes b */
struct node {
    uint16_t op;
    uint16_t flags;
    uint32_t rows, cols;
    uint32_t in[3];
    uint32_t aux;
};

enum { CUMSUM_ROWS = 1, CUMSUM_REVERSED = 2 };
enum { SYSTEM_SIDE = 63, SYSTEM_CHOLESKY = 64, SYSTEM_TRANSPOSED = 128 };
enum { NODE_LABELLED = 1, NODE_HELD = 2 };

struct label {
    uint32_t id;
    uint32_t text; /* offset in `texts` */
};

#define BLOCK_BITS 12 /* nodes come in blocks: growing never copies them */
#define BLOCK_SIZE (1u << BLOCK_BITS)

struct ad_tape {
    enum ad_type type;
    uint32_t recording; /* its number, in handles */
    struct ad_error error;
    struct node **blocks;
    size_t n_nodes, n_blocks, max_blocks;
    double *numbers; /* constants */
    size_t n_numbers, max_numbers;
    uint32_t *lists; /* index and part lists */
    size_t n_lists, max_lists;
    struct label *labels;
    size_t n_labels, max_labels;
    char *texts;
    size_t n_texts, max_texts;
    struct ad_direct *direct; /* memory of direct evaluation; NULL before the first */
};

/* What direct evaluation keeps with the tape (direct/): forgets the nodes; frees all. Take NULL. */
void ad_direct_reset(struct ad_direct *direct);
void ad_direct_free(struct ad_direct *direct);

static inline struct node *node_at(const ad_tape *tape, uint32_t id)
{
    return &tape->blocks[id >> BLOCK_BITS][id & (BLOCK_SIZE - 1)];
}

static inline size_t node_size(const struct node *n) { return (size_t)n->rows * n->cols; }

static inline size_t type_bytes(enum ad_type type)
{
    return type == AD_F32 ? sizeof(float) : sizeof(double);
}

/* Of memory that vectors read: the widest vector, a cache line. */
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

/* The nodes a node reads: those of place operations are in their list. */
static inline size_t n_inputs(const ad_tape *tape, const struct node *n)
{
    return n->op == AD_OP_place ? tape->lists[n->aux] : ad_ops[n->op].arity;
}

static inline uint32_t input_of(const ad_tape *tape, const struct node *n, size_t k)
{
    return n->op == AD_OP_place ? tape->lists[n->aux + 1 + 3 * k] : n->in[k];
}

/* Makes room for `more` further elements of `size` bytes; false when memory is exhausted. */
bool ad_reserve(void **array, size_t n, size_t *max, size_t more, size_t size);

/* A copy of a recording whose handles name the same values on it; NULL when out of memory. */
ad_tape *ad_tape_copy(const ad_tape *tape);

/* The handle of a node. */
static inline ad_var ad_at(ad_tape *tape, uint32_t id)
{
    return (ad_var){tape, id, tape->recording};
}
/* What an operation returns that the tape, if there is one, keeps an error of. */
static inline ad_var ad_refused(ad_tape *tape) { return tape ? ad_at(tape, 0) : (ad_var){0}; }
/* x is of what its tape records now. */
static inline bool ad_is_current(ad_var x)
{
    return x.tape && x.recording == x.tape->recording && x.id < x.tape->n_nodes;
}

/* ---- refusing (refuse.c) ---- */

/* Recorded as other operations, refused by their own names: numbered after enum ad_op. */
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
    X(mean)                                                                                        \
    X(dot)                                                                                         \
    X(hold)                                                                                        \
    X(label)                                                                                       \
    X(grad)                                                                                        \
    X(vjp)                                                                                         \
    X(jvp)                                                                                         \
    X(jacobian)                                                                                    \
    X(compile)                                                                                     \
    X(check)
#define AD_COMPOSITE(name) AD_COMPOSITE_##name,
enum { AD_COMPOSITES_FOLLOW = AD_N_OPS - 1, AD_COMPOSITES(AD_COMPOSITE) };
#undef AD_COMPOSITE

/* Whether op can be recorded on x[0..n-1]: all current, of one tape without an error. If not, the
   tape keeps an error, and *none is the handle to return. */
bool ad_operands(unsigned op, size_t n, const ad_var x[], ad_var *none);
/* Whether x[0..n-1], called `what` in the error kept if not, are of what the tape records now. */
bool ad_all_on(ad_tape *tape, unsigned op, const char *what, size_t n, const ad_var x[]);
/* Keeps an error of op in the tape, with the place in the recording and the operands x[0..n-1]. */
ad_var ad_refuse_operands(ad_tape *tape, enum ad_status status, unsigned op, size_t n,
                          const ad_var x[], const char *format, ...)
    __attribute__((format(printf, 6, 7)));

/* Rows and columns fit BLAS's int, and a tile beyond the last fits uint32_t; bytes fit size_t. */
static inline bool ad_is_shape(size_t rows, size_t cols)
{
    return rows && cols && rows <= INT32_MAX && cols <= INT32_MAX &&
           (uint64_t)rows * cols <= (uint64_t)1 << 46;
}
/* Whether op on x[0..n-1] may have this shape; keeps an error in the tape if not. */
bool ad_shape_fits(ad_tape *tape, unsigned op, size_t n, const ad_var x[], size_t rows,
                   size_t cols);
/* The shape x[0..n-1] broadcast to; false, and an error of op, where they do not. */
bool ad_broadcasts(unsigned op, size_t n, const ad_var x[], uint32_t *rows, uint32_t *cols);

/* ---- recording ---- */

/* Appends a node whose shape is checked here; on failure the error is kept and the handle of node 0
 * returned. */
ad_var ad_append(ad_tape *tape, struct node node);
/* Appends numbers or list entries; returns the offset of the first, UINT32_MAX when out of memory.
 */
uint32_t ad_append_numbers(ad_tape *tape, size_t n, const double *values);
uint32_t ad_append_list(ad_tape *tape, size_t n, const uint32_t *values);

/* Records op of n arguments of one tape, as it is. */
ad_var ad_elementwise(ad_tape *tape, enum ad_op op, size_t n, const ad_var *in);
/* c x, with factors of factors multiplied into one. */
ad_var ad_scale(ad_var x, double c);
/* A shorter form of a binary operation, in *y; false where there is none. Of numbers, constants on
   the tape among them, and one value at most; then of any two values. */
bool ad_simplify_numbers(ad_tape *tape, enum ad_op op, ad_arg a, ad_arg b, ad_var *y);
bool ad_simplify(enum ad_op op, ad_var a, ad_var b, ad_var *y);

/* Cumulative sum, flags as in the node. */
ad_var ad_cumulative(ad_var x, unsigned flags);

/* Of small systems (systems.c), in each column: the solution by a factor that is there; a unit
   matrix; u v', of n rows and m columns each; a x, a transposed or not. */
ad_var ad_solve_factored(ad_var a, ad_var factor, ad_var b, uint32_t aux);
ad_var ad_each_unit(ad_tape *tape, size_t n, size_t cols);
ad_var ad_each_outer(ad_var u, ad_var v, size_t n, size_t m);
ad_var ad_each_product(ad_var a, ad_var x, size_t n, size_t m, bool transposed);

/* The value of a scalar constant; false if x is none. */
bool ad_constant_value(ad_var x, double *value);

/* ---- differences (check.c, kink.c) ---- */

/* y as a function of one entry of one input. */
struct ad_section {
    ad_program *program;
    const double *y;
    double *x;
};

/* y at x, which is put back. */
double ad_section_value(const struct ad_section *section, double x);
/* Whether the slope of y jumps within h of x, by more than `least`; *mean is then that over h. */
bool ad_kink_near(const struct ad_section *section, double h, double least, double *mean);

#endif
