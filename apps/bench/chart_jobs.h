/* Complete jobs for chart_jobs.c, with published settings and with ours, both by this library. */
#ifndef APPS_BENCH_CHART_JOBS_H
#define APPS_BENCH_CHART_JOBS_H

#include "autodiff/autodiff.h"

enum { JOBS_MOST = 16 };

struct job_side {
    double seconds, error; /* CPU time; error at the end */
    bool cut;              /* stopped by the limit of time */
};

struct job {
    const char *name, *group, *measure; /* measure: what the error is */
    struct job_side published, ours;
    double level; /* seconds of ours until its error is no more than the published one; infinite:
                     never */
};

/* Each adds its jobs to jobs[*n ...]. */

/* The scenes of the paper: its descent by Adam, and Newton's method (chart_solvers.c). */
enum ad_status jobs_paths(bool quick, struct job jobs[], size_t *n, struct ad_error *error);
/* Hamiltonian networks: the published training, and a shorter one whose learning rate falls to
   nothing. */
enum ad_status jobs_networks(bool quick, struct job jobs[], size_t *n, struct ad_error *error);
/* The packet in a box: published grid and kernel, and between walls that reflect. */
enum ad_status jobs_quantum(bool quick, struct job jobs[], size_t *n, struct ad_error *error);

#endif
