/* Initial models: statistics of the weights, names and shapes of the parameters, refused settings.
 */
#include "physics/linear/linear.h"
#include "small.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <string.h>

static const struct hnn_block *find(const hnn_model *model, const char *name)
{
    size_t n;
    const struct hnn_block *blocks = hnn_model_blocks(model, &n);
    for (size_t k = 0; k < n; k++)
        if (strcmp(blocks[k].name, name) == 0)
            return &blocks[k];
    fail_msg("no block %s", name);
    return NULL;
}

static hnn_model *wide(enum hnn_start start, uint64_t seed)
{
    struct hnn_settings s = hnn_defaults(HNN_BASELINE, 3);
    s.hidden[0] = 160;
    s.hidden[1] = 120;
    s.start = start;
    s.precision = AD_F64;
    s.seed = seed;
    return small_model(&s);
}

static const double *values(const hnn_model *model, const struct hnn_block *b)
{
    return (const double *)hnn_model_parameters(model) + b->offset;
}

/* Products of rows i and j, or of columns where there are fewer of these. */
static void check_orthogonal(const hnn_model *model, const char *name)
{
    const struct hnn_block *b = find(model, name);
    const double *w = values(model, b);
    bool by_rows = b->rows < b->cols;
    size_t n = by_rows ? b->rows : b->cols, length = by_rows ? b->cols : b->rows;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t k = 0; k < length; k++)
                sum += by_rows ? w[i * b->cols + k] * w[j * b->cols + k]
                               : w[k * b->cols + i] * w[k * b->cols + j];
            assert_close(sum, i == j, 0, 1e-14);
        }
}

static void test_orthogonal(void **state)
{
    (void)state;
    hnn_model *model = wide(HNN_ORTHOGONAL, 4);
    check_orthogonal(model, "linear1.weight");
    check_orthogonal(model, "linear2.weight");
    check_orthogonal(model, "linear3.weight");
    hnn_model_free(model);
}

/* Mean 0 and the variance asked for, within five standard deviations of their estimates. */
static void check_normal(const hnn_model *model, double variance)
{
    const struct hnn_block *b = find(model, "linear2.weight");
    const double *w = values(model, b);
    size_t n = b->rows * b->cols;
    double sum = 0, squares = 0, fourth = 0;
    for (size_t k = 0; k < n; k++) {
        sum += w[k];
        squares += w[k] * w[k];
        fourth += w[k] * w[k] * w[k] * w[k];
    }
    double size = (double)n;
    assert_close(sum / size, 0, 0, 5 * sqrt(variance / size));
    assert_close(squares / size, variance, 5 * sqrt(2 / size), 0);
    assert_close(fourth / size, 3 * variance * variance, 5 * sqrt(96.0 / 9 / size), 0);
}

static void test_normal(void **state)
{
    (void)state;
    hnn_model *xavier = wide(HNN_XAVIER, 5), *he = wide(HNN_HE, 5);
    check_normal(xavier, 2.0 / (160 + 120));
    check_normal(he, 2.0 / 160);
    hnn_model_free(xavier);
    hnn_model_free(he);
}

static void test_biases(void **state)
{
    (void)state;
    hnn_model *model = wide(HNN_ORTHOGONAL, 6);
    const struct hnn_block *b = find(model, "linear2.bias");
    double bound = 1 / sqrt(160), squares = 0;
    assert_int_equal(b->rows, 120);
    for (size_t k = 0; k < b->rows; k++) {
        double x = values(model, b)[k];
        assert_true(fabs(x) <= bound);
        squares += x * x;
    }
    assert_close(squares / 120, bound * bound / 3, 5 * sqrt(0.8 / 120), 0);
    hnn_model_free(model);
}

static void test_seeds(void **state)
{
    (void)state;
    hnn_model *a = wide(HNN_HE, 1), *b = wide(HNN_HE, 1), *c = wide(HNN_HE, 2);
    size_t bytes = hnn_model_size(a) * sizeof(double);
    assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(b), bytes);
    assert_memory_not_equal(hnn_model_parameters(a), hnn_model_parameters(c), bytes);
    hnn_model_free(a);
    hnn_model_free(b);
    hnn_model_free(c);
}

