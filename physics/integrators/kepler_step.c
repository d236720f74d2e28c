/* The motion of two bodies by Stumpff's functions (Danby, Fundamentals of Celestial Mechanics,
   section 6.9) and Laguerre's iteration (Conway, Celestial Mechanics 39 (1986) 199). */
#include "kepler_step.h"
#include "physics/linear/vectors.h"
#include "stepper.h"

/* G_k = X^k c_k(beta X^2), by quarters of the argument; the series of c_2 and c_3 in pairs of
   terms, which need not wait for each other. */
static void stumpff(double beta, double X, double G[4])
{
    const double small = 0.1;
    size_t quarters = 0;
    double z = beta * X * X;
    for (; fabs(z) > small && quarters < 512; quarters++)
        z *= 0.25;
    const double z2 = z * z;
    double c2 = (1.0 / 2 - z * (1.0 / 24)) + z2 * ((1.0 / 720 - z * (1.0 / 40320)) +
                                                   z2 * (1.0 / 3628800 - z * (1.0 / 479001600)));
    double c3 = (1.0 / 6 - z * (1.0 / 120)) + z2 * ((1.0 / 5040 - z * (1.0 / 362880)) +
                                                    z2 * (1.0 / 39916800 - z * (1.0 / 6227020800)));
    for (; quarters > 0; quarters--) {
        double c0 = 1 - z * c2, c1 = 1 - z * c3;
        c3 = 0.25 * (c2 + c0 * c3);
        c2 = 0.5 * c1 * c1;
        z *= 4;
    }
    G[0] = 1 - z * c2;
    G[1] = X * (1 - z * c3);
    G[2] = X * X * c2;
    G[3] = X * X * X * c3;
}

/* The same at X + d, for a small d. */
static void shift(double beta, double d, double G[4])
{
    const double half = d * (1.0 / 2), third = d * (1.0 / 3), quarter = d * (1.0 / 4), G0 = G[0],
                 G1 = G[1], turn = G0 - quarter * beta * G1;
    G[3] += d * (G[2] + half * (G1 + third * turn));
    G[2] += d * (G1 + half * (G0 - third * beta * (G1 + quarter * G0)));
    G[1] += d * (G0 - half * beta * (G1 + third * turn));
    G[0] = 1 - beta * G[2];
}

/* At the universal anomaly X after a time h, which grows with it: the root of r0 X + eta G_2 + zeta
   G_3 = h, between 0 and infinity at first. */
static void find_anomaly(double h, double r0, double eta, double beta, double zeta, double G[4])
{
    enum { MOST = 200 };
    const double close = 1e-3; /* the iteration is of third order: one more of the second is left */
    const double in_r0 = 1 / r0, s = h * in_r0, a = 0.5 * eta * in_r0 * s;
    double X = s * (1 - a + (2 * a * a - zeta * in_r0 * s * s * (1.0 / 6))), low = 0,
           high = copysign(INFINITY, h);
    if (!(X * h > 0))
        X = s;
    for (size_t i = 0; i < MOST; i++) {
        stumpff(beta, X, G);
        const double F = r0 * X + eta * G[2] + zeta * G[3] - h, r = r0 + eta * G[1] + zeta * G[2],
                     slope = eta * G[0] + zeta * G[1];
        double d = -5 * F / (r + sqrt(fabs(16 * r * r - 20 * F * slope)));
        if (fabs(d) <= close * fabs(X)) {
            shift(beta, d, G);
            d = (h - r0 * (X + d) - eta * G[2] - zeta * G[3]) / (r0 + eta * G[1] + zeta * G[2]);
            G[3] += d * G[2];
            G[2] += d * G[1];
            G[1] += d * G[0];
            return;
        }
        if (F * h <= 0)
            low = X;
        else
            high = X;
        double next = X + d;
        if (!((next - low) * h > 0 && (high - next) * h > 0))
            next = isinf(high) ? 2 * X : 0.5 * (low + high);
        X = next;
    }
}

static void add(double *x, double *cut, double increment)
{
    phys_add_with_cut(*x, increment, *cut, x, cut);
}

void phys_kepler_step(size_t dims, double mu, double h, double *q, double *v, double *cut_q,
                      double *cut_v)
{
    double G[4];
    const double r0 = phys_norm(dims, q), eta = phys_dot(dims, q, v),
                 beta = 2 * mu / r0 - phys_dot(dims, v, v), zeta = mu - beta * r0;
    if (beta > 0 && h * h * beta * beta * beta > M_PI * M_PI * mu * mu) /* half a period */
        h = remainder(h, 2 * M_PI * mu / (beta * sqrt(beta)));
    if (h == 0)
        return;
    find_anomaly(h, r0, eta, beta, zeta, G);
    const double in_r0 = mu / r0, in_r = 1 / (r0 + eta * G[1] + zeta * G[2]), f = -in_r0 * G[2],
                 g = h - mu * G[3], df = -in_r0 * G[1] * in_r, dg = -mu * G[2] * in_r;
    for (size_t d = 0; d < dims; d++) {
        const double x = q[d], u = v[d];
        add(&q[d], &cut_q[d], f * x + g * u);
        add(&v[d], &cut_v[d], df * x + dg * u);
    }
}
