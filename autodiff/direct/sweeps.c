/* The two sweeps of direct evaluation (direct.h). The build compiles this file for each element
   type: AD_DIRECT_F32 or AD_DIRECT_F64.

   Scalars go one way, all other shapes another: through strides, 0 along what is broadcast. */
#include "direct.h"
#include "autodiff/blas.h"
#include "autodiff/kernels/kernels.h"
#include "autodiff/tape/elements.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef AD_DIRECT_F32
typedef float R;
#define F(name) name##f
#define FORWARD ad_forward_f32
#define BACKWARD ad_backward_f32
#define TYPE AD_F32
#else
typedef double R;
#define F(name) name
#define FORWARD ad_forward_f64
#define BACKWARD ad_backward_f64
#define TYPE AD_F64
#endif

#include "formulas.h"

/* ---- other shapes, element by element ---- */

static void elementwise(const ad_tape *tape, struct ad_direct *d, uint32_t id, bool backward)
{
    const struct node *n = node_at(tape, id);
    const size_t arity = ad_ops[n->op].arity, at = direct_offset(d, id);
    struct elements in[3] = {{0}, {0}, {0}};
    R *v = d->value, *adjoint = d->adjoint;
    for (size_t k = 0; k < arity; k++) {
        in[k] = ad_broadcast_elements(node_at(tape, n->in[k]));
        in[k].offset = direct_offset(d, n->in[k]);
    }
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            size_t o = at + r * n->cols + c, i[3];
            for (size_t k = 0; k < 3; k++)
                i[k] = in[k].offset + r * in[k].row + c * in[k].col;
            if (!backward)
                v[o] = value_of(n->op, v[i[0]], v[i[1]], v[i[2]]);
            else if (adjoint[o] != 0)
                scalar_adjoint(n->op, v[o], adjoint[o], v[i[0]], v[i[1]], &adjoint[i[0]],
                               &adjoint[i[1]], &adjoint[i[2]]);
        }
}

#include "systems.h"

#include "customs.h"

#include "structure.h"

/* ---- the sweeps ---- */

static void set_constant(const ad_tape *tape, const struct node *n, R *value)
{
    for (size_t k = 0; k < node_size(n); k++)
        value[k] = (R)tape->numbers[n->aux + k];
}

static void other_forward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    R *v = d->value;
    if (is_elementwise(n))
        elementwise(tape, d, id, false);
    else if (n->op == AD_OP_constant)
        set_constant(tape, n, v + direct_offset(d, id));
    else if (n->op != AD_OP_input)
        structure(tape, d, id, false);
}

static void other_backward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    const R *g = (const R *)d->adjoint + direct_offset(d, id);
    bool any = false;
    for (size_t k = 0; k < node_size(n) && !any; k++)
        any = g[k] != 0;
    if (any && is_elementwise(n))
        elementwise(tape, d, id, true);
    else if (any && n->op != AD_OP_constant && n->op != AD_OP_input)
        structure(tape, d, id, true);
}

/* The third operand of a listed node. */
static inline uint32_t third(const ad_tape *tape, uint8_t op, uint32_t id)
{
    return op == AD_OP_select ? node_at(tape, id)->in[2] : 0;
}

static void forward_scalars(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    const uint8_t *ops = d->op;
    const struct operands *in = d->in;
    R *v = d->value;
    for (uint32_t id = 0; id < end; id++) {
        const uint8_t op = ops[id];
        if (op >= AD_OP_copy)
            v[id] = value_of(op, v[in[id].a], v[in[id].b], v[third(tape, op, id)]);
        else
            other_forward(tape, d, id);
    }
}

static void backward_scalars(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    const uint8_t *ops = d->op;
    const struct operands *in = d->in;
    const R *restrict v = d->value;
    R *g = d->adjoint;
    for (uint32_t id = end; id-- > 0;) {
        const uint8_t op = ops[id];
        if (g[id] == 0)
            continue;
        if (op >= AD_OP_copy)
            scalar_adjoint(op, v[id], g[id], v[in[id].a], v[in[id].b], &g[in[id].a], &g[in[id].b],
                           &g[third(tape, op, id)]);
        else
            other_backward(tape, d, id);
    }
}

static void forward_shapes(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    const size_t *at = d->offset;
    R *v = d->value;
    for (uint32_t id = 0; id < end; id++) {
        const struct node *n = node_at(tape, id);
        if (is_scalar(n))
            v[at[id]] = value_of(n->op, v[at[n->in[0]]], v[at[n->in[1]]], v[at[n->in[2]]]);
        else
            other_forward(tape, d, id);
    }
}

static void backward_shapes(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    const size_t *at = d->offset;
    const R *v = d->value;
    R *g = d->adjoint;
    for (uint32_t id = end; id-- > 0;) {
        const struct node *n = node_at(tape, id);
        if (!is_scalar(n))
            other_backward(tape, d, id);
        else if (g[at[id]] != 0)
            scalar_adjoint(n->op, v[at[id]], g[at[id]], v[at[n->in[0]]], v[at[n->in[1]]],
                           &g[at[n->in[0]]], &g[at[n->in[1]]], &g[at[n->in[2]]]);
    }
}

void FORWARD(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    (end > d->n_scalars ? forward_shapes : forward_scalars)(tape, d, end);
}

void BACKWARD(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    (end > d->n_scalars ? backward_shapes : backward_scalars)(tape, d, end);
}
