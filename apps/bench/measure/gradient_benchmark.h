/* Derivatives of the action by the tape against hand-written C: same function, same path. */
#ifndef APPS_BENCH_MEASURE_GRADIENT_BENCHMARK_H
#define APPS_BENCH_MEASURE_GRADIENT_BENCHMARK_H

#include "sized_gradient.h"
#include "timing.h"
#include "physics/physics.h"

enum {
    TAPE_GRADIENT,   /* interpreted */
    NATIVE_GRADIENT, /* compiled; interpreted, where there is no compiler */
    HAND_GRADIENT,
    LIMIT_GRADIENT, /* by intrinsics, where this machine has the instructions */
    TAPE_PRIMAL,
    HAND_PRIMAL,
    ADAM_STEP,                 /* gradient by the tape, interpreted, and the step */
    NATIVE_ADAM_STEP,          /* compiled */
    RACE_FIRST,                /* number of first-order jobs; second order: */
    TAPE_PRODUCT = RACE_FIRST, /* Hessian times a vector */
    NATIVE_PRODUCT,
    HAND_PRODUCT,
    HESSIAN_BLOCKS, /* the whole Hessian, block by block, as Newton's method takes it */
    RACE_JOBS
};

enum { RACE_ADAM_STEPS = 100 };

/* Values of a scene's race, [dof x HAND_SLICES] each: the path, a vector; by the tape the gradient,
   the Hessian times the vector, and the path after the steps of Adam. */
struct race_values {
    size_t n;
    double adam_rate;                          /* its learning rate */
    double *x, *u, *gradient, *product, *adam; /* of one allocation, at x */
};

struct race {
    double ns[RACE_JOBS];               /* of one call */
    double ratio[RACE_JOBS][RACE_JOBS]; /* [a][b]: how much longer a takes than b (time_ratio) */
    double disagreement;                /* of the four gradients, relative to the largest entry */
    double second; /* the same of Hessians times a vector: tape, compiled, hand, blocks */
    struct race_values values;
};

/* Measures scene number `scene` of hand.h. Ends with race_free, whatever it returned. */
enum ad_status race_run(int scene, bool quick, struct race *race, struct ad_error *error);
void race_free(struct race *race);

/* ---- between the first derivatives and the second ---- */

/* Room for n numbers, aligned as the values of programs are; NULL when out of memory. */
double *race_rows(size_t n);
/* Times jobs[0..n-1] in turn: numbers first ... of race->ns and race->ratio. */
void race_time(size_t n, struct timed jobs[], size_t rounds, size_t first, struct race *race);
/* Fills race->ns and ratio from RACE_FIRST on, second and values.product, at values.x and values.u.
 */
enum ad_status race_second(int scene, bool quick, struct race *race, struct ad_error *error);
/* Largest difference of two vectors, relative to the largest entry of the first. */
double race_disagreement(size_t n, const double *a, const double *b);

#endif
