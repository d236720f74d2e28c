/* Isolation of roots: polynomials, functions of many oscillations, close pairs, touches, noise. */
#include "tests/close.h"
#include "tests/physics/motion.h"
#include "physics/motion/roots.h"

static struct phys_root found[PHYS_ROOTS_MOST];

static size_t roots_of(phys_root_function *f, void *context, double a, double b)
{
    struct phys_roots_table table;
    phys_roots_fill(&table);
    return phys_roots(&table, f, context, a, b, found);
}

static double pair(void *context, double x)
{
    double gap = *(const double *)context;
    return (x - 0.3123) * (x - 0.3123) - 0.25 * gap * gap;
}

static double touching(void *context, double x)
{
    (void)context;
    return 1.57 + pow(sin(3 * (x - 0.41)), 2) - 1.57;
}

static double waves(void *context, double x) { return sin(*(const double *)context * x + 0.2); }
static double cube(void *context, double x) { return (void)context, pow(x - 0.7, 3); }
static double none(void *context, double x) { return (void)context, 1e-9 + x * x; }
static double zero(void *context, double x) { return (void)context, (void)x, 0; }
static double lost(void *context, double x) { return (void)context, x > 0.5 ? NAN : x - 0.1; }
static double line(void *context, double x) { return x - *(const double *)context; }

/* Two roots however near, as long as the gap is above rounding; then one touch. */
static void test_close_pairs(void **state)
{
    (void)state;
    for (double gap = 0.5; gap > 1e-6; gap *= 0.1) {
        assert_int_equal(roots_of(pair, &gap, 0, 1), 2);
        assert_close(found[1].x - found[0].x, gap, 1e-3, 0);
        assert_int_equal(found[0].kind, -1);
        assert_int_equal(found[1].kind, 1);
    }
    double gap = 0;
    assert_int_equal(roots_of(pair, &gap, 0, 1), 1);
    assert_int_equal(found[0].kind, 0);
    assert_close(found[0].x, 0.3123, 0, 1e-6);
    assert_int_equal(roots_of(touching, NULL, 0, 1), 1);
    assert_int_equal(found[0].kind, 0);
    assert_close(found[0].x, 0.41, 0, 1e-6);
}

static void test_many(void **state)
{
    (void)state;
    for (double w = 5; w < 700; w *= 1.7) {
        size_t n = (size_t)floor((w + 0.2) / M_PI);
        assert_int_equal(roots_of(waves, &w, 0, 1), n);
        for (size_t k = 0; k < n; k++) {
            assert_close(found[k].x, ((double)(k + 1) * M_PI - 0.2) / w, 0, 1e-14);
            assert_int_equal(found[k].kind, k % 2 ? 1 : -1);
        }
    }
}

static void test_ends_and_nothing(void **state)
{
    (void)state;
    for (double x = 0.001; x < 1; x += 0.0371) {
        assert_int_equal(roots_of(line, &x, 0, 1), 1);
        assert_close(found[0].x, x, 1e-14, 0);
    }
    assert_int_equal(roots_of(none, NULL, -1, 1), 0);
    assert_int_equal(roots_of(cube, NULL, 0, 1), 1);
    assert_int_equal(found[0].kind, 1);
    assert_int_equal(roots_of(zero, NULL, 0, 1), 0); /* not a crossing, and the search ends */
    assert_in_range(roots_of(lost, NULL, 0, 1), 0, 1);
}

struct count {
    size_t n;
};

static void place(void *context, double t, const double *y, double *g)
{
    (void)context, (void)t;
    g[0] = y[0];
}

static bool note(void *context, size_t k, double t, const double *y)
{
    struct count *c = context;
    (void)k, (void)t;
    assert_close(y[0], 0, 0, 1e-9);
    c->n++;
    return true;
}

/* A12: steps of more than a period; what lies within them is followed more finely. */
static void test_steps_of_many_periods(void **state)
{
    (void)state;
    for (double dt = 0.5; dt <= 8; dt *= 2) {
        struct count count = {0};
        struct motion m;
        const struct phys_events events = {
            .n = 1, .values = place, .found = note, .context = &count};
        motion_open(&m, "spring", false, NULL);
        m.settings.events = &events;
        m.settings.n_events = 1;
        motion_run(&m, "gauss5", dt, 96, AD_OK);
        assert_in_range(count.n, 30, 32); /* 96 / pi = 30.6; gauss5's phase errs at dt 8 */
        motion_close(&m);
    }
}

/* The bound of the error of interpolation (docs/theory.md, Events): where the eighth derivative
   varies by less than a factor of 2, the error is nowhere more than twice the largest at the nine
   extrema of T_8; and the product of the distances from the nodes is 2/4^8 T_8. */
static double smooth(int k, double x)
{
    return k == 0 ? exp(0.6 * x) : k == 1 ? 1 / (14 + x) : k == 2 ? sin(x + 1) : pow(x + 1.7, 8.5);
}

static void test_bound(void **state)
{
    (void)state;
    enum { N = PHYS_ROOTS_N, FINE = 2000 };
    struct phys_roots_table table;
    phys_roots_fill(&table);
    for (int k = 0; k < 4; k++) {
        double c[N] = {0}, at_extrema = 0, anywhere = 0, size = 0;
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++)
                c[j] += table.coefficient[j][i] * smooth(k, 0.5 - 0.5 * cos((i + 0.5) * M_PI / N));
        for (int i = 0; i <= N; i++) {
            double p = 0, x = 0.5 - 0.5 * cos(i * M_PI / N);
            for (int j = 0; j < N; j++)
                p += table.value[i][j] * c[j];
            at_extrema = fmax(at_extrema, fabs(p - smooth(k, x)));
            size = fmax(size, fabs(smooth(k, x)));
        }
        for (int i = 0; i <= FINE; i++) {
            double p = 0, x = (double)i / FINE, product = 1;
            static const double binomial[N] = {1, 7, 21, 35, 35, 21, 7, 1};
            for (int j = 0; j < N; j++) {
                p += c[j] * binomial[j] * pow(x, j) * pow(1 - x, N - 1 - j);
                product *= x - (0.5 - 0.5 * cos((j + 0.5) * M_PI / N));
            }
            anywhere = fmax(anywhere, fabs(p - smooth(k, x)));
            assert_close(product, 2 * pow(0.25, 8) * cos(8 * acos(2 * x - 1)), 0, 1e-15);
        }
        assert_true(anywhere <= 2 * at_extrema + 1e-14 * size);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bound),
        cmocka_unit_test(test_close_pairs),
        cmocka_unit_test(test_many),
        cmocka_unit_test(test_ends_and_nothing),
        cmocka_unit_test(test_steps_of_many_periods),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
