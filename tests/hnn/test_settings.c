/* Settings, activations, notes and names of components of a model. */
#include "small.h"
#include "hnn/data/data.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <stdio.h>

/* ---- G5: numbers that are none of an enum ---- */

static void test_settings(void **state)
{
    (void)state;
    for (int k = 0; k < 8; k++) {
        struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
        struct ad_error error = {0};
        hnn_model *model;
        int value = k < 4 ? 7 : -1;
        if (k % 4 == 0)
            s.kind = (enum hnn_kind)value;
        else if (k % 4 == 1)
            s.field = (enum hnn_field_type)value;
        else if (k % 4 == 2)
            s.start = (enum hnn_start)value;
        else
            s.precision = (enum ad_type)value;
        assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
        assert_null(model);
    }
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = small_model(&s);
    double x[2] = {0.5, 0.25}, before[2], after[2];
    assert_int_equal(hnn_model_field(model, x, before), AD_OK);
    hnn_model_evaluate_in(model, (enum ad_type)7);
    assert_int_equal(hnn_model_field(model, x, after), AD_OK);
    assert_memory_equal(before, after, sizeof before);
    hnn_model_free(model);
}

/* C11: another name of the same. */
static void test_silu(void **state)
{
    (void)state;
    static const char *const names[] = {"swish", "silu"};
    double rate[2][2], x[2] = {0.5, 0.25};
    for (size_t k = 0; k < 2; k++) {
        struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
        s.activation = names[k];
        hnn_model *model = small_model(&s);
        assert_int_equal(hnn_model_field(model, x, rate[k]), AD_OK);
        hnn_model_free(model);
    }
    assert_memory_equal(rate[0], rate[1], sizeof rate[0]);
}

/* C11: names of the data, where they are names that any file can hold. */
static void test_components(void **state)
{
    (void)state;
    static const char *const cases[][3] = {
        {"theta,p_theta", "theta", "p_theta"},
        {"p,q", "p", "q"},
        {NULL, "q1", "p1"},
        {"3,4", "q1", "p1"},
        {"q", "q1", "p1"},
        {"q,p,x", "q1", "p1"},
        {"q,\"p, kg\"", "q1", "p1"},
        {"q\n,p", "q1", "p1"},
        {"q,", "q1", "p1"},
        {"q,`id`", "q1", "p1"},
        {"θ,ω", "θ", "ω"},
        {"run/q,p", "q1", "p1"},
    };
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = small_model(&s);
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct ad_error error = {0};
        char q[32], p[32];
        hnn_model_note(model, "state", cases[k][0], &error);
        hnn_model_component(model, 0, q, sizeof q);
        hnn_model_component(model, 1, p, sizeof p);
        assert_string_equal(q, cases[k][1]);
        assert_string_equal(p, cases[k][2]);
    }
    hnn_model_component(NULL, 0, (char[8]){""}, 8);
    hnn_model_free(model);
}

/* E11: there is room for 16 remarks and no more; one that is there can still change. */
static void test_notes(void **state)
{
    (void)state;
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = small_model(&s);
    char name[8];
    for (int k = 0; k < 20; k++) {
        struct ad_error error = {0};
        snprintf(name, sizeof name, "n%d", k);
        assert_int_equal(hnn_model_note(model, name, name, &error), k < 16 ? AD_OK : AD_E_MEMORY);
    }
    struct ad_error error = {0};
    assert_int_equal(hnn_model_note(model, "n3", "changed", &error), AD_OK);
    assert_string_equal(hnn_model_noted(model, "n3"), "changed");
    assert_string_equal(hnn_model_noted(model, "n15"), "n15");
    assert_null(hnn_model_noted(model, "n16"));
    assert_int_equal(hnn_model_note(model, "n3", NULL, &error), AD_OK);
    assert_int_equal(hnn_model_note(model, "n16", "room again", &error), AD_OK);
    hnn_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_settings),
        cmocka_unit_test(test_silu),
        cmocka_unit_test(test_notes),
        cmocka_unit_test(test_components),
    };
    return cmocka_run_group_tests_name("settings", tests, files_setup, files_teardown);
}
