/* T = a^1.5 (2 pi turns + alpha - sin alpha - (beta - sin beta)), sin^2(alpha / 2) = s / 2a,
   sin^2(beta / 2) = (s - c) / 2a, beta of either sign (Lagrange). */
#include "lambert.h"
#include "tests/close.h"

#include <math.h>
#include <stdbool.h>

static double time_of(double alpha, int sign, int turns, double s, double c, double *energy)
{
    const double a = s / 2 / pow(sin(alpha / 2), 2), beta = sign * 2 * asin(sqrt((s - c) / 2 / a));
    *energy = -0.5 / a;
    return pow(a, 1.5) * (2 * M_PI * turns + alpha - sin(alpha) - (beta - sin(beta)));
}

size_t lambert_energies(double s, double c, double time, double *energy)
{
    enum { STEPS = 20000, TURNS = 8 };
    size_t n = 0;
    for (int turns = 0; turns < TURNS; turns++)
        for (int sign = -1; sign <= 1; sign += 2) {
            double before = (double)NAN, E;
            for (int k = 1; k < STEPS; k++) {
                const double T = time_of(2 * M_PI * k / STEPS, sign, turns, s, c, &E);
                if ((T < time) != (before < time) && !isnan(before)) {
                    double low = 2 * M_PI * (k - 1) / STEPS, high = 2 * M_PI * k / STEPS;
                    for (int b = 0; b < 50; b++) {
                        const double middle = (low + high) / 2;
                        const bool same =
                            (time_of(middle, sign, turns, s, c, &E) < time) == (before < time);
                        *(same ? &low : &high) = middle;
                    }
                    assert_true(n < LAMBERT_MOST);
                    energy[n++] = E;
                }
                before = T;
            }
        }
    return n;
}
