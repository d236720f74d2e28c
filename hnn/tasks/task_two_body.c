/* Two bodies about their centre of mass: H = (p1^2 + p2^2)/2 - k/r. */
#include "task.h"

#include <math.h>

/* Opposite each other, at distances r from the centre; on a circle v^2 / r = k / (2 r)^2. */
static void start(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    double qx = hnn_between(random, s->radius_min, s->radius_max);
    double qy = hnn_between(random, s->radius_min, s->radius_max);
    double r = hypot(qx, qy), speed = sqrt(s->strength / r) / 2;
    speed *= 1 + s->spread * phys_random_normal(random);
    double state[4] = {qx, qy, -speed * qy / r, speed * qx / r};
    for (int k = 0; k < 4; k++) {
        y[2 * k] = state[k];
        y[2 * k + 1] = -state[k];
    }
}

const struct hnn_task hnn_task_two_body = {
    .name = "twobody",
    .what = "two bodies that attract each other, on nearly circular orbits",
    .dof = 4,
    .coordinates = (const char *const[]){"1x", "2x", "1y", "2y"},
    .H = hnn_task_gravity,
    .start = start,
    .published = {.size = sizeof(struct hnn_sampling),
                  .trials = 1000,
                  .points = 50,
                  .time = 20,
                  .radius_min = 0.5,
                  .radius_max = 1.5,
                  .spread = 0.05,
                  .strength = 1},
};
