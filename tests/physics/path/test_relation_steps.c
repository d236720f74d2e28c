/* Newton's and Levenberg's steps and the inertia where ends keep linear relations, against dense
   matrices on the space that the relations leave. */
#include "physics/linear/linear.h"
#include "physics/path/inertia.h"
#include "physics/path/newton_system.h"
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const bool both[] = {true, true, true, true, true, true};

enum {
    SLICES = 5,
    DEGREE = 3,
    DOF = 6,
    MOST = ((SLICES - 1) * DEGREE + 1) * DOF,
    PATH = DEGREE * DOF * SLICES
};

/* What is left of x [n] beside `count` orthonormal rows of z; false: nothing. */
static bool orthonormal(size_t n, size_t count, const double *z, double *x)
{
    double norm = 0;
    for (size_t pass = 0; pass < 2 * count; pass++) {
        double share = 0;
        for (size_t k = 0; k < n; k++)
            share += z[pass % count * n + k] * x[k];
        for (size_t k = 0; k < n; k++)
            x[k] -= share * z[pass % count * n + k];
    }
    for (size_t k = 0; k < n; k++)
        norm += x[k] * x[k];
    for (size_t k = 0; k < n; k++)
        x[k] /= sqrt(norm);
    return norm > 1e-8;
}

/* Row z [n] in order of time is coefficient k, [2 dof], of the ends. */
static size_t end_at(const struct phys_hessian *h, size_t n, size_t k)
{
    for (size_t place = 0; place < h->dof; place++)
        if (h->order[place] == k % h->dof)
            return k < h->dof ? place : n - h->dof + place;
    return n;
}

/* Orthonormal rows that span what may move, of coordinates in units `unit` by place: their number;
   they begin at row *first of z. */
static size_t space(const struct phys_hessian *h, size_t n, const double *unit, double *z,
                    size_t *first)
{
    const struct phys_ends *ends = h->ends;
    const size_t dof = h->dof;
    size_t rows = 0;
    for (size_t r = 0; r < ends->n_relations + 2 * dof + n; r++) {
        double *row = z + rows * n;
        memset(row, 0, n * sizeof *row);
        if (r == ends->n_relations + 2 * dof)
            *first = rows;
        if (r < ends->n_relations) {
            for (size_t k = 0; k < 2 * dof; k++)
                row[end_at(h, n, k)] = ends->relation[r * (2 * dof + 1) + k];
            for (size_t k = 0; k < n; k++)
                row[k] *= unit[k % dof];
        } else if (r < ends->n_relations + 2 * dof) {
            size_t k = r - ends->n_relations;
            row[end_at(h, n, k)] = !phys_end_moves(ends, k / dof, k % dof);
        } else {
            row[r - ends->n_relations - 2 * dof] = 1;
        }
        rows += orthonormal(n, rows, z, row);
    }
    return rows - *first;
}

/* z (U H U) z^T for m rows of z. */
static void reduced(const struct phys_hessian *h, size_t n, const double *unit, size_t m,
                    const double *z, double *R)
{
    static double H[MOST * MOST], half[MOST * MOST];
    const size_t dof = h->dof, stride = h->table.degree * dof;
    memset(H, 0, sizeof H);
    for (size_t e = 0; e < h->elements; e++)
        for (size_t i = 0; i < h->side; i++)
            for (size_t j = 0; j < h->side; j++)
                H[(e * stride + i) * n + e * stride + j] +=
                    phys_hessian_entry(h, e, i / dof, i % dof, j / dof, j % dof) * unit[i % dof] *
                    unit[j % dof];
    for (size_t a = 0; a < m; a++)
        for (size_t j = 0; j < n; j++) {
            half[a * n + j] = 0;
            for (size_t i = 0; i < n; i++)
                half[a * n + j] += z[a * n + i] * H[i * n + j];
        }
    for (size_t a = 0; a < m; a++)
        for (size_t b = 0; b < m; b++) {
            R[a * m + b] = 0;
            for (size_t j = 0; j < n; j++)
                R[a * m + b] += half[a * n + j] * z[b * n + j];
        }
}

static void apply(size_t m, const double *R, const double *x, double *y)
{
    for (size_t a = 0; a < m; a++) {
        y[a] = 0;
        for (size_t b = 0; b < m; b++)
            y[a] += R[a * m + b] * x[b];
    }
}

