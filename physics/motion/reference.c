/* The motion as well as double precision knows it (motion.h): two runs, whose distance tells how
   rounding grows, and one back to the start, which tells of errors that both have in common. */
#include "motion.h"
#include "physics/integrators/stepper.h"
#include "physics/ode/internal.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST, SECOND, BACK, BACK_AGAIN, RUNS };
enum { LOOKS = 1000 }; /* stretches of time, at least, in which a step ends */

static const double tolerance = 1e-15;
/* Where the second run cuts each stretch: its steps nowhere coincide with those of the first. */
static const double cut = 0.381966011250105;

/* How often more than its rounding a run back may miss the start. */
static const double alike = 10;

/* One of the runs: its landings, `each` from sample to sample. */
struct pass {
    const struct phys_ode *ode;
    size_t dof, each, landed, kept, n;
    double *times; /* [each (n-1)] */
    double *x;     /* [n][2 dof] */
    bool (*proceed)(void *context);
    void *context;
    struct phys_simulation_info info;
};

static bool keep(void *context, double t, const double *y)
{
    struct pass *p = context;
    struct ad_error local = {0};
    if (p->landed++ % p->each != 0)
        return true;
    double *x = p->x + 2 * p->kept * p->dof;
    if (phys_ode_leave(p->ode, t, y, x, x + p->dof, &local) != AD_OK)
        return false;
    p->kept++;
    return true;
}

static bool proceed(void *context)
{
    const struct pass *p = context;
    return !p->proceed || p->proceed(p->context);
}

/* n times cut into `pieces` each, and these at `share` (0: not). Runs back keep no samples. */
static enum ad_status fill_times(struct pass *p, const double *times, size_t pieces, double share,
                                 struct ad_error *error)
{
    size_t parts = share > 0 ? 2 : 1, m = 0;
    p->each = parts * pieces;
    p->times = malloc(p->each * p->n * sizeof *p->times);
    bool back = times[p->n - 1] < times[0];
    p->x = back ? NULL : malloc(2 * p->dof * p->n * sizeof *p->x);
    if (!p->times || (!back && !p->x))
        return ad_fail(error, AD_E_MEMORY, "out of memory for the reference");
    for (size_t i = 1; i < p->n; i++) {
        double from = times[i - 1], length = times[i] - from;
        for (size_t j = 0; j < pieces; j++) {
            if (share > 0)
                p->times[m++] = from + length * ((double)j + share) / (double)pieces;
            p->times[m++] =
                j + 1 == pieces ? times[i] : from + length * (double)(j + 1) / (double)pieces;
        }
    }
    return AD_OK;
}

static enum ad_status follow(struct pass *p, const double *times, const double *scale, double *y,
                             struct ad_error *error)
{
    const struct phys_simulation settings = {.integrator = &phys_extrapolation,
                                             .t0 = times[0],
                                             .t1 = times[p->n - 1],
                                             .rtol = tolerance,
                                             .atol = tolerance,
                                             .scale = scale,
                                             .n_samples = p->each * (p->n - 1),
                                             .times = p->times,
                                             .land = true,
                                             .sample = p->x ? keep : NULL,
                                             .proceed = proceed,
                                             .context = p};
    return phys_simulate(&settings, p->ode, y, &p->info, error);
}

/* b NULL: the origin. */
static double apart(size_t dof, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < dof; k++)
        sum += pow(a[k] - (b ? b[k] : 0), 2);
    return sqrt(sum);
}

static void find_horizon(struct phys_reference *r, const double *times, double lost)
{
    r->horizon = INFINITY;
    for (size_t i = r->n; i-- > 0;)
        if (!(r->uncertainty[i] <= lost * r->size))
            r->horizon = times[i];
}

static void compare(const struct pass *second, const double *times, double lost,
                    struct phys_reference *r)
{
    for (size_t i = 0; i < r->n; i++) {
        size_t at = 2 * i * r->dof;
        double rounding = DBL_EPSILON * apart(r->dof, r->x + at, NULL);
        r->uncertainty[i] = i < second->kept ? rounding + apart(r->dof, r->x + at, second->x + at)
                                             : (double)INFINITY;
    }
    find_horizon(r, times, lost);
}

