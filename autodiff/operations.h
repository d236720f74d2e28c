/* What is recorded on a tape: operations, those of a user, loops. See autodiff.h, also for errors
   and threads. */
#ifndef AUTODIFF_OPERATIONS_H
#define AUTODIFF_OPERATIONS_H

#include "tape.h"

AD_HEADER_BEGIN

/* ---- elementwise operations ---- */

/* Argument of an operation: a variable, or a number on either side. */
typedef struct ad_arg {
    ad_var var;
    double value;
    bool is_number; /* `value`; else `var` */
} ad_arg;

/* The conversions that AD_ARG selects. */
static inline ad_arg ad_arg_var(ad_var x)
{
    ad_arg a = {x, 0, false};
    return a;
}
static inline ad_arg ad_arg_number(double x)
{
    ad_arg a = {{NULL, 0, 0}, x, true};
    return a;
}

/* Numbers of all operations; names, kernels and gradient rules come from the same table. */
enum ad_op {
#define AD_STRUCTURE(name, arity) AD_OP_##name,
#define AD_UNARY(name, value, dx, lo, hi) AD_OP_##name,
#define AD_BINARY(name, value, da, db, lo, hi) AD_OP_##name,
#define AD_TERNARY(name, value, da, db, dc, lo, hi) AD_OP_##name,
#include "ops.def"
    AD_N_OPS
};

/* Record an elementwise operation by its number, as the named functions below do. AD_E_ARGUMENT if
   op is not elementwise or takes another number of arguments. */
ad_var ad_unary(enum ad_op op, ad_var x);
ad_var ad_binary(enum ad_op op, ad_arg a, ad_arg b);
/* The same of two variables, or of one and a number; quicker for programs of scalars. */
ad_var ad_binary_vars(enum ad_op op, ad_var a, ad_var b);
ad_var ad_binary_right(enum ad_op op, ad_var a, double b);
ad_var ad_binary_left(enum ad_op op, double a, ad_var b);
ad_var ad_ternary(enum ad_op op, ad_arg a, ad_arg b, ad_arg c);
const char *ad_op_name(enum ad_op op); /* "matmul", as in messages; "?" if unknown */

/* detach neg abs sign step square cube sqrt recip exp log log1p expm1 sin cos tan asin acos atan
   sinh cosh tanh sigmoid softplus relu: ad_NAME(x), of the shape of x. detach(x) is x with gradient
   0. At the edges of their domains the value is that of C, and the gradient is finite wherever the
   value is: abs 0 at 0; sign 0 everywhere; step(x) = (x > 0), 0 everywhere; relu 0 at 0; sqrt,
   asin, acos: 0 where the true derivative is infinite. Outside (log, recip at 0; sqrt below 0)
   value and gradient are infinite or NaN, unless a select discards them. */
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    static inline ad_var ad_##name(ad_var x) { return ad_unary(AD_OP_##name, x); }
#include "ops.def"

