/* Motions with exact solutions (motions.h), in long double, so that their own rounding is
 * negligible.
 */
#include "motions.h"

#include <math.h>

#define PI 3.141592653589793238462643383279502884L

/* Kepler's equation E - e sin E = t by Newton's method; beginning at pi it converges for all e < 1
   (the function is convex beyond, and its slope at least 1 - e). */
static long double eccentric_anomaly(long double e, long double t)
{
    long double M = fmodl(t, 2 * PI), E = PI;
    for (int step = 0; step < 100; step++) {
        long double change = (E - e * sinl(E) - M) / (1 - e * cosl(E));
        E -= change;
        if (fabsl(change) < 1e-18L)
            break;
    }
    return E;
}

void exact_kepler(double e_, double t, double *q, double *v)
{
    long double e = e_, E = eccentric_anomaly(e, t), b = sqrtl(1 - e * e);
    long double rate = 1 / (1 - e * cosl(E));
    q[0] = (double)(cosl(E) - e);
    q[1] = (double)(b * sinl(E));
    v[0] = (double)(-rate * sinl(E));
    v[1] = (double)(rate * b * cosl(E));
}

/* Jacobi's amplitude am(u, k) by the arithmetic-geometric mean (Abramowitz, Stegun, 16.4). */
static long double amplitude(long double u, long double k)
{
    enum { MOST = 12 };
    long double a[MOST] = {1}, c[MOST] = {k}, b = sqrtl(1 - k * k);
    int n = 0;
    for (; n + 1 < MOST && fabsl(c[n]) > 1e-19L; n++) {
        a[n + 1] = (a[n] + b) / 2;
        c[n + 1] = (a[n] - b) / 2;
        b = sqrtl(a[n] * b);
    }
    long double phi = ldexpl(a[n] * u, n);
    for (; n > 0; n--)
        phi = (phi + asinl(c[n] / a[n] * sinl(phi))) / 2;
    return phi;
}

void exact_pendulum(double k_, double t, double *q, double *v)
{
    long double k = k_, phi = amplitude(t, k);
    q[0] = (double)(2 * asinl(k * sinl(phi)));
    v[0] = (double)(2 * k * cosl(phi));
}
