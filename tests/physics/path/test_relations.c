/* Paths whose ends keep linear relations, against closed forms, and their steps and inertia against
   dense matrices on the space that the relations leave. */
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

/* ---- an oscillator with x(T) = a x(0) + b ---- */

/* A cos t + B sin t, with a p(T) = p(0) by transversality. */
static void coefficients(double a, double b, double T, double *A, double *B)
{
    double c = cos(T), s = sin(T), m[4] = {c - a, s, -a * s, a * c - 1};
    double det = m[0] * m[3] - m[1] * m[2];
    *A = b * m[3] / det;
    *B = -b * m[2] / det;
}

/* Jacobi fields that keep the relation with b = 0 have frequencies with cos(w T) = 2 a / (1 + a^2),
   and the second variation the eigenvalues w^2 - 1. */
static size_t negative(double a, double T, double *smallest)
{
    double angle = acos(2 * a / (1 + a * a));
    size_t count = angle < T;
    *smallest = angle / T * angle / T - 1;
    for (double turn = 2 * M_PI; turn - angle < T; turn += 2 * M_PI)
        count += turn + angle < T ? 2 : 1;
    return count;
}

static double oscillator_error(const struct phys_system *system, const struct phys_solver *solver,
                               const struct phys_rule *rule, size_t slices, double a, double b,
                               double T, struct phys_path_found *found)
{
    const double relation[] = {-a, 1, b};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {both, both}, .n_relations = 1, .relation = relation};
    struct ad_error error = {0};
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = rule,
                                                .slices = slices,
                                                .steps = 10000,
                                                .learning_rate = 0.1,
                                                .dt = T / (double)(slices - 1),
                                                .ends = &ends};
    double *path = calloc(rule->degree * slices, sizeof *path), A, B, most = 0;
    phys_path_find(solver, system, &settings, path, found, &error);
    assert_no_error(&error);
    coefficients(a, b, T, &A, &B);
    for (size_t i = 0; i < slices; i++) {
        double t = (double)i * settings.dt;
        most = fmax(most, fabs(path[i] - A * cos(t) - B * sin(t)));
    }
    assert_close(path[slices - 1], a * path[0] + b, 1e-14, 1e-14);
    free(path);
    return most;
}

static void oscillator(void **state)
{
    static const double as[] = {-1, 1, 0.6, -1.7}, times[] = {1.1, 2.3, 5.3, 7.7};
    struct phys_system system = system_opened("spring");
    (void)state;
    for (size_t k = 0; k < LENGTH(as) * LENGTH(times); k++)
        for (const struct phys_rule *const *rule = phys_rules; *rule; rule++) {
            const double a = as[k % LENGTH(as)], T = times[k / LENGTH(as)];
            double error[2], smallest;
            const size_t index = negative(a, T, &smallest);
            for (size_t fine = 0; fine < 2; fine++) {
                struct phys_path_found found;
                error[fine] = oscillator_error(&system, &phys_solver_newton, *rule, fine ? 129 : 65,
                                               a, 0.7, T, &found);
                assert_int_equal(found.info.stop, PHYS_STOP_ROUNDING);
                assert_false(found.spectrum.undetermined);
                assert_int_equal(found.spectrum.index, index);
                assert_int_equal(found.spectrum.n_conjugate, 0);
                if ((*rule)->order > 3)
                    assert_close(found.spectrum.second_variation, smallest, 1e-6, 1e-9);
                if ((*rule)->order > 1)
                    assert_true(found.free_momentum < 100 * error[fine] + 1e-10);
                phys_path_found_free(&found);
            }
            if (error[1] > 1e-11)
                assert_true(error[0] > 0.75 * pow(2, (double)(*rule)->order) * error[1]);
            assert_true(error[1] < ((*rule)->order == 1 ? 1 : 6e-3));
        }
    phys_system_close(&system);
}

/* A minimum, by descent. */
static void oscillator_by_descent(void **state)
{
    struct phys_system system = system_opened("spring");
    struct phys_path_found found;
    struct ad_error error = {0};
    (void)state;
    const double away = oscillator_error(
        &system, &phys_solver_lbfgs, phys_rule_find("gauss2", &error), 17, -1, 0.7, 1.3, &found);
    assert_true(away < 1e-6);
    assert_true(found.free_momentum < 1e-5);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

/* ---- Kepler's problem: the end is the start, turned ---- */

/* On the x axis and turned by `angle` after T: a circle. Radial momenta agree. */
static void turned_orbit(void **state)
{
    enum { N = 9 };
    const double angle = 2 * M_PI / 3, T = 3, r = pow(T / angle, 2.0 / 3);
    const double relation[] = {-cos(angle), 0, 1, 0, 0, -sin(angle), 0, 0, 1, 0};
    static const bool on_axis[] = {true, false};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {on_axis, both}, .n_relations = 2, .relation = relation};
    struct phys_path_settings settings = {
        .size = sizeof settings, .slices = N, .steps = 100, .dt = T / (N - 1), .ends = &ends};
    struct phys_system system = system_opened("kepler");
    struct phys_refined refined;
    struct ad_error error = {0};
    double line[2 * N];
    (void)state;
    for (size_t i = 0; i < N; i++) {
        line[i] = 1 - 1.5 * (double)i / (N - 1);
        line[N + i] = 0.9 * (double)i / (N - 1);
    }
    phys_path_refine(&system, &settings, line, 0, 1e-10, &refined, &error);
    assert_no_error(&error);
    const size_t n = refined.settings->slices;
    for (size_t i = 0; i < n; i++) {
        double at = angle * (double)i / (double)(n - 1);
        assert_close(refined.path[i], r * cos(at), 0, 1e-10);
        assert_close(refined.path[n + i], r * sin(at), 0, 1e-10);
    }
    assert_false(refined.spectrum.undetermined);
    phys_refined_free(&refined);
    phys_system_close(&system);
}

