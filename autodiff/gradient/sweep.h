/* Internals of the gradient: the state of one reverse sweep, and its rules. */
#ifndef AUTODIFF_GRADIENT_SWEEP_H
#define AUTODIFF_GRADIENT_SWEEP_H

#include "autodiff/internal.h"

/* Part of an adjoint: covers rows x cols of the value from (row, col) on. */
struct adjoint_part {
    uint32_t id, row, col, rows, cols, next;
};

enum { NEEDED = 1, TAINTED = 2 }; /* depends on some x; its adjoint came through a branch */

struct sweep {
    ad_tape *tape;
    uint32_t *adjoint; /* per node: the id of its adjoint so far, 0 none */
    uint32_t *first;   /* per node: 1 + its first part */
    uint8_t *flags;
    struct adjoint_part *parts;
    size_t n_parts, max_parts;
    uint32_t from; /* the first of the x */
    bool tainted;  /* of the node being treated */
};

static inline ad_var sweep_var(const struct sweep *s, uint32_t id) { return ad_at(s->tape, id); }

static inline bool is_needed(const struct sweep *s, uint32_t id) { return s->flags[id] & NEEDED; }

/* The shape that the derivatives of x broadcast to in each dimension: that of x, or 1. */
static inline bool ad_fits(ad_var d, ad_var x)
{
    return (ad_rows(d) == ad_rows(x) || ad_rows(d) == 1) &&
           (ad_cols(d) == ad_cols(x) || ad_cols(d) == 1);
}

/* The sweeps of ad_vjp and ad_jvp, of m values; arguments have been checked. `tainted`: factors of
   exactly 0 stay 0 whatever they are multiplied by, so that an infinite derivative in one direction
   makes no NaN in another. */
enum ad_status ad_sweep_back(ad_tape *tape, size_t m, const ad_var y[], const ad_var seed[],
                             bool tainted, size_t n, const ad_var x[], ad_var g[]);
enum ad_status ad_sweep_forward(ad_tape *tape, bool tainted, size_t n, const ad_var x[],
                                const ad_var dx[], size_t m, const ad_var y[], ad_var dy[]);
/* One past the last of the nodes x[0..n-1]. */
static inline uint32_t ad_end_of(size_t n, const ad_var x[])
{
    uint32_t end = 1;
    for (size_t k = 0; k < n; k++)
        end = x[k].id < end ? end : x[k].id + 1;
    return end;
}

/* True for a part of a constant (a seed) that is 0: behind branches it need not be passed on. */
bool ad_is_zero(ad_var x);
/* Operations that send an exact zero to the branch not taken. */
bool ad_branches(uint16_t op);
/* Adds c to the adjoint of node `to`. */
void ad_accumulate(struct sweep *s, uint32_t to, ad_var c);
/* Sums the dimensions in which x was broadcast to y; a dimension that the adjoint leaves implicit
   counts as often as it repeats. */
ad_var ad_reduce_to(ad_var c, const struct node *y, const struct node *x);
/* Passes the adjoint g of node n on to its inputs. */
void ad_elementwise_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g);
void ad_structure_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g);
void ad_scan_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g);
/* Of a user's own operation and its adjoint (rules_custom.c); the tangent of either, of node n with
   the value y, where operand k moves by t[k] (id 0: not at all). */
void ad_custom_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g);
void ad_custom_adjoint_rule(struct sweep *s, const struct node *n, ad_var g);
ad_var ad_custom_tangent(const struct node *n, ad_var y, const ad_var t[3], bool tainted);
/* The gradient of a log-determinant with respect to its matrix. */
ad_var ad_logdet_slope(const struct node *n, ad_tape *tape);
/* The tangent of an elementwise y from those of its operands (id 0: none); id 0 if there is none.
 */
ad_var ad_elementwise_tangent(const struct node *n, ad_var y, const ad_var t[3], bool tainted);
/* The tangent of a loop, or of its adjoint, from those of all nodes (0: none); id 0: none. */
ad_var ad_scan_tangent(const struct node *n, ad_var y, const uint32_t *tangent);
/* The loop of a loop and its derivative along its states and the other operands that `along` marks:
   all states, then their tangents, inputs and tangents of those marked, and so on. Its number. */
uint32_t ad_tangent_loop(ad_tape *tape, uint32_t loop, const uint8_t *along);
/* A bit for each operand on which the derivative of an elementwise operation is not always 0. */
unsigned ad_derivative_operands(uint16_t op);

#endif
