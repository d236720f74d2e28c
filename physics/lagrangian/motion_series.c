/* Taylor coefficients of the motion of a Lagrangian, from the series of its right side: where
   q, v and a are series in s = t' - t, (k+1) q_(k+1) = v_k, (k+1) v_(k+1) = a_k (Jorba and Zou,
   Experimental Mathematics 14 (2005) 99). The accelerations are recorded: with a constant inverse
   of the mass matrix M, or, of few coordinates, with the elimination M = L D L^T. Otherwise, or
   where D has both signs and would want other pivots, order by order
       M_0 a_k = f_k - sum_j M_j a_(k-j),   j = 1 ... k,
   with M_0 factored once. Variations (dq, dv) of the motion are further states of the recording. */
#include "autodiff/free.h"
#include "internal.h"
#include "mass.h"
#include "physics/linear/linear.h"

#include "autodiff/derivatives.h"
#include "autodiff/series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Beyond, masses that vary are too many series. */
enum { COORDINATES_MOST = PHYS_MASS_FEW };

struct phys_motion_series {
    phys_motion *motion;
    size_t dof, order, columns; /* variations, with those by parameters */
    size_t n_params;
    bool constant_mass;
    ad_series *flow;  /* of q, v, variations and t, if accelerations are recorded */
    double *time;     /* that t */
    ad_series *force; /* of the force and the mass matrix, where needed */
    double *a;        /* [order + 1][dof] */
    double
        *factor; /* [dof x dof] M_0 = P L U; then [dof] largest entries of its columns, [dof] D */
    int *pivots;
};

enum { Q, V, T, INPUTS };
enum { FORCE, MASS };

/* The flow: its inputs are q, v, the variations dq and dv in turn, t, and the parameters; its
   outputs their rates, then M and D. */
static size_t flow_inputs(const struct phys_motion_series *s)
{
    return INPUTS + 2 * s->columns + s->n_params;
}
static size_t flow_time(const struct phys_motion_series *s) { return T + 2 * s->columns; }

static enum ad_status too_much(const struct phys_motion_series *s, const char *why,
                               struct ad_error *error)
{
    return ad_fail(error, AD_E_ARGUMENT, "taylor: %s: %s; take dop853",
                   phys_motion_system(s->motion)->scene->name, why);
}

static enum ad_status series_of(const struct phys_motion_series *s, size_t n_y, const ad_var y[],
                                size_t n_x, const ad_var x[], ad_series **series,
                                struct ad_error *error)
{
    if (ad_series_new(n_y, y, n_x, x, s->order, series) != AD_OK) {
        phys_tape_status(x[Q].tape, error);
        return ad_fail(error, AD_E_ARGUMENT, "taylor: no series of the forces; take dop853");
    }
    if (ad_series_branches(*series) && s->columns > 0) /* no other method has them */
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: forces have kinks (abs, min, max, relu, a root of a square, or a "
                       "comparison), where variations of the motion jump; expected smooth ones, "
                       "such as tanh(x/small) for sign(x)",
                       phys_motion_system(s->motion)->scene->name);
    if (ad_series_branches(*series))
        return too_much(s, "L has kinks (abs, min, max, relu, a root of a square, or a comparison)",
                        error);
    return AD_OK;
}

static enum ad_status record_flow(struct phys_motion_series *s, const ad_var x[], const ad_var y[],
                                  struct ad_error *error)
{
    const size_t n = flow_inputs(s);
    ad_var *in = malloc((2 * n + 2) * sizeof *in);
    if (!in)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_var *rate = in + n, *params = in + flow_time(s) + 1, D,
           a = phys_record_solution(s->motion, s->dof, s->constant_mass, y[MASS], y[FORCE], &D);
    const ad_var one = ad_scalar(x[T].tape, 1);
    double value;
    memcpy(in, x, 2 * sizeof *in);
    in[flow_time(s)] = x[T];
    rate[flow_time(s)] = ad_add(ad_mul(x[T], 0.0), 1.0);
    for (size_t k = 0; k < s->n_params; k++) {
        params[k] = phys_motion_parameter(s->motion, k, &value);
        rate[flow_time(s) + 1 + k] = ad_mul(params[k], 0.0);
    }
    rate[Q] = x[V];
    rate[V] = a;
    for (size_t k = 1; k <= s->columns; k++) {
        ad_var *d = in + 2 * k, *rate_of_d = rate + 2 * k;
        d[Q] = ad_input(x[Q].tape, s->dof, 1, "dq");
        d[V] = ad_input(x[Q].tape, s->dof, 1, "dv");
        rate_of_d[Q] = d[V];
        const bool by_start = k + s->n_params <= s->columns;
        const size_t param = by_start ? 0 : k + s->n_params - s->columns - 1;
        ad_jvp(a, by_start ? 2 : 3, (ad_var[]){x[Q], x[V], by_start ? x[V] : params[param]},
               (ad_var[]){d[Q], d[V], one}, &rate_of_d[V]);
    }
    rate[n] = y[MASS];
    rate[n + 1] = D;
    series_of(s, s->constant_mass ? n : n + 2, rate, n, in, &s->flow, error);
    s->time = ad_series_input(s->flow, flow_time(s), 0);
    free(in);
    return error->status;
}

