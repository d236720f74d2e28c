/* Runs a user's own operation (ad_custom) over blocks of columns, for compiled programs and for
   direct evaluation. */
#ifndef AUTODIFF_CUSTOM_H
#define AUTODIFF_CUSTOM_H

#include "internal.h"

enum custom_fault {
    CUSTOM_DONE,
    CUSTOM_FAILED,     /* it said so */
    CUSTOM_OUTSIDE,    /* it wrote where it must not */
    CUSTOM_MEMORY,     /* there was none for its block */
    CUSTOM_NO_ADJOINT, /* of direct evaluation: it has none, or its own derivative is asked for */
    CUSTOM_SECOND
};

/* A matrix of the tape's type; rows lie `stride` elements apart. */
struct custom_matrix {
    void *at;
    size_t stride;
};

/* How many columns are computed at a time: fixed by the operation, whatever the threads. */
size_t ad_custom_block(const struct custom *c);
/* `cols` columns, at most a block, from column `first` on: out = value(in[0]), or the adjoint of
   in[0], in[1], in[2]. NaN where it fails. */
enum custom_fault ad_custom_run(const struct custom *c, enum ad_type type, bool adjoint,
                                size_t first, size_t cols, const struct custom_matrix in[],
                                struct custom_matrix out);
/* Keeps the error of node `node`, of its value or adjoint, in the block that begins at column
 * `col`.
 */
enum ad_status ad_custom_report(struct ad_error *error, uint32_t node, bool adjoint,
                                const struct custom *c, enum custom_fault fault, size_t col);

#endif
