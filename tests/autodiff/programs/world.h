/* Random programs. A world is a tape with random operations, and for every variable its value
   computed by plain loops in f64. One seed chooses the operations, another the values of the
   inputs: the same program with other inputs is a second world. */
#ifndef TESTS_AUTODIFF_PROGRAMS_WORLD_H
#define TESTS_AUTODIFF_PROGRAMS_WORLD_H

#include "tests/autodiff/support.h"

enum { MAX_NODES = 96, MAX_INPUTS = 4 };

struct matrix {
    size_t rows, cols;
    double *v;
};

struct world {
    ad_tape *tape;
    uint64_t structure, values; /* states of the two random sequences */
    bool smooth;                /* no kinks: differences can be taken */
    size_t n, n_inputs;
    ad_var var[MAX_NODES];
    struct matrix m[MAX_NODES]; /* the inputs come first */
};

/* A world of inputs, constants and `operations` random operations on up to `cols` columns. */
void world_init(struct world *w, enum ad_type type, uint64_t structure, uint64_t values,
                size_t cols, size_t operations, bool smooth);
void world_release(struct world *w);

#endif
