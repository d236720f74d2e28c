/* Exact solutions for V = m (curvature x^2/2 + gravity x). All follow from two solutions of the
   classical equation, C'' = -curvature C with C(0) = 1, C'(0) = 0 and S with S(0) = 0, S'(0) = 1,
   and their integrals A = int S = (1 - C)/curvature, B = int A = (t - S)/curvature. */
#include "internal.h"

#include <complex.h>
#include <math.h>

struct motion {
    double C, S, A, B;
};

static struct motion motion(double curvature, double t)
{
    double w = sqrt(curvature);
    if (curvature == 0)
        return (struct motion){1, t, t * t / 2, t * t * t / 6};
    double half = sin(w * t / 2);
    return (struct motion){cos(w * t), sin(w * t) / w, 2 * half * half / curvature,
                           (t - sin(w * t) / w) / curvature};
}

/* A classical particle: position, velocity, and the integral of its path. */
struct particle {
    double x, v, integral;
};

static struct particle at(const struct qm_quadratic *scene, const struct motion *m, double x,
                          double v)
{
    double g = scene->gravity, k = scene->curvature;
    return (struct particle){x * m->C + v * m->S - g * m->A, -k * x * m->S + v * m->C - g * m->S,
                             x * m->S + v * m->A - g * m->B};
}

/* From d(x v)/dt = 2 (T - V)/m + gravity x, which gives twice the action. */
static double action(const struct qm_quadratic *scene, double x, double v,
                     const struct particle *end)
{
    return 0.5 * scene->mass * (end->x * end->v - x * v - scene->gravity * end->integral);
}

/* z^(-1/2) where z = C + i k S, k > 0, runs around 0 as exp(i w t) does and never half a turn away
   from it: the branch that is continuous from t = 0 on. */
static qm_complex inverse_root(qm_complex z, double curvature, double t)
{
    double turned = sqrt(curvature) * t;
    double phase = turned + carg(z * cexp(-I * turned));
    return cexp(-0.5 * I * phase) / sqrt(cabs(z));
}

static bool makes_sense(const struct qm_quadratic *scene, double hbar)
{
    return scene && hbar > 0 && scene->mass > 0 && scene->curvature >= 0;
}

void qm_exact_packet(const struct qm_quadratic *scene, double hbar,
                     const struct qm_gaussian *packet, double t, const struct qm_grid *grid,
                     qm_complex *psi)
{
    if (!grid || !psi)
        return;
    if (!makes_sense(scene, hbar) || !packet || !(packet->sigma > 0)) {
        qm_unknown(grid->n, 1, psi);
        return;
    }
    struct motion m = motion(scene->curvature, t);
    double rate = hbar / (2 * scene->mass * packet->sigma * packet->sigma);
    qm_complex z = m.C + I * rate * m.S, slope = -scene->curvature * m.S + I * rate * m.C;
    double v = packet->p / scene->mass;
    struct particle c = at(scene, &m, packet->x, v);
    double phase = action(scene, packet->x, v, &c) / hbar;
    qm_complex height = pow(2 * M_PI * packet->sigma * packet->sigma, -0.25) * cexp(I * phase) *
                        inverse_root(z, scene->curvature, t);
    for (size_t a = 0; a < grid->n; a++) {
        double d = qm_x(grid, a) - c.x;
        psi[a] = height * cexp(I * scene->mass / hbar * (0.5 * slope / z * d * d + c.v * d));
    }
}

qm_complex qm_exact_kernel(const struct qm_quadratic *scene, double hbar, double x_a, double x_b,
                           double t)
{
    if (!makes_sense(scene, hbar) || !(t > 0) || !(sqrt(scene->curvature) * t < M_PI))
        return (double)NAN;
    struct motion m = motion(scene->curvature, t);
    double v = (x_a - x_b * m.C + scene->gravity * m.A) / m.S;
    struct particle end = at(scene, &m, x_b, v);
    double phase = action(scene, x_b, v, &end) / hbar - M_PI / 4;
    return sqrt(scene->mass / (2 * M_PI * hbar * m.S)) * cexp(I * phase);
}

/* Behind a slit the packet's phase is theta x^2 / (4 sigma^2 (1 + theta^2)), theta = hbar t / (2 m
   sigma^2); two of them, `apart`, differ by a phase proportional to x. */
double qm_exact_fringe(double mass, double hbar, double apart, double sigma, double t)
{
    if (!(mass > 0) || !(hbar > 0) || !(apart > 0) || !(sigma > 0) || !(t > 0))
        return NAN;
    double theta = hbar * t / (2 * mass * sigma * sigma);
    return 4 * M_PI * sigma * sigma * (1 + theta * theta) / (theta * apart);
}