#ifdef __cplusplus
} /* overloads need C++ linkage */
static inline ad_arg ad_to_arg(ad_var x) { return ad_arg_var(x); }
static inline ad_arg ad_to_arg(double x) { return ad_arg_number(x); }
#define AD_ARG(x) ad_to_arg(x)
static inline ad_var ad_binary_args(ad_op op, ad_var a, ad_var b)
{
    return ad_binary_vars(op, a, b);
}
static inline ad_var ad_binary_args(ad_op op, ad_var a, double b)
{
    return ad_binary_right(op, a, b);
}
static inline ad_var ad_binary_args(ad_op op, double a, ad_var b)
{
    return ad_binary_left(op, a, b);
}
static inline ad_var ad_binary_args(ad_op op, double a, double b)
{
    return ad_binary(op, ad_arg_number(a), ad_arg_number(b));
}
extern "C" {
#else
#define AD_ARG(x) _Generic((x), ad_var : ad_arg_var, default : ad_arg_number)(x)
static inline ad_var ad_binary_numbers(enum ad_op op, double a, double b)
{
    return ad_binary(op, ad_arg_number(a), ad_arg_number(b));
}
#ifdef __cppcheck__ /* 2.10 does not parse what follows */
#define ad_binary_args(op, a, b) ad_binary(op, AD_ARG(a), AD_ARG(b))
#else
#define ad_binary_args(op, a, b)                                                                   \
    _Generic((a), ad_var                                                                           \
             : _Generic((b), ad_var                                                                \
                        : ad_binary_vars, default                                                  \
                        : ad_binary_right),                                                        \
               default                                                                             \
             : _Generic((b), ad_var                                                                \
                        : ad_binary_left, default                                                  \
                        : ad_binary_numbers))(op, a, b)
#endif
#endif

/* Binary operations: a variable or a number on either side (at least one variable), broadcasting.
   min, max: where both are equal each side gets half the gradient; NaN propagates. hypot, atan2:
   gradient 0 at (0, 0). pow: gradient 0 at base 0 where the true one is infinite; the gradient of
   the exponent at base 0 is 0. Comparisons give 1 or 0 and have gradient 0. Constants are folded
   when recording: an integer exponent of up to 32 becomes products, c1*(c2*x) one product, c/x a
   reciprocal times c (also for a matrix of constants). Each may change the last bit. */
#define ad_add(a, b) ad_binary_args(AD_OP_add, a, b)
#define ad_sub(a, b) ad_binary_args(AD_OP_sub, a, b)
#define ad_mul(a, b) ad_binary_args(AD_OP_mul, a, b)
#define ad_div(a, b) ad_binary_args(AD_OP_div, a, b)
#define ad_pow(a, b) ad_binary_args(AD_OP_pow, a, b)
#define ad_atan2(y, x) ad_binary_args(AD_OP_atan2, y, x)
#define ad_hypot(a, b) ad_binary_args(AD_OP_hypot, a, b)
#define ad_min(a, b) ad_binary_args(AD_OP_min, a, b)
#define ad_max(a, b) ad_binary_args(AD_OP_max, a, b)
#define ad_lt(a, b) ad_binary_args(AD_OP_lt, a, b)
#define ad_le(a, b) ad_binary_args(AD_OP_le, a, b)
#define ad_gt(a, b) ad_binary_args(AD_OP_lt, b, a)
#define ad_ge(a, b) ad_binary_args(AD_OP_le, b, a)
#define ad_eq(a, b) ad_binary_args(AD_OP_eq, a, b)
#define ad_ne(a, b) ad_binary_args(AD_OP_ne, a, b)

/* Elementwise c != 0 ? a : b. A NaN or infinity of the branch not taken never reaches the value or
   a gradient of any order: a zero adjoint stays zero whatever it is multiplied by. */
#define ad_select(c, a, b) ad_ternary(AD_OP_select, AD_ARG(c), AD_ARG(a), AD_ARG(b))

/* ---- shape and structure ---- */

ad_var ad_sum(ad_var x);           /* all elements -> 1 x 1 */
ad_var ad_sum_rows(ad_var x);      /* over rows    -> 1 x cols */
ad_var ad_sum_cols(ad_var x);      /* over columns -> rows x 1 */
ad_var ad_mean(ad_var x);          /* all elements -> 1 x 1 */
ad_var ad_dot(ad_var a, ad_var b); /* sum of a*b, broadcast to one shape -> 1 x 1 */

/* The largest or smallest value over rows (1 x cols) or over columns (rows x 1). NaN propagates.
   Where several are equal their gradients add up to 1, divided among them in an unspecified way. */
ad_var ad_max_rows(ad_var x);
ad_var ad_max_cols(ad_var x);
ad_var ad_min_rows(ad_var x);
ad_var ad_min_cols(ad_var x);
/* The index of the row (1 x cols) or column (rows x 1) of the largest value: the first of equal
   ones, or the first NaN if there is one. Gradient 0. */
ad_var ad_arg_max_rows(ad_var x);
ad_var ad_arg_max_cols(ad_var x);
/* The logarithm of the sum of exp(x) over rows (1 x cols) or columns (rows x 1), without overflow.
   -inf, with gradient 0, where all x are -inf. */
ad_var ad_log_sum_exp_rows(ad_var x);
ad_var ad_log_sum_exp_cols(ad_var x);
/* exp(x) over the sum of exp(x) over all rows or columns; the shape of x. NaN where all x are -inf
   or one is inf. */
ad_var ad_softmax_rows(ad_var x);
ad_var ad_softmax_cols(ad_var x);
/* Row (column) k is the sum of rows (columns) 0 to k of x. */
ad_var ad_cumsum_rows(ad_var x);
ad_var ad_cumsum_cols(ad_var x);

/* op(a) op(b), where op transposes if its flag is set. */
ad_var ad_matmul(ad_var a, bool transpose_a, ad_var b, bool transpose_b);
ad_var ad_transpose(ad_var x); /* -> cols x rows */

/* Linear systems, one per column: a has n*n rows, n up to 32, and row i*n + j is element (i, j). A
   single column may hold a matrix of any size, for LAPACK: ad_reshape(A, n*n, 1). LU with partial
   pivoting, or Cholesky, which reads only the lower triangle of a symmetric positive definite a. A
   column whose matrix is singular to rounding, or not positive definite, gives NaN, and an error
   that names it: in ad_program_error after a run, and from ad_run_checked, ad_evaluate,
   ad_gradient, and ad_compile where the matrices are constants. Singular to rounding is a condition
   number over 2e15 (f32: 4e6), which leaves no digit, with rows and columns scaled to a largest
   element of 1: bad scaling alone is no error. See ad_program_condition. */
enum ad_factors { AD_LU, AD_CHOLESKY };
/* The solution x of a x = b; b has n*m rows, and row i*m + k is element i of right side k. A single
   column of a or b is broadcast to the columns of the other. */
ad_var ad_solve(ad_var a, ad_var b, enum ad_factors factors);
ad_var ad_inverse(ad_var a, enum ad_factors factors); /* -> n*n x cols */
ad_var ad_logdet(ad_var a, enum ad_factors factors);  /* log |det a| -> 1 x cols */
/* Products of small matrices, one per column: a has n*inner rows, b inner*m, the result n*m, in the
   same order. A single column of a or b is broadcast to the columns of the other. */
ad_var ad_product(ad_var a, ad_var b, size_t inner);

/* Views; nothing is copied. first + count must lie within the shape. */
ad_var ad_row(ad_var x, size_t row);                        /* -> 1 x cols */
ad_var ad_col(ad_var x, size_t col);                        /* -> rows x 1 */
ad_var ad_slice_rows(ad_var x, size_t first, size_t count); /* -> count x cols */
ad_var ad_slice_cols(ad_var x, size_t first, size_t count); /* -> rows x count */
ad_var ad_reshape(ad_var x, size_t rows, size_t cols);      /* same elements in row-major order */
ad_var ad_broadcast(ad_var x, size_t rows, size_t cols);    /* repeats a scalar, column or row */
ad_var ad_gather_rows(ad_var x, size_t n, const uint32_t rows[]); /* row k is row rows[k] of x */

/* Column k is column cols[k] of x; a copy. */
ad_var ad_gather_cols(ad_var x, size_t n, const uint32_t cols[]);

/* Adds row k of x to row rows[k] of a zero matrix of `height` rows, or column k to column cols[k]
   of `width` columns: segmented sums, where the list has the segment of each; an empty segment
   gives 0. Adjoints of the gathers. */
ad_var ad_scatter_rows(ad_var x, const uint32_t rows[], size_t height);
ad_var ad_scatter_cols(ad_var x, const uint32_t cols[], size_t width);

ad_var ad_concat_rows(size_t n, const ad_var parts[]); /* parts [n] one above the other */
ad_var ad_concat_cols(size_t n, const ad_var parts[]); /* parts [n] side by side */

/* A zero matrix rows x cols with each part added at (row[k], col[k]): the adjoint of slices. */
ad_var ad_place(ad_tape *tape, size_t rows, size_t cols, size_t n, const ad_var parts[],
                const size_t row[], const size_t col[]);

/* Time difference: column i is scale*(x[i+1] - x[i]); rows x (cols-1), or, with `repeat`, rows x
   cols with the last column twice. */
ad_var ad_diff(ad_var x, double scale, bool repeat);
/* The adjoint of ad_diff; the result has `cols` columns. */
ad_var ad_diff_adjoint(ad_var u, double scale, bool repeat, size_t cols);

/* ---- a user's own operation ---- */

/* An operation y = f(x[0], x[1], ...) by C functions, column by column: a column of y depends on
   the same column of every x alone. The callbacks get blocks of `cols` columns, in double whatever
   the tape's type: x[k] and gx[k] have the rows of input k x cols, y and gy `rows` x cols,
   row-major. Where blocks begin is unspecified. Each result is NaN before the call, and the
   callback writes all of it. It returns 0, or another number if it failed: then its block is NaN
   and the run has an error (AD_E_NONFINITE) that names the operation. A write of up to 8 numbers
   before or behind a result is an error, too (AD_E_ARGUMENT). Results must depend on the arguments
   and on what `user` points to alone. `user` is neither copied nor freed and must outlive tape and
   programs; what it points to may change between runs. With ad_set_threads several threads call at
   once. */
struct ad_custom {
    size_t size;      /* sizeof(struct ad_custom) */
    const char *name; /* for messages; 31 characters are kept; may be NULL */
    size_t rows;      /* of y */
    int (*value)(void *user, size_t cols, const double *const x[], double *y);
    /* gx[k] = (df/dx[k])' gy. May be NULL: first derivatives are then `recorded`, and ad_gradient
       returns AD_E_ARGUMENT. Where a column of gy is 0, its gx is set to 0. */
    int (*adjoint)(void *user, size_t cols, const double *const x[], const double *y,
                   const double *gy, double *const gx[]);
    /* The same, recorded, for derivatives of second and higher order; gx[k] broadcasts to the shape
       of x[k]. May be NULL: ad_grad of a gradient is then AD_E_ARGUMENT. ad_check_second finds
       where it contradicts `adjoint`. */
    void (*recorded)(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[]);
    void *user;
};
/* Records it on x [n], 1 to 16 inputs of equal width; one of a single column is broadcast.
   *operation is copied. -> operation->rows x cols. A function of a whole matrix takes it reshaped
   to one column. Interpreter, machine code (which calls the functions) and direct evaluation run
   it; it is computed in every ad_run and ad_rerun, also from constants and held inputs. ad_jvp
   calls the adjoint once per row of y. */
ad_var ad_custom(size_t n, const ad_var x[], const struct ad_custom *operation);

/* ---- loops ---- */

/* One step of a loop, recorded on a tape of its own, whose inputs are all named here, each once. */
struct ad_body {
    size_t size; /* sizeof(struct ad_body) */
    ad_tape *tape;
    /* Carried from step to step: state[k] as a step finds it, next[k], of its shape, as it leaves
       it. */
    size_t n_state;
    const ad_var *state, *next;
    size_t n_in; /* inputs that have another value in each step, */
    const ad_var *in;
    size_t n_shared; /* and the same in all */
    const ad_var *shared;
    size_t n_out; /* results that are kept of each step */
    const ad_var *out;
    /* States stored for the gradient, of `steps`; the others are computed again from these, by the
       binomial schedule: with s of them, C(s + r, s) steps take at most r runs forward each. Values
       do not depend on it, to the last bit. 0: as many as 32 MB hold. */
    size_t checkpoints;
    /* Asked before every step, forward and back, in loops made of this one, too; false interrupts
       the run: the loop's results are NaN, and the error is AD_E_ACCURACY with the step. NULL: not
       asked. A run after that one starts anew. */
    bool (*proceed)(void *context);
    void *context;
};

/* A loop of so many steps, whose compile time and program do not depend on how many they are. The
   body is copied: its tape may go on, be reset or freed. start[k] has the shape of state[k], or
   broadcasts to it, and so has shared[k]. Where an input of a step has c columns, in[k] has
   steps*c: step t reads columns t*c to (t+1)*c - 1, and so it is with out[k]. last[k] is the state
   after the last step. 0 steps are for loops without inputs and outputs of steps. Gradients to any
   order are loops, too; adjoints of shared values are summed from the last step to the first, in
   double, whatever the number of threads and checkpoints. Compiled, what depends on shared inputs
   alone is computed once. An error of a step, a singular column (and of ad_run_checked a value that
   is not finite), names the step and the node of the body. Returns the tape's status. */
enum ad_status ad_scan(ad_tape *tape, const struct ad_body *body, size_t steps,
                       const ad_var start[], const ad_var in[], const ad_var shared[],
                       ad_var last[], ad_var out[]);

AD_HEADER_END
#endif
