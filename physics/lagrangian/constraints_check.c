/* Checks of starts and of steps of a motion with constraints (constraints.h). */
#include "constraints.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double start_tolerance = 1e-10; /* relative to the sizes of q and v */

/* ---- starts ---- */

static enum ad_status refuse_start(const struct phys_constraints *c, const char *what,
                                   bool velocity, const double *b, const double *near,
                                   struct ad_error *error)
{
    enum { SHOWN = 6 };
    char text[320] = "", name[64];
    size_t worst = 0;
    for (size_t i = 1; i < c->n; i++)
        if (fabs(b[i]) / c->size[i] > fabs(b[worst]) / c->size[worst])
            worst = i;
    for (size_t k = 0; k < c->dof && k < SHOWN && near; k++) {
        phys_coordinate_name(c->system, k, name, sizeof name);
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%s%.20s = %.15g",
                 k ? ", " : "; try ", velocity ? "v_" : "", name, near[k]);
    }
    return ad_fail(error, AD_E_ARGUMENT,
                   "%s: the %s does not satisfy constraint %s: %s %s = %.3g, "
                   "expected 0%s%s",
                   c->system->scene->name, what, c->system->scene->constraints[worst],
                   velocity ? "its velocities give" : "the value is", velocity ? "dg/dt" : "g",
                   b[worst], text,
                   near && c->dof > SHOWN ? ", ..."
                   : near                 ? ""
                                          : "; no place near it does");
}

/* room [n + 2 dof], zeros. */
static enum ad_status check_start(phys_motion *motion, const char *what, const double *q,
                                  const double *v, double t, double *room, struct ad_error *error)
{
    struct phys_constraints *c = phys_motion_constraints(motion);
    double *b = room, *near = b + c->n, *near_v = near + c->dof, off[2];
    struct ad_error cause = {0};
    memcpy(near, q, c->dof * sizeof *near);
    if (v)
        memcpy(near_v, v, c->dof * sizeof *near_v);
    if (phys_motion_residual(motion, near, near_v, t, off, &cause) != AD_OK)
        return ad_fail(error, cause.status == AD_E_NONFINITE ? AD_E_ARGUMENT : cause.status, "%s",
                       cause.message);
    const bool velocity = !(off[0] > start_tolerance * phys_norm(c->dof, q));
    if (velocity && (!v || !(off[1] > start_tolerance * phys_norm(c->dof, v))))
        return AD_OK;
    memcpy(b, velocity ? c->rate : c->g, c->n * sizeof *b);
    const bool found = phys_motion_project(motion, t, near, near_v, &cause) == AD_OK;
    return refuse_start(c, what, velocity, b, !found ? NULL : velocity ? near_v : near, error);
}

enum ad_status phys_motion_check_constraints(phys_motion *motion, const char *what, const double *q,
                                             const double *v, double t, struct ad_error *error)
{
    const struct phys_constraints *c = phys_motion_constraints(motion);
    if (!c)
        return AD_OK;
    double *room = calloc(c->n + 2 * c->dof, sizeof *room);
    if (!room)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    check_start(motion, what, q, v, t, room, error);
    free(room);
    return error->status;
}

/* ---- steps ---- */

/* The state at the share s of a step h from x0 to x, both q, v: by Hermite's cubic. */
static void go_between(size_t dof, const double *x0, const double *x, double h, double s,
                       double *to)
{
    const double left = 1 - s, *v0 = x0 + dof, *v = x + dof;
    for (size_t k = 0; k < dof; k++) {
        to[k] = left * left * ((1 + 2 * s) * x0[k] + s * h * v0[k]) +
                s * s * ((1 + 2 * left) * x[k] - left * h * v[k]);
        to[dof + k] = left * v0[k] + s * v[k];
    }
}

/* det G(q) W(q0) is positive at q = q0, and changes its sign where G loses its rank, or turns by a
   right angle: shorter pieces tell the two apart. */
enum ad_status phys_motion_check_step(phys_motion *motion, double t, double h, const double *x0,
                                      const double *x, struct ad_error *error)
{
    enum { PIECES = 32 };
    struct phys_constraints *c = phys_motion_constraints(motion);
    const size_t n = c->n, dof = c->dof;
    double *place = malloc((2 * dof + n * dof) * sizeof *place);
    bool passes = false;
    if (!place)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *W = place + 2 * dof;
    for (int pieces = 1; pieces <= PIECES && !passes; pieces *= PIECES) {
        passes = true;
        for (int i = 0; i < pieces && passes; i++) {
            const double from = (double)i / pieces, to = (i + 1.0) / pieces;
            go_between(dof, x0, x, h, from, place);
            if (phys_motion_constrain(motion, place, place + dof, t + from * h, error) != AD_OK)
                goto done;
            memcpy(W, c->W, n * dof * sizeof *W);
            go_between(dof, x0, x, h, to, place);
            phys_constraints_evaluate(c, place, place + dof, t + to * h);
            for (size_t k = 0; k < n * n; k++)
                c->S[k] = phys_dot(dof, c->G + k / n * dof, W + k % n * dof);
            passes = phys_lapack_lu_sign(n, c->S, c->pivots) > 0;
        }
    }
    if (!passes)
        ad_fail(error, AD_E_NONFINITE,
                "%s: the constraints are not independent everywhere between t = %g and %g (%s%s): "
                "how the motion goes on is not determined; stop before that, or take shorter steps",
                c->system->scene->name, t, t + h, c->system->scene->constraints[0],
                n > 1 ? ", ..." : "");
done:
    free(place);
    return error->status;
}
