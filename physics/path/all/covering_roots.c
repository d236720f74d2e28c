/* Roots of an end map, alone or in families (covering.h). */
#include "covering.h"
#include "physics/io/grow.h"

#include <math.h>
#include <string.h>

enum { DOF = PHYS_END_MAP_DOF, ITERATIONS = 25, HALVINGS = 6 };

static const double CLOSED = 1e-9;   /* |miss| of a root */
static const double SINGULAR = 1e-6; /* a singular value that is 0, relative to the largest, or to
                                        that of a free motion */
static const double SAME = 1e-6;     /* distance of roots that are one, relative to the speed */
static const double SPREAD = 0.02, NEIGHBOUR = 0.2; /* of a family's roots, relative to the speed */

/* A root from w, and its singular directions `null` [rows of return's dimension]; -1: none. */
static int polish(struct phys_end_map *map, double *w, double null[][DOF])
{
    size_t n = map->dof;
    double g[DOF], J[DOF * DOF], next[DOF], there[DOF], other[DOF * DOF];
    struct phys_singular s;
    if (!phys_end_map_at(map, w, PHYS_END_MAP_TIGHT, g, J))
        return -1;
    for (int k = 0; k < ITERATIONS; k++) {
        double step[DOF] = {0}, length = 1, size = phys_end_norm(n, g);
        phys_singular_values(n, J, &s);
        double least = SINGULAR * fmax(s.size[0], map->time * map->unit[0] / map->reach);
        for (size_t r = 0; r < n && s.size[r] > least; r++) {
            double along = 0;
            for (size_t i = 0; i < n; i++)
                along += s.left[r][i] * g[i] / s.size[r];
            for (size_t i = 0; i < n; i++)
                step[i] -= along * s.right[r][i];
        }
        if (size <= CLOSED && phys_end_norm(n, step) <= SAME * (phys_end_norm(n, w) + map->speed)) {
            int dimension = 0;
            for (size_t r = 0; r < n; r++)
                if (s.size[r] <= least)
                    memcpy(null[dimension++], s.right[r], sizeof s.right[r]);
            if (size > 1e-3 * CLOSED && k + 1 < ITERATIONS && dimension == 0)
                for (size_t i = 0; i < n; i++)
                    w[i] += step[i];
            return dimension;
        }
        int h = 0;
        for (; h < HALVINGS; h++, length *= 0.5) {
            for (size_t i = 0; i < n; i++)
                next[i] = w[i] + length * step[i];
            if (phys_end_map_at(map, next, PHYS_END_MAP_TIGHT, there, other) &&
                phys_end_norm(n, there) < size)
                break;
        }
        if (h == HALVINGS)
            return -1;
        memcpy(w, next, sizeof next);
        memcpy(g, there, sizeof g);
        memcpy(J, other, sizeof J);
    }
    return -1;
}

static struct phys_end_root *add_root(struct phys_end_roots *roots, const double *w, size_t n,
                                      struct ad_error *error)
{
    if (!phys_grow(&roots->root, roots->n, sizeof *roots->root)) {
        ad_fail(error, AD_E_MEMORY, "out of memory for another path");
        return NULL;
    }
    struct phys_end_root *root = &roots->root[roots->n];
    *root = (struct phys_end_root){.family = roots->n++};
    memcpy(root->w, w, n * sizeof *w);
    return root;
}

/* Whether roots go on from w in the direction of `null`: that w is no fold. */
static bool goes_on(struct phys_end_map *map, const double *w, const double *null, double by)
{
    double next[DOF], other[DOF][DOF];
    for (size_t i = 0; i < map->dof; i++)
        next[i] = w[i] + by * null[i];
    return polish(map, next, other) > 0 && phys_end_distance(map->dof, w, next) > 0.5 * by;
}

/* Whether two roots of families are joined by one half-way. */
static bool joined(struct phys_end_map *map, const double *a, const double *b)
{
    double middle[DOF], null[DOF][DOF], apart = phys_end_distance(map->dof, a, b);
    for (size_t i = 0; i < map->dof; i++)
        middle[i] = 0.5 * (a[i] + b[i]);
    return polish(map, middle, null) > 0 && phys_end_distance(map->dof, a, middle) < 0.75 * apart &&
           phys_end_distance(map->dof, b, middle) < 0.75 * apart;
}

static void keep_family(struct phys_covering *c, const double *w, size_t dimension,
                        struct ad_error *error)
{
    size_t n = c->map->dof, had = c->roots->n, family = had;
    for (size_t k = 0; k < had; k++) { /* one of its roots is near: a smooth family has no other */
        const struct phys_end_root *a = &c->roots->root[k];
        if (a->dimension > 0 && phys_end_near(n, a->w, w, SPREAD * c->outer)) {
            c->roots->root[a->family].coverings |= 1u << c->number;
            return;
        }
    }
    for (size_t k = 0; k < had; k++) {
        const struct phys_end_root *a = &c->roots->root[k];
        if (a->dimension == 0 || a->family == family ||
            !phys_end_near(n, a->w, w, NEIGHBOUR * c->outer) || !joined(c->map, a->w, w))
            continue;
        size_t from = family < a->family ? a->family : family;
        size_t to = family < a->family ? family : a->family;
        if (from < had)
            c->roots->root[to].coverings |= c->roots->root[from].coverings;
        for (size_t j = 0; j < had; j++)
            if (c->roots->root[j].family == from)
                c->roots->root[j].family = to;
        family = to;
    }
    struct phys_end_root *root = add_root(c->roots, w, n, error);
    if (!root)
        return;
    root->dimension = dimension;
    root->family = family;
    c->roots->root[family].coverings |= 1u << c->number;
}

int phys_cover_near(struct phys_covering *c, double *w, struct ad_error *error)
{
    size_t n = c->map->dof;
    double null[DOF][DOF];
    int dimension = polish(c->map, w, null);
    const double size = phys_end_norm(n, w);
    if (dimension < 0)
        return -1;
    if (c->bounded && !(size > SAME * c->map->speed && size <= c->outer))
        return dimension;
    if (dimension > 0 && goes_on(c->map, w, null[0], SPREAD * c->outer)) {
        keep_family(c, w, (size_t)dimension, error);
        return dimension;
    }
    const double same = SAME * (size + c->map->speed);
    struct phys_end_root *known = NULL;
    for (size_t k = 0; k < c->roots->n && !known; k++)
        if (phys_end_near(n, c->roots->root[k].w, w, same))
            known = &c->roots->root[k];
    if (!known)
        known = add_root(c->roots, w, n, error);
    if (known)
        known->coverings |= 1u << c->number;
    return 0;
}
