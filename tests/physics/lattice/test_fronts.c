/* Nested dissection: sparse systems put back into their equations, and Newton steps of paths of a
   membrane beside those of the band. */
#include "docs/examples/membrane.c"
#include "physics/linear/dissection.h"
#include "physics/linear/fronts.h"
#include "physics/path/newton_system.h"
#include "tests/close.h"

#include <complex.h>
#include <string.h>

enum { N = 400 };

/* Points of the unit cube that are near to each other; the last one is alone, and those beyond
   x = 1/2 are away from the others. */
static void make_graph(struct phys_pattern *pattern)
{
    uint32_t at[N + 1] = {0}, (*pair)[2] = malloc((size_t)N * N * sizeof *pair);
    size_t n = 0;
    double x[N][3];
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < 3; k++)
            x[i][k] = fmod(0.5 + (double)(3 * i + k + 1) * (k == 0 ? 0.618034 : 0.754878), 1);
    for (uint32_t i = 0; i < N; i++) {
        at[i] = (uint32_t)n;
        for (uint32_t j = 0; j < N; j++) {
            double d = 0;
            for (size_t k = 0; k < 3; k++)
                d += pow(x[i][k] - x[j][k], 2);
            if (i == j ||
                (d < 0.05 && (x[i][0] < 0.5) == (x[j][0] < 0.5) && i + 1 < N && j + 1 < N))
                pair[n][0] = i, pair[n++][1] = j;
        }
    }
    at[N] = (uint32_t)n;
    *pattern = (struct phys_pattern){.n = N};
    pattern->start = malloc((N + 1) * sizeof *pattern->start);
    pattern->row = malloc(n * sizeof *pattern->row);
    for (size_t i = 0; i <= N; i++)
        pattern->start[i] = at[i];
    for (size_t k = 0; k < n; k++)
        pattern->row[k] = pair[k][1];
    free(pair);
}

static size_t beside(const void *context, size_t u, uint32_t *to)
{
    const struct phys_pattern *p = context;
    const size_t n = p->start[u + 1] - p->start[u];
    memcpy(to, p->row + p->start[u], n * sizeof *to);
    return n;
}

/* Fronts by the parts of a dissection, in each of which every vertex is once, and none beside one
   of the other part. */
static void eliminate_parts(const struct phys_pattern *p, const struct phys_dissection *d,
                            size_t part, struct phys_fronts *f)
{
    const struct phys_dissected *at = &d->part[part];
    const size_t left = at->part[0] ? d->part[at->part[0]].end : at->begin;
    for (size_t k = at->begin; k < left; k++)
        for (size_t j = left; j < at->separator; j++)
            assert_false(phys_pattern_has(p, d->vertex[k], d->vertex[j]));
    for (int side = 0; at->part[0] && side < 2; side++) {
        assert_true(d->part[at->part[side]].end > d->part[at->part[side]].begin);
        eliminate_parts(p, d, at->part[side], f);
    }
    for (size_t k = at->separator; k < at->end; k++)
        phys_fronts_add(f, d->vertex[k]);
    phys_fronts_next(f);
}

static double complex entry(size_t i, size_t j, size_t parts)
{
    const size_t low = i < j ? i : j, high = i < j ? j : i;
    return sin(1.7 * (double)(low + 3 * high)) + (i == j ? 2 * cos(3.1 * (double)i) : 0) +
           (parts == 2 ? I * cos(0.9 * (double)(3 * low + high)) : 0);
}

static void set_entries(const struct phys_pattern *p, struct phys_fronts *f, size_t parts)
{
    assert_true(phys_fronts_clear(f, parts));
    for (size_t j = 0; j < N; j++)
        for (size_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const size_t at = phys_fronts_place(f, p->row[k], j);
            assert_true(at != SIZE_MAX || phys_fronts_place(f, j, p->row[k]) < f->size);
            if (at == SIZE_MAX)
                continue;
            f->values[parts * at] = creal(entry(p->row[k], j, parts));
            if (parts == 2)
                f->values[parts * at + 1] = cimag(entry(p->row[k], j, parts));
        }
}

