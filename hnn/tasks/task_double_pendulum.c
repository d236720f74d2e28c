/* A double pendulum of equal rods and bobs, L = T - V in angles from the vertical and their rates:
   M. Cranmer, S. Greydanus, S. Hoyer, P. Battaglia, D. Spergel, S. Ho, "Lagrangian Neural
   Networks", arXiv 2003.04630. Accelerations are written out, M a = f solved by Cramer's rule. */
#include "task.h"

#include <math.h>
#include <stdlib.h>

/* T = v1^2 + v2^2/2 + v1 v2 cos(q1 - q2), V = -g (2 cos q1 + cos q2) */
static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const double g = *(const double *)context, c = cos(y[0] - y[1]), s = sin(y[0] - y[1]);
    const double f1 = -s * y[3] * y[3] - 2 * g * sin(y[0]), f2 = s * y[2] * y[2] - g * sin(y[1]);
    const double determinant = 2 - c * c;
    (void)t;
    rate[0] = y[2];
    rate[1] = y[3];
    rate[2] = (f1 - c * f2) / determinant;
    rate[3] = (2 * f2 - c * f1) / determinant;
    return error->status;
}

static double energy(void *context, double t, const double *y)
{
    const double g = *(const double *)context;
    (void)t;
    return y[2] * y[2] + 0.5 * y[3] * y[3] + y[2] * y[3] * cos(y[0] - y[1]) -
           g * (2 * cos(y[0]) + cos(y[1]));
}

enum ad_status hnn_task_double_pendulum_ode(double strength, struct phys_ode *ode,
                                            struct ad_error *error)
{
    double *g = malloc(sizeof *g);
    *ode = (struct phys_ode){0};
    if (!g)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *g = strength;
    *ode = (struct phys_ode){.n = 4, .field = field, .energy = energy, .context = g, .free = free};
    return AD_OK;
}

static void draw(struct phys_random *random, double slowest, double fastest, double *y)
{
    for (size_t k = 0; k < 2; k++) {
        y[k] = hnn_between(random, 0, 2 * M_PI);
        y[2 + k] = hnn_between(random, slowest, fastest);
    }
}

static void start(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    draw(random, -s->radius_max, s->radius_max, y);
}

/* Nearly at rest. */
static void published_start(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    (void)s;
    draw(random, 0, 0.1, y);
}

const struct hnn_task hnn_task_double_pendulum = {
    .name = "double-pendulum",
    .what = "L of a double pendulum, angles and rates uniform",
    .dof = 2,
    .coordinates = (const char *const[]){"1", "2"},
    .start = start,
    .published = {.size = sizeof(struct hnn_sampling),
                  .trials = 600000,
                  .points = 1,
                  .time = 10,
                  .radius_max = 10,
                  .strength = 9.8},
    .published_start = published_start,
};
