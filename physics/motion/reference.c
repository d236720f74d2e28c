/* The reference motion, accurate to double precision (motion.h): two runs, whose distance shows how
   rounding grows, that of the start and of the mass matrix among it, and a run back to the start,
   which shows errors that both have in common. Where forces dissipate, the way back makes as much
   of a rounding of the end, and a run forwards by another method shows them. Forces that are a
   small difference of large terms are known to less than the tolerance: it is raised to that. */
#include "autodiff/free.h"
#include "autodiff/ascending.h"
#include "motion.h"
#include "time_scan.h"
#include "physics/integrators/stepper.h"
#include "physics/lagrangian/conserved.h"
#include "physics/ode/internal.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 20 };     /* between landings, at most, where forces change abruptly with time */
enum { LOOKS = 1000 };   /* stretches of time, at least, in which a step ends */
enum { BUDGET = 20000 }; /* steps, beside landings, after which forces may be rounding */

/* How much farther a step goes at ten times the tolerance, at least, where the forces are rounding,
   whose error is in proportion to the length of the step; that of order 8 goes 1.3 times as far. */
enum { FARTHER = 3 };

/* Of the motion with what travels, at most, each of which changes the rest. */
enum { MEETINGS = 8 };
static const double unchanged = 1e-10; /* of the end */

static const double tolerance = 1e-15;
static const char *const another = "dop853";
static const double tolerance_of_another = 1e-14; /* of a step: its rounding is larger */
/* Where the second run cuts each stretch: its steps nowhere coincide with those of the first. */
static const double cut = 0.381966011250105;
static const double cut_of_another = 0.723606797749979;

/* Of the largest distance: less than this has no digit to lose. */
static const double negligible = 1e-6;

/* How often more than its rounding a run back may miss the start; and how much more runs may err
   than they differ by, where each has rounding of its own that grows. */
static const double alike = 10;

/* Settings and costs of the runs. */
struct runs {
    const struct phys_system *system;
    const struct phys_ode *ode;
    struct phys_simulation how;
    struct phys_time_scan scan;   /* steps end at its times, too */
    bool looks;                   /* for more of them along the motion */
    bool interrupted, dissipates; /* energy is not conserved */
    bool limited, exhausted;      /* to BUDGET; the last run was */
    bool carried; /* forces saw a lot of what rounding cuts off places in a hundredth of steps */
    double longest, average; /* step of the last run */
    size_t steps;            /* of the last run */
};

static int descending(const void *a, const void *b) { return ad_ascending(b, a); }

/* Times at which steps end: equal parts of the stretches between n times, `share` (0: not) of each
   part, and those of the scan; row [n] of each time among them, that of the first being 0 and none
   of them. Returns their number. */
static size_t find_landings(const struct runs *runs, size_t n, const double *times, double share,
                            size_t pieces, double *landing, size_t *row)
{
    const struct phys_time_scan *scan = &runs->scan;
    size_t m = 0, k = 0;
    bool back = times[n - 1] < times[0];
    row[0] = 0;
    for (size_t i = 0; i + 1 < n; i++) {
        double from = times[i], to = times[i + 1];
        size_t first = m;
        for (size_t j = 0; j < pieces; j++) {
            if (share > 0)
                landing[m++] = from + (to - from) * ((double)j + share) / (double)pieces;
            if (j + 1 < pieces)
                landing[m++] = from + (to - from) * (double)(j + 1) / (double)pieces;
        }
        for (; k < scan->n; k++) {
            double t = scan->times[back ? scan->n - 1 - k : k];
            if (back ? t <= to : t >= to)
                break;
            if (back ? t < from : t > from)
                landing[m++] = t;
        }
        qsort(landing + first, m - first, sizeof *landing, back ? descending : ad_ascending);
        landing[m++] = to;
        row[i + 1] = m;
    }
    return m;
}

/* Of a motion in (q, p), rows [n] of path [2 dof][columns] become (q, v); y, x [2 dof]: room. */
static void leave(const struct phys_ode *ode, size_t n, const double *t, size_t columns,
                  double *path, double *y, double *x, struct ad_error *error)
{
    for (size_t i = 0; ode->leave && i < n; i++) {
        for (size_t k = 0; k < ode->n; k++)
            y[k] = path[k * columns + i];
        phys_ode_leave(ode, t[i], y, x, x + ode->n / 2, error);
        for (size_t k = 0; k < ode->n; k++)
            path[k * columns + i] = x[k];
    }
}

/* The motion from row 0 of x [n][2 dof] to the other times, landing at equal parts of the stretches
   between them, and at `share` (0: not) of each part; adds times at which forces change along it if
   that is wanted. Returns how many rows are known. */
