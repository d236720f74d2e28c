/* Random recordings of any length, of all operations, to compare back ends. */
#ifndef TESTS_AUTODIFF_PROGRAMS_RANDOM_TAPE_H
#define TESTS_AUTODIFF_PROGRAMS_RANDOM_TAPE_H

#include "plain.h"

enum { TAPE_INPUTS = 4, TAPE_OUTPUTS = 24 };

struct random_tape {
    ad_tape *tape;
    struct plain plain; /* of all nodes, for values[0] */
    size_t n_inputs, n_held, n_out;
    ad_var in[TAPE_INPUTS]; /* the first n_held are held */
    double *values[2][TAPE_INPUTS];
    ad_var out[TAPE_OUTPUTS];
    int order; /* of derivatives among the outputs */
};

/* What seed says, with about `nodes` nodes. */
void random_tape_init(struct random_tape *r, uint64_t seed, size_t nodes);
void random_tape_release(struct random_tape *r);

#endif
