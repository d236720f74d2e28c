/* What a caller gives to training: a network, a loss. */
#define main training_main
#include "docs/examples/linked/training.c"
#undef main
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* H = w0 q^2/2 + w1 p^2/2 + w2 q p; the context scales it. */
static ad_var quadratic(void *context, ad_var w, ad_var x)
{
    ad_var q = ad_row(x, 0), p = ad_row(x, 1);
    ad_var H = ad_mul(ad_slice_cols(w, 2, 1), ad_mul(q, p));
    H = ad_add(H, ad_mul(ad_slice_cols(w, 0, 1), ad_mul(0.5, ad_square(q))));
    H = ad_add(H, ad_mul(ad_slice_cols(w, 1, 1), ad_mul(0.5, ad_square(p))));
    return ad_mul(*(const double *)context, H);
}

static double once = 1, twice = 2;
static const double start[3] = {1.3, 0.7, 0.2};
static const struct hnn_network oscillator = {
    .name = "oscillator", .size = 3, .start = start, .record = quadratic, .context = &once};

static struct hnn_settings own(const struct hnn_network *network, enum ad_type precision)
{
    return (struct hnn_settings){.size = sizeof(struct hnn_settings),
                                 .kind = HNN_HAMILTONIAN,
                                 .dof = 1,
                                 .precision = precision,
                                 .network = network};
}

static void assert_field(hnn_model *model, double scale)
{
    const double x[2] = {0.6, -0.9};
    double rate[2], energy = scale * (0.65 * 0.36 + 0.35 * 0.81 - 0.2 * 0.54);
    assert_int_equal(hnn_model_field(model, x, rate), AD_OK);
    assert_close(rate[0], scale * (-0.7 * 0.9 + 0.2 * 0.6), 1e-7, 0);
    assert_close(rate[1], -scale * (1.3 * 0.6 - 0.2 * 0.9), 1e-7, 0);
    assert_close(hnn_model_energy(model, x), energy, 1e-7, 0);
}

static void test_network_and_its_file(void **state)
{
    (void)state;
    struct path file = files_temporary("own.h5"), plain = files_temporary("plain.h5");
    for (int type = AD_F32; type <= AD_F64; type++) {
        struct ad_error error = {0};
        struct hnn_settings settings = own(&oscillator, (enum ad_type)type);
        hnn_model *model = small_model(&settings), *loaded;
        struct hnn_network unnamed = oscillator;
        assert_field(model, 1);
        assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
        unnamed.start = NULL;
        if (hnn_model_load_network(file.text, &unnamed, &loaded, &error) != AD_OK)
            fail_msg("%s", error.message);
        assert_field(loaded, 1);
        struct phys_ode ode;
        double rate[2];
        assert_int_equal(hnn_model_ode(loaded, &ode, &error), AD_OK);
        assert_int_equal(ode.field(ode.context, 0, (double[]){0.6, -0.9}, rate, &error), AD_OK);
        assert_close(rate[0], -0.51, 1e-7, 0);
        assert_true(ode.canonical);
        hnn_model_free(loaded);
        hnn_model_free(model);
    }
    /* who does not have the network, or another one of that name, is told */
    struct hnn_network other[] = {oscillator, oscillator, oscillator};
    other[0].name = "pendulum";
    other[1].context = &twice;
    other[2].size = 4;
    other[2].start = (const double[]){1, 1, 1, 1};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error error = {0};
        hnn_model *loaded;
        assert_int_equal(k < 3 ? hnn_model_load_network(file.text, &other[k], &loaded, &error)
                               : hnn_model_load(file.text, &loaded, &error),
                         AD_E_INPUT);
        assert_null(loaded);
        assert_mentions(error.message, "own.h5");
    }
    struct ad_error error = {0};
    hnn_model *model = small_model(&(struct hnn_settings){.size = sizeof(struct hnn_settings),
                                                          .kind = HNN_HAMILTONIAN,
                                                          .dof = 1,
                                                          .layers = 2,
                                                          .hidden = {4},
                                                          .activation = "tanh"});
    assert_int_equal(hnn_model_save(model, plain.text, NULL, &error), AD_OK);
    hnn_model_free(model);
    assert_int_equal(hnn_model_load_network(plain.text, &oscillator, &model, &error), AD_E_INPUT);
}

static ad_var mixed(void *context, ad_var w, ad_var x)
{
    return ad_mul(quadratic(context, w, x), ad_add(1.0, ad_mean(ad_square(x))));
}
static ad_var summed(void *context, ad_var w, ad_var x) { return ad_sum(quadratic(context, w, x)); }

static void test_refused_networks(void **state)
{
    (void)state;
    static char longest[65];
    memset(longest, 'x', 64);
    struct hnn_network wrong[] = {oscillator, oscillator, oscillator, oscillator,
                                  oscillator, oscillator, oscillator, oscillator};
    const enum ad_status expected[] = {AD_E_ARGUMENT,  AD_E_SHAPE,    AD_E_ARGUMENT, AD_E_ARGUMENT,
                                       AD_E_NONFINITE, AD_E_ARGUMENT, AD_E_ARGUMENT, AD_E_ARGUMENT};
    wrong[0].record = mixed;
    wrong[1].record = summed;
    wrong[2].name = "";
    wrong[3].name = longest;
    wrong[4].start = (double[]){1, NAN, 1};
    wrong[5].start = NULL;
    wrong[6].size = 0;
    wrong[7].record = NULL;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        struct hnn_settings settings = own(&wrong[k], AD_F64);
        struct ad_error error = {0};
        hnn_model *model;
        if (hnn_model_new(&settings, &model, &error) != expected[k])
            fail_msg("%zu: %d %s", k, error.status, error.message);
        assert_null(model);
    }
    struct hnn_settings settings = own(&oscillator, AD_F64);
    struct ad_error error = {0};
    hnn_model *model;
    settings.dissipation = true;
    assert_int_equal(hnn_model_new(&settings, &model, &error), AD_E_ARGUMENT);
}

