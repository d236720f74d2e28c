/* Parts of leastaction chart quantum: measured (chart_quantum.c), what the errors are against
   (chart_quantum_truth.c), drawn (chart_quantum_draw.c). */
#ifndef APPS_CHART_QUANTUM_H
#define APPS_CHART_QUANTUM_H

#include "apps/output/plot.h"
#include "quantum/quantum.h"

enum { QUANTUM_PROBLEMS = 3, QUANTUM_WAYS = 6, QUANTUM_LEVELS = 12 };

/* A packet whose end is known. */
struct quantum_problem {
    const char *name, *title, *scene;
    double g; /* set where there is one; NaN: leave it */
    double low, high, time;
    struct qm_gaussian packet;
    bool exact; /* in closed form: */
    struct qm_quadratic quadratic;
};
extern const struct quantum_problem quantum_problems[QUANTUM_PROBLEMS];

/* A method with a rule, between walls, and its grid: so many points, or so many a slice; 0 and 0:
   as few as the sum over paths allows at a dt. */
struct quantum_way {
    const char *name, *rule;
    const struct qm_method *method;
    enum qm_walls walls;
    size_t points, a_slice;
};
extern const struct quantum_way quantum_ways[QUANTUM_WAYS];

struct quantum_point {
    size_t points, steps;
    double setup, seconds, error; /* seconds: all of it */
};
struct quantum_curve {
    size_t n;
    struct quantum_point point[QUANTUM_LEVELS];
};

struct quantum_curves {
    struct quantum_curve at[QUANTUM_PROBLEMS][QUANTUM_WAYS];
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

void chart_quantum_draw(const struct quantum_curves *curves, struct plot *plot);

#endif
