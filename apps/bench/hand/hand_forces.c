/* The accelerations of hand.h, compiled once for each instruction set (HAND_ISA). */
#include "hand.h"

#include <math.h>

#define HAND_JOIN(a, b) a##_##b
#define HAND_NAME(isa) HAND_JOIN(hand_forces, isa)

static void kepler(const double *p, const double *q, const double *v, double *a)
{
    const double r2 = q[0] * q[0] + q[1] * q[1], by = -p[0] / (r2 * sqrt(r2));
    (void)v;
    a[0] = by * q[0];
    a[1] = by * q[1];
}

static void figure8(const double *p, const double *q, const double *v, double *a)
{
    static const int pair[3][2] = {{0, 2}, {0, 4}, {2, 4}};
    const double strength = p[0] * p[1];
    (void)v;
    for (int k = 0; k < 6; k++)
        a[k] = 0;
    for (int k = 0; k < 3; k++) {
        const int i = pair[k][0], j = pair[k][1];
        const double x = q[j] - q[i], y = q[j + 1] - q[i + 1], r2 = x * x + y * y;
        const double by = strength / (r2 * sqrt(r2));
        a[i] += by * x;
        a[i + 1] += by * y;
        a[j] -= by * x;
        a[j + 1] -= by * y;
    }
}

/* p: m1, m2, l1, l2, g. */
static void double_pendulum(const double *p, const double *q, const double *v, double *a)
{
    const double sa = sin(q[0]), ca = cos(q[0]), sb = sin(q[1]), cb = cos(q[1]);
    const double cross = p[1] * p[2] * p[3], s = sa * cb - ca * sb, c = cross * (ca * cb + sa * sb);
    const double upper = (p[0] + p[1]) * p[2], lower = p[1] * p[3];
    const double f = -cross * s * v[1] * v[1] - upper * p[4] * sa;
    const double g = cross * s * v[0] * v[0] - lower * p[4] * sb;
    const double over = 1 / (upper * p[2] * lower * p[3] - c * c);
    a[0] = (lower * p[3] * f - c * g) * over;
    a[1] = (upper * p[2] * g - c * f) * over;
}

extern const struct hand_force HAND_NAME(HAND_ISA)[HAND_FORCES];
const struct hand_force HAND_NAME(HAND_ISA)[HAND_FORCES] = {
    {"kepler", 2, {"gm"}, kepler},
    {"figure8", 6, {"m", "G"}, figure8},
    {"dblpend", 2, {"m1", "m2", "l1", "l2", "g"}, double_pendulum},
};
