/* The parts of `leastaction field`: setup and evaluation on a grid (field_setup), output
   (field_write). */
#ifndef APPS_HNN_FIELD_H
#define APPS_HNN_FIELD_H

#include "apps/options.h"
#include "apps/output/figure.h"
#include "hnn/hnn.h"
#include "physics/io/hdf5_file.h"

struct field_options {
    struct common common;
    const char *axes, *across, *up, *at;
    size_t grid;
};

/* Where a field is looked at: components `across` and `up` of the state vary over their ranges, the
   others, and inputs, are those of `at` [2 dof + inputs]. */
struct field_plane {
    size_t across, up;
    struct range x, y;
    const double *at;
};

struct field {
    hnn_model *model;
    struct phys_ode ode; /* for the names of components */
    struct field_plane plane;
    size_t states, n, samples; /* n x n = samples */
    double *at, *x, *rate, *H; /* [states]; [states x samples] twice; [samples] */
};

/* Model, grid, and what they give. Ends with field_free, whatever it returned. */
enum ad_status field_setup(const struct field_options *options, struct field *field,
                           struct ad_error *error);
void field_free(struct field *field);

/* A row a point: state, rates, H. */
void field_write_csv(const void *field, FILE *out);
enum ad_status field_write_file(const void *field, phys_hdf5 *file, struct ad_error *error);
/* Lines of equal H, where there is one, and arrows. */
enum ad_status field_picture(const void *field, struct plot *plot, struct ad_error *error);

/* ---- vector fields of models in pictures (field_arrows) ---- */

/* The state of point (i, j) of an n x n grid with points on the edges; i across, j up. */
void field_state(const struct field_plane *plane, size_t states, size_t n, size_t i, size_t j,
                 double *state);
/* Rows "x y dx dy speed" of n x n arrows, points and arrows well inside the edges; the longest
   arrow reaches from its point to the next. Equal units across and up are not needed. */
enum ad_status field_arrows(hnn_model *model, const struct field_plane *plane, size_t n, FILE *out,
                            struct ad_error *error);

#endif
