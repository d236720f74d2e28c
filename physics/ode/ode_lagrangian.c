/* The motion of a Lagrangian in y = (q, v). */
#include "autodiff/free.h"
#include "internal.h"
#include "physics/lagrangian/constraints.h"

#include <stdlib.h>
#include <string.h>

struct context {
    const struct phys_system *system;
    phys_motion *motion;
    struct phys_motion_series *series; /* NULL until needed */
    double *still; /* [dof] zeros: velocities where accelerations do not ask for them */
    bool thin;     /* rates are taken from the series: phys_ode_thin */
    double *rows;  /* [2][2 dof] of it */
};

enum { THIN_MOST = 18 }; /* coordinates; beyond, columns of a program are worth their overhead */

/* Whether the rates come from the series, which has them in straight code for one point. */
static bool is_thin(struct context *c, struct ad_error *error)
{
    if (!c->thin || c->series)
        return c->thin;
    struct ad_error none = {0};
    c->thin = phys_motion_series_new(c->motion, PHYS_SERIES_MOST, 0, &c->series, &none) == AD_OK;
    phys_keep_memory(&none, error);
    return c->thin;
}

/* Accelerations at c->rows; its second row are the rates. */
static enum ad_status thin_rates(struct context *c, double t, double *a, struct ad_error *error)
{
    const size_t dof = c->system->dof;
    if (phys_motion_series(c->series, 1, t, c->rows, NULL, error) == AD_OK)
        for (size_t k = 0; k < dof; k++)
            a[k] = c->rows[3 * dof + k];
    return error->status;
}

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    struct context *c = context;
    const size_t dof = c->system->dof;
    const bool thin = is_thin(c, error);
    double *row = thin ? c->rows : NULL;
    for (size_t k = 0; k < dof; k++) { /* a call of memcpy takes as long as a force */
        const double q = y[k], v = y[dof + k];
        rate[k] = v;
        if (thin) {
            row[k] = q;
            row[dof + k] = v;
        }
    }
    if (thin)
        return thin_rates(c, t, rate + dof, error);
    phys_motion_acceleration(c->motion, y, y + dof, t, rate + dof, error);
    return error->status;
}

static enum ad_status kick(void *context, double t, const double *q, double *rate,
                           struct ad_error *error)
{
    struct context *c = context;
    if (is_thin(c, error)) {
        memcpy(c->rows, q, c->system->dof * sizeof *q); /* whatever the velocities */
        return thin_rates(c, t, rate, error);
    }
    phys_motion_acceleration(c->motion, q, c->still, t, rate, error);
    return error->status;
}

static enum ad_status series(void *context, size_t order, double t, double *c, const double *cut,
                             struct ad_error *error)
{
    struct context *x = context;
    if (!x->series &&
        phys_motion_series_new(x->motion, PHYS_SERIES_MOST, 0, &x->series, error) != AD_OK)
        return error->status;
    return phys_motion_series(x->series, order, t, c, cut, error);
}

static void rest(void *context, double t, const double *y, const double *cut, double *off)
{
    phys_motion_series_rest(((struct context *)context)->series, t, y, cut, off);
}

struct phys_motion_series *phys_ode_motion_series(const struct phys_ode *ode)
{
    return ode->series == series ? ((struct context *)ode->context)->series : NULL;
}

static enum ad_status project(void *context, double t, double *y, struct ad_error *error)
{
    const struct context *c = context;
    return phys_motion_project(c->motion, t, y, y + c->system->dof, error);
}

phys_motion *phys_ode_constrained_motion(const struct phys_ode *ode)
{
    return ode->project == project ? ((struct context *)ode->context)->motion : NULL;
}

static double energy(void *context, double t, const double *y)
{
    const struct context *c = context;
    return phys_motion_energy(c->motion, y, y + c->system->dof, t);
}

static const char *interpreted(const void *context)
{
    const struct context *c = context;
    if (c->series) /* the forces by themselves gave the first step at most */
        return phys_motion_series_compiled(c->series) ? ""
                                                      : "the series takes too little time to pay "
                                                        "for compiling it, or cannot be compiled";
    return phys_motion_interpreted(c->motion);
}

static void release(void *context)
{
    struct context *c = context;
    phys_motion_series_free(c->series);
    phys_motion_free(c->motion);
    AD_FREE(c->still, c->rows, c);
}

void phys_ode_round_mass(const struct phys_ode *ode, double share)
{
    if (ode->field != field)
        return;
    struct context *c = ode->context;
    c->thin = false;
    phys_motion_round_mass(c->motion, share);
}

void phys_ode_thin(const struct phys_ode *ode)
{
    struct context *c = ode->context;
    if (ode->field == field && ode->series)
        c->thin = c->system->dof <= THIN_MOST;
}

enum ad_status phys_ode_lagrangian(const struct phys_system *system, struct phys_ode *ode,
                                   struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, system, system->scene))
        return error->status;
    if (system->scene->ode)
        return system->scene->ode(system, ode, error);
    struct context *c = calloc(1, sizeof *c);
    *ode = (struct phys_ode){.context = c, .free = c ? release : NULL};
    if (!c || !(c->still = calloc(system->dof, sizeof *c->still)) ||
        !(c->rows = calloc(4 * system->dof, sizeof *c->rows)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    c->system = system;
    if (phys_motion_new(system, &c->motion, error) != AD_OK)
        return error->status;
    ode->name = system->scene->name;
    ode->n = 2 * system->dof;
    ode->field = field;
    if (phys_motion_constraints(c->motion)) {
        ode->project = project;
    } else {
        if (phys_motion_separates(c->motion, error))
            ode->kick = kick;
        ode->canonical = ode->kick && !phys_system_has_forces(system);
        ode->series = series;
        ode->rest = rest;
    }
    ode->energy = energy;
    ode->interpreted = interpreted;
    ode->system = system;
    return error->status;
}
