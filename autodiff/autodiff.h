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
   scalar, a column (rows x 1) or a row (1 x cols). Shapes: arrays of values are rows*cols doubles.

   Errors: nothing here prints, exits or aborts on a user's mistake. The first error of a recording
   stays in the tape; later operations on that tape pass through, and ad_compile returns it. Its
   message names the operation, its number (ad_tape_size(tape) just before) and its operands by
   label, or by the nearest label before them. NULL that must not be is AD_E_ARGUMENT or AD_E_TAPE;
   functions that return no status, here and in the headers above this one, then return NaN, 0,
   NULL or "?", or do nothing.
   Threads: handles share nothing: two tapes, or two programs, may be used from two threads; one
   handle may not. */
#ifndef AUTODIFF_AUTODIFF_H
#define AUTODIFF_AUTODIFF_H

#include "operations.h"
#include "program.h"

AD_HEADER_BEGIN

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
    bool kink;    /* the worst entry lies within 1e-3 (relative) of a kink of y: `difference` is
                     then the mean of the slopes on either side */
    bool cancels; /* terms of y cancel there: the tape agrees with `difference` as far as the
                     rounding of y lets it know, and `worst` is the tolerance */
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

/* What ad_check_all found. */
struct ad_checks {
    bool passed;
    struct ad_error not_finite;    /* of y and its gradient; if set, nothing else was checked */
    struct ad_check first, second; /* ad_check_gradient of 200 entries an input, ad_check_second */
};
/* Every check of y at a point, arguments as in ad_check_gradient; tolerance 0: 1e-6, where a wrong
   term shows and rounding of differences does not. Appends to the tape. Returns AD_OK if the checks
   were made. */
enum ad_status ad_check_all(ad_var y, size_t n, const ad_var x[], const double *const at[],
                            double tolerance, struct ad_checks *checks);
/* The report of checks of the inputs x, by their labels, as lines of text, as snprintf: at most
   `size` bytes with the closing 0, and returns the length of all. */
size_t ad_checks_text(const struct ad_checks *checks, size_t n, const ad_var x[], char *text,
                      size_t size);

AD_HEADER_END
#endif
