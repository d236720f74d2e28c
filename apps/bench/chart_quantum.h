/* Truths for the errors of `leastaction chart quantum`. */
#ifndef APPS_BENCH_CHART_QUANTUM_H
#define APPS_BENCH_CHART_QUANTUM_H

#include "quantum/quantum.h"

/* A packet whose end is known. */
struct quantum_problem {
    const char *name, *title, *scene;
    double g; /* set where there is one; NaN: leave it */
    double low, high, time;
    struct qm_gaussian packet;
    bool exact; /* in closed form: */
    struct qm_quadratic quadratic;
};

/* psi at the end of a problem, on any grid. Opaque; ends with quantum_reference_free. */
struct quantum_reference {
    const struct quantum_problem *problem;
    struct qm_grid grid; /* of the fine solution, where there is no closed form */
    qm_complex *psi;
};
enum ad_status quantum_reference_new(const struct quantum_problem *problem,
                                     const struct phys_system *system, bool quick,
                                     struct quantum_reference *reference, struct ad_error *error);
void quantum_reference_free(struct quantum_reference *reference);
/* sqrt(int |psi - reference|^2 dx); room [n]. */
double quantum_reference_error(const struct quantum_reference *reference,
                               const struct qm_grid *grid, const qm_complex *psi, qm_complex *room);

#endif
