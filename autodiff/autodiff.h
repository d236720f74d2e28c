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

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* ---- status ---- */

enum ad_status {
    AD_OK = 0,
    AD_E_MEMORY = -1,    /* an allocation failed */
    AD_E_SHAPE = -2,     /* shapes that do not fit the operation */
    AD_E_TAPE = -3,      /* variables of two tapes, or a variable the program does not have */
    AD_E_ARGUMENT = -4,  /* an argument outside its range */
    AD_E_NONFINITE = -5, /* a value is infinite or not a number */
    AD_E_INPUT = -6,   /* unusable data from outside: file, line and what was expected are named */
    AD_E_IO = -7,      /* a file could not be read or written */
    AD_E_ACCURACY = -8 /* the accuracy asked for is out of reach, or the run was interrupted */
};

/* An error and its one-line explanation; zero-initialised is "no error". */
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

/* Handle of one value on a tape, passed by value. Valid until its tape is reset or freed: after a
   reset it is refused with AD_E_TAPE. {0} is a variable that was never recorded; operations refuse
   it, too. */
typedef struct ad_var {
    ad_tape *tape;
    uint32_t id;
    uint32_t recording; /* number of the recording, another after each reset */
} ad_var;

/* New empty tape; NULL when memory is exhausted. */
ad_tape *ad_tape_new(enum ad_type type);
/* Forgets all that was recorded, errors too, and keeps the memory for the next recording. */
void ad_tape_reset(ad_tape *tape);
void ad_tape_free(ad_tape *tape); /* takes NULL; programs live on */
/* First error of the recording (status AD_OK if none). Lives as long as the tape. Of NULL: memory
   was exhausted. */
const struct ad_error *ad_tape_error(const ad_tape *tape);
/* Keeps an error in the tape, as operations do: for callbacks that find they cannot record what
   they should. Returns a handle that later operations pass through. */
