/* The energy of a rod (pixel_energy.h) from states and from angles. */
#include "pixel_energy.h"

#include <math.h>

/* E with the speed at the time of the angle. */
static double shadow_energy(const struct hnn_rod *rod, double angle, double speed)
{
    const double inertia = rod->mass * rod->length * rod->length / 3;
    const double weight = rod->mass * rod->gravity * rod->length / 2;
    const double w2 = speed * speed, force = weight * sin(angle);
    return inertia * w2 / 2 + weight * (1 - cos(angle)) +
           rod->dt * rod->dt * (w2 * weight * cos(angle) / 12 - force * force / (24 * inertia));
}

double hnn_rod_energy(const struct hnn_rod *rod, double angle, double speed)
{
    if (!rod)
        return NAN;
    double next = angle, speed_after = speed;
    hnn_rod_step(rod, &next, &speed_after);
    return shadow_energy(rod, angle, (speed + speed_after) / 2);
}

void hnn_rod_energies(const struct hnn_rod *rod, size_t n, const double *angle, double *energy)
{
    if (!rod || !angle || !energy)
        return;
    const double turn = 2 * acos(-1);
    for (size_t k = 1; k + 1 < n; k++) {
        double moved =
            remainder(angle[k + 1] - angle[k], turn) + remainder(angle[k] - angle[k - 1], turn);
        energy[k - 1] = shadow_energy(rod, angle[k], moved / (2 * rod->dt));
    }
}
