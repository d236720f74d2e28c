/* The measurement behind the chart of training is complete and consistent. No times are asserted.
 */
#include "tests/close.h"
#include "apps/bench/measure/training_speed.h"

static struct training_speed measure(enum hnn_kind kind, enum ad_type type, size_t threads)
{
    struct hnn_settings settings = hnn_defaults(kind, 1);
    struct training_speed speed = {0};
    struct ad_error error = {0};
    settings.hidden[0] = 40;
    settings.hidden[1] = 24;
    settings.precision = type;
    assert_int_equal(training_speed_measure(&settings, 300, threads, 3, &speed, &error), AD_OK);
    return speed;
}

static void test_step_and_floor(void **state)
{
    (void)state;
    for (int k = 0; k < 8; k++) {
        struct training_speed s =
            measure(k & 1 ? HNN_BASELINE : HNN_HAMILTONIAN, k & 2 ? AD_F32 : AD_F64, k & 4 ? 2 : 1);
        assert_true(s.step_ms > 0 && s.products_ms > 0 && s.activation_ms > 0);
        assert_true(s.share > 0);
    }
}

static void test_two_networks_are_refused(void **state)
{
    (void)state;
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct training_speed speed;
    struct ad_error error = {0};
    settings.separable = true;
    assert_int_equal(training_speed_measure(&settings, 10, 1, 3, &speed, &error), AD_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_and_floor),
        cmocka_unit_test(test_two_networks_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
