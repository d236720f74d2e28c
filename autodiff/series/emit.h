/* Writing the C of a series. For emit.c, emit_values.c and emit_orders.c only. */
#ifndef AUTODIFF_SERIES_EMIT_H
#define AUTODIFF_SERIES_EMIT_H

#include "lanes.h"

#include <stdio.h>

struct emit {
    FILE *out;
    const ad_series *s;
    struct lanes l;
    bool *stored;        /* packs of this order */
    size_t accumulators; /* of one loop: what registers hold */
    bool many;           /* AD_SERIES_POINTS points: every number is a vector, of one each */
};

/* The coefficient of a jet at the order under way; its coefficient 0. */
void ad_emit_name(const struct emit *e, uint32_t id);
void ad_emit_value(const struct emit *e, uint32_t id);
/* A vector of what `lane` writes of each jet of a pack. */
void ad_emit_vector(const struct emit *e, const struct pack *p,
                    void (*lane)(const struct emit *e, uint32_t id));
/* Coefficients 0 of all jets (emit_values.c). */
void ad_emit_values(const struct emit *e);
/* The loop over orders, of a flow of n inputs (emit_orders.c); false when out of memory. */
bool ad_emit_orders(struct emit *e, size_t n);

#endif
