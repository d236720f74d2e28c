/* The published variant beside the same scene done right: run (quantum_paper.c), drawn
   (quantum_paper_picture.c). */
#ifndef APPS_QUANTUM_PAPER_H
#define APPS_QUANTUM_PAPER_H

#include "quantum.h"

/* The published run (arXiv 2303.02115, figure 4), defects and all. */
struct published {
    struct qm_grid grid; /* its points: low + a dx */
    double dt, hbar, phases, ghost, norm, gauge;
    size_t steps, frames;
    qm_complex *K;          /* [n x n] */
    qm_complex *psi, *work; /* [n] each, twice: with the potential and without */
    double *density;        /* [frames x n] */
    double *time, *mean;    /* [frames] */
};

void paper_picture(const struct published *published, const struct quantum_run *run,
                   const struct quantum_result *result, const qm_complex *K, struct plot *plot);

/* What the two runs cost, seconds of the processor, and how far the mean ends from the particle. */
struct paper_cost {
    double published_seconds, published_error, seconds, error;
};
enum ad_status paper_measure(double scale, struct paper_cost *cost, struct ad_error *error);

#endif