static size_t run(struct runs *runs, size_t n, const double *times, double share, double *x,
                  struct ad_error *lost)
{
    struct phys_simulation how = runs->how;
    struct phys_simulation_info info = {0};
    size_t states = runs->ode->n, pieces = (LOOKS + n - 2) / (n - 1), known = 0;
    size_t most = 2 * pieces * (n - 1) + runs->scan.n;
    double *at = malloc((1 + most + states * (most + 3)) * sizeof *at);
    size_t *row = malloc(n * sizeof *row);
    if (at && row) {
        double *landing = at + 1, *y = landing + most, *path = y + 2 * states;
        size_t m = find_landings(runs, n, times, share, pieces, landing, row);
        at[0] = times[0];
        how.t0 = times[0];
        how.t1 = times[n - 1];
        how.n_samples = m;
        how.times = landing;
        how.max_steps = runs->limited  ? BUDGET + FARTHER * m
                        : runs->scan.n ? STEPS * (m + LOOKS) /* a noisy pulse has no end */
                                       : 0;
        if (phys_ode_enter(runs->ode, times[0], x, x + states / 2, y, lost) == AD_OK)
            phys_trajectory(&how, runs->ode, y, states, m + 1, path, &info, lost);
        leave(runs->ode, info.samples, at, m + 1, path, y, y + states, lost);
        for (; known < n && row[known] < info.samples; known++)
            for (size_t k = 0; k < states; k++)
                x[known * states + k] = path[k * (m + 1) + row[known]];
        if (runs->looks && lost->status == AD_OK && info.samples == m + 1)
            phys_time_scan_along(runs->system, m + 1, at, path, &runs->scan, lost);
    } else {
        ad_fail(lost, AD_E_MEMORY, "out of memory for the reference");
    }
    runs->interrupted |= info.stop == PHYS_SIMULATION_INTERRUPTED;
    runs->exhausted = runs->limited && lost->status == AD_E_ACCURACY && info.steps >= BUDGET;
    runs->carried |= 100 * info.interpolations > info.steps;
    runs->longest = info.max_step;
    runs->average = fabs(info.t - times[0]) / (double)(info.steps + 1);
    runs->steps = info.steps;
    AD_FREE(at, row);
    return known;
}

/* The first run, at the tolerance above which the forces are more than rounding. */
static void run_first(struct runs *runs, size_t n, const double *times, double *x,
                      struct ad_error *error)
{
    struct phys_simulation *how = &runs->how;
    double before = 0, last = how->rtol;
    bool farther = true;
    struct ad_error lost;
    runs->limited = true;
    do {
        lost = (struct ad_error){0};
        run(runs, n, times, 0, x, &lost);
        farther = runs->average >= FARTHER * before;
        if (farther) {
            before = runs->average;
            last = how->rtol;
            how->rtol = how->atol *= 10;
        }
    } while (farther && runs->exhausted);
    how->rtol = how->atol = last;
    runs->limited = false;
    if (!farther) /* as many steps as the motion asks for */
        run(runs, n, times, 0, x, error);
    else if (lost.status != AD_OK)
        ad_fail(error, lost.status, "%s", lost.message);
}

/* True for a failure other than a lost motion. */
static enum ad_status hand_on(const struct runs *runs, const struct ad_error *lost,
                              struct ad_error *error)
{
    if (runs->interrupted)
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    if (lost->status != AD_OK && lost->status != AD_E_ACCURACY && lost->status != AD_E_NONFINITE)
        return ad_fail(error, lost->status, "%s", lost->message);
    return AD_OK;
}

/* b NULL: the origin. */
static double apart(size_t dof, const double *a, const double *b)
{
    double length = 0;
    for (size_t k = 0; k < dof; k++)
        length = hypot(length, a[k] - (b ? b[k] : 0));
    return length;
}

/* Sizes are the largest distance and speed so far: angles that wind are lost by their speeds, and
   what grows is not lost by its start. A speed that moves nothing in this time is none. */
static void find_horizon(struct phys_reference *r, const double *times, double lost)
{
    double most = 0, speed = 0, span = fabs(times[r->n - 1] - times[0]);
    for (size_t i = 0; i < r->n; i++)
        if (isfinite(r->uncertainty[i]))
            most = fmax(most, apart(r->dof, r->x + 2 * i * r->dof, NULL));
    r->size = negligible * most;
    r->horizon = INFINITY;
    for (size_t i = 0; i < r->n && isinf(r->horizon); i++) {
        const double *x = r->x + 2 * i * r->dof;
        r->size = fmax(r->size, apart(r->dof, x, NULL));
        speed = fmax(speed, apart(r->dof, x + r->dof, NULL));
        if (!(r->uncertainty[i] <= lost * r->size &&
              r->uncertainty[r->n + i] <= lost * fmax(speed, r->size / span)))
            r->horizon = times[i];
    }
}

