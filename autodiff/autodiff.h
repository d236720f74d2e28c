/* Reverse-mode automatic differentiation: record once, gradient on the same tape, replay as a
   vector program.

       ad_tape *t = ad_tape_new(AD_F64);
       ad_var x = ad_input(t, 3, 100, "x");              3 coordinates, 100 samples
       ad_var y = ad_sum(ad_mul(0.5, ad_square(x))), g;
       ad_grad(y, 1, &x, &g);                            appends the gradient to the tape
       ad_program *p;
       if (ad_compile(t, 2, (ad_var[]){y, g}, &p) != AD_OK) puts(ad_tape_error(t)->message);
       ad_set(p, x, values); ad_run(p); ad_get(p, g, gradient);

   Values are dense matrices, rows x cols, row-major; a scalar is 1 x 1. COLUMNS ARE SAMPLES (time
   slices, lanes of a batch), rows are coordinates or features. Elementwise operations broadcast a
   scalar, a column (rows x 1) or a row (1 x cols).

   Errors. Nothing here prints, exits or aborts on a user's mistake. The first error of a recording
   stays in the tape; later operations on that tape pass through, and ad_compile returns it. Its
   message names the operation, its number (ad_tape_size(tape) just before) and its operands by
   label, or by the nearest label before them. NULL that must not be is AD_E_ARGUMENT or AD_E_TAPE;
   functions that return no status, here and in the headers above this one, then return NaN, 0,
   NULL or "?", or do nothing.
   Threads. Handles share nothing: two tapes, or two programs, may be used from two threads; one
   handle may not. */
#ifndef AUTODIFF_H
#define AUTODIFF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Around the declarations of every header. */
#ifdef __cplusplus
#define AD_HEADER_BEGIN                                                                            \
    extern "C" {                                                                                   \
    _Pragma("GCC diagnostic push") /* C has a struct and a function of one name */                 \
        _Pragma("GCC diagnostic ignored \"-Wshadow\"")
#define AD_HEADER_END                                                                              \
    _Pragma("GCC diagnostic pop")                                                                  \
    }
#else
#define AD_HEADER_BEGIN
#define AD_HEADER_END
#endif

AD_HEADER_BEGIN

/* ---- status ---- */

enum ad_status {
    AD_OK = 0,
    AD_E_MEMORY = -1,    /* an allocation failed */
    AD_E_SHAPE = -2,     /* shapes do not fit the operation */
    AD_E_TAPE = -3,      /* variables of two tapes, or a variable unknown to the program */
    AD_E_ARGUMENT = -4,  /* an argument outside its range */
    AD_E_NONFINITE = -5, /* a value is infinite or not a number */
    AD_E_INPUT = -6,     /* unusable data from outside; the message names file and line */
    AD_E_IO = -7,        /* a file could not be read or written */
    AD_E_ACCURACY = -8   /* the accuracy asked for is out of reach, or the run was interrupted */
};

/* An error, its message of one line; all zero: no error. An argument `error` is never NULL. */
struct ad_error {
    enum ad_status status;
    char message[312];
};

