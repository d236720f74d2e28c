/* Whether a motion is stiff: its forces have rates far above its own, and steps of an implicit
   method that follow the motion alone do it in fewer evaluations. The second is not concluded from
   the first, but measured (Hairer, Wanner, Solving Ordinary Differential Equations II, section
   IV.1). */
#include "physics/linear/vectors.h"
#include "autodiff/free.h"
#include "diagnostics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 16, SETTLE = 8, ITERATIONS = 24, COMPARED = 100, LEAST_COMPARED = 10 };
static const double far_above = 10; /* of the motion's own rate */
static const size_t fewer = 3;      /* times fewer evaluations are worth telling */

/* The spectral radius of the rates' Jacobian at y, by the growth of a difference that is followed
   by powers of it; *own: |a| / |v|. NaN where the field is not known. work [4 n]. */
static double rate_at(const struct phys_ode *ode, double t, const double *y, double *work,
                      double *own)
{
    const size_t n = ode->n;
    double *u = work, *f = u + n, *moved = f + n, *g = moved + n, growth = 0;
    const double step = 1e-7 * phys_norm(n, y);
    struct ad_error none = {0};
    if (step == 0 || ode->field(ode->context, t, y, f, &none) != AD_OK)
        return (double)NAN;
    *own = phys_norm(n / 2, f + n / 2) / phys_norm(n / 2, f);
    for (size_t k = 0; k < n; k++)
        u[k] = cos(1.7 * (double)k + 0.4);
    for (int i = 0; i < ITERATIONS; i++) {
        const double length = phys_norm(n, u);
        growth += i > SETTLE ? log(length) : 0;
        for (size_t k = 0; k < n; k++)
            moved[k] = y[k] + step * u[k] / length;
        if (ode->field(ode->context, t, moved, g, &none) != AD_OK)
            return (double)NAN;
        for (size_t k = 0; k < n; k++)
            u[k] = (g[k] - f[k]) / step;
    }
    growth += log(phys_norm(n, u));
    return exp(growth / (ITERATIONS - SETTLE));
}

/* The fastest rate at some samples, and, as a geometric mean, how many times the motion's own. */
static double fastest(const struct phys_motion_solution *m, double *times)
{
    const size_t n = m->ode.n, dof = m->system->dof;
    double *y = malloc(5 * n * sizeof *y), most = 0, sum = 0;
    size_t count = 0;
    struct ad_error none = {0};
    for (size_t j = 0; y && j < PLACES; j++) {
        const size_t i = (2 * j + 1) * (m->n - 1) / (2 * PLACES);
        const double *x = m->x + 2 * i * dof;
        double own = 0;
        if (phys_ode_enter(&m->ode, m->t[i], x, x + dof, y, &none) != AD_OK)
            break;
        const double rate = rate_at(&m->ode, m->t[i], y, y + n, &own);
        if (!isfinite(rate) || !(own > 0) || isinf(own) || !(rate > 0))
            continue; /* at rest, or not smooth */
        most = fmax(most, rate);
        sum += log(rate / own);
        count++;
    }
    free(y);
    *times = count > PLACES / 2 ? exp(sum / (double)count) : 0;
    return most;
}

/* Samples from one that is compared to the next: equal times of few of them. 0: they are not. */
static size_t stride_of(const struct phys_motion_solution *m)
{
    const size_t all = m->n - 1;
    const double time = m->t[all];
    size_t stride = all / COMPARED + (all % COMPARED != 0);
    while (stride > 0 && all % stride != 0)
        stride++;
    if (stride == 0 || all / stride < LEAST_COMPARED)
        return 0;
    for (size_t i = 0; i <= all; i += stride)
        if (fabs(m->t[i] - time * (double)i / (double)all) > 1e-9 * time)
            return 0;
    return stride;
}

/* The largest distance of steps of one length from the motion; infinite where they fail. */
static double follow(const struct phys_motion_settings *settings,
                     const struct phys_motion_solution *m, const struct phys_ode *ode,
                     const struct phys_integrator *method, size_t stride, double dt, double *memory,
                     struct phys_simulation_info *info)
{
    const size_t dof = m->system->dof, points = (m->n - 1) / stride, row = points + 1;
    struct phys_simulation how = phys_simulation_of(method, dt, m->t[m->n - 1]);
    struct ad_error none = {0};
    double *y = memory, *path = y + ode->n, most = 0;
    how.n_samples = points;
    how.proceed = settings->proceed;
    how.context = settings->context;
    if (phys_ode_enter(ode, 0, m->start, m->start + dof, y, &none) != AD_OK ||
        phys_trajectory(&how, ode, y, dof, row, path, info, &none) != AD_OK || info->samples != row)
        return (double)INFINITY;
    for (size_t i = 0; i < row; i++) {
        double sum = 0;
        for (size_t k = 0; k < dof; k++)
            sum = hypot(sum, path[k * row + i] - m->x[2 * i * stride * dof + k]);
        most = fmax(most, sum);
    }
    return most;
}

void phys_judge_stiffness(const struct phys_motion_settings *settings,
                          const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    const double allowed =
        settings->error > 0 ? settings->error : fmax(m->error, m->setting * m->size);
    const size_t most = m->info.evaluations / fewer;
    struct ad_error none = {0};
    const struct phys_integrator *method = phys_integrator_find("gauss3", &none);
    struct phys_ode ode = {0};
    double times = 0, rate = m->n > PLACES ? fastest(m, &times) : 0;
    const size_t stride = times > far_above ? stride_of(m) : 0;
    if (stride == 0 || phys_ode_for(m->system, method, &ode, &none) != AD_OK)
        return;
    const size_t points = (m->n - 1) / stride;
    double *memory = malloc((ode.n + m->system->dof * (points + 1)) * sizeof *memory);
    for (size_t steps = points; memory && 6 * steps < most; steps *= 2) {
        struct phys_simulation_info info = {0};
        const double dt = m->t[m->n - 1] / (double)steps;
        const double distance = follow(settings, m, &ode, method, stride, dt, memory, &info);
        if (info.evaluations > most || info.stop == PHYS_SIMULATION_INTERRUPTED)
            break;
        if (!(distance <= allowed))
            continue;
        d->stiff = (struct phys_stiffness){rate, times, dt, info.evaluations, distance};
        snprintf(d->warning[d->n_warnings++], sizeof *d->warning,
                 "stiff: the forces have rates of up to %.2g, %.2g times the motion's own, which "
                 "shorten the steps of %s; --integrator %s --dt %.6g (implicit) takes %zu "
                 "evaluations in place of %zu and differs from this run by %.1e",
                 rate, times, m->integrator->name, method->name, dt, info.evaluations,
                 m->info.evaluations, distance);
        break;
    }
    phys_ode_free(&ode);
    AD_FREE(memory);
}
