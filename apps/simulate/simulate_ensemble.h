/* Inside of simulate --ensemble. */
#ifndef APPS_SIMULATE_SIMULATE_ENSEMBLE_H
#define APPS_SIMULATE_SIMULATE_ENSEMBLE_H

#include "simulate.h"
#include "apps/output/outputs.h"

struct ensemble_run {
    struct simulate_run *run;
    struct phys_ensemble_settings settings;
    struct phys_ensemble ensemble;
    char **names; /* [settings.n_columns], NULL where a column has none */
    double *values;
};

/* What is printed and, by --json, written (simulate_ensemble_report.c). */
void simulate_ensemble_report(const void *context, struct report *report);
/* A row for each member and time that it reached. */
void simulate_ensemble_csv(const void *context, FILE *out);
enum ad_status simulate_ensemble_file(const void *context, phys_hdf5 *file, struct ad_error *error);

#endif
