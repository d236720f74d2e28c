/* Accelerations written by hand, as a program for one system would have them: the baseline of
   forces.csv (`leastaction chart gradients`). */
#ifndef APPS_BENCH_HAND_HAND_FORCES_H
#define APPS_BENCH_HAND_HAND_FORCES_H

enum { HAND_FORCES = 3, HAND_FORCE_DOF = 6, HAND_FORCE_PARAMS = 5 };

struct hand_force {
    const char *scene;
    int dof;
    const char *params[HAND_FORCE_PARAMS]; /* names of p; NULL: no more */
    void (*acceleration)(const double *p, const double *q, const double *v, double *a);
};

/* [HAND_FORCES], as compiled for the best instruction set of this machine. */
const struct hand_force *hand_forces(void);

#endif
