/* Nested dissection of a path's Hessian (dissected.h). */
#include "dissected.h"
#include "autodiff/free.h"
#include "physics/linear/dissection.h"

#include <stdlib.h>
#include <string.h>

enum {
    SMALLEST = 1000, /* unknowns that are worth it */
    WHOLE = 32       /* unknowns that are not divided further */
};
static const uint32_t NONE = UINT32_MAX;

bool phys_dissected_serves(const struct phys_hessian *h, size_t n)
{
    return n >= SMALLEST && h->width < h->dof && h->of->coupling.n == h->dof &&
           phys_hessian_size(h) < UINT32_MAX;
}

/* ---- fronts ---- */

struct cut {
    struct phys_dissected_path *path;
    const struct phys_dissection *sites;
    size_t degree;
};

/* The coordinates vertex[begin] up to vertex[end - 1] at nodes [from, to). */
static void add(const struct cut *c, size_t begin, size_t end, size_t from, size_t to)
{
    const struct phys_pattern *coupling = &c->path->hessian->of->coupling;
    for (size_t k = begin; k < end; k++)
        for (size_t node = from; node < to; node++)
            phys_fronts_add(&c->path->fronts, node * coupling->n +
                                                  coupling->place[c->sites->vertex[k]] -
                                                  c->path->first);
    phys_fronts_next(&c->path->fronts);
}

/* Eliminates a part of the coordinates at nodes [from, to). */
static void dissect(const struct cut *c, size_t part, size_t from, size_t to)
{
    const struct phys_dissected *at = &c->sites->part[part];
    const size_t sites = at->end - at->begin, nodes = to - from;
    const size_t middle = (from + to) / 2 / c->degree * c->degree;
    const bool in_time = middle >= from && nodes > 1, in_space = at->part[0] > 0;
    if (sites * nodes <= WHOLE || !(in_time || in_space)) {
        add(c, at->begin, at->end, from, to);
    } else if (in_time && (!in_space || sites <= (at->end - at->separator) * nodes)) {
        if (from < middle)
            dissect(c, part, from, middle);
        if (middle + 1 < to)
            dissect(c, part, middle + 1, to);
        add(c, at->begin, at->end, middle, middle + 1);
    } else {
        dissect(c, at->part[0], from, to);
        dissect(c, at->part[1], from, to);
        add(c, at->separator, at->end, from, to);
    }
}

/* What unknown u is coupled to by the elements that have its node. */
static size_t beside(const void *context, size_t u, uint32_t *to)
{
    const struct phys_dissected_path *path = context;
    const struct phys_pattern *coupling = &path->hessian->of->coupling;
    const size_t degree = path->hessian->table.degree, dof = coupling->n, n = path->fronts.n;
    const size_t node = (path->first + u) / dof, site = coupling->order[(path->first + u) % dof];
    const size_t from = node == 0 ? 0 : (node - 1) / degree * degree;
    const size_t last = (node / degree + 1) * degree;
    size_t count = 0;
    for (size_t other = from; other <= last; other++)
        for (size_t k = coupling->start[site]; k < coupling->start[site + 1]; k++) {
            const size_t v = other * dof + coupling->place[coupling->row[k]] - path->first;
            if (v < n && v != u) /* before the first it has wrapped around */
                to[count++] = (uint32_t)v;
        }
    return count;
}

/* ---- entries ---- */

/* What is done with the entries of element matrices between unknowns that may not be zero: without
   `scale` their places among the values are found; they are added there, or y -= the matrix times
   x where there is an x. */
struct use {
    const double *scale, *x;
    const bool *held;
    double *y;
};

