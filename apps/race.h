/* The gradient of the action by the tape against hand-written C: same function, same path. */
#ifndef APPS_RACE_H
#define APPS_RACE_H

#include "../autodiff/autodiff.h"

enum {
    TAPE_GRADIENT,   /* interpreted */
    NATIVE_GRADIENT, /* compiled; interpreted, where there is no compiler */
    HAND_GRADIENT,
    TAPE_PRIMAL,
    HAND_PRIMAL,
    ADAM_STEP,
    RACE_JOBS
};

struct race {
    double ns[RACE_JOBS]; /* of one call; ADAM_STEP: gradient by the tape and the step */
    double ratio[RACE_JOBS][RACE_JOBS]; /* [a][b]: how much longer a takes than b (time_ratio) */
    double disagreement;                /* of the three gradients, relative to the largest entry */
};

/* Measures scene number `scene` of hand.h. */
enum ad_status race_run(int scene, bool quick, struct race *race, struct ad_error *error);

#endif