/* ---- losses ---- */

static ad_var squares(void *context, const hnn_model *model, ad_var w, ad_var x, ad_var target)
{
    ad_var off = ad_sub(hnn_model_record(model, w, x).field, target);
    return ad_mul(*(double *)context, ad_sum_rows(ad_square(off)));
}
static ad_var of_batch(void *context, const hnn_model *model, ad_var w, ad_var x, ad_var target)
{
    ad_var all = squares(context, model, w, x, target);
    return ad_div(all, ad_mean(all));
}
static ad_var scalar(void *context, const hnn_model *model, ad_var w, ad_var x, ad_var target)
{
    return ad_mean(squares(context, model, w, x, target));
}

static struct hnn_settings seven(void) { return small_settings(&small_kinds[1], 1, 3); }

static void test_loss(void **state)
{
    (void)state;
    static double half = 0.5, third = 1.0 / 3;
    struct hnn_samples train = small_pendulum(1, 50, 0), test = small_pendulum(2, 30, 0);
    struct hnn_training training = hnn_training_defaults(), with = training;
    struct hnn_settings settings = seven();
    hnn_model *a = small_model(&settings), *b = small_model(&settings), *c = small_model(&settings);
    training.steps = with.steps = 60;
    training.batch = with.batch = 20;
    with.loss = squares; /* the mean square, written by the caller */
    with.loss_context = &half;
    hnn_trainer *plain = small_trainer(a, &training, &train, &test);
    hnn_trainer *mine = small_trainer(b, &with, &train, &test), *resumed;
    small_run(plain);
    small_run(mine);
    const double *p = hnn_model_parameters(a), *q = hnn_model_parameters(b);
    for (size_t k = 0; k < hnn_model_size(a); k++)
        assert_close(p[k], q[k], 1e-9, 1e-9);
    assert_close(hnn_trainer_test_loss(mine), small_loss(b, &test), 1e-12, 0);

    /* resumed with another loss, or none: refused */
    struct path file = files_temporary("loss.h5");
    struct ad_error error = {0};
    assert_int_equal(hnn_trainer_save(mine, file.text, NULL, &error), AD_OK);
    resumed = small_trainer(c, &with, &train, &test);
    if (hnn_trainer_resume(resumed, file.text, &error) != AD_OK)
        fail_msg("%s", error.message);
    hnn_trainer_free(resumed);
    with.loss_context = &third;
    for (int k = 0; k < 2; k++) {
        struct ad_error why = {0};
        resumed = small_trainer(c, k ? &training : &with, &train, &test);
        assert_int_equal(hnn_trainer_resume(resumed, file.text, &why), AD_E_INPUT);
        assert_mentions(why.message, "loss");
        hnn_trainer_free(resumed);
    }
    struct ad_error mixes = {0}, shape = {0};
    with.loss = of_batch;
    assert_int_equal(hnn_trainer_new(c, &with, &train, &test, &resumed, &mixes), AD_E_ARGUMENT);
    with.loss = scalar;
    assert_int_equal(hnn_trainer_new(c, &with, &train, &test, &resumed, &shape), AD_E_SHAPE);
    hnn_trainer_free(plain);
    hnn_trainer_free(mine);
    hnn_model_free(a);
    hnn_model_free(b);
    hnn_model_free(c);
    small_samples_free(&train);
    small_samples_free(&test);
}

/* A model made of a network alone is that of settings in double precision, and refuses as it does.
 */
static void test_model_of_network(void **state)
{
    struct ad_error error = {0}, wrong = {0}, none = {0};
    struct hnn_network lacks = oscillator;
    hnn_model *model;
    (void)state;
    if (hnn_model_new_network(&oscillator, HNN_HAMILTONIAN, 1, &model, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(hnn_model_settings(model)->precision, AD_F64);
    assert_memory_equal(hnn_model_parameters(model), start, sizeof start);
    assert_field(model, 1);
    hnn_model_free(model);
    assert_int_equal(hnn_model_new_network(&oscillator, HNN_HAMILTONIAN, 0, &model, &wrong),
                     AD_E_ARGUMENT);
    assert_null(model);
    lacks.start = NULL;
    assert_int_equal(hnn_model_new_network(&lacks, HNN_HAMILTONIAN, 1, &model, &none),
                     AD_E_ARGUMENT);
    assert_mentions(none.message, "start");
}

/* The example, as a reader runs it, and the file that it leaves. */
static void test_example(void **state)
{
    (void)state;
    struct path folder = files_temporary(".");
    char *from = getcwd(NULL, 0);
    struct hnn_network network = {.name = "ab", .size = 2, .record = energy};
    struct ad_error error = {0};
    hnn_model *model;
    assert_int_equal(chdir(folder.text), 0);
    assert_int_equal(training_main(), 0);
    if (hnn_model_load_network("pendulum.h5", &network, &model, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(chdir(from), 0);
    const double *w = hnn_model_parameters(model);
    assert_close(w[0], 0.25, 1e-4, 0);
    assert_close(w[1], 3, 1e-4, 0);
    hnn_model_free(model);
    free(from);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_network_and_its_file),
        cmocka_unit_test(test_refused_networks),
        cmocka_unit_test(test_loss),
        cmocka_unit_test(test_model_of_network),
        cmocka_unit_test(test_example),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
