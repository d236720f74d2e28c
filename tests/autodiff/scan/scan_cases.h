/* Loops as tables: a step as a function of variables of any tape, so that the same step can be a
   body or be unrolled. */
#ifndef TESTS_AUTODIFF_SCAN_SCAN_CASES_H
#define TESTS_AUTODIFF_SCAN_SCAN_CASES_H

#include "tests/autodiff/support.h"

enum { SCAN_MOST = 4, SCAN_ORDERS = 3 };

struct scan_shape {
    size_t rows, cols;
};

struct scan_case {
    const char *name;
    size_t n_state, n_in, n_shared, n_out;
    struct scan_shape state[SCAN_MOST], in[SCAN_MOST], shared[SCAN_MOST];
    void (*step)(const ad_var state[], const ad_var in[], const ad_var shared[], ad_var next[],
                 ad_var out[]);
    double lo, hi; /* of operands */
};

extern const struct scan_case scan_cases[];
extern const size_t n_scan_cases;

/* The case of this name. */
const struct scan_case *scan_case_named(const char *name);

/* A loop recorded, by ad_scan or unrolled: the sum of all results times irregular weights. */
struct scan_made {
    ad_tape *tape;
    size_t n;
    ad_var x[3 * SCAN_MOST]; /* operands: states, ins, shared */
    ad_var last[SCAN_MOST], out[SCAN_MOST];
    ad_var y;
};

struct scan_made scan_make(const struct scan_case *c, enum ad_type type, size_t steps,
                           size_t checkpoints, bool unrolled);
/* The body of a case, recorded on `tape`; the arrays are those of `v`. */
struct scan_vars {
    ad_var state[SCAN_MOST], in[SCAN_MOST], shared[SCAN_MOST], next[SCAN_MOST], out[SCAN_MOST];
};
struct ad_body scan_body(const struct scan_case *c, ad_tape *tape, struct scan_vars *v);

/* Sets all operands to values of this seed. */
void scan_set_all(ad_program *p, const struct scan_made *m, uint64_t seed);
/* Values of x and of y in two programs, of like recordings. */
void scan_assert_like(ad_program *p, ad_var x, ad_program *q, ad_var y);

/* y, its gradient, and gradients of weighted sums of the gradient before, up to `order`: one value
   after the other in *n doubles that the caller frees. threads 0: machine code. */
double *scan_derivatives(const struct scan_case *c, enum ad_type type, size_t steps,
                         size_t checkpoints, bool unrolled, int order, size_t threads, size_t *n);

#endif