/* (R^2 + d^2) y = -R g, or R y = -g: steps of scaled coordinates, in the space. */
static void assert_step(struct phys_hessian *h, struct phys_newton_system *band, size_t n,
                        double damping, size_t m, const double *z, const double *R)
{
    static double g[PATH], step[PATH], y[MOST], gr[MOST], Ry[MOST], RRy[MOST], Rg[MOST];
    const size_t dof = h->dof, degree = h->table.degree;
    for (size_t k = 0; k < PATH; k++)
        g[k] = cos(2.1 * (double)k);
    assert_true(phys_newton_system_factor(band, damping));
    phys_newton_system_step(band, g, step);
    double along = 0, whole = 0, most = 0;
    for (size_t a = 0; a < m; a++) {
        y[a] = gr[a] = 0;
        for (size_t k = 0; k < n; k++) {
            size_t node = k / dof,
                   at = (node % degree * dof + h->order[k % dof]) * SLICES + node / degree;
            y[a] += z[a * n + k] * step[at] / band->scale[k % dof];
            gr[a] += z[a * n + k] * g[at] * band->scale[k % dof];
        }
        along += y[a] * y[a];
    }
    for (size_t k = 0; k < n; k++) {
        size_t node = k / dof;
        double x = step[(node % degree * dof + h->order[k % dof]) * SLICES + node / degree] /
                   band->scale[k % dof];
        whole += x * x;
    }
    assert_close(along, whole, 1e-11, 0); /* all of it lies in the space */
    for (size_t k = 0; k < m * m; k++)
        most = fmax(most, fabs(R[k]));
    if (damping > 0)
        most *= most;
    apply(m, R, y, Ry);
    apply(m, R, Ry, RRy);
    apply(m, R, gr, Rg);
    for (size_t a = 0; a < m; a++)
        assert_close(damping > 0 ? RRy[a] + damping * damping * y[a] + Rg[a] : Ry[a] + gr[a], 0, 0,
                     1e-12 * most * sqrt(whole));
}

static void dense_matrices_agree(void **state)
{
    static const char *const scenes[] = {"spring", "dblpend", "threebody"}, *const rules[] = {
                                                                                "left", "gauss2",
                                                                                "gauss3"};
    static const bool some[] = {true, false, true, true, true, true};
    static double z[2 * MOST * MOST], R[MOST * MOST], work[64 * MOST], path[PATH];
    (void)state;
    for (size_t t = 0; t < 2 * LENGTH(scenes) * LENGTH(rules); t++) {
        struct phys_system system = system_opened(scenes[t / 2 % LENGTH(scenes)]);
        struct ad_error error = {0};
        struct phys_hessian h;
        struct phys_newton_system band;
        const struct phys_rule *rule = phys_rule_find(rules[t / 2 / LENGTH(scenes)], &error);
        const size_t dof = system.dof, relations = dof > 1 ? 2 : 1,
                     n = ((SLICES - 1) * rule->degree + 1) * dof;
        double relation[2 * (2 * DOF + 1)], ones[DOF];
        for (size_t k = 0; k < LENGTH(relation); k++)
            relation[k] = sin(1.7 * (double)k + 0.3);
        for (size_t k = 0; k < DOF; k++)
            ones[k] = 1;
        const struct phys_ends ends = {.size = sizeof ends,
                                       .free = {both, t % 2 ? some : both},
                                       .n_relations = relations,
                                       .relation = relation};
        phys_hessian_new(&h, &system, rule, SLICES, 0.4, NULL, &error);
        h.ends = &ends;
        for (size_t k = 0; k < LENGTH(path); k++)
            path[k] = sin(1.3 * (double)k);
        phys_hessian_at(&h, path, 0);
        phys_newton_system_new(&band, &h, 1, &error);
        assert_no_error(&error);
        phys_newton_system_scale(&band);
        size_t first, m = space(&h, n, band.scale, z, &first);
        assert_int_equal(m, n - relations - (t % 2 && dof > 1));
        reduced(&h, n, band.scale, m, z + first * n, R);
        assert_step(&h, &band, n, 0, m, z + first * n, R);
        assert_step(&h, &band, n, 0.4, m, z + first * n, R);

        struct phys_end_space moves;
        struct phys_inertia c;
        phys_end_space_new(&moves, &ends, dof, &error);
        phys_end_space_scale(&moves, h.order, NULL);
        assert_true(phys_inertia_new(&c, &h, &moves));
        phys_inertia_masses(&c, false);
        m = space(&h, n, ones, z, &first);
        size_t least = SIZE_MAX, most = 0;
        for (int shift = -6; shift <= 6; shift++) {
            double sigma = 0.17 * c.largest * shift, log_determinant = 0;
            int pivots[MOST];
            reduced(&h, n, ones, m, z + first * n, R);
            for (size_t k = 0; k < m; k++)
                R[k * m + k] -= sigma;
            assert_int_equal(phys_lapack_symmetric_factor(m, R, pivots, work), 0);
            size_t below = phys_lapack_symmetric_inertia(m, m, R, pivots, &log_determinant);
            assert_int_equal(phys_inertia_below(&c, sigma, NULL), below);
            least = below < least ? below : least;
            most = below > most ? below : most;
        }
        assert_true(least < most);
        phys_inertia_free(&c);
        phys_end_space_free(&moves);
        phys_newton_system_free(&band);
        phys_hessian_free(&h);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(dense_matrices_agree)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
