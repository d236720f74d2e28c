/* The tables of Runge-Kutta methods, digit by digit: the order conditions of all rooted trees
   (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.2), for the
   solution, the error estimates, and the dense output. */
#include "tests/close.h"
#include "physics/integrators/stepper.h"

#include <string.h>

enum { ORDER = 8, STAGES = 16, TREES = 200 }; /* 1 + 1 + 2 + 4 + 9 + 20 + 48 + 115 trees */

/* A tree: its order and density, and the product of sums over its branches at every slope. */
struct tree {
    size_t order;
    double density, phi[STAGES];
};

/* A method with all its slopes: a full matrix, f(t + h, next) and the extra stages included. */
struct full {
    size_t n;
    double a[STAGES][STAGES];
};

static struct full full_of(const struct phys_butcher *table)
{
    struct full f = {.n = table->stages + 1 + table->extra};
    const double *row = table->a;
    for (size_t i = 1; i < f.n; i++) {
        bool end = i == table->stages;
        for (size_t j = 0; j < i; j++)
            f.a[i][j] = end ? table->b[j] : row[j];
        if (!end)
            row += i;
    }
    return f;
}

/* Adds all trees whose branches are `tree`'s and `left` more nodes in branches of numbers up to
   `last`. */
static void grow(const struct full *f, struct tree *trees, size_t *count, struct tree tree,
                 size_t left, size_t last, const size_t *first_of_order)
{
    if (left == 0) {
        tree.density *= (double)tree.order;
        assert_true(*count < TREES);
        trees[(*count)++] = tree;
        return;
    }
    for (size_t k = 0; k < first_of_order[left + 1] && k <= last; k++) {
        struct tree more = tree;
        more.density *= trees[k].density;
        for (size_t i = 0; i < f->n; i++) {
            double sum = 0;
            for (size_t j = 0; j < f->n; j++)
                sum += f->a[i][j] * trees[k].phi[j];
            more.phi[i] *= sum;
        }
        grow(f, trees, count, more, left - trees[k].order, k, first_of_order);
    }
}

static size_t grow_all(const struct full *f, struct tree *trees)
{
    size_t first_of_order[ORDER + 2] = {0}, count = 0;
    for (size_t order = 1; order <= ORDER; order++) {
        struct tree root = {.order = order, .density = 1};
        for (size_t i = 0; i < f->n; i++)
            root.phi[i] = 1;
        grow(f, trees, &count, root, order - 1, SIZE_MAX, first_of_order);
        first_of_order[order + 1] = count;
    }
    assert_int_equal(count, TREES);
    return count;
}

/* sum_i w_i phi_i(tree) = goal^order / density for all trees up to `order`, and not beyond. */
static void check_weights(const struct full *f, const struct tree *trees, const double *w,
                          double goal, size_t order, double tolerance)
{
    double beyond = 0;
    for (size_t k = 0; k < TREES; k++) {
        double sum = 0, size = 0, expected = pow(goal, (double)trees[k].order) / trees[k].density;
        for (size_t i = 0; i < f->n; i++) {
            sum += w[i] * trees[k].phi[i];
            size += fabs(w[i] * trees[k].phi[i]);
        }
        if (trees[k].order <= order)
            assert_close(sum, expected, 0, tolerance * (1 + size));
        else
            beyond = fmax(beyond, fabs(sum - expected));
    }
    if (order < ORDER)
        assert_true(beyond > 1e-7);
}

/* Weights of the slopes at theta in a step's dense output (stepper.c). */
static void dense_weights(const struct phys_butcher *table, size_t n, double theta, double *w)
{
    for (size_t j = 0; j < n; j++) {
        double b = j < table->stages ? table->b[j] : 0;
        double first = j == 0, last = j == table->stages;
        double rows[3 + 4] = {b, first - b, 2 * b - first - last};
        for (size_t r = 0; r < table->n_dense; r++)
            rows[3 + r] = table->dense[r * n + j];
        w[j] = 0;
        for (size_t r = 3 + table->n_dense; r-- > 0;)
            w[j] = (w[j] + rows[r]) * (r % 2 == 0 ? theta : 1 - theta);
    }
}

/* c_i is the sum of row i. */
static void assert_node(const struct full *f, size_t i, double c)
{
    double sum = 0, size = 0;
    for (size_t j = 0; j < f->n; j++) {
        sum += f->a[i][j];
        size += fabs(f->a[i][j]);
    }
    assert_close(sum, c, 0, 2e-16 * (1 + size));
}

/* Error weights are for the stages and the slope at the end; further stages have none. */
static void check_error(const struct full *f, const struct tree *trees,
                        const struct phys_butcher *table, const double *error, size_t order)
{
    double w[STAGES] = {0};
    if (!error)
        return;
    memcpy(w, error, (table->stages + 1) * sizeof *w);
    check_weights(f, trees, w, 0, order, 5e-15);
}

static void check_method(const struct phys_integrator *method, size_t error_order,
                         size_t error_3_order, size_t dense_order)
{
    static struct tree trees[TREES];
    const struct phys_butcher *table = method->coefficients;
    struct full f = full_of(table);
    double w[STAGES] = {0};
    grow_all(&f, trees);
    for (size_t i = 0; i < table->stages; i++) {
        assert_node(&f, i, table->c[i]);
        w[i] = table->b[i];
    }
    for (size_t e = 0; e < table->extra; e++)
        assert_node(&f, table->stages + 1 + e, table->c[table->stages + e]);
    check_weights(&f, trees, w, 1, method->order, 5e-15);
    check_error(&f, trees, table, table->error, error_order);
    check_error(&f, trees, table, table->error_3, error_3_order);
    for (double theta = 0.11; theta < 1; theta += 0.27) {
        dense_weights(table, f.n, theta, w);
        check_weights(&f, trees, w, theta, dense_order, 1e-14);
    }
}

static void test_euler(void **state) { (void)state, check_method(&phys_euler, 0, 0, 1); }
static void test_rk4(void **state) { (void)state, check_method(&phys_rk4, 0, 0, 3); }
static void test_dopri5(void **state) { (void)state, check_method(&phys_dopri5, 4, 0, 4); }
static void test_dop853(void **state) { (void)state, check_method(&phys_dop853, 5, 3, 7); }

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_euler),
        cmocka_unit_test(test_rk4),
        cmocka_unit_test(test_dopri5),
        cmocka_unit_test(test_dop853),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
