/* Three bodies on a triangle: H = (p1^2 + p2^2 + p3^2)/2 - k (1/r12 + 1/r13 + 1/r23). */
#include "task.h"

#include <math.h>

/* The corners of an equilateral triangle turn about its centre on a circle of radius r with
   v^2 = k / (sqrt(3) r); then every component of every speed is changed a little. */
static void start(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    double corner[2], third = 2 * acos(-1.0) / 3;
    hnn_task_on_circle(random, s, corner);
    double r = hypot(corner[0], corner[1]), angle = atan2(corner[1], corner[0]);
    double speed = sqrt(s->strength / (sqrt(3.0) * r));
    for (int body = 0; body < 3; body++, angle += third) {
        y[body] = r * cos(angle);
        y[3 + body] = r * sin(angle);
        y[6 + body] = -speed * sin(angle) * (1 + hnn_between(random, -s->spread, s->spread));
        y[9 + body] = speed * cos(angle) * (1 + hnn_between(random, -s->spread, s->spread));
    }
}

const struct hnn_task hnn_task_three_body = {
    .name = "threebody",
    .what = "three bodies that attract each other, about a turning triangle",
    .dof = 6,
    .coordinates = (const char *const[]){"1x", "2x", "3x", "1y", "2y", "3y"},
    .H = hnn_task_gravity,
    .start = start,
    .published = {.size = sizeof(struct hnn_sampling),
                  .trials = 5000,
                  .points = 20,
                  .time = 5,
                  .radius_min = 0.9,
                  .radius_max = 1.2,
                  .spread = 0.2,
                  .strength = 1},
};
