/* Time of a training step relative to its floor: the matrix products that no implementation can
   omit, by OpenBLAS on the whole batch, and one activation per unit. For an inner matrix an HNN
   needs six products (value, gradient in the graph, and their adjoints), a baseline three; those of
   the first and last layer are thin and are not counted.

       struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
       struct training_speed speed;
       if (training_speed_measure(&settings, 750, 1, TIMING_ROUNDS, &speed, &error) == AD_OK)
           printf("%.2f ms, %.2f x the floor\n", speed.step_ms,
                  speed.step_ms / (speed.products_ms + speed.activation_ms)); */
#ifndef APPS_BENCH_MEASURE_TRAINING_SPEED_H
#define APPS_BENCH_MEASURE_TRAINING_SPEED_H

#include "timing.h"
#include "hnn/hnn.h"

struct training_speed {
    double step_ms;                    /* loss, gradient and a step of Adam, full batch */
    double share;                      /* of loss and gradient inside OpenBLAS, one thread */
    double products_ms, activation_ms; /* the floor */
    double hand_ms, hand_ratio; /* the step by hand, and ours in its terms; NaN where there is none
                                   (hand_training.h), and on more threads than one */
};

/* Lower quartiles, all measured in this process, on one thread in turn by the processor's clock.
   With more threads than one OpenBLAS uses its own for the floor, and the clock is the wall's.
   Hamiltonian or baseline models of states alone: AD_E_ARGUMENT. */
enum ad_status training_speed_measure(const struct hnn_settings *settings, size_t batch,
                                      size_t threads, size_t rounds, struct training_speed *speed,
                                      struct ad_error *error);

#endif