static void sparse_equations_are_solved(void **state)
{
    struct phys_pattern p;
    struct phys_dissection d;
    struct phys_fronts f;
    bool no_memory;
    (void)state;
    make_graph(&p);
    assert_true(phys_dissection_new(&d, &p) && d.part[0].part[0] > 0);
    assert_true(phys_fronts_new(&f, N));
    eliminate_parts(&p, &d, 0, &f);
    assert_int_equal(f.placed, N);
    assert_true(phys_fronts_link(&f, beside, &p));
    assert_true(f.operations < 0.1 * 2. / 3 * N * (double)N * N);
    for (size_t parts = 1; parts <= 2; parts++) {
        double x[2 * N], b[2 * N] = {0}, most = 0;
        for (size_t k = 0; k < parts * N; k++)
            x[k] = b[k] = sin(0.3 * (double)k);
        set_entries(&p, &f, parts);
        assert_true(phys_fronts_factor(&f, &no_memory));
        phys_fronts_solve(&f, x);
        for (size_t j = 0; j < N; j++) {
            double complex r = b[parts * j] + (parts == 2 ? I * b[2 * j + 1] : 0);
            for (size_t k = p.start[j]; k < p.start[j + 1]; k++) {
                const size_t i = p.row[k];
                r -= entry(i, j, parts) * (x[parts * i] + (parts == 2 ? I * x[2 * i + 1] : 0));
            }
            most = fmax(most, cabs(r));
        }
        assert_close(most, 0, 0, 1e-9);
    }
    /* an unknown that nothing holds, and one that holds by rounding alone */
    for (double tiny = 0; tiny < 1e-8; tiny += 1e-9) {
        set_entries(&p, &f, 1);
        const size_t u = d.vertex[0];
        for (size_t k = p.start[u]; tiny == 0 && k < p.start[u + 1]; k++)
            for (int turn = 0; turn < 2; turn++) {
                const size_t at = phys_fronts_place(&f, turn ? u : p.row[k], turn ? p.row[k] : u);
                f.values[at == SIZE_MAX ? phys_fronts_place(&f, u, u) : at] = 0;
            }
        for (size_t k = 0; tiny > 0 && k < f.front[0].pivots; k++)
            for (size_t j = 0; j < f.front[0].pivots; j++)
                f.values[f.front[0].at + j * f.front[0].pivots + k] = k == j ? tiny : 0;
        assert_false(phys_fronts_factor(&f, &no_memory) || no_memory);
    }
    phys_fronts_free(&f);
    phys_dissection_free(&d);
    phys_pattern_free(&p);
}

/* Of a membrane of 16 x 16: both ends given, or the last one where every third mass is free. */
static void steps_are_those_of_the_band(void **state)
{
    enum { SITES = 256, TIMES = 13, MOST = 4 * SITES * TIMES };
    static const struct {
        const char *rule;
        double damping;
        bool free;
    } cases[] = {
        {"gauss2", 0, true}, {"gauss2", 0.2, false}, {"gauss4", 0, false}, {"gauss4", 0.2, true}};
    static double path[MOST], gradient[MOST], step[2][MOST];
    bool free_end[SITES];
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_system_make(&leastaction_scene, &system, &error), AD_OK);
    phys_system_set(&system, "columns", 16, &error);
    phys_system_set(&system, "rows", 16, &error);
    phys_system_set(&system, "beta", 0.3, &error);
    for (size_t k = 0; k < MOST; k++) {
        path[k] = sin(1.3 * (double)k);
        gradient[k] = cos(2.1 * (double)k);
    }
    for (size_t k = 0; k < SITES; k++)
        free_end[k] = k % 3 == 0;
    const struct phys_ends free_ends = {.size = sizeof free_ends, .free = {NULL, free_end}};
    for (size_t r = 0; r < LENGTH(cases); r++) {
        const struct phys_rule *rule = phys_rule_find(cases[r].rule, &error);
        struct phys_hessian h;
        struct phys_newton_system newton;
        double size = 0;
        assert_int_equal(phys_hessian_new(&h, &system, rule, TIMES, 0.4, NULL, &error), AD_OK);
        if (cases[r].free) {
            h.ends = &free_ends;
            h.free[1] = free_end;
        }
        phys_hessian_at(&h, path, 0);
        for (int band = 0; band < 2; band++) {
            assert_int_equal(phys_newton_system_new(&newton, &h, 1, &error), AD_OK);
            newton.no_fronts = band;
            phys_newton_system_scale(&newton);
            assert_true(phys_newton_system_factor(&newton, cases[r].damping));
            assert_int_equal(newton.by_fronts, !band);
            phys_newton_system_step(&newton, gradient, step[band]);
            size = phys_newton_system_norm(&newton, step[band]);
            phys_newton_system_free(&newton);
        }
        for (size_t k = 0; k < rule->degree * SITES * TIMES; k++)
            assert_close(step[0][k], step[1][k], 0, 1e-10 * size);
        phys_hessian_free(&h);
    }
    phys_system_close(&system);
}

/* The lowest mode is a closed form. */
static void a_membrane_swings_as_it_should(void **state)
{
    struct phys_system system;
    struct ad_error error = {0};
    double q[2 * 63], path[2 * 63];
    (void)state;
    assert_int_equal(phys_system_make(&leastaction_scene, &system, &error), AD_OK);
    phys_system_set(&system, "columns", 7, &error);
    phys_system_set(&system, "rows", 9, &error);
    const double w = 2 * hypot(sin(M_PI / 16), sin(M_PI / 20));
    assert_int_equal(start(system.params, 0, q, q + 63, &error), AD_OK);
    assert_int_equal(phys_motion_path(&system, NULL, q, q + 63, 2, 3, path, &error), AD_OK);
    for (size_t k = 0; k < 63; k++)
        assert_close(path[2 * k + 1], q[k] * cos(3 * w), 0, 1e-9);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(sparse_equations_are_solved),
                                       cmocka_unit_test(steps_are_those_of_the_band),
                                       cmocka_unit_test(a_membrane_swings_as_it_should)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