/* Keeps the first error: does nothing when `e` already holds one. Returns e->status. */
enum ad_status ad_fail(struct ad_error *e, enum ad_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

/* ---- tape ---- */

enum ad_type { AD_F32, AD_F64 }; /* element type of a tape and of the programs compiled from it */

typedef struct ad_tape ad_tape;
typedef struct ad_program ad_program;

/* Handle of one value on a tape, passed by value. Valid until its tape is reset or freed; after a
   reset operations refuse it with AD_E_TAPE. They also refuse {0}, which was never recorded. */
typedef struct ad_var {
    ad_tape *tape;
    uint32_t id;
    uint32_t recording; /* number of the recording; each reset starts another */
} ad_var;

/* New empty tape; NULL when memory is exhausted. */
ad_tape *ad_tape_new(enum ad_type type);
/* Clears the recording and its error, and keeps the memory for the next one. */
void ad_tape_reset(ad_tape *tape);
void ad_tape_free(ad_tape *tape); /* takes NULL; its programs stay valid */
/* The first error of the recording (status AD_OK if none). Lives as long as the tape. For NULL the
   error is that memory was exhausted. */
const struct ad_error *ad_tape_error(const ad_tape *tape);
/* Records an error in the tape, as operations do: for callbacks that cannot record their value.
   Returns a handle that later operations pass on. */
ad_var ad_refuse(ad_tape *tape, enum ad_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Number of values recorded so far. */
size_t ad_tape_size(const ad_tape *tape);
/* Bytes held by the tape (nodes, constants, labels, index lists, memory of direct evaluation). */
size_t ad_tape_bytes(const ad_tape *tape);

/* Shape of a value; 0 x 0 for a handle without a tape or of an earlier recording. */
size_t ad_rows(ad_var x);
size_t ad_cols(ad_var x);

/* Records an input: a value set before each run, zero until set. The label (may be NULL) is copied.
 */
ad_var ad_input(ad_tape *tape, size_t rows, size_t cols, const char *label);
/* Marks an input as held: ad_rerun skips what depends on held inputs alone. Returns it. */
ad_var ad_hold(ad_var input);
/* A constant matrix: rows*cols values, row-major, copied. */
ad_var ad_const(ad_tape *tape, size_t rows, size_t cols, const double *values);
/* A constant scalar. */
ad_var ad_scalar(ad_tape *tape, double value);
/* Names a value in error messages; returns it. The label is copied. */
ad_var ad_label(ad_var x, const char *label);

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

/* Small linear systems, one per column: a has n*n rows, n up to 32, and row i*n + j is element (i,
   j). LU with partial pivoting, or Cholesky, which reads only the lower triangle of a symmetric
   positive definite a. A column whose matrix is singular to rounding, or not positive definite,
   gives NaN, and an error that names it: in ad_program_error after a run, and from ad_run_checked,
   ad_evaluate, ad_gradient, and ad_compile where the matrices are constants. Singular to rounding
   is a condition number over 2e15 (f32: 4e6), which leaves no digit, with rows and columns scaled
   to a largest element of 1: bad scaling alone is no error. See ad_program_condition. */
enum ad_factors { AD_LU, AD_CHOLESKY };
/* The solution x of a x = b; b has n*m rows, and row i*m + k is element i of right side k. A single
   column of a or b is broadcast to the columns of the other. */
ad_var ad_solve(ad_var a, ad_var b, enum ad_factors factors);
ad_var ad_inverse(ad_var a, enum ad_factors factors); /* -> n*n x cols */
ad_var ad_logdet(ad_var a, enum ad_factors factors);  /* log |det a| -> 1 x cols */

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

ad_var ad_concat_rows(size_t n, const ad_var parts[]); /* one above the other */
ad_var ad_concat_cols(size_t n, const ad_var parts[]); /* side by side */

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
/* Records it on 1 to 16 inputs of equal width; one of a single column is broadcast. *operation is
   copied. -> operation->rows x cols. A function of a whole matrix takes it reshaped to one column.
   Interpreter, machine code (which calls the functions) and direct evaluation run it; it is
   computed in every ad_run and ad_rerun, also from constants and held inputs. ad_jvp calls the
   adjoint once per row of y. */
ad_var ad_custom(size_t n, const ad_var x[], const struct ad_custom *operation);

/* ---- loops ---- */

/* One step of a loop, recorded on a tape of its own, whose inputs are all named here, each once. */
struct ad_body {
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

/* ---- gradient ---- */

/* Appends the gradient of the sum of y's elements with respect to x[0..n-1]; g[k] has the shape of
   x[k]. The rules are recorded in the operations above, so g can be differentiated again. Time is
   linear in the length of the tape, without recursion. Returns the tape's status. */
enum ad_status ad_grad(ad_var y, size_t n, const ad_var x[], ad_var g[]);

/* ---- direct evaluation ---- */

/* Run a recording at once, without compiling: for programs that run once or a few times, scalar
   ones above all. x[0..n-1] are all inputs recorded before y, and at[k] their values (rows*cols
   doubles each). value (may be NULL) receives y, gradient[k] (NULL: not wanted) the derivative of
   the sum of y's elements with respect to x[k]. Everything recorded up to y is evaluated, in the
   tape's type. The memory stays with the tape: 16 bytes (f64) per scalar operation, 8 more where
   there are other shapes. An adjoint of exactly 0 is not propagated. Errors: AD_E_TAPE;
   AD_E_ARGUMENT for an x that is no input and for an input without a value; AD_E_NONFINITE for a
   singular column of ad_solve; those of ad_custom; AD_E_MEMORY; the error of the recording, if
   there is one. The tape's own error is left as it is. */
enum ad_status ad_evaluate(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, struct ad_error *error);
enum ad_status ad_gradient(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, double *const gradient[], struct ad_error *error);

/* ---- program ---- */

/* Compiles what the outputs need into a program, freed by the caller; it outlives the tape, whose
   variables name its inputs and outputs. On failure *program is NULL; the status is returned and
   kept in the tape. */
enum ad_status ad_compile(ad_tape *tape, size_t n_out, const ad_var out[], ad_program **program);
void ad_program_free(ad_program *program); /* takes NULL */

/* Sets an input from rows*cols doubles (converted for f32). AD_E_TAPE if x is not an input of the
   program, or of another tape or recording. Every input recorded before compiling is one, whether
   an output needs it or not. */
enum ad_status ad_set(ad_program *program, ad_var x, const double *values);
/* Copies an input or output to rows*cols doubles; AD_E_TAPE as above. */
enum ad_status ad_get(const ad_program *program, ad_var x, double *values);
/* The storage of an input or output: rows*cols contiguous elements of the tape's type, at an
   address fixed for the life of the program; NULL if the program has no such input or output. */
void *ad_data(ad_program *program, ad_var x);
/* Runs the program; allocates nothing, except where ad_native_lazy compiles. */
void ad_run(ad_program *program);
/* As ad_run, but keeps the values that depend on held inputs alone from the last ad_run.
   AD_E_ARGUMENT, and nothing runs, before the first ad_run and after a held input was set
   (ad_program_error names it), and after an interrupted run. Writes through ad_data are not
   detected. */
enum ad_status ad_rerun(ad_program *program);
/* The error of the last run: a refused ad_rerun, an interrupted loop, a singular column or an
   ad_custom that failed; status AD_OK if none. Lives as long as the program. */
const struct ad_error *ad_program_error(const ad_program *program);
/* The largest condition number of the regular matrices of ad_solve, ad_inverse and ad_logdet in the
   last run, scaled as above: an estimate from below, mostly within a factor of 3. Times 2e-16 (f32:
   1e-7) it is the relative error to expect of the largest unknown. 0 if all are certainly below
   5e11 (f32: 1.5e5), which leaves a quarter of the digits; INFINITY if the scales exceed the range
   of numbers. */
double ad_program_condition(const ad_program *program);
/* As ad_run; returns the seconds spent in matrix products, inside OpenBLAS. */
double ad_run_timed(ad_program *program);

/* Compiles the program to machine code by the system's C compiler (CC, or cc), cached in the user's
   cache folder ($XDG_CACHE_HOME/leastaction, or ~/.cache/leastaction). `runs` is roughly how often
   ad_run will be called: the program is compiled only if that saves more time than compiling takes,
   0.15 s and 6.5 s for a megabyte of source, up to 1.6 ms an instruction; INFINITY compiles in any
   case (up to 65536 instructions). Returns true if the program now runs as machine code. False if
   it stays interpreted, with the reason in `note` (may be NULL): compiling does not pay, there is
   no compiler or no safe folder, or LEASTACTION_NATIVE=0 is in the environment. Values agree to
   rounding. */
bool ad_native(ad_program *program, double runs, struct ad_error *note);

/* As ad_native, for an unknown number of runs: ad_run or ad_rerun compiles the program first once
   the earlier runs would have saved as much time as compiling takes. The moment depends on the
   program alone, so that the same work gives the same bits. */
void ad_native_lazy(ad_program *program);
/* For the handler of a signal that ends the process: removes the files of unfinished compilations.
 */
void ad_native_abandon(void);
/* Why the program is interpreted; "" if it is not. Lives as long as the program. */
const char *ad_native_note(const ad_program *program);

/* Number of threads for large segments (default 1). Results are the same to the last bit. */
void ad_set_threads(ad_program *program, size_t threads);

/* As ad_run, and checks every value: AD_E_NONFINITE with operation, label and position of the first
   node, in the order of recording, that is not finite. */
enum ad_status ad_run_checked(ad_program *program, struct ad_error *error);

/* Sizes of a compiled program. */
struct ad_program_info {
    size_t nodes;        /* after removing dead nodes and sharing equal ones */
    size_t constants;    /* of these, computed once at compile time */
    size_t instructions; /* executed in each run */
    size_t segments;     /* passes over memory in each run */
    size_t value_bytes;  /* values in memory: inputs, outputs, values that cross segments, tiles */
    size_t bytes;        /* everything else the program holds */
};
struct ad_program_info ad_program_info(const ad_program *program);

/* ---- checks ---- */

/* Comparison of a gradient with extrapolated central differences. Error of an entry: |tape -
   difference| / (largest |gradient| of that input + tiny). */
struct ad_check {
    bool passed;
    size_t entries; /* number compared */
    double worst;   /* error of the worst entry */
    size_t input;   /* the worst entry: index of x, row and column */
    size_t row, col;
    double tape;       /* of the worst entry: the gradient on the tape ... */
    double difference; /* ... and by differences */
    bool kink; /* the worst entry lies within 1e-3 (relative) of a kink of y: `difference` is
                  then the mean of the slopes on either side */
};

/* Compares the gradient of the scalar y at x[k] = at[k] (rows*cols doubles each) with differences,
   for at most `entries` entries of each input, evenly spread (0: all). Entries near a kink fail.
   Appends to the tape, which must be f64. Returns AD_OK if the comparison was made; its outcome is
   report->passed. */
enum ad_status ad_check_gradient(ad_var y, size_t n, const ad_var x[], const double *const at[],
                                 double tolerance, size_t entries, struct ad_check *report);
/* As ad_check_gradient one order higher: checks the gradient of <grad y, u> for a fixed irregular
   u. */
enum ad_status ad_check_second(ad_var y, size_t n, const ad_var x[], const double *const at[],
                               double tolerance, size_t entries, struct ad_check *report);

AD_HEADER_END
#endif
