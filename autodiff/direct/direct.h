/* Direct evaluation: runs a recording over its own nodes, values forward and adjoints backward,
   without compiling it. evaluate.c has the public functions; sweeps.c, compiled for f32 and f64,
   the two sweeps, with formulas and derivatives from ops.def. */
#ifndef AUTODIFF_DIRECT_DIRECT_H
#define AUTODIFF_DIRECT_DIRECT_H

#include "autodiff/custom.h"
#include "autodiff/internal.h"

/* Values and adjoints of the nodes of a tape. */
struct ad_direct {
    uint32_t n_scalars; /* nodes before the first of another shape: offsets are their numbers */
    size_t *offset;     /* of each node, in elements, once there is another shape */
    size_t n_offsets, max_offsets;
    size_t elements; /* of the nodes placed so far */
    size_t bytes;    /* of each array */
    void *value, *adjoint;
    /* Scalars alone: operations and first two operands of nodes [0, n_listed). The sweeps read 9
       bytes a node here for 28 on the tape. */
    uint8_t *op;
    struct operands {
        uint32_t a, b;
    } * in;
    uint32_t n_listed, max_listed;
    uint32_t singular; /* of the last sweep forward: the first factor with a singular column ... */
    size_t column;     /* ... and that; 0: none */
    struct ad_error error; /* of a loop */
};

static inline size_t direct_offset(const struct ad_direct *d, uint32_t id)
{
    return id < d->n_scalars ? id : d->offset[id];
}

/* A loop, or its adjoint: its value; adjoints of what it reads. Errors are kept in d->error. */
void ad_direct_scan(const ad_tape *tape, struct ad_direct *d, uint32_t id);
void ad_direct_scan_back(const ad_tape *tape, struct ad_direct *d, uint32_t id);
/* Values of nodes [0, end), whose inputs are set. */
void ad_forward_f32(const ad_tape *tape, struct ad_direct *d, uint32_t end);
void ad_forward_f64(const ad_tape *tape, struct ad_direct *d, uint32_t end);
/* Adjoints of nodes [0, end), of which the last one's is set and the others are 0. What has an
   adjoint of 0 sends nothing on: no NaN comes from a branch that was not taken. */
void ad_backward_f32(const ad_tape *tape, struct ad_direct *d, uint32_t end);
void ad_backward_f64(const ad_tape *tape, struct ad_direct *d, uint32_t end);

#endif