/* Where a run back from the first run's sample `last` ends, q and v [2 dof]; false: nowhere. */
static bool run_back(struct pass *p, struct phys_reference *r, size_t last, const double *times,
                     double share, const double *scale, double *start, struct ad_error *error)
{
    struct ad_error lost = {0};
    size_t n = p->n = last + 1, pieces = (LOOKS + last - 1) / last;
    const double *from = r->x + 2 * last * r->dof;
    double *back = malloc((n + 2 * r->dof) * sizeof *back), *y = back ? back + n : NULL;
    bool arrived = false;
    if (!back)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the reference"), false;
    for (size_t i = 0; i < n; i++)
        back[i] = times[last - i];
    if (fill_times(p, back, pieces, share, error) == AD_OK &&
        phys_ode_enter(p->ode, back[0], from, from + r->dof, y, &lost) == AD_OK &&
        follow(p, back, scale, y, &lost) == AD_OK && p->info.stop == PHYS_SIMULATION_END)
        arrived = phys_ode_leave(p->ode, times[0], y, start, start + r->dof, &lost) == AD_OK;
    if (p->info.stop == PHYS_SIMULATION_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    r->evaluations += p->info.evaluations;
    free(back);
    return arrived;
}

/* Back from where it is known to the start. What is missed there beyond the uncertainty so far is
   rounding that grows on the way back, and then another run back ends as far from this one, or an
   error that both runs share: then all are as uncertain. */
static enum ad_status reverse(struct pass *pass, const double *times, const double *scale,
                              double lost, struct phys_reference *r, struct ad_error *error)
{
    size_t last = 0;
    double known = 0, grown = 0;
    while (last + 1 < r->n && times[last + 1] < r->horizon)
        known = fmax(known, r->uncertainty[++last]);
    double *back = malloc(4 * r->dof * sizeof *back), *again = back ? back + 2 * r->dof : NULL;
    if (!back)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the reference");
    r->reversal = (double)NAN;
    if (last > 0 && run_back(&pass[BACK], r, last, times, 0, scale, back, error))
        r->reversal = apart(r->dof, back, r->x);
    if (r->reversal > alike * known) {
        if (run_back(&pass[BACK_AGAIN], r, last, times, cut, scale, again, error))
            grown = apart(r->dof, back, again);
        double share = r->reversal > alike * grown ? r->reversal / known : 1;
        for (size_t i = 0; i < r->n; i++)
            r->uncertainty[i] *= share;
        find_horizon(r, times, lost);
    }
    free(back);
    return error->status;
}

static void pass_free(struct pass *p)
{
    free(p->times);
    free(p->x);
}

static enum ad_status all(struct pass pass[RUNS], const double *times, const double *scale,
                          const double *start, double *y, double lost, struct phys_reference *r,
                          struct ad_error *error)
{
    size_t n = pass[FIRST].ode->n, pieces = (LOOKS + r->n - 2) / (r->n - 1);
    struct ad_error local = {0}; /* of the second: the motion is not known from there on */
    memcpy(y, start, n * sizeof *y);
    if (fill_times(&pass[FIRST], times, pieces, 0, error) != AD_OK ||
        fill_times(&pass[SECOND], times, pieces, cut, error) != AD_OK ||
        follow(&pass[FIRST], times, scale, y, error) != AD_OK)
        return error->status;
    memcpy(y, start, n * sizeof *y);
    if (pass[FIRST].info.stop == PHYS_SIMULATION_END)
        follow(&pass[SECOND], times, scale, y, &local);
    if (pass[FIRST].info.stop != PHYS_SIMULATION_END ||
        (local.status == AD_OK && pass[SECOND].info.stop != PHYS_SIMULATION_END))
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    if (local.status != AD_OK && local.status != AD_E_ACCURACY && local.status != AD_E_NONFINITE)
        return ad_fail(error, local.status, "%s", local.message);
    r->x = pass[FIRST].x;
    pass[FIRST].x = NULL;
    r->seen = pass[FIRST].info.max_step / (double)phys_extrapolation.order;
    r->evaluations = pass[FIRST].info.evaluations + pass[SECOND].info.evaluations;
    compare(&pass[SECOND], times, lost, r);
    return reverse(pass, times, scale, lost, r, error);
}

enum ad_status phys_reference(const struct phys_system *system, const double *q, const double *v,
                              size_t n, const double *times, double lost,
                              bool (*go_on)(void *context), void *context,
                              struct phys_reference *reference, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct phys_reference *r = reference;
    *r = (struct phys_reference){.n = n};
    if (phys_lacks_scene(system, error) || phys_lacks(q, "coordinates", error) ||
        phys_lacks(v, "velocities", error) || phys_lacks(times, "times", error))
        return error->status;
    r->dof = system->dof;
    if (n < 2)
        return ad_fail(error, AD_E_ARGUMENT, "a reference at %zu times, expected at least 2", n);
    double *y = malloc(3 * 2 * system->dof * sizeof *y);
    struct pass pass[RUNS];
    for (size_t k = 0; k < RUNS; k++)
        pass[k] = (struct pass){
            .ode = &ode, .dof = system->dof, .n = n, .proceed = go_on, .context = context};
    if (!y || !(r->uncertainty = malloc(n * sizeof *r->uncertainty)))
        ad_fail(error, AD_E_MEMORY, "out of memory for the reference");
    else if (phys_ode_lagrangian(system, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, times[0], q, v, y + ode.n, error) == AD_OK &&
             phys_typical_sizes(&ode, times[0], y + ode.n, y + 2 * ode.n, error) == AD_OK) {
        r->size = y[2 * ode.n];
        all(pass, times, y + 2 * ode.n, y + ode.n, y, lost, r, error);
    }
    for (size_t k = 0; k < RUNS; k++)
        pass_free(&pass[k]);
    phys_ode_free(&ode);
    free(y);
    if (error->status != AD_OK)
        phys_reference_free(r);
    return error->status;
}

void phys_reference_free(struct phys_reference *reference)
{
    if (!reference)
        return;
    free(reference->x);
    free(reference->uncertainty);
    reference->x = reference->uncertainty = NULL;
}
