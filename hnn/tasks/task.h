/* The systems with which Hamiltonian and Lagrangian neural networks were published, as models of
   data (data.h): one file each, one line each in the table of task.c. Other folders find them by
   hnn_task_find. */
#ifndef HNN_TASKS_TASK_H
#define HNN_TASKS_TASK_H

#include "hnn/data/data.h"
#include "hnn/model/internal.h"

extern const struct hnn_task hnn_task_spring, hnn_task_pendulum, hnn_task_two_body,
    hnn_task_three_body, hnn_task_double_pendulum, hnn_task_wave, hnn_task_string;

enum { HNN_TASK_STATES_MOST = 64 };

/* Uniform in [a, b). */
static inline double hnn_between(struct phys_random *random, double a, double b)
{
    return a + (b - a) * phys_random_uniform(random);
}

/* A point at a radius of the sampling, in the direction of one drawn from a square. */
void hnn_task_on_circle(struct phys_random *random, const struct hnn_sampling *sampling,
                        double point[2]);

/* q and p between 0.2 and 1, of either sign. */
void hnn_task_off_axes(struct phys_random *random, const struct hnn_sampling *sampling,
                       double point[2]);

/* Strength of the potential; 0: as published. */
double hnn_task_strength(const struct hnn_task *task, double strength);
/* That task's, which has no H. */
enum ad_status hnn_task_double_pendulum_ode(double strength, struct phys_ode *ode,
                                            struct ad_error *error);
/* Kinetic and potential energy of equal masses 1 in the plane, q and p all x before all y. */
ad_var hnn_task_gravity(ad_var q, ad_var p, ad_var t, const void *strength);

#endif