/* 2-200-200-1 without a bias on the last layer, as published. */
static void test_layout(void **state)
{
    (void)state;
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = small_model(&s);
    assert_int_equal(hnn_model_size(model), 2 * 200 + 200 + 200 * 200 + 200 + 200);
    assert_int_equal(find(model, "linear1.weight")->cols, 2);
    assert_int_equal(find(model, "linear3.weight")->rows, 1);
    assert_int_equal(find(model, "linear3.weight")->offset, 2 * 200 + 200 + 200 * 200 + 200);
    hnn_model_free(model);
    s.separable = s.dissipation = true;
    model = small_model(&s);
    assert_int_equal(find(model, "kinetic.linear1.weight")->cols, 1);
    assert_int_equal(find(model, "potential.linear2.bias")->rows, 200);
    assert_int_equal(find(model, "dissipation.linear1.weight")->cols, 2);
    hnn_model_free(model);
}

static void refused(struct hnn_settings s, const char *why)
{
    struct ad_error error = {0};
    hnn_model *model;
    assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
    assert_null(model);
    assert_mentions(error.message, why);
}

static void test_refusals(void **state)
{
    (void)state;
    struct hnn_settings good = hnn_defaults(HNN_HAMILTONIAN, 1), s;
    refused((s = good, s.activation = "tahn", s), "'tanh'");
    refused((s = good, s.dof = 0, s), "freedom");
    refused((s = good, s.layers = 0, s), "layers");
    refused((s = good, s.layers = HNN_LAYERS_MOST + 1, s), "layers");
    refused((s = good, s.hidden[1] = 0, s), "width hidden");
    refused((s = good, s.field = HNN_BOTH, s.separable = true, s), "separable");
    refused((s = good, s.kind = HNN_BASELINE, s.dissipation = true, s), "dissipation");
}

/* C12: LAPACK's rows are those of Gram's and Schmidt's method, none turned around. */
static void orthonormal_rows_are_those_of_gram_and_schmidt(void **state)
{
    enum { N = 7, LENGTH_OF_ROW = 12 };
    double a[N][LENGTH_OF_ROW], b[N][LENGTH_OF_ROW], work[2 * N];
    (void)state;
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < LENGTH_OF_ROW; k++)
            a[i][k] = b[i][k] = sin(7.3 * pow((double)(i * LENGTH_OF_ROW + k), 2) + 0.2);
    for (size_t i = 0; i < N; i++) {
        double norm = 0;
        for (size_t j = 0; j < 2 * i; j++) { /* twice */
            double share = 0;
            for (size_t k = 0; k < LENGTH_OF_ROW; k++)
                share += b[i][k] * b[j % i][k];
            for (size_t k = 0; k < LENGTH_OF_ROW; k++)
                b[i][k] -= share * b[j % i][k];
        }
        for (size_t k = 0; k < LENGTH_OF_ROW; k++)
            norm += b[i][k] * b[i][k];
        for (size_t k = 0; k < LENGTH_OF_ROW; k++)
            b[i][k] /= sqrt(norm);
    }
    assert_true(phys_lapack_orthonormal_rows(N, LENGTH_OF_ROW, a[0], work));
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < LENGTH_OF_ROW; k++)
            assert_close(a[i][k], b[i][k], 0, 1e-13);
    double one = -3;
    assert_true(phys_lapack_orthonormal_rows(1, 1, &one, work));
    assert_true(one == -1);
}

static void test_names_of_pixel_models(void **state)
{
    (void)state;
    struct hnn_settings s = hnn_pixel_defaults(HNN_HAMILTONIAN, 1568);
    s.start = HNN_XAVIER;
    hnn_model *model = small_model(&s);
    size_t n;
    const struct hnn_block *block = hnn_model_blocks(model, &n);
    assert_int_equal(n, 16 + 5);
    assert_string_equal(block[0].name, "autoencoder.linear1.weight");
    assert_true(block[0].rows == 200 && block[0].cols == 1568);
    assert_string_equal(block[15].name, "autoencoder.linear8.bias");
    assert_int_equal(block[15].rows, 1568);
    assert_string_equal(block[16].name, "hnn.linear1.weight");
    assert_string_equal(block[20].name, "hnn.linear3.weight");
    assert_true(block[20].rows == 1 && block[20].cols == 200);
    hnn_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names_of_pixel_models),
        cmocka_unit_test(test_orthogonal),
        cmocka_unit_test(orthonormal_rows_are_those_of_gram_and_schmidt),
        cmocka_unit_test(test_normal),
        cmocka_unit_test(test_biases),
        cmocka_unit_test(test_seeds),
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
