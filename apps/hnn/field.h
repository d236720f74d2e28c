/* The parts of `leastaction field`: setup and evaluation on a grid (field_setup), output
   (field_write). */
#ifndef APPS_HNN_FIELD_H
#define APPS_HNN_FIELD_H

#include "field_arrows.h"
#include "apps/options.h"
#include "apps/output/plot.h"
#include "physics/io/hdf5_file.h"

struct field_options {
    struct common common;
    const char *axes, *across, *up, *at;
    size_t grid;
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

#endif