/* What rounding of the forces makes of coordinates (half 0) or velocities by a row at most, where
   it is more than the tolerance: in every step as much as is allowed, all in one direction. Runs
   have its mean in common. */
static double bias(const struct runs *runs, const struct phys_reference *r, const double *times,
                   size_t row, size_t half)
{
    const struct phys_simulation *how = &runs->how;
    const double time = fabs(times[row] - times[0]), *x = r->x + 2 * row * r->dof;
    const double steps = (double)runs->steps * time / fabs(times[r->n - 1] - times[0]);
    const double speed = how->scale[r->dof] + apart(r->dof, x + r->dof, NULL);
    const double size = how->scale[0] + apart(r->dof, x, NULL) + time / 2 * speed;
    return r->tolerance > tolerance ? r->tolerance * steps * (half ? speed : size) : 0;
}

/* Of the first run from the second, of which some rows are known. */
static void compare(const struct runs *runs, const double *second, size_t known,
                    const double *times, double lost, struct phys_reference *r)
{
    const double caution = runs->carried ? alike : 1;
    for (size_t i = 0; i < 2 * r->n; i++) {
        size_t half = i / r->n, row = i % r->n, at = (2 * row + half) * r->dof;
        r->uncertainty[i] = row < known ? DBL_EPSILON * apart(r->dof, r->x + at, NULL) +
                                              caution * apart(r->dof, r->x + at, second + at) +
                                              bias(runs, r, times, row, half)
                                        : (double)INFINITY;
    }
    find_horizon(r, times, lost);
}

/* x [last + 1][2 dof] back from its row 0; false: there is no way back. */
static bool run_back(struct runs *runs, size_t last, const double *back, double share, double *x,
                     struct ad_error *error)
{
    struct ad_error lost = {0};
    size_t known = run(runs, last + 1, back, share, x, &lost);
    return hand_on(runs, &lost, error) == AD_OK && lost.status == AD_OK && known == last + 1;
}

/* Raises the uncertainty to the distance from a run by another method. x: work space as r->x. */
static enum ad_status compare_forwards(struct runs *runs, const double *times, double lost,
                                       double *x, struct phys_reference *r, struct ad_error *error)
{
    struct ad_error lost_way = {0};
    memcpy(x, r->x, 2 * r->dof * sizeof *x);
    runs->how.integrator = phys_integrator_find(another, error);
    runs->how.rtol = runs->how.atol = tolerance_of_another * (r->tolerance / tolerance);
    size_t known = run(runs, r->n, times, cut_of_another, x, &lost_way);
    if (hand_on(runs, &lost_way, error) != AD_OK || known < r->n)
        return error->status; /* no measure, either */
    r->forward = 0;
    for (size_t i = 0; i < 2 * r->n; i++) {
        size_t half = i / r->n, row = i % r->n, at = (2 * row + half) * r->dof;
        double distance = apart(r->dof, r->x + at, x + at);
        if (half == 0 && times[row] < r->horizon)
            r->forward = fmax(r->forward, distance);
        r->uncertainty[i] = fmax(r->uncertainty[i], distance);
    }
    find_horizon(r, times, lost);
    return AD_OK;
}

/* Runs back to the start from the end of the known motion. A miss beyond the uncertainty is either
   that of the end and rounding, which grow on the way back, and then another run back, from the end
   of the second run, ends as far from this one; or an error common to both forward runs, which
   raises the uncertainty. x, of the second run, and again: work space as r->x; back [n]. */
static enum ad_status reverse(struct runs *runs, const double *times, double lost, double *x,
                              double *again, double *back, struct phys_reference *r,
                              struct ad_error *error)
{
    size_t last = 0, state = 2 * r->dof;
    double known = 0, grown = INFINITY;
    while (last + 1 < r->n && times[last + 1] < r->horizon)
        known = fmax(known, r->uncertainty[++last]);
    if (last == 0)
        return AD_OK;
    for (size_t i = 0; i <= last; i++)
        back[i] = times[last - i];
    for (size_t k = 0; k < state; k++) /* twice the rounding of the end */
        again[k] = x[state * last + k] * (1 + DBL_EPSILON);
    memcpy(x, r->x + state * last, state * sizeof *x);
    if (run_back(runs, last, back, 0, x, error))
        r->reversal = apart(r->dof, x + state * last, r->x);
    if (r->reversal <= alike * known || error->status != AD_OK)
        return error->status;
    if (isfinite(r->reversal) && run_back(runs, last, back, cut, again, error))
        grown = apart(r->dof, x + state * last, again + state * last);
    if (error->status != AD_OK)
        return error->status;
    if (!(r->reversal > alike * grown))
        return runs->dissipates ? compare_forwards(runs, times, lost, x, r, error) : AD_OK;
    for (size_t i = 0; i < 2 * r->n; i++)
        r->uncertainty[i] *= r->reversal / known;
    find_horizon(r, times, lost);
    return error->status;
}