/* Entry (i, j) of M of a series. */
static double mass_entry(const struct phys_motion_series *s, ad_series *series, size_t mass,
                         size_t i, size_t j)
{
    const size_t place = phys_motion_mass_place(s->motion, i, j);
    return place == SIZE_MAX ? 0 : ad_series_output(series, mass, place)[0];
}

/* Whether M_0 was eliminated without harm: its pivots have one sign and are not too small. */
static bool is_definite(struct phys_motion_series *s)
{
    const size_t n = s->dof;
    double *column = s->factor + n * n, *d = column + n;
    size_t worst, positive = 0;
    if (s->constant_mass)
        return !phys_motion_is_singular(s->motion);
    for (size_t k = 0; k < n * n; k++)
        s->factor[k] = mass_entry(s, s->flow, flow_inputs(s), k / n, k % n);
    for (size_t k = 0; k < n; k++) {
        d[k] = ad_series_output(s->flow, flow_inputs(s) + 1, k)[0];
        positive += d[k] > 0;
    }
    phys_mass_columns(n, s->factor, column);
    return (positive == 0 || positive == n) &&
           phys_mass_condition(n, column, d, 1, &worst) <= PHYS_MASS_SINGULAR;
}

/* ---- */

static enum ad_status record(struct phys_motion_series *s, struct ad_error *error)
{
    ad_var x[INPUTS], y[2];
    s->constant_mass = phys_motion_recorded(s->motion, x, y);
    if (!s->constant_mass && s->dof > COORDINATES_MOST)
        return too_much(s, "masses that vary of more than 64 coordinates", error);
    if (s->constant_mass || s->dof <= PHYS_ELIMINATED_MOST ||
        (s->columns && phys_motion_is_diagonal(s->motion)))
        return record_flow(s, x, y, error);
    if (s->columns)
        return too_much(s, "variations with masses that vary of more than 6 coordinates", error);
    return series_of(s, 2, y, INPUTS, x, &s->force, error);
}