ad_var ad_refuse(ad_tape *tape, enum ad_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Number of values recorded so far. */
size_t ad_tape_size(const ad_tape *tape);
/* Bytes held by the tape (nodes, constants, labels, index lists). */
size_t ad_tape_bytes(const ad_tape *tape);

/* Shape of a value; 0 x 0 for a handle without a tape or of an earlier recording. */
size_t ad_rows(ad_var x);
size_t ad_cols(ad_var x);

/* A value set before each run; zero until set. The label (may be NULL) is copied. */
ad_var ad_input(ad_tape *tape, size_t rows, size_t cols, const char *label);
/* Marks an input that changes less often than the others, for ad_rerun; returns it. */
ad_var ad_hold(ad_var input);
/* A constant matrix: rows*cols values, row-major, copied. */
ad_var ad_const(ad_tape *tape, size_t rows, size_t cols, const double *values);
/* A constant scalar. */
ad_var ad_scalar(ad_tape *tape, double value);
/* Names a value for error messages; returns it. */
ad_var ad_label(ad_var x, const char *label);

/* ---- elementwise operations ---- */

/* Argument of an operation: a variable, or a number on either side. */
typedef struct ad_arg {
    ad_var var;
    double value;
    bool is_number; /* `value`; else `var` */
} ad_arg;

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

/* Every operation by number; names, kernels and gradient rules come from the same table. */
enum ad_op {
#define AD_STRUCTURE(name, arity) AD_OP_##name,
#define AD_UNARY(name, value, dx, lo, hi) AD_OP_##name,
#define AD_BINARY(name, value, da, db, lo, hi) AD_OP_##name,
#define AD_TERNARY(name, value, da, db, dc, lo, hi) AD_OP_##name,
#include "ops.def"
    AD_N_OPS
};

/* An elementwise operation by its number: what the names below are short for. AD_E_ARGUMENT where
   op is not elementwise or takes another number of arguments. */
ad_var ad_unary(enum ad_op op, ad_var x);
ad_var ad_binary(enum ad_op op, ad_arg a, ad_arg b);
ad_var ad_ternary(enum ad_op op, ad_arg a, ad_arg b, ad_arg c);
const char *ad_op_name(enum ad_op op); /* "matmul", as messages name it */

/* detach neg abs sign step square cube sqrt recip exp log log1p expm1 sin cos tan asin acos atan
   sinh cosh tanh sigmoid softplus relu: ad_NAME(x), the shape of x. detach is x as a constant: no
   gradient goes through. At the edges of their domains the value is that of C, and the gradient
   stays finite wherever the value is: abs 0 at 0; sign 0 everywhere; step(x) = (x > 0), 0
   everywhere; relu 0 at 0; sqrt, asin, acos: 0 where the true derivative is infinite. Outside (log,
   recip at 0; sqrt below 0) infinities and NaN come through, value and gradient, unless a select
   does not take them. */
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    static inline ad_var ad_##name(ad_var x) { return ad_unary(AD_OP_##name, x); }
#include "ops.def"

#ifdef __cplusplus
} /* overloads stand outside extern "C" */
static inline ad_arg ad_to_arg(ad_var x) { return ad_arg_var(x); }
static inline ad_arg ad_to_arg(double x) { return ad_arg_number(x); }
#define AD_ARG(x) ad_to_arg(x)
extern "C" {
#else
#define AD_ARG(x) _Generic((x), ad_var : ad_arg_var, default : ad_arg_number)(x)
#endif

/* Binary operations: variable or number on either side (one of them a variable), broadcasting.
   min, max: where both are equal each side gets half the gradient; NaN wins. hypot, atan2: gradient
   0 at (0, 0). pow: gradient 0 at base 0 where the true one is infinite; the gradient of the
   exponent at base 0 is 0. Comparisons give 1 or 0 and have no gradient.
   Numbers meet before lanes do: a whole exponent up to 32 becomes products, c1*(c2*x) one product,
   c/x a reciprocal times c (for a matrix of constants, too). Each may move the last bit. */
#define ad_add(a, b) ad_binary(AD_OP_add, AD_ARG(a), AD_ARG(b))
#define ad_sub(a, b) ad_binary(AD_OP_sub, AD_ARG(a), AD_ARG(b))
#define ad_mul(a, b) ad_binary(AD_OP_mul, AD_ARG(a), AD_ARG(b))
#define ad_div(a, b) ad_binary(AD_OP_div, AD_ARG(a), AD_ARG(b))
#define ad_pow(a, b) ad_binary(AD_OP_pow, AD_ARG(a), AD_ARG(b))
#define ad_atan2(y, x) ad_binary(AD_OP_atan2, AD_ARG(y), AD_ARG(x))
#define ad_hypot(a, b) ad_binary(AD_OP_hypot, AD_ARG(a), AD_ARG(b))
#define ad_min(a, b) ad_binary(AD_OP_min, AD_ARG(a), AD_ARG(b))
#define ad_max(a, b) ad_binary(AD_OP_max, AD_ARG(a), AD_ARG(b))
#define ad_lt(a, b) ad_binary(AD_OP_lt, AD_ARG(a), AD_ARG(b))
#define ad_le(a, b) ad_binary(AD_OP_le, AD_ARG(a), AD_ARG(b))
#define ad_gt(a, b) ad_binary(AD_OP_lt, AD_ARG(b), AD_ARG(a))
#define ad_ge(a, b) ad_binary(AD_OP_le, AD_ARG(b), AD_ARG(a))
#define ad_eq(a, b) ad_binary(AD_OP_eq, AD_ARG(a), AD_ARG(b))
#define ad_ne(a, b) ad_binary(AD_OP_ne, AD_ARG(a), AD_ARG(b))

/* Elementwise c != 0 ? a : b. No NaN comes through the branch not taken, at any order of gradient:
   a zero adjoint stays zero whatever it is multiplied by. */
#define ad_select(c, a, b) ad_ternary(AD_OP_select, AD_ARG(c), AD_ARG(a), AD_ARG(b))

/* ---- shape and structure ---- */

ad_var ad_sum(ad_var x);           /* all elements -> 1 x 1 */
ad_var ad_sum_rows(ad_var x);      /* over rows    -> 1 x cols */
ad_var ad_sum_cols(ad_var x);      /* over columns -> rows x 1 */
ad_var ad_mean(ad_var x);          /* all elements -> 1 x 1 */
ad_var ad_dot(ad_var a, ad_var b); /* sum of a*b, shapes broadcast -> 1 x 1 */

/* The largest or smallest of all rows (1 x cols) or of all columns (rows x 1). NaN wins. Where
   several are equal their gradients add up to 1; which has how much is not specified. */
ad_var ad_max_rows(ad_var x);
ad_var ad_max_cols(ad_var x);
ad_var ad_min_rows(ad_var x);
ad_var ad_min_cols(ad_var x);
/* The number of the row (1 x cols) or column (rows x 1) of the largest value: the first of equal
   ones; where there is a NaN the first of those. No gradient. */
ad_var ad_arg_max_rows(ad_var x);
ad_var ad_arg_max_cols(ad_var x);
/* log of the sum of exp(x) over rows (1 x cols) or columns (rows x 1), without overflow. Where all
   x are -inf: -inf, with gradient 0. */
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

/* Small systems, one in each column: a has n*n rows, n up to 32, row i*n + j is element (i, j). LU
   with pivoting, or Cholesky, which reads the lower triangle of a symmetric positive definite a
   alone. A column whose matrix is singular, but for rounding, or not positive definite gives NaN
   there, and an error that names it: in ad_program_error after a run, of ad_run_checked,
   ad_evaluate and ad_gradient, and of ad_compile where the matrices are constants. A matrix that is
   nearly singular is no error: solutions have a relative error of up to its condition number times
   the rounding unit, which is not computed. */
enum ad_factors { AD_LU, AD_CHOLESKY };
/* x with a x = b; b has n*m rows, row i*m + k is element i of right side k. One column of a or b
   stands for as many as the other has. */
ad_var ad_solve(ad_var a, ad_var b, enum ad_factors factors);
ad_var ad_inverse(ad_var a, enum ad_factors factors); /* -> n*n x cols */
ad_var ad_logdet(ad_var a, enum ad_factors factors);  /* log |det a| -> 1 x cols */

/* Views: no copy is made. Slices need first + count within the shape. */
ad_var ad_row(ad_var x, size_t row);                        /* -> 1 x cols */
ad_var ad_col(ad_var x, size_t col);                        /* -> rows x 1 */
ad_var ad_slice_rows(ad_var x, size_t first, size_t count); /* -> count x cols */
ad_var ad_slice_cols(ad_var x, size_t first, size_t count); /* -> rows x count */
ad_var ad_reshape(ad_var x, size_t rows, size_t cols);      /* same elements in row-major order */
ad_var ad_broadcast(ad_var x, size_t rows, size_t cols);    /* repeats a scalar, column or row */
ad_var ad_gather_rows(ad_var x, size_t n, const uint32_t rows[]); /* row k is row rows[k] of x */

/* Column k is column cols[k] of x; a copy. */
ad_var ad_gather_cols(ad_var x, size_t n, const uint32_t cols[]);

/* Adds row k of x into row rows[k] of a zero matrix of `height` rows, or column k into column
   cols[k] of `width` columns: sums by segment, where the list has the segment of each; 0 where a
   segment has none. The adjoints of gathers. */
ad_var ad_scatter_rows(ad_var x, const uint32_t rows[], size_t height);
ad_var ad_scatter_cols(ad_var x, const uint32_t cols[], size_t width);

ad_var ad_concat_rows(size_t n, const ad_var parts[]); /* one above the other */
ad_var ad_concat_cols(size_t n, const ad_var parts[]); /* side by side */

/* Zero matrix rows x cols with every part added at its place (row[k], col[k]): the adjoint of
   slices. */
ad_var ad_place(ad_tape *tape, size_t rows, size_t cols, size_t n, const ad_var parts[],
                const size_t row[], const size_t col[]);

/* Time difference: column i is scale*(x[i+1] - x[i]); rows x (cols-1), or, with `repeat`, rows x
   cols with the last column twice. */
ad_var ad_diff(ad_var x, double scale, bool repeat);
/* Its adjoint, `cols` columns wide. */
ad_var ad_diff_adjoint(ad_var u, double scale, bool repeat, size_t cols);

/* ---- gradient ---- */

/* Appends the gradient of the sum of y's elements with respect to x[0..n-1] to the tape: g[k] has
   the shape of x[k]. The rules are written in these same operations, so g can be differentiated
   again. Runs in time linear in the tape, without recursion. Returns the tape's status. */
enum ad_status ad_grad(ad_var y, size_t n, const ad_var x[], ad_var g[]);

/* ---- direct evaluation ---- */

/* Run a recording at once, without compiling it: for programs that run once or a few times, of
   scalars above all. x[0..n-1] are all inputs that were recorded before y, at[k] their values
   (rows*cols doubles each); value (may be NULL) becomes y, gradient[k] (NULL: not wanted) the
   derivative of the sum of y's elements with respect to x[k]. Everything recorded up to y is
   evaluated, in the tape's type; memory for it stays with the tape: 16 bytes (f64) a scalar
   operation, 8 more where there are other shapes. What has an adjoint of exactly 0 sends none on.
   AD_E_TAPE, AD_E_ARGUMENT for an x that is no input and for an input without a value,
   AD_E_NONFINITE for a singular column of ad_solve, AD_E_MEMORY;
   the error of the recording, if there is one. Nothing is kept in the tape's error. */
enum ad_status ad_evaluate(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, struct ad_error *error);
enum ad_status ad_gradient(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, double *const gradient[], struct ad_error *error);

/* ---- program ---- */

/* Compiles what the outputs need into a program the caller frees; it is independent of the tape
   except that variables name its inputs and outputs. On failure *program is NULL, the status is
   returned and kept in the tape. */
enum ad_status ad_compile(ad_tape *tape, size_t n_out, const ad_var out[], ad_program **program);
void ad_program_free(ad_program *program); /* takes NULL */

/* Sets an input from rows*cols doubles (converted for f32). AD_E_TAPE if x is not one of the
   program's inputs, or of another tape or recording; every input recorded before compiling is one,
   whether an output needs it or not. */
enum ad_status ad_set(ad_program *program, ad_var x, const double *values);
/* Copies an input or output to rows*cols doubles; AD_E_TAPE as above. */
enum ad_status ad_get(const ad_program *program, ad_var x, double *values);
/* The storage of an input or output, rows*cols contiguous elements of the tape's type, fixed for
   the life of the program; NULL if the program has no such input or output. */
void *ad_data(ad_program *program, ad_var x);
/* One pass over the program; allocates nothing, but where ad_native_lazy says so. */
void ad_run(ad_program *program);
/* The same without what depends on held inputs alone, which stays as the last ad_run had it.
   AD_E_ARGUMENT, and nothing runs, before the first ad_run and where a held input was set since:
   ad_program_error says which. (What is written through ad_data is not seen.) */
enum ad_status ad_rerun(ad_program *program);
/* What was wrong with the last run: that of ad_rerun, or a singular column; status AD_OK if
 * nothing. Lives as long as the program. */
const struct ad_error *ad_program_error(const ad_program *program);
/* As ad_run; returns the seconds of it spent in matrix products, inside OpenBLAS. */
double ad_run_timed(ad_program *program);

/* Has the system's C compiler (CC, or cc) make machine code of the program, kept for the next time
   in the user's cache folder ($XDG_CACHE_HOME/leastaction, or ~/.cache/leastaction). `runs` is
   about how often ad_run will be called: where so many runs save less than compiling takes, 0.15
   s and 6.5 s for a megabyte of source, 0.5 to 1 ms an instruction, nothing is done; INFINITY asks
   for it in any case (of up to 65536 instructions). True if the program now runs as machine code.
   False if it goes on being interpreted, with the reason in `note` (may be NULL): it does not pay,
   there is no compiler or no safe folder, or LEASTACTION_NATIVE=0 is in the environment. Values are
   the same to rounding. */
bool ad_native(ad_program *program, double runs, struct ad_error *note);

/* The same as soon as it pays, for programs of which nobody knows how often they will run: a later
   ad_run or ad_rerun compiles first, once those before it would have saved as much time as that
   takes. When that is depends on the program alone, so that the same work gives the same bits. */
void ad_native_lazy(ad_program *program);
/* For a handler of a signal that ends the process: removes the files of compilations under way. */
void ad_native_abandon(void);
/* Why the program is interpreted; "" if it is not. Lives as long as the program. */
const char *ad_native_note(const ad_program *program);

/* Threads for large segments (default 1). Results do not depend on it, to the last bit. */
void ad_set_threads(ad_program *program, size_t threads);

/* As ad_run, and looks at every value: AD_E_NONFINITE with the operation, the label and the
   position of the first node (in the order of recording) that is not finite. */
enum ad_status ad_run_checked(ad_program *program, struct ad_error *error);

/* What compiling made of the recording. */
struct ad_program_info {
    size_t nodes;        /* after dropping dead and sharing equal ones */
    size_t constants;    /* of these, computed once, when compiling */
    size_t instructions; /* executed in each run */
    size_t segments;     /* passes over memory in each run */
    size_t value_bytes;  /* values in memory: inputs, outputs, what crosses segments, tiles */
    size_t bytes;        /* everything else the program holds */
};
struct ad_program_info ad_program_info(const ad_program *program);

/* ---- checks ---- */

/* Comparison of a gradient with central differences (Richardson extrapolated). Error of an entry:
   |tape - difference| / (largest |gradient| of that input + tiny). */
struct ad_check {
    bool passed;
    size_t entries; /* compared */
    double worst;   /* error of the worst entry */
    size_t input;   /* of the worst entry: which x, row and column */
    size_t row, col;
    double tape;       /* of the worst entry: gradient on the tape ... */
    double difference; /* ... and by differences */
    bool kink; /* the worst entry lies within 1e-3 (relative) of a kink of y: `difference` is
                  then the mean of the slopes on either side */
};

/* Compares the gradient of the scalar y at x[k] = at[k] (rows*cols doubles each). At most `entries`
   entries an input are compared, spread evenly (0: all). Entries beside a kink fail. Appends to the
   tape. Needs an f64 tape. Returns AD_OK when it could compare, whatever the outcome: see
   report->passed. */
enum ad_status ad_check_gradient(ad_var y, size_t n, const ad_var x[], const double *const at[],
                                 double tolerance, size_t entries, struct ad_check *report);
/* The same one order higher: the gradient of <grad y, u> for fixed irregular u. */
enum ad_status ad_check_second(ad_var y, size_t n, const ad_var x[], const double *const at[],
                               double tolerance, size_t entries, struct ad_check *report);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
