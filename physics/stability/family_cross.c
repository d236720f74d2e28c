/* From a branch point to the family that crosses there: at it the equations have a second null
   vector, along which the other family leaves (Keller, in Applications of Bifurcation Theory, 1977,
   section 5). A period doubling is a branch point of the motions gone round twice. */
#include "family_parts.h"
#include "physics/linear/vectors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double farthest = 0.1, nearest = 1e-3; /* arc length from the branch point */
static const double across = 0.8; /* cosine of the angle of the family found with the null vector */

static bool branches(const struct phys_family_member *member)
{
    return member->mark == PHYS_MARK_BRANCH || member->mark == PHYS_MARK_DOUBLING;
}

/* The member where it branches; SIZE_MAX: there is none yet. */
static size_t branch_of(const struct family_run *run)
{
    size_t left = (size_t)abs(run->settings->cross);
    for (size_t k = 0; k < run->family->n && left > 0; k++)
        if (branches(&run->family->member[k]) && --left == 0)
            return k;
    return SIZE_MAX;
}

/* Gone round twice. */
static void repeat(struct family_run *run, struct family_point *a)
{
    const size_t n = run->columns, T = n - 1;
    a->u[T] *= 2;
    a->tangent[T] *= 2;
    const double length = phys_norm(n, a->tangent);
    for (size_t j = 0; j < n; j++)
        a->tangent[j] /= length;
    run->held *= run->settings->hold == PHYS_HOLD_ENERGY ? 1 : 2;
}

/* The branch point from the member, and the null vector across a's tangent. */
static enum ad_status find_null(struct family_run *run, const struct family_point *a,
                                const struct phys_family_member *member, struct family_point *at,
                                double *null, struct ad_error *error)
{
    const size_t n = run->columns, d = run->d;
    double along = 0, moved;
    memcpy(at->u, member->motion.x, d * sizeof *at->u);
    at->u[n - 1] = member->motion.period * (member->mark == PHYS_MARK_DOUBLING ? 2 : 1);
    if (run->along == ALONG_PARAMETER)
        at->u[d] = member->value;
    for (size_t j = 0; j < n; j++)
        along += a->tangent[j] * (at->u[j] - a->u[j]) / run->unit[j];
    if (phys_family_correct(run, a, a->tangent, along, at, &moved, error) != AD_OK)
        return error->status;
    for (size_t j = 0; j < n; j++) /* of the least singular value */
        null[j] = (run->settings->cross > 0 ? 1 : -1) * run->V[j * n + n - 1];
    return error->status;
}

static enum ad_status leave(struct family_run *run, const struct family_point *at,
                            const double *null, struct family_point *to, struct ad_error *error)
{
    const size_t n = run->columns;
    for (double length = farthest; length >= nearest; length /= 2) {
        struct ad_error lost = {0};
        double moved;
        for (size_t j = 0; j < n; j++)
            to->u[j] = at->u[j] + length * null[j] * run->unit[j];
        if (phys_family_correct(run, at, null, length, to, &moved, &lost) == AD_OK &&
            phys_dot(n, null, to->tangent) > across)
            return AD_OK;
        if (lost.status != AD_OK && lost.status != AD_E_ACCURACY && lost.status != AD_E_NONFINITE)
            return ad_fail(error, lost.status, "%s", lost.message);
    }
    return ad_fail(error, AD_E_ACCURACY, "no other family is found at the branch point");
}

enum ad_status phys_family_cross(struct family_run *run, struct family_point *a,
                                 struct ad_error *error)
{
    struct phys_family *family = run->family;
    const size_t branch = branch_of(run);
    struct family_point at = {0}, to = {0};
    if (branch == SIZE_MAX)
        return AD_OK;
    run->crossed = true;
    if (family->member[branch].mark == PHYS_MARK_DOUBLING) {
        if (run->along == ALONG_PERIOD)
            return ad_fail(error, AD_E_ARGUMENT,
                           "crossing at a period doubling, where periods double: expected a family "
                           "in the energy or a parameter, got one in the period");
        repeat(run, a);
    }
    while (family->n > branch + 1)
        phys_periodic_free(&family->member[--family->n].motion);
    double *null = malloc(run->columns * sizeof *null);
    if (!null || !phys_family_point_new(run, &at) || !phys_family_point_new(run, &to))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (find_null(run, a, &family->member[branch], &at, null, error) == AD_OK &&
             leave(run, &at, null, &to, error) == AD_OK &&
             phys_family_add(run, &to, PHYS_MARK_NONE, NAN, error) == AD_OK)
        phys_family_point_copy(run, &to, a);
    phys_family_point_free(&at);
    phys_family_point_free(&to);
    free(null);
    return error->status;
}
