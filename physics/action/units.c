/* Units of coordinates (units.h). */
#include "units.h"

#include <math.h>

bool phys_may_differ_in_unit(const struct phys_system *system)
{
    return system->dof >= 2 && system->dof <= PHYS_UNITS_MOST &&
           (system->dims <= 1 || system->bodies <= 1);
}

void phys_units(size_t dof, const double *mass, const double *x, double *unit)
{
    double most = 0, common = 0;
    bool known = true;
    for (size_t k = 0; k < dof; k++) {
        unit[k] = 1;
        known = known && mass[k] > 0 && isfinite(mass[k]);
        most = fmax(most, sqrt(mass[k]) * fabs(x[k]));
        common = fmax(common, fabs(x[k]));
    }
    for (size_t k = 0; known && most > 0 && k < dof; k++) {
        double share = most / sqrt(mass[k]) / common;
        unit[k] = share < PHYS_ANOTHER_UNIT ? share : 1;
    }
}
