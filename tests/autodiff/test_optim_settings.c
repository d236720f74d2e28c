/* Settings of optimisers: left out, out of range, too large. */
#include "autodiff/optim.h"
#include "support.h"
#include "tests/mentions.h"

static void test_null_and_too_large(void **state)
{
    (void)state;
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    ad_optimiser_free(NULL);
    assert_null(ad_optimiser_new(&s, AD_F64, SIZE_MAX / 8, NULL));
}

/* G7: what is left out of an initialiser is as usual; a gradient of 0 moves nothing. */
static void test_settings_left_out(void **state)
{
    (void)state;
    for (int k = 2 * AD_SGD; k <= 2 * AD_ADAM + 1; k++) {
        struct ad_optimiser_settings s = {.size = sizeof s,
                                          .method = (enum ad_optimiser_method)(k / 2),
                                          .learning_rate = k % 2 ? 0 : 0.1},
                                     usual = ad_optimiser_defaults(s.method);
        if (s.learning_rate > 0)
            usual.learning_rate = s.learning_rate;
        ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 3, NULL),
                     *same = ad_optimiser_new(&usual, AD_F64, 3, NULL);
        double x[3] = {1, -2, 3}, y[3] = {1, -2, 3};
        const double none[3] = {0}, g[3] = {0.5, 0, -7};
        ad_optimiser_step(o, x, none);
        assert_true(x[0] == 1 && x[1] == -2 && x[2] == 3);
        ad_optimiser_step(o, x, g);
        ad_optimiser_step(same, y, none);
        ad_optimiser_step(same, y, g);
        assert_memory_equal(x, y, sizeof x);
        assert_true(x[0] < 1 && x[1] == -2 && x[2] > 3);
        ad_optimiser_free(o);
        ad_optimiser_free(same);
    }
}

/* G7 */
static void test_settings_out_of_range(void **state)
{
    (void)state;
    static const double wrong[] = {-0.5, NAN, INFINITY, -INFINITY};
    for (size_t k = 0; k < 7; k++)
        for (size_t w = 0; w < 4; w++) {
            struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
            double *const field[] = {&s.learning_rate, &s.momentum,     &s.beta1, &s.beta2,
                                     &s.epsilon,       &s.weight_decay, &s.least};
            static const char *const names[] = {"learning rate", "momentum",     "beta1", "beta2",
                                                "epsilon",       "weight decay", "least"};
            struct ad_error error = {0};
            *field[k] = wrong[w];
            assert_null(ad_optimiser_new(&s, AD_F64, 3, &error));
            assert_int_equal(error.status, AD_E_ARGUMENT);
            assert_mentions(error.message, names[k]);
        }
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    struct ad_error error = {0};
    s.beta2 = 1;
    assert_null(ad_optimiser_new(&s, AD_F64, 3, &error));
    assert_int_equal(error.status, AD_E_ARGUMENT);
    error = (struct ad_error){0};
    s = (struct ad_optimiser_settings){.size = sizeof(struct ad_optimiser_settings),
                                       .method = (enum ad_optimiser_method)7};
    assert_null(ad_optimiser_new(&s, AD_F64, 3, &error));
    assert_int_equal(error.status, AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_null(ad_optimiser_new(NULL, AD_F64, 3, &error));
    assert_int_equal(error.status, AD_E_ARGUMENT);
    ad_fail(&error, AD_E_INPUT, "another");
    assert_null(ad_optimiser_new(NULL, AD_F64, 3, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_null_and_too_large),
        cmocka_unit_test(test_settings_left_out),
        cmocka_unit_test(test_settings_out_of_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
