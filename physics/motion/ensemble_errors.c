/* Errors of ensembles (ensemble.h): how many members miss what is wanted, and the distance of two
   members from their reference motions. */
#include "autodiff/sized.h"
#include "ensemble_run.h"
#include "solving.h"
#include "physics/system/internal.h"

#include <math.h>

void phys_ensemble_count(const struct ensemble_task *task)
{
    struct phys_ensemble *e = task->ensemble;
    const double wanted = task->settings->motion->error;
    for (size_t i = 0; i < e->n; i++) {
        struct phys_member *m = &e->member[i];
        const bool complete = phys_member_complete(m);
        m->missed = complete && wanted > 0 && !(m->error <= wanted);
        e->failed += m->failure.status != AD_OK;
        e->missed += m->missed;
        e->complete += complete;
        e->unknown += complete && isnan(m->error) && !task->settings->motion->no_reference;
    }
}

/* The distance of a member from its reference, and how far that is known. */
static double distance(const struct ensemble_task *task, size_t i, double *uncertainty,
                       struct ad_error *error)
{
    struct phys_ensemble *e = task->ensemble;
    const struct phys_motion_settings *s = task->settings->motion;
    const double *start = e->start + 2 * e->dof * i, *x = e->x + 2 * e->dof * e->n_times * i;
    struct phys_reference r = {0};
    struct phys_system system = {0};
    struct ad_error lost = {0};
    double most = 0;
    size_t n = 0;
    while (n < e->n_times && isfinite(x[2 * e->dof * n]))
        n++;
    if (n < 2 || phys_ensemble_system(task, i, &system, error) != AD_OK ||
        phys_reference(&system, start, start + e->dof, n, e->t, PHYS_MOTION_LOST, s->proceed,
                       s->context, &r, &lost) != AD_OK)
        most = (double)NAN;
    for (size_t j = 0; j < n && lost.status == AD_OK && !isnan(most); j++) {
        double apart = 0;
        for (size_t k = 0; k < e->dof; k++)
            apart = hypot(apart, x[2 * e->dof * j + k] - r.x[2 * e->dof * j + k]);
        most = e->t[j] < r.horizon ? fmax(most, apart) : (double)NAN;
        *uncertainty = fmax(*uncertainty, r.uncertainty[j]);
    }
    phys_reference_free(&r);
    phys_system_close(&system);
    return most;
}

void phys_ensemble_check(const struct ensemble_task *task, struct ad_error *error)
{
    struct phys_ensemble *e = task->ensemble;
    size_t worst = e->n, first = e->n;
    for (size_t i = 0; i < e->n; i++) {
        const struct phys_member *m = &e->member[i];
        if (m->failure.status != AD_OK || isnan(m->error))
            continue;
        first = first == e->n ? i : first;
        worst = worst == e->n || m->error > e->member[worst].error ? i : worst;
    }
    if (first == e->n || e->interrupted || e->system->bodies > PHYS_MOTION_FEW)
        return;
    e->checked[e->n_checked++] = first;
    if (worst != first)
        e->checked[e->n_checked++] = worst;
    for (size_t k = 0; k < e->n_checked && error->status == AD_OK; k++)
        e->measured[k] = distance(task, e->checked[k], &e->uncertainty[k], error);
}

enum ad_status phys_ensemble_met(const struct phys_ensemble_settings *settings,
                                 const struct phys_ensemble *e, struct ad_error *error)
{
    if (AD_LACKS(error, settings, settings->motion, e))
        return error->status;
    AD_OWN(phys_ensemble_settings, settings, at_once, error);
    for (size_t i = 0; e->failed && i < e->n; i++)
        if (e->member[i].failure.status != AD_OK)
            return ad_fail(error, AD_E_ACCURACY, "%zu of %zu members failed; row %zu: %.300s",
                           e->failed, e->n, i + 1, e->member[i].failure.message);
    for (size_t k = 0; k < e->n_checked; k++)
        if (e->measured[k] > e->member[e->checked[k]].error + e->uncertainty[k])
            return ad_fail(error, AD_E_ACCURACY,
                           "row %zu errs by %.3g, not %.3g as estimated: a force that the series "
                           "steps over; try dop853",
                           e->checked[k] + 1, e->measured[k], e->member[e->checked[k]].error);
    for (size_t i = 0; e->missed && i < e->n; i++)
        if (e->member[i].missed)
            return ad_fail(error, AD_E_ACCURACY,
                           "an error of %g: %zu of %zu members miss it; row %zu: %.3g",
                           settings->motion->error, e->missed, e->n, i + 1, e->member[i].error);
    return AD_OK;
}
