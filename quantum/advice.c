/* Suitable box, dt and grid for a run, before it starts (run.h). */
#include "run.h"

#include <math.h>

/* The potential and the mass at x. */
static double potential(const struct phys_system *system, double x, double *mass,
                        struct ad_error *error)
{
    double V = 0;
    qm_potential(system, &(struct qm_grid){x - 0.5, x + 0.5, 1}, &V, mass, error);
    return V;
}

void qm_box(const struct phys_system *system, double hbar, const struct qm_gaussian *p, double *low,
            double *high)
{
    enum { MOST = 40 };
    if (!low || !high)
        return;
    *low = *high = NAN;
    if (!system || !p)
        return;
    struct ad_error none = {0};
    double mass = 1, speed = fabs(p->p) + hbar / p->sigma, energy = -INFINITY;
    for (int side = -1; side <= 1; side++) {
        double V = potential(system, p->x + 2 * side * p->sigma, &mass, &none);
        energy = fmax(energy, V + speed * speed / (2 * mass));
    }
    for (int side = 0; side < 2; side++) {
        double step = side ? p->sigma : -p->sigma, *wall = side ? high : low, V = -INFINITY;
        *wall = p->x + 4 * step;
        for (int k = 0; k < MOST && !(V > energy) && none.status == AD_OK; k++) {
            *wall += step;
            V = potential(system, *wall, &mass, &none);
        }
        *wall += 2 * step;
    }
}

double qm_inside(const struct qm_slice *slice, const struct qm_gaussian *p)
{
    if (!slice || !p)
        return NAN;
    double low = slice->grid.low - p->x, high = slice->grid.high - p->x;
    if (slice->walls == QM_RING && slice->absorb == 0) {
        high = 0.5 * (high - low);
        low = -high;
    }
    double unit = p->sigma * M_SQRT2;
    return 0.5 * (erf(high / unit) - erf(low / unit));
}

/* Up or down to four digits. */
static double rounded(double x, double (*way)(double))
{
    if (!isfinite(x))
        return x;
    double unit = pow(10, floor(log10(x)) - 3);
    return way(x / unit) * unit;
}

struct qm_advice qm_aliasing_advice(const struct qm_slice *slice, const struct qm_aliasing *a)
{
    if (!slice || !a)
        return (struct qm_advice){NAN, NAN, NAN};
    return (struct qm_advice){
        .dt = isnan(a->dt_least) ? a->dt_least : rounded(a->dt_least, ceil),
        .points = rounded((double)slice->grid.n * qm_dx(&slice->grid) / a->dx_most, ceil),
        .box = rounded(a->box_most, floor)};
}
