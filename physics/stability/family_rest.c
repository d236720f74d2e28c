/* Where a family shrinks to a point at rest: the point by Newton's method on the forces, the period
   and the parameter there by extrapolation in the energy (family_parts.h). */
#include "family_parts.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { REST_STEPS = 12 };

/* Half a period after p, in y. */
static enum ad_status find_opposite(struct family_run *run, const struct family_point *p,
                                    struct ad_error *error)
{
    const struct phys_orbit orbit = {run->d, run->unit, FAMILY_FINE, run->settings->proceed,
                                     run->settings->context};
    return phys_orbit_follow(&orbit, &run->ode, "taylor", p->u, 0, 0.5 * p->u[run->columns - 1],
                             run->y, error);
}

bool phys_family_is_small(struct family_run *run, const struct family_point *p,
                          struct ad_error *error)
{
    const double period = p->u[run->columns - 1];
    double across = 0, rates = 0;
    if (find_opposite(run, p, error) != AD_OK)
        return false;
    for (size_t i = 0; i < run->d; i++) {
        across += pow((run->y[i] - p->u[i]) / run->unit[i], 2);
        rates += pow(p->rate[i] * period / run->unit[i], 2);
    }
    return across <= rates;
}

/* Newton's method to the point at rest amid a small motion p: x [d]. */
static enum ad_status find_rest(struct family_run *run, const struct family_point *p, double *x,
                                struct ad_error *error)
{
    const size_t dof = run->d / 2;
    double *rate = run->slope, *a = run->step, *J = run->J, off = INFINITY;
    if (find_opposite(run, p, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i < run->d; i++)
        x[i] = i < dof ? 0.5 * (p->u[i] + run->y[i]) : 0;
    memset(run->y, 0, run->ode.n * sizeof *run->y);
    for (size_t k = 0; k < REST_STEPS && off > 4 * DBL_EPSILON; k++) {
        for (size_t j = 0; j <= dof; j++) /* J by rows; the force itself last */
            for (int sign = 1; sign >= -1; sign -= 2) {
                const double h = j < dof ? 1e-5 * run->unit[j] : 1;
                memcpy(run->y, x, run->d * sizeof *x);
                run->y[j] += j < dof ? sign * h : 0;
                if (run->ode.field(run->ode.context, 0, run->y, rate, error) != AD_OK)
                    return error->status;
                for (size_t i = 0; i < dof && j < dof; i++)
                    J[i * dof + j] =
                        (sign > 0 ? 0 : J[i * dof + j]) + sign * rate[dof + i] / (2 * h);
            }
        memcpy(a, rate + dof, dof * sizeof *a);
        if (phys_lapack_lu_solve_once(dof, J, a) != 0)
            break;
        off = 0;
        for (size_t i = 0; i < dof; i++) {
            x[i] -= a[i];
            off = fmax(off, fabs(a[i]) / run->unit[i]);
        }
    }
    return off < 1e-9
               ? AD_OK
               : ad_fail(error, AD_E_ACCURACY, "the motion shrinks, but to no point at rest");
}

/* f, linear in e, at e0, by the last two of three; and by how much it is not linear. */
static double extrapolate(const double e[3], const double f[3], double e0, double *doubt)
{
    double at[2];
    for (size_t k = 0; k < 2; k++)
        at[k] = f[k + 1] + (f[k + 1] - f[k]) * (e0 - e[k + 1]) / (e[k + 1] - e[k]);
    *doubt = fabs(at[1] - at[0]);
    return at[1];
}

enum ad_status phys_family_rest(struct family_run *run, struct family_point *p,
                                struct ad_error *error)
{
    const struct phys_family *family = run->family;
    const size_t T = run->columns - 1;
    double e[3], f[3], periods[3], doubt = 0, period_doubt;
    if (family->n < 3)
        return ad_fail(error, AD_E_ACCURACY, "the motion shrinks to a point at rest");
    if (find_rest(run, p, p->u, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < 3; k++) {
        const struct phys_family_member *m = &family->member[family->n - 3 + k];
        e[k] = m->energy;
        f[k] = m->value;
        periods[k] = m->motion.period;
    }
    const double e0 = phys_family_energy(run, p->u);
    p->u[T] = extrapolate(e, periods, e0, &period_doubt);
    if (run->along == ALONG_PARAMETER)
        p->u[run->d] = extrapolate(e, f, e0, &doubt);
    doubt = (run->along == ALONG_PERIOD ? period_doubt : doubt) + 8 * DBL_EPSILON * run->power;
    if (phys_family_add(run, p, PHYS_MARK_REST, doubt, error) == AD_OK)
        run->family->member[run->family->n - 1].motion.uncertainty =
            period_doubt + 8 * DBL_EPSILON * p->u[T];
    return error->status;
}