/* Left free to be turned as a whole it is one of a family: no index, and no tolerance is met. */
static void orbit_of_a_family(void **state)
{
    enum { N = 9, FINE = 17 };
    const double angle = 2 * M_PI / 3, T = 3, r = pow(T / angle, 2.0 / 3);
    const double relation[] = {-cos(angle), sin(angle), 1, 0, 0, -sin(angle), -cos(angle), 0, 1, 0};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {both, both}, .n_relations = 2, .relation = relation};
    struct phys_path_settings settings = {
        .size = sizeof settings, .slices = N, .steps = 100, .dt = T / (N - 1), .ends = &ends};
    struct phys_system system = system_opened("kepler");
    struct phys_refined refined;
    struct phys_path_found found;
    struct ad_error error = {0};
    double path[8 * FINE];
    (void)state;
    for (size_t i = 0; i < FINE; i++) {
        double at = angle * (double)i / (FINE - 1);
        path[i] = 1.1 * r * cos(at) + 0.02;
        path[FINE + i] = 0.9 * r * sin(at);
    }
    double coarse[2 * N];
    for (size_t k = 0; k < 2 * N; k++)
        coarse[k] = path[k / N * FINE + k % N * 2];
    assert_int_equal(phys_path_refine(&system, &settings, coarse, 0, 1e-6, &refined, &error),
                     AD_E_ACCURACY);
    phys_refined_free(&refined);
    error = (struct ad_error){0};
    settings.rule = phys_rule_find("gauss4", &error);
    settings.slices = FINE;
    settings.dt = T / (FINE - 1);
    phys_rule_interpolate(settings.rule, 2, FINE, path);
    phys_path_find(&phys_solver_newton, &system, &settings, path, &found, &error);
    assert_no_error(&error);
    assert_int_equal(found.info.stop, PHYS_STOP_ROUNDING);
    for (size_t i = 0; i < FINE; i++)
        assert_close(hypot(path[i], path[FINE + i]), r, 0, 1e-9);
    assert_true(found.free_momentum < 1e-9);
    assert_true(found.spectrum.undetermined);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

/* ---- dense matrices ---- */

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

/* ---- refusals ---- */

static void what_is_refused(void **state)
{
    static const bool end_given[] = {false};
    static const struct {
        const bool *free[2];
        size_t n;
        double relation[6];
        const char *what;
    } cases[] = {
        {{both, both}, 2, {1, -1, 0.2, 2, -2, 0.4}, "relation 2 between the ends follows"},
        {{both, both}, 2, {1, -1, 0.2, 2, -2, 0.5}, "relation 2 between the ends contradicts"},
        {{both, both}, 1, {0, 0, 0}, "relation 1 between the ends follows"},
        {{both, both}, 1, {0, 0, 1}, "relation 1 between the ends contradicts"},
        {{NULL, end_given}, 1, {1, -1, -0.3}, "relation 1 between the ends follows"},
        {{NULL, end_given}, 1, {1, -1, 0.3}, "relation 1 between the ends contradicts"},
        {{both, both}, 1, {1, NAN, 0.3}, "relation 1 between the ends: got nan"},
    };
    struct phys_system system = system_opened("spring");
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        const struct phys_ends ends = {.size = sizeof ends,
                                       .free = {cases[k].free[0], cases[k].free[1]},
                                       .n_relations = cases[k].n,
                                       .relation = cases[k].relation};
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_path_info info;
        struct ad_error error = {0};
        double path[5] = {0, 0, 0, 0, 0.3};
        settings.slices = 5;
        settings.ends = &ends;
        assert_int_equal(
            phys_path_solve(&phys_solver_newton, &system, &settings, path, &info, &error),
            AD_E_ARGUMENT);
        if (!strstr(error.message, cases[k].what))
            fail_msg("'%s' for '%s'", error.message, cases[k].what);
        error = (struct ad_error){0};
        assert_int_equal(phys_path_solve(&phys_solver_sgd, &system, &settings, path, &info, &error),
                         AD_E_ARGUMENT);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(oscillator),           cmocka_unit_test(oscillator_by_descent),
        cmocka_unit_test(turned_orbit),         cmocka_unit_test(orbit_of_a_family),
        cmocka_unit_test(dense_matrices_agree), cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