/* The first run, again as long as changes of the forces seen along it change it: behind one that
   was stepped over all is another motion. end [2 dof]: room. */
static void run_seeing(struct runs *runs, const double *times, struct phys_reference *r,
                       double *end, struct ad_error *error)
{
    const double *last = r->x + 2 * r->dof * (r->n - 1);
    size_t seen = runs->scan.n;
    runs->looks = runs->scan.times != NULL;
    run_first(runs, r->n, times, r->x, error);
    for (int k = 0; k < MEETINGS && error->status == AD_OK && runs->scan.n > seen; k++) {
        seen = runs->scan.n;
        memcpy(end, last, 2 * r->dof * sizeof *end);
        run(runs, r->n, times, 0, r->x, error);
        if (apart(2 * r->dof, last, end) <= unchanged * apart(2 * r->dof, last, NULL))
            break;
    }
    runs->looks = false;
}

/* Both runs from row 0 of r->x on, and back. */
static enum ad_status measure(struct runs *runs, const double *times, double lost,
                              struct phys_reference *r, struct ad_error *error)
{
    size_t rows = 2 * r->dof * r->n;
    struct ad_error lost_way = {0}; /* of the second: the motion is not known from there on */
    double *second = malloc((2 * rows + r->n) * sizeof *second);
    if (!second)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the reference");
    double *again = second + rows;
    for (size_t k = 0; k < 2 * r->dof; k++)
        second[k] = r->x[k] * (1 + DBL_EPSILON); /* twice the rounding of the start */
    run_seeing(runs, times, r, again, error);
    r->tolerance = runs->how.rtol;
    r->seen = runs->longest / (double)phys_extrapolation.order;
    if (error->status == AD_OK) {
        phys_ode_round_mass(runs->ode, DBL_EPSILON); /* of an entry, twice or more */
        size_t known = run(runs, r->n, times, cut, second, &lost_way);
        phys_ode_round_mass(runs->ode, 0);
        compare(runs, second, known, times, lost, r);
        if (hand_on(runs, &lost_way, error) == AD_OK)
            reverse(runs, times, lost, second, again, again + rows, r, error);
    }
    free(second);
    return error->status;
}

enum ad_status phys_reference(const struct phys_system *system, const double *q, const double *v,
                              size_t n, const double *times, double lost,
                              bool (*proceed)(void *context), void *context,
                              struct phys_reference *reference, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct phys_reference *r = reference;
    if (AD_LACKS(error, reference))
        return error->status;
    *r = (struct phys_reference){.n = n, .reversal = NAN, .forward = NAN};
    if (AD_LACKS(error, system, system->scene, q, v, times))
        return error->status;
    size_t states = 2 * (r->dof = system->dof);
    if (n < 2)
        return ad_fail(error, AD_E_ARGUMENT, "a reference at %zu times, expected at least 2", n);
    double *scale = malloc(states * sizeof *scale);
    r->x = malloc(states * n * sizeof *r->x);
    r->uncertainty = malloc(2 * n * sizeof *r->uncertainty);
    struct runs runs = {.system = system,
                        .ode = &ode,
                        .how = {.size = sizeof(struct phys_simulation),
                                .integrator = &phys_extrapolation,
                                .rtol = tolerance,
                                .atol = tolerance,
                                .scale = scale,
                                .land = true,
                                .proceed = proceed,
                                .context = context}};
    if (!scale || !r->x || !r->uncertainty)
        ad_fail(error, AD_E_MEMORY, "out of memory for the reference");
    else if ((system->scene->hamiltonian ? phys_ode_canonical
                                         : phys_ode_lagrangian)(system, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, times[0], q, v, r->x, error) == AD_OK &&
             phys_typical_sizes(&ode, times[0], r->x, scale, error) == AD_OK &&
             phys_time_scan(system, q, v, times[0], times[n - 1], &runs.scan, error) == AD_OK) {
        runs.dissipates =
            ode.friction != 0 || !(system->scene->ode || phys_keeps_energy(system, error));
        memcpy(r->x, q, r->dof * sizeof *q);
        memcpy(r->x + r->dof, v, r->dof * sizeof *v);
        measure(&runs, times, lost, r, error);
    }
    r->time_resolution = runs.scan.resolution;
    r->time_unresolved = runs.scan.unresolved;
    phys_time_scan_free(&runs.scan);
    phys_ode_free(&ode);
    free(scale);
    if (error->status != AD_OK)
        phys_reference_free(r);
    return error->status;
}

void phys_reference_free(struct phys_reference *reference)
{
    if (!reference)
        return;
    AD_FREE(reference->x, reference->uncertainty);
    reference->x = reference->uncertainty = NULL;
}
