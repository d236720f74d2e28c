/* The position of a planet from mean Kepler elements (ephemeris.h). */
#include "ephemeris.h"

#include <math.h>

static const double au = 149597870700.0, degree = M_PI / 180;

static double at(struct ephemeris_element element, double T)
{
    return element.value + element.rate * T;
}

/* E - e sin E = M by Newton's method, which converges from M for the small e of planets. */
static double eccentric_anomaly(double M, double e)
{
    double E = M, step = 1;
    for (int k = 0; k < 20 && fabs(step) > 1e-15; k++) {
        step = (E - e * sin(E) - M) / (1 - e * cos(E));
        E -= step;
    }
    return E;
}

/* From the orbit's plane, x to the perihelion, to the ecliptic. */
static void turn(double x, double y, double node, double argument, double inclination,
                 double out[3])
{
    double u = x * cos(argument) - y * sin(argument), v = x * sin(argument) + y * cos(argument);
    out[0] = u * cos(node) - v * sin(node) * cos(inclination);
    out[1] = u * sin(node) + v * cos(node) * cos(inclination);
    out[2] = v * sin(inclination);
}

void phys_ephemeris_kepler(const void *orbit, double gm, double T, double position[3],
                           double velocity[3])
{
    const struct ephemeris_orbit *o = orbit;
    double a = at(o->a, T) * au, e = at(o->e, T), b = a * sqrt(1 - e * e);
    double node = at(o->node, T) * degree, perihelion = at(o->w, T) * degree;
    double inclination = at(o->inclination, T) * degree;
    double E = eccentric_anomaly(remainder(at(o->L, T) * degree - perihelion, 2 * M_PI), e);
    double rate = sqrt(gm / (a * a * a)) / (1 - e * cos(E)); /* of E */
    turn(a * (cos(E) - e), b * sin(E), node, perihelion - node, inclination, position);
    turn(-a * sin(E) * rate, b * cos(E) * rate, node, perihelion - node, inclination, velocity);
}