static void visit(struct phys_dissected_path *path, struct use u)
{
    const struct phys_hessian *h = path->hessian;
    const struct phys_pattern *coupling = &h->of->coupling;
    const size_t dof = h->dof, degree = h->table.degree, n = path->fronts.n;
    uint32_t *place = path->place;
    for (size_t e = 0; e < h->elements; e++)
        for (size_t b = 0; b <= degree; b++)
            for (size_t site = 0; site < dof; site++) {
                const size_t j = coupling->place[site], end = coupling->start[site + 1];
                const size_t column = (e * degree + b) * dof + j - path->first;
                for (size_t a = 0; column < n && a <= degree; a++)
                    for (size_t k = coupling->start[site]; k < end; k++) {
                        const size_t i = coupling->place[coupling->row[k]];
                        const size_t row = (e * degree + a) * dof + i - path->first;
                        if (row >= n) /* before the first it has wrapped around */
                            continue;
                        if (!u.scale)
                            *place = (uint32_t)phys_fronts_place(&path->fronts, row, column);
                        const uint32_t at = *place++;
                        if (!u.scale || (u.held && (u.held[row] || u.held[column])))
                            continue;
                        const double entry =
                            phys_hessian_entry(h, e, a, i, b, j) * u.scale[i] * u.scale[j];
                        if (u.x)
                            u.y[row] -= entry * u.x[column];
                        else if (at != NONE)
                            path->fronts.values[path->fronts.parts * at] += entry;
                    }
            }
}

/* ---- */

bool phys_dissected_new(struct phys_dissected_path *path, const struct phys_hessian *hessian,
                        size_t first, size_t n)
{
    const struct phys_hessian *h = hessian;
    const size_t nodes = h->table.degree + 1;
    const size_t entries = h->elements * nodes * nodes * h->of->coupling.start[h->dof];
    struct phys_dissection sites = {0};
    *path = (struct phys_dissected_path){.hessian = h, .first = first};
    const struct cut cut = {path, &sites, h->table.degree};
    bool made = phys_fronts_new(&path->fronts, n) &&
                phys_dissection_new(&sites, &h->of->coupling) &&
                (path->place = malloc(entries * sizeof *path->place)) != NULL;
    if (made) {
        dissect(&cut, 0, (first + h->dof - 1) / h->dof, (first + n) / h->dof);
        made = phys_fronts_link(&path->fronts, beside, path) && path->fronts.size < NONE;
    }
    if (made)
        visit(path, (struct use){0});
    phys_dissection_free(&sites);
    return made;
}

void phys_dissected_free(struct phys_dissected_path *path)
{
    phys_fronts_free(&path->fronts);
    free(path->place);
    *path = (struct phys_dissected_path){0};
}

double phys_dissected_bytes(const struct phys_dissected_path *path, size_t parts)
{
    return (double)parts * path->fronts.bytes;
}

bool phys_dissected_factor(struct phys_dissected_path *path, const double *scale, double damping,
                           const bool *held, bool *no_memory)
{
    struct phys_fronts *f = &path->fronts;
    *no_memory = !phys_fronts_clear(f, damping > 0 ? 2 : 1);
    if (*no_memory)
        return false;
    visit(path, (struct use){.scale = scale, .held = held});
    for (size_t u = 0; u < f->n; u++) {
        double *diagonal = f->values + f->parts * phys_fronts_place(f, u, u);
        diagonal[0] += held && held[u] ? 1 : 0;
        if (damping > 0)
            diagonal[1] = -damping;
    }
    return phys_fronts_factor(f, no_memory);
}

/* Pivots are chosen among few: an error that this leaves is corrected once. */
static void refine(struct phys_dissected_path *path, const double *scale, const bool *held,
                   const double *right, double *x)
{
    const size_t n = path->fronts.n;
    double *rest = x + n;
    memcpy(rest, right, n * sizeof *rest);
    visit(path, (struct use){.scale = scale, .held = held, .x = x, .y = rest});
    for (size_t u = 0; held && u < n; u++)
        rest[u] -= held[u] ? x[u] : 0;
    phys_fronts_solve(&path->fronts, rest);
    for (size_t u = 0; u < n; u++)
        x[u] += rest[u];
}

void phys_dissected_solve(struct phys_dissected_path *path, const double *scale, const bool *held,
                          double *right, double *x)
{
    struct phys_fronts *f = &path->fronts;
    for (size_t u = f->parts * f->n; u-- > 0;)
        x[u] = u % f->parts == 0 ? right[u / f->parts] : 0;
    phys_fronts_solve(f, x);
    if (f->parts == 1)
        refine(path, scale, held, right, x);
    for (size_t u = 0; u < f->n; u++)
        right[u] = x[f->parts * u];
}
