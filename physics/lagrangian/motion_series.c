/* Taylor coefficients of the motion of a Lagrangian, from the series of its right side: where
   q, v and a are series in s = t' - t, (k+1) q_(k+1) = v_k, (k+1) v_(k+1) = a_k, and order by order
       M_0 a_k = f_k - sum_j M_j a_(k-j),   j = 1 ... k,
   with M_0 factored once (Jorba and Zou, Experimental Mathematics 14 (2005) 99). */
#include "internal.h"
#include "mass.h"
#include "physics/linear/linear.h"

#include "autodiff/series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Beyond, masses that vary are too many series. */
enum { COORDINATES_MOST = 64 };

struct phys_motion_series {
    phys_motion *motion;
    size_t dof, order;
    bool constant_mass;
    ad_series *force; /* of the force, and where it varies of the mass matrix */
    double *a;        /* [order + 1][dof] */
    double *factor;   /* [dof x dof] M_0 = P L U; then [dof] largest entries of its columns */
    int *pivots;
};

enum { Q, V, W, T, INPUTS };
enum { FORCE, MASS };

static enum ad_status too_much(const struct phys_motion_series *s, const char *why,
                               struct ad_error *error)
{
    return ad_fail(error, AD_E_ARGUMENT, "taylor: %s: %s; take dop853",
                   phys_motion_system(s->motion)->scene->name, why);
}

static enum ad_status record(struct phys_motion_series *s, struct ad_error *error)
{
    ad_var x[INPUTS], y[2];
    s->constant_mass = phys_motion_recorded(s->motion, x, y);
    if (!s->constant_mass && s->dof > COORDINATES_MOST)
        return too_much(s, "masses that vary of more than 64 coordinates", error);
    if (ad_series_new(s->constant_mass ? 1 : 2, y, INPUTS, x, s->order, &s->force) != AD_OK) {
        phys_tape_status(x[Q].tape, error);
        return ad_fail(error, AD_E_ARGUMENT, "taylor: no series of the forces; take dop853");
    }
    if (ad_series_branches(s->force))
        return too_much(s, "L has kinks (abs, min, max, relu, a root of a square, or a comparison)",
                        error);
    return AD_OK;
}

enum ad_status phys_motion_series_new(phys_motion *motion, size_t order,
                                      struct phys_motion_series **series, struct ad_error *error)
{
    const size_t n = phys_motion_system(motion)->dof;
    struct phys_motion_series *s = *series = calloc(1, sizeof *s);
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *s = (struct phys_motion_series){.motion = motion, .dof = n, .order = order};
    if (record(s, error) == AD_OK) {
        s->a = calloc((order + 1) * n, sizeof *s->a);
        s->factor = calloc(s->constant_mass ? 1 : (n + 1) * n, sizeof *s->factor);
        s->pivots = calloc(n, sizeof *s->pivots);
        if (!s->a || !s->factor || !s->pivots)
            ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    if (error->status != AD_OK) {
        phys_motion_series_free(s);
        *series = NULL;
    }
    return error->status;
}

void phys_motion_series_free(struct phys_motion_series *series)
{
    if (!series)
        return;
    ad_series_free(series->force);
    free(series->a);
    free(series->factor);
    free(series->pivots);
    free(series);
}

static bool factor_mass(struct phys_motion_series *s)
{
    const size_t n = s->dof;
    size_t worst;
    for (size_t i = 0; i < n * n; i++)
        s->factor[i] = ad_series_output(s->force, MASS, i)[0];
    phys_mass_columns(n, s->factor, s->factor + n * n);
    phys_lapack_lu_factor(n, s->factor, s->pivots);
    return phys_mass_condition(n, s->factor + n * n, s->factor, n + 1, &worst) <=
           PHYS_MASS_SINGULAR;
}

/* a_k. */
static void accelerate(struct phys_motion_series *s, size_t k)
{
    const size_t n = s->dof;
    double *a = s->a + k * n;
    for (size_t i = 0; i < n; i++)
        a[i] = ad_series_output(s->force, FORCE, i)[k];
    if (s->constant_mass) {
        phys_motion_solve_constant(s->motion, a);
        return;
    }
    for (size_t i = 0; i < n; i++)
        for (size_t m = 0; m < n; m++) {
            const double *M = ad_series_output(s->force, MASS, i * n + m);
            for (size_t j = 1; j <= k && !ad_series_is_number(s->force, MASS, i * n + m); j++)
                a[i] -= M[j] * s->a[(k - j) * n + m];
        }
    phys_lapack_lu_solve(n, s->factor, s->pivots, a);
}

static void set(struct phys_motion_series *s, size_t k, double t, const double *c)
{
    for (size_t i = 0; i < s->dof; i++) {
        ad_series_input(s->force, Q, i)[k] = c[i];
        ad_series_input(s->force, V, i)[k] = c[s->dof + i];
        ad_series_input(s->force, W, i)[k] = c[s->dof + i];
    }
    ad_series_input(s->force, T, 0)[k] = k == 0 ? t : k == 1 ? 1 : 0;
}

/* Says why; the field at the point knows better. */
static enum ad_status refuse(const struct phys_motion_series *s, double t, const double *c,
                             struct ad_error *error)
{
    phys_motion_acceleration(s->motion, c, c + s->dof, t, s->a, error);
    return ad_fail(error, AD_E_NONFINITE, "%s: a Taylor coefficient is not finite at t = %g",
                   phys_motion_system(s->motion)->scene->name, t);
}

enum ad_status phys_motion_series(struct phys_motion_series *series, size_t order, double t,
                                  double *c, struct ad_error *error)
{
    struct phys_motion_series *s = series;
    const size_t n = s->dof;
    bool good = true;
    for (size_t k = 0; k < order && good; k++) {
        const double *now = c + k * 2 * n;
        double *next = c + (k + 1) * 2 * n;
        set(s, k, t, now);
        ad_series_advance(s->force, k);
        good = k > 0 || s->constant_mass || factor_mass(s);
        accelerate(s, k);
        for (size_t i = 0; i < n; i++) {
            next[i] = now[n + i] / (double)(k + 1);
            next[n + i] = s->a[k * n + i] / (double)(k + 1);
            good = good && isfinite(next[n + i]);
        }
    }
    return good ? AD_OK : refuse(s, t, c, error);
}
