/* Vector fields of models in pictures. */
#ifndef APPS_HNN_FIELD_ARROWS_H
#define APPS_HNN_FIELD_ARROWS_H

#include "apps/output/figure.h"
#include "hnn/hnn.h"

/* Where a field is looked at: components `across` and `up` of the state vary over their ranges, the
   others, and inputs, are those of `at` [2 dof + inputs]. */
struct field_plane {
    size_t across, up;
    struct range x, y;
    const double *at;
};

/* The state of point (i, j) of an n x n grid with points on the edges; i across, j up. */
void field_state(const struct field_plane *plane, size_t states, size_t n, size_t i, size_t j,
                 double *state);
/* Rows "x y dx dy speed" of n x n arrows, points and arrows well inside the edges; the longest
   arrow reaches from its point to the next. Equal units across and up are not needed. */
enum ad_status field_arrows(hnn_model *model, const struct field_plane *plane, size_t n, FILE *out,
                            struct ad_error *error);

#endif
