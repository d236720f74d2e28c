/* The parts of `leastaction fit`: measured motions (fit_data), output (fit_report). */
#ifndef APPS_FIT_FIT_H
#define APPS_FIT_FIT_H

#include "apps/options.h"
#include "apps/output/plot.h"
#include "apps/output/report.h"
#include "hnn/hnn.h"
#include "physics/fit/fit.h"

struct fit_options {
    struct common common;
    const char *free, *columns, *noise;
    bool fixed_start;
    double hold_out;
    size_t stretch, tries, skip;
};

/* NAME,NAME or NAME=TEXT,NAME=TEXT. */
struct fit_list {
    size_t n;
    char *text; /* owned; the names and what follows = stand in it */
    const char **name, **value;
};

struct fit_run {
    const struct fit_options *options;
    struct phys_system system;
    struct fit_list free, columns, noises;
    struct phys_fit_data data;
    double *values, *noise; /* of the data; [2 dof] */
    size_t *trials;
    struct phys_fit_settings settings;
    struct phys_fit fit;
};

/* "theta", "v_theta": component i of (q, v). */
void fit_quantity(const struct phys_system *system, size_t i, char *name, size_t size);
/* The measured motions of a file. */
enum ad_status fit_read(struct fit_run *run, const char *file, struct ad_error *error);

void fit_report(const void *run, struct report *report);
void fit_write_csv(const void *run, FILE *out);
enum ad_status fit_file(const void *run, phys_hdf5 *file, struct ad_error *error);
enum ad_status fit_picture(const void *run, struct plot *plot, struct ad_error *error);

#endif
