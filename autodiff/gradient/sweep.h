/* Inside of the gradient: the state of one reverse sweep, and the rules it applies. */
#ifndef AUTODIFF_SWEEP_H
#define AUTODIFF_SWEEP_H

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
    bool tainted; /* of the node being treated */
};

static inline ad_var sweep_var(const struct sweep *s, uint32_t id) { return ad_at(s->tape, id); }

static inline bool is_needed(const struct sweep *s, uint32_t id) { return s->flags[id] & NEEDED; }

/* Operations that send an exact zero along what they do not take. */
bool ad_branches(uint16_t op);
/* Adds c to the adjoint of node `to`. */
void ad_accumulate(struct sweep *s, uint32_t to, ad_var c);
/* Sums dimensions in which y was broadcast from x; a dimension the adjoint left implicit counts as
   often as it repeats. */
ad_var ad_reduce_to(ad_var c, const struct node *y, const struct node *x);
/* Passes the adjoint g of node n on to its inputs. */
void ad_elementwise_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g);
void ad_structure_rule(struct sweep *s, const struct node *n, ad_var g);

#endif