enum ad_status phys_motion_series_new(phys_motion *motion, size_t order, size_t columns,
                                      struct phys_motion_series **series, struct ad_error *error)
{
    const size_t n = phys_motion_system(motion)->dof;
    *series = NULL;
    if (phys_refuse_constraints(phys_motion_system(motion), "series", error) != AD_OK)
        return error->status;
    struct phys_motion_series *s = *series = calloc(1, sizeof *s);
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *s = (struct phys_motion_series){
        .motion = motion, .dof = n, .order = order, .n_params = phys_motion_parameters(motion)};
    s->columns = columns + s->n_params;
    phys_motion_record_energy(motion);
    if (record(s, error) == AD_OK) {
        s->a = calloc((order + 1) * n, sizeof *s->a);
        s->factor = calloc(s->constant_mass ? 1 : (n + 2) * n, sizeof *s->factor);
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

bool phys_motion_series_compiled(const struct phys_motion_series *series)
{
    return ad_series_compiled(series->flow);
}

void phys_motion_series_free(struct phys_motion_series *series)
{
    if (!series)
        return;
    ad_series_free(series->flow);
    ad_series_free(series->force);
    AD_FREE(series->a, series->factor, series->pivots, series);
}

/* ---- order by order ---- */

static bool factor_mass(struct phys_motion_series *s)
{
    const size_t n = s->dof;
    size_t worst;
    for (size_t i = 0; i < n * n; i++)
        s->factor[i] = mass_entry(s, s->force, MASS, i / n, i % n);
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
    for (size_t i = 0; i < n; i++) {
        a[i] = ad_series_output(s->force, FORCE, i)[k];
        for (size_t m = 0; m < n; m++) {
            const size_t place = phys_motion_mass_place(s->motion, i, m);
            if (place == SIZE_MAX || ad_series_is_number(s->force, MASS, place))
                continue;
            const double *M = ad_series_output(s->force, MASS, place);
            for (size_t j = 1; j <= k; j++)
                a[i] -= M[j] * s->a[(k - j) * n + m];
        }
    }
    phys_lapack_lu_solve(n, s->factor, s->pivots, a);
}

static enum ad_status order_by_order(struct phys_motion_series *s, size_t order, double t,
                                     double *c, bool *good, struct ad_error *error)
{
    const size_t n = s->dof;
    ad_var x[INPUTS], y[2];
    phys_motion_recorded(s->motion, x, y);
    if (!s->force && series_of(s, 2, y, INPUTS, x, &s->force, error) != AD_OK)
        return error->status;
    *good = true;
    for (size_t k = 0; k < order && *good; k++) {
        const double *now = c + k * 2 * n;
        double *next = c + (k + 1) * 2 * n;
        for (size_t i = 0; i < n; i++) {
            ad_series_input(s->force, Q, i)[k] = now[i];
            ad_series_input(s->force, V, i)[k] = now[n + i];
        }
        ad_series_input(s->force, T, 0)[k] = k == 0 ? t : k == 1 ? 1 : 0;
        ad_series_advance(s->force, k);
        *good = k > 0 || factor_mass(s);
        accelerate(s, k);
        for (size_t i = 0; i < n; i++) {
            next[i] = now[n + i] / (double)(k + 1);
            next[n + i] = s->a[k * n + i] / (double)(k + 1);
        }
    }
    return AD_OK;
}

/* Says why; the field at the point knows better. */
static enum ad_status refuse(const struct phys_motion_series *s, double t, const double *c,
                             struct ad_error *error)
{
    phys_motion_acceleration(s->motion, c, c + s->dof, t, s->a, error);
    return ad_fail(error, AD_E_NONFINITE, "%s: a Taylor coefficient is not finite at t = %g",
                   phys_motion_system(s->motion)->scene->name, t);
}

/* Of a few numbers, an even count, without a call. */
static inline void copy_or_clear(size_t n, const double *from, double *to)
{
    for (size_t k = 0; k < n; k += 2) {
        to[k] = from ? from[k] : 0;
        to[k + 1] = from ? from[k + 1] : 0;
    }
}

static size_t length(const struct phys_motion_series *s) { return 2 * s->dof * (1 + s->columns); }

/* Time and parameters of the flow. */
static void set_others(struct phys_motion_series *s, double t)
{
    *s->time = t;
    for (size_t k = 0; k < s->n_params; k++)
        phys_motion_parameter(s->motion, k, ad_series_input(s->flow, flow_time(s) + 1 + k, 0));
}

void phys_motion_series_rest(struct phys_motion_series *series, double t, const double *y,
                             const double *cut, double *rest)
{
    memset(rest, 0, length(series) * sizeof *rest);
    if (!series->flow)
        return;
    set_others(series, t);
    ad_series_rates_cut(series->flow, length(series), y, cut, rest);
    if (!is_definite(series))
        memset(rest, 0, length(series) * sizeof *rest);
}

enum ad_status phys_motion_series(struct phys_motion_series *series, size_t order, double t,
                                  double *c, const double *cut, struct ad_error *error)
{
    struct phys_motion_series *s = series;
    const size_t n = length(s);
    bool good = s->flow;
    if (s->flow) {
        set_others(s, t);
        copy_or_clear(n, cut, c + n);
        ad_series_flow_cut(s->flow, n, order, c);
        good = is_definite(s);
    }
    if (!good && s->columns && !s->constant_mass)
        return too_much(s, "variations with masses of both signs", error);
    if (!good && !s->constant_mass && order_by_order(s, order, t, c, &good, error) != AD_OK)
        return error->status;
    double none[2] = {0}; /* NaN if one is not finite; n is even */
    for (size_t k = n; k < (order + 1) * n; k += 2) {
        none[0] += 0 * c[k];
        none[1] += 0 * c[k + 1];
    }
    return good && none[0] + none[1] == 0 ? AD_OK : refuse(s, t, c, error);
}

/* ---- many motions at once ---- */

ad_points *phys_motion_points(struct phys_motion_series *series, bool build)
{
    return series->flow ? ad_points_new(series->flow, length(series), build, NULL) : NULL;
}

bool phys_motion_points_put(ad_points *points, size_t p, const struct phys_motion_series *series)
{
    const bool singular = series->constant_mass && phys_motion_is_singular(series->motion);
    return series->flow && !singular && ad_points_put(points, p, series->flow);
}

double *phys_motion_points_times(ad_points *points, const struct phys_motion_series *model)
{
    return ad_points_input(points, flow_time(model), 0);
}

/* is_definite; near its limit, which the series of that motion alone decides, lost. */
void phys_motion_points_end(const ad_points *points, const struct phys_motion_series *model,
                            double *lost)
{
    enum { P = AD_SERIES_POINTS };
    const size_t n = model->constant_mass ? 0 : model->dof, M = flow_inputs(model);
    double positive[P] = {0};
    for (size_t k = 0; k < n; k++) {
        const double *d = ad_points_output(points, M + 1, k);
        double column[P] = {0};
        for (size_t i = 0; i < n; i++) {
            const size_t place = phys_motion_mass_place(model->motion, k, i);
            const double *entry = place == SIZE_MAX ? NULL : ad_points_output(points, M, place);
            for (size_t p = 0; p < P && entry; p++)
                column[p] = fabs(entry[p]) > column[p] ? fabs(entry[p]) : column[p];
        }
        for (size_t p = 0; p < P; p++) {
            const double pivot = fabs(d[p]);
            lost[p] = column[p] < PHYS_MASS_SINGULAR / 2 * pivot ? lost[p] : 1;
            positive[p] += d[p] > 0;
        }
    }
    for (size_t p = 0; p < P && n; p++)
        lost[p] = positive[p] == 0 || positive[p] == (double)n ? lost[p] : 1;
}
