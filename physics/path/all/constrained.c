/* Starts of a search for all paths with constraints: velocities along them (multistart.h). */
#include "multistart.h"
#include "physics/lagrangian/constraints.h"
#include "physics/linear/vectors.h"
#include "physics/ode/internal.h"

#include <math.h>
#include <string.h>

/* v at q and t, less what changes the constraints. */
static bool turn(struct phys_multistart *s, const double *q, double t, double *v)
{
    phys_motion *motion = phys_ode_constrained_motion(&s->motion);
    struct ad_error lost = {0};
    if (motion && phys_motion_constrain(motion, q, v, t, &lost) == AD_OK)
        phys_constraints_turn(phys_motion_constraints(motion), v);
    return lost.status == AD_OK;
}

bool phys_multistart_turn(struct phys_multistart *s, double *v) { return turn(s, s->q, 0, v); }

bool phys_multistart_directions(struct phys_multistart *s)
{
    const size_t dof = s->dof;
    double *q = s->y, *v = s->y + dof, *drift = s->v;
    for (size_t end = 0; end < 2; end++) {
        const double t = end ? s->settings.dt * (double)(s->slices - 1) : 0;
        double most = 0;
        for (size_t k = 0; k < dof; k++)
            q[k] = s->given[k * s->slices + end * (s->slices - 1)];
        memset(drift, 0, dof * sizeof *drift);
        if (!turn(s, q, t, drift))
            return false;
        for (size_t k = 0; k < dof; k++) { /* all leave the same direction */
            memset(v, 0, dof * sizeof *v);
            v[k] = 1;
            turn(s, q, t, v);
            for (size_t d = 0; d < dof; d++)
                v[d] -= drift[d];
            const double length = phys_norm(dof, v);
            for (size_t d = 0; d < dof && length > most; d++)
                s->along[end * dof + d] = v[d] / length;
            most = fmax(most, length);
        }
    }
    return true;
}

bool phys_multistart_velocity(struct phys_multistart *s, double x)
{
    for (size_t d = 0; d < s->dof; d++)
        s->v[d] = x * s->along[d];
    return phys_multistart_turn(s, s->v);
}
