/* How networks learn, over seconds of training. */
#ifndef APPS_CHART_HNN_LEARNING_H
#define APPS_CHART_HNN_LEARNING_H

#include "chart_hnn.h"

enum { LEARNING_POINTS = 24 };

struct learning_point {
    size_t step;
    double seconds;               /* of the processor, of training alone */
    double test_loss, energy_mse; /* the latter infinite where a motion was lost */
};

struct learning_curve {
    struct network network;
    size_t n;
    struct learning_point point[LEARNING_POINTS];
};

/* Above the test loss, below the energy error; left f32, right f64. */
void learning_draw(size_t n, const struct learning_curve curves[], struct plot *plot);

#endif
