/* Relations between the ends of a path (ends.h): rows a with a . z = c, orthonormal over what moves
   by Gram and Schmidt, twice. */
#include "ends.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double DEPENDENT = 1e-12; /* of a row's length: what is left of one that is implied */

static bool moves(const struct phys_end_space *s, const uint32_t *order, size_t k)
{
    size_t place = k % s->dof;
    return phys_end_moves(s->ends, k / s->dof, order ? order[place] : place);
}

/* Product of two rows over what moves. */
static double product(const struct phys_end_space *s, const uint32_t *order, const double *a,
                      const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < 2 * s->dof; k++)
        if (moves(s, order, k))
            sum += a[k] * b[k];
    return sum;
}

size_t phys_end_space_scale(struct phys_end_space *s, const uint32_t *order, const double *unit)
{
    const size_t columns = 2 * s->dof + 1;
    for (size_t r = 0; r < s->n; r++) {
        double *row = s->row + r * columns, whole = 0;
        const double *given = s->ends->relation + r * columns;
        for (size_t k = 0; k < 2 * s->dof; k++) {
            size_t place = k % s->dof;
            row[k] = given[k - place + (order ? order[place] : place)] * (unit ? unit[place] : 1);
            whole += row[k] * row[k];
        }
        row[2 * s->dof] = given[2 * s->dof];
        for (size_t pass = 0; pass < 2 * r; pass++) {
            const double *other = s->row + pass % r * columns;
            const double share = product(s, order, row, other);
            for (size_t k = 0; k < columns; k++)
                row[k] -= share * other[k];
        }
        const double length = sqrt(product(s, order, row, row));
        if (!(length > DEPENDENT * sqrt(whole)))
            return r;
        for (size_t k = 0; k < columns; k++)
            row[k] /= length;
    }
    return s->n;
}

enum ad_status phys_end_space_new(struct phys_end_space *s, const struct phys_ends *ends,
                                  size_t dof, struct ad_error *error)
{
    *s = (struct phys_end_space){.ends = ends, .n = ends ? ends->n_relations : 0, .dof = dof};
    s->row = malloc((s->n + 1) * (2 * dof + 1) * sizeof *s->row);
    if (!s->row)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu relations", s->n);
    phys_end_space_scale(s, NULL, NULL);
    return AD_OK;
}

void phys_end_space_free(struct phys_end_space *s)
{
    free(s->row);
    s->row = NULL;
}

void phys_end_space_project(const struct phys_end_space *s, const uint32_t *order, double *x)
{
    for (size_t k = 0; k < 2 * s->dof; k++)
        if (!moves(s, order, k))
            x[k] = 0;
    for (size_t r = 0; r < s->n; r++) {
        const double *row = s->row + r * (2 * s->dof + 1), along = product(s, order, row, x);
        for (size_t k = 0; k < 2 * s->dof; k++)
            if (moves(s, order, k))
                x[k] -= along * row[k];
    }
}

void phys_end_space_meet(const struct phys_end_space *s, double *z)
{
    for (size_t r = 0; r < s->n; r++) {
        const double *row = s->row + r * (2 * s->dof + 1);
        double left = row[2 * s->dof];
        for (size_t k = 0; k < 2 * s->dof; k++)
            left -= row[k] * z[k];
        for (size_t k = 0; k < 2 * s->dof; k++)
            if (moves(s, NULL, k))
                z[k] += left * row[k];
    }
}

void phys_ends_of_surface(struct phys_surface *surface, struct phys_ends *ends)
{
    if (!surface || !surface->whole->ends)
        return;
    struct phys_hessian *h = &surface->tangent;
    *ends = (struct phys_ends){.size = sizeof *ends, .free = {h->free[0], h->free[1]}};
    h->ends = ends;
}

/* ---- of a path ---- */

/* Where end coordinate k is in a path. */
static size_t place(const struct phys_end_space *s, size_t slices, size_t k)
{
    return k % s->dof * slices + (k < s->dof ? 0 : slices - 1);
}

/* `what` of the ends of x [rows x slices], with the row behind the last as room. */
static void at_ends(const struct phys_end_space *s, size_t slices, double *x, bool meet)
{
    double *z = s->row + s->n * (2 * s->dof + 1);
    for (size_t k = 0; k < 2 * s->dof; k++)
        z[k] = x[place(s, slices, k)];
    if (meet)
        phys_end_space_meet(s, z);
    else
        phys_end_space_project(s, NULL, z);
    for (size_t k = 0; k < 2 * s->dof; k++)
        x[place(s, slices, k)] = z[k];
}

void phys_end_space_meet_path(const struct phys_end_space *s, size_t slices, double *path)
{
    if (s->n > 0)
        at_ends(s, slices, path, true);
}

double phys_end_space_gradient(const struct phys_end_space *s, size_t slices, size_t n, double *g)
{
    double sum = 0;
    at_ends(s, slices, g, false);
    for (size_t k = 0; k < n; k++)
        sum += g[k] * g[k];
    return sqrt(sum);
}

enum ad_status phys_ends_check(const struct phys_system *system, const struct phys_ends *ends,
                               size_t slices, const double *path, struct ad_error *error)
{
    const size_t dof = system->dof, columns = 2 * dof + 1;
    struct phys_end_space s;
    if (!ends || ends->n_relations == 0)
        return AD_OK;
    if (!ends->relation)
        return ad_fail(error, AD_E_ARGUMENT, "%zu relations between the ends, got NULL for them",
                       ends->n_relations);
    for (size_t k = 0; k < ends->n_relations * columns; k++)
        if (!isfinite(ends->relation[k]))
            return ad_fail(error, AD_E_ARGUMENT, "relation %zu between the ends: got %g",
                           k / columns + 1, ends->relation[k]);
    if (phys_end_space_new(&s, ends, dof, error) != AD_OK)
        return error->status;
    size_t r = phys_end_space_scale(&s, NULL, NULL);
    if (r < s.n) { /* its row is what is left of it */
        double left = s.row[r * columns + 2 * dof],
               size = fabs(ends->relation[r * columns + 2 * dof]);
        for (size_t k = 0; k < 2 * dof; k++) {
            const double x = path[place(&s, slices, k)];
            left -= moves(&s, NULL, k) ? 0 : s.row[r * columns + k] * x;
            size = fmax(size, fabs(ends->relation[r * columns + k] * x));
        }
        if (fabs(left) <= 1e3 * DEPENDENT * size)
            ad_fail(error, AD_E_ARGUMENT,
                    "relation %zu between the ends follows from those before it and from the "
                    "coordinates that are given; leave it out",
                    r + 1);
        else
            ad_fail(error, AD_E_ARGUMENT,
                    "relation %zu between the ends contradicts those before it or the coordinates "
                    "that are given, by %.3g; change one of them",
                    r + 1, fabs(left));
    }
    phys_end_space_free(&s);
    return error->status;
}

const char *phys_ends_advice(const struct phys_ends *ends)
{
    return ends && ends->n_relations
               ? "paths that keep the relations may be shifted in time or turned: give a "
                 "coordinate of an end, too"
               : "try other ends or another time";
}
