/* The parts of `leastaction modes`: the run (cmd_modes), output (modes_report). */
#ifndef APPS_MODES_MODES_H
#define APPS_MODES_MODES_H

#include "apps/options.h"
#include "apps/output/plot.h"
#include "apps/output/report.h"
#include "physics/modes/modes.h"

struct modes_options {
    struct common common;
    struct texts within;
    size_t starts, equilibrium, mode;
};

struct modes_run {
    const struct modes_options *options;
    struct phys_system system;
    double *low, *high; /* [dof], NULL: none given */
    struct phys_equilibria found;
    size_t drawn, drawn_mode; /* what the picture is of */
};

void modes_report(const void *run, struct report *report);
void modes_write_csv(const void *run, FILE *out);
enum ad_status modes_file(const void *run, phys_hdf5 *file, struct ad_error *error);
enum ad_status modes_picture(const void *run, struct plot *plot, struct ad_error *error);

#endif
