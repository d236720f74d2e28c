/* Normals and tangents of constraints at the nodes of a path (nodes.h). */
#include "nodes.h"
#include "physics/linear/vectors.h"

#include <math.h>
#include <string.h>

static const double dependent = 1e-6; /* of a gradient: what the others leave of it */

size_t phys_surface_place(const struct phys_surface *s, size_t dof, size_t j, size_t d)
{
    const size_t degree = s->whole->table.degree;
    return (j % degree * dof + d) * (s->whole->elements + 1) + j / degree;
}

double phys_surface_time(const struct phys_surface *s, size_t j)
{
    const struct phys_hessian *h = s->whole;
    const size_t e = j / h->table.degree, k = j % h->table.degree;
    const double after = k ? h->table.node[k] * phys_hessian_length(h, e) * h->dt : 0;
    return phys_hessian_slice_time(h, e) + after;
}

void phys_surface_get(const struct phys_surface *s, const double *path, size_t j, double *q)
{
    for (size_t d = 0; d < s->dof; d++)
        q[d] = path[phys_surface_place(s, s->dof, j, d)];
}

bool phys_surface_at_end(const struct phys_surface *s, size_t j)
{
    return j == 0 || j + 1 == s->nodes;
}

bool phys_surface_moves(const struct phys_surface *s, size_t j, size_t d)
{
    return !phys_surface_at_end(s, j) || (s->whole->free[j > 0] && s->whole->free[j > 0][d]);
}

bool phys_surface_some_move(const struct phys_surface *s, size_t j)
{
    return !phys_surface_at_end(s, j) || s->whole->free[j > 0];
}

void phys_take_off(size_t dof, size_t m, const double *Q, double *x)
{
    for (size_t k = 0; k < 2 * m; k++) {
        const double *row = Q + k % m * dof, along = phys_dot(dof, row, x);
        for (size_t d = 0; d < dof; d++)
            x[d] -= along * row[d];
    }
}

static double make_unit(size_t dof, double *x)
{
    const double length = phys_norm(dof, x);
    for (size_t d = 0; d < dof && length > 0; d++)
        x[d] /= length;
    return length;
}

bool phys_surface_normals(struct phys_surface *s, size_t j, const double *q)
{
    const size_t dof = s->dof;
    bool independent = true;
    phys_constraints_evaluate(s->at, q, NULL, phys_surface_time(s, j));
    memcpy(s->Q, s->at->G, s->n * dof * sizeof *s->Q);
    for (size_t i = 0; i < s->n; i++) {
        double *row = s->Q + i * dof;
        const double length = make_unit(dof, row);
        phys_take_off(dof, i, s->Q, row);
        const double rest = make_unit(dof, row);
        independent = independent && length > 0 && isfinite(length) && rest > dependent;
    }
    return independent;
}

size_t phys_surface_free_normals(struct phys_surface *s, size_t j, const double *q)
{
    const size_t dof = s->dof;
    size_t rank = 0;
    if (!phys_surface_at_end(s, j))
        return phys_surface_normals(s, j, q) ? s->n : 0;
    phys_constraints_evaluate(s->at, q, NULL, phys_surface_time(s, j));
    for (size_t i = 0; i < s->n; i++) {
        double *G = s->at->G + i * dof, *row = s->Q + i * dof, whole = phys_norm(dof, G);
        for (size_t d = 0; d < dof; d++)
            row[d] = G[d] = phys_surface_moves(s, j, d) ? G[d] : 0;
        phys_take_off(dof, i, s->Q, row);
        const bool depends = !(make_unit(dof, row) > dependent * whole);
        if (depends) {
            memset(row, 0, dof * sizeof *row);
            memset(G, 0, dof * sizeof *G);
        }
        rank += !depends;
    }
    return rank;
}

void phys_surface_tangents(struct phys_surface *s, size_t j, size_t normals, double *Z)
{
    const size_t dof = s->dof;
    double *x = s->x, *best = s->x + dof;
    size_t m = 0;
    for (size_t d = 0; d < dof; d++)
        m += phys_surface_moves(s, j, d);
    m = m > normals ? m - normals : 0;
    memset(Z, 0, s->left * dof * sizeof *Z);
    for (size_t i = 0; i < s->left && phys_surface_at_end(s, j); i++)
        s->moves[(j > 0) * s->left + i] = i < m;
    for (size_t i = 0; i < m; i++) {
        double most = 0;
        for (size_t d = 0; d < dof; d++) {
            if (!phys_surface_moves(s, j, d))
                continue;
            memset(x, 0, dof * sizeof *x);
            x[d] = 1;
            phys_take_off(dof, s->n, s->Q, x);
            phys_take_off(dof, i, Z, x);
            const double length = phys_dot(dof, x, x);
            if (length > most) {
                most = length;
                memcpy(best, x, dof * sizeof *x);
            }
        }
        make_unit(dof, best);
        memcpy(Z + i * dof, best, dof * sizeof *best);
    }
}
