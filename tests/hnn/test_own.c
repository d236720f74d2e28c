/* What a caller gives to training: a network, a loss, columns in memory, a loop of its own. */
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

/* ---- loops ---- */

/* G1. In pieces as at once, to the last bit; after each piece the losses are those of the model. */
static void test_advance(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 60, 0.1), test = small_pendulum(2, 40, 0.1);
    const char *methods[] = {"adam", "adamw", "sgd", "lbfgs", "adam"};
    struct hnn_settings settings = seven();
    for (size_t k = 0; k < 5; k++) {
        struct ad_error error = {0};
        struct hnn_training training = hnn_training_defaults();
        training.optimiser = hnn_optimiser_find(methods[k], &error);
        training.schedule = hnn_schedule_find("cosine", &error);
        training.steps = 100;
        training.batch = k == 3 ? 0 : 16;
        training.average = k == 4 ? 0 : 0.3;
        training.patience = k == 4 ? 20 : 0;
        training.learning_rate = k == 4 ? 0.3 : 1e-2; /* patience ends it */
        hnn_model *a = small_model(&settings), *b = small_model(&settings);
        hnn_trainer *whole = small_trainer(a, &training, &train, &test);
        hnn_trainer *parts = small_trainer(b, &training, &train, &test);
        enum hnn_stop why = small_run(whole), stop = 0;
        for (size_t n = 1; !stop; n += 2) {
            size_t before = hnn_trainer_step(parts);
            assert_int_equal(hnn_trainer_advance(parts, n, &stop, &error), AD_OK);
            assert_true(stop || hnn_trainer_step(parts) == before + n);
            assert_close(hnn_trainer_test_loss(parts), small_loss(b, &test), 1e-11, 0);
            assert_close(hnn_trainer_train_loss(parts), small_loss(b, &train), 1e-11, 0);
        }
        assert_int_equal(stop, why);
        assert_int_equal(hnn_trainer_step(parts), hnn_trainer_step(whole));
        assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(b),
                            hnn_model_size(a) * sizeof(double));
        size_t rows, others;
        const struct hnn_row *one = hnn_trainer_history(whole, &rows),
                             *two = hnn_trainer_history(parts, &others);
        assert_int_equal(rows, others);
        for (size_t r = 0; r < rows; r++)
            assert_true(one[r].step == two[r].step && one[r].train_loss == two[r].train_loss &&
                        one[r].test_loss == two[r].test_loss);
        hnn_trainer_free(whole);
        hnn_trainer_free(parts);
        hnn_model_free(a);
        hnn_model_free(b);
    }
    small_samples_free(&train);
    small_samples_free(&test);
}

static bool again(void *context, hnn_trainer *trainer)
{
    struct ad_error error = {0};
    *(enum ad_status *)context = hnn_trainer_advance(trainer, 1, NULL, &error);
    return false;
}

/* Rates, and parameters from outside, between the steps. */
static void test_between_steps(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 60, 0.1);
    struct hnn_settings settings = seven();
    struct hnn_training training = hnn_training_defaults();
    struct path file = files_temporary("rate.h5");
    struct ad_error error = {0};
    training.optimiser = hnn_optimiser_find("sgd", &error);
    training.weight_decay = training.average = 0;
    hnn_model *a = small_model(&settings), *b = small_model(&settings);
    hnn_trainer *t = small_trainer(a, &training, &train, NULL), *u;
    size_t n = hnn_model_size(a), bytes = n * sizeof(double);
    double *before = malloc(bytes), *moved = malloc(bytes);
    const double *now = hnn_model_parameters(a);
    memcpy(before, now, bytes);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    memcpy(moved, now, bytes);
    /* from the first parameters again, at a tenth of the rate: a tenth of the way */
    hnn_model_set_parameters(a, before);
    assert_int_equal(hnn_trainer_set_rate(t, 1e-4, &error), AD_OK);
    assert_close(hnn_trainer_rate(t), 1e-4, 0, 0);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    for (size_t k = 0; k < n; k++)
        assert_close(now[k] - before[k], 0.1 * (moved[k] - before[k]), 1e-6, 1e-15);
    /* a trainer made with the same arguments goes on at that rate */
    assert_int_equal(hnn_trainer_save(t, file.text, NULL, &error), AD_OK);
    u = small_trainer(b, &training, &train, NULL);
    assert_int_equal(hnn_trainer_resume(u, file.text, &error), AD_OK);
    assert_close(hnn_trainer_rate(u), 1e-4, 0, 0);
    assert_int_equal(hnn_trainer_advance(t, 5, NULL, &error), AD_OK);
    assert_int_equal(hnn_trainer_advance(u, 5, NULL, &error), AD_OK);
    assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(b), bytes);
    const double rates[] = {0, -1, NAN, INFINITY};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error why = {0};
        assert_int_equal(hnn_trainer_set_rate(t, rates[k], &why), AD_E_ARGUMENT);
    }
    hnn_trainer_free(u);
    training.optimiser = hnn_optimiser_find("lbfgs", &error);
    u = small_trainer(b, &training, &train, NULL);
    struct ad_error searches = {0};
    assert_int_equal(hnn_trainer_set_rate(u, 1e-2, &searches), AD_E_ARGUMENT);
    hnn_trainer_free(u);

    enum ad_status inside = AD_OK;
    training.progress = again;
    training.context = &inside;
    u = small_trainer(b, &training, &train, NULL);
    assert_int_equal(small_run(u), HNN_STOP_INTERRUPTED);
    assert_int_equal(inside, AD_E_ARGUMENT);
    hnn_trainer_free(u);
    /* weights that became too large for the next number: said, and the model stays */
    training.progress = NULL;
    training.optimiser = hnn_optimiser_find("sgd", &error);
    training.learning_rate = 1e308;
    memcpy(before, hnn_model_parameters(b), bytes);
    double far[120];
    for (size_t k = 0; k < 120; k++)
        far[k] = 1e4 * train.target[k];
    struct hnn_samples steep = {.n = 60, .x = train.x, .target = far};
    u = small_trainer(b, &training, &steep, NULL);
    struct ad_error lost = {0};
    assert_int_equal(hnn_trainer_advance(u, 1, NULL, &lost), AD_E_NONFINITE);
    assert_memory_equal(before, hnn_model_parameters(b), bytes);
    hnn_trainer_free(u);
    hnn_trainer_free(t);
    free(before);
    free(moved);
    hnn_model_free(a);
    hnn_model_free(b);
    small_samples_free(&train);
}

/* A normalisation is part of programs that were recorded before it. */
static void test_normalised_later(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 20, 0);
    struct hnn_settings settings = seven();
    struct hnn_training training = hnn_training_defaults();
    const double x[2] = {0.4, 0.5}, centre[2] = {0.1, -0.2}, size[2] = {2, 3};
    double early[2], late[2];
    struct ad_error error = {0};
    hnn_model *a = small_model(&settings), *b = small_model(&settings);
    assert_int_equal(hnn_model_field(a, x, early), AD_OK);
    hnn_trainer *t = small_trainer(a, &training, &train, NULL);
    assert_int_equal(hnn_model_normalise(a, centre, size, size, &error), AD_OK);
    assert_int_equal(hnn_model_normalise(b, centre, size, size, &error), AD_OK);
    assert_int_equal(hnn_model_field(a, x, early), AD_OK);
    assert_int_equal(hnn_model_field(b, x, late), AD_OK);
    assert_true(early[0] == late[0] && early[1] == late[1]);
    assert_int_equal(hnn_trainer_run(t, NULL, &error), AD_E_ARGUMENT);
    hnn_trainer_free(t);
    hnn_model_free(a);
    hnn_model_free(b);
    small_samples_free(&train);
}

/* ---- columns ---- */

enum { ROWS = 40 };
struct motion {
    double trial[ROWS], t[ROWS], q[ROWS], p[ROWS];
};

static void put_motion(struct motion *m)
{
    for (int i = 0; i < ROWS; i++) {
        m->trial[i] = i / 10;
        m->t[i] = 0.1 * (i % 10) + 0.003 * sin(i);
        m->q[i] = sin(m->t[i] + i / 10);
        m->p[i] = cos(m->t[i] + i / 10);
    }
}

/* Columns give the samples that a file of the same numbers gives, however they are made. */
static void test_columns(void **state)
{
    (void)state;
    struct motion m;
    put_motion(&m);
    static char text[ROWS * 100];
    size_t end = (size_t)sprintf(text, "trial,t,q,p\n");
    for (int i = 0; i < ROWS; i++)
        end += (size_t)sprintf(text + end, "%.17g,%.17g,%.17g,%.17g\n", m.trial[i], m.t[i], m.q[i],
                               m.p[i]);
    struct path file = files_write_text("m.csv", text);
    const char *names[] = {"trial", "t", "q", "p"};
    struct hnn_columns columns = {4, ROWS, (const double *[]){m.trial, m.t, m.q, m.p}, names};
    const struct hnn_dataset_settings cases[] = {
        {.time = "t", .differences = HNN_CENTRAL, .test_fraction = 0.25, .split = HNN_SPLIT_TRIAL},
        {.time = "t", .rollout = 3, .test_fraction = 0.3, .seed = 4},
        {.time = "2", .state = "3,4", .test_fraction = 0.3, .split = HNN_SPLIT_RANDOM},
        {.state = "q,p", .rate = "t,trial"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hnn_dataset_settings s = cases[k];
        s.size = sizeof s;
        struct hnn_dataset a, b;
        struct ad_error error = {0};
        s.file = file.text;
        assert_int_equal(hnn_dataset_read(&s, &a, &error), AD_OK);
        s.file = NULL;
        s.columns = &columns;
        if (hnn_dataset_read(&s, &b, &error) != AD_OK)
            fail_msg("%s", error.message);
        assert_true(a.train.n == b.train.n && a.test.n == b.test.n && a.trials == b.trials);
        assert_string_equal(a.state_names, b.state_names);
        assert_memory_equal(a.train.x, b.train.x, 2 * a.train.n * sizeof(double));
        assert_memory_equal(a.train.target, b.train.target, 2 * a.train.n * sizeof(double));
        assert_memory_equal(a.centre, b.centre, 2 * sizeof(double));
        if (a.test.n)
            assert_memory_equal(a.test.x, b.test.x, 2 * a.test.n * sizeof(double));
        hnn_dataset_free(&a);
        hnn_dataset_free(&b);
    }
}

static void test_refused_columns(void **state)
{
    (void)state;
    struct motion m;
    put_motion(&m);
    const double *all[] = {m.q, m.p, m.t}, *lacks[] = {m.q, NULL, m.t};
    struct hnn_columns columns = {3, ROWS, all, NULL}, none = columns, empty = columns;
    none.column = lacks;
    empty.rows = 0;
    const struct hnn_dataset_settings wrong[] = {
        {sizeof(struct hnn_dataset_settings), .columns = &none, .state = "1,2", .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &empty, .state = "1,2", .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .file = "x.csv", .state = "1,2",
         .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .skip_rows = 1, .state = "1,2",
         .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .test_file = "x",
         .test_columns = &columns, .state = "1,2"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .test_columns = &columns,
         .test_fraction = 0.5, .state = "1,2"},
        {sizeof(struct hnn_dataset_settings), .state = "1,2"},
    };
    struct hnn_dataset data;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        struct ad_error error = {0};
        if (hnn_dataset_read(&wrong[k], &data, &error) != AD_E_ARGUMENT)
            fail_msg("%zu: %d %s", k, error.status, error.message);
        hnn_dataset_free(&data);
    }
    struct hnn_dataset_settings s = {
        .size = sizeof s, .columns = &columns, .state = "1,4", .rate = "2,3"};
    struct ad_error error = {0}, nan = {0}, back = {0};
    assert_int_equal(hnn_dataset_read(&s, &data, &error), AD_E_INPUT);
    s.state = "1,2";
    m.t[7] = NAN;
    assert_int_equal(hnn_dataset_read(&s, &data, &nan), AD_E_INPUT);
    assert_mentions(nan.message, "8");
    put_motion(&m); /* time goes back where a trial begins, and no column says so */
    s.rate = NULL;
    s.time = "3";
    s.trial = "";
    assert_int_equal(hnn_dataset_read(&s, &data, &back), AD_E_INPUT);
    assert_mentions(back.message, "11");
    hnn_dataset_free(&data);
}

/* The example, as a reader runs it, and the file that it leaves. */
static void test_example(void **state)
{
    (void)state;
    struct path folder = files_temporary(".");
    char *from = getcwd(NULL, 0);
    struct hnn_network network = {.name = "pendulum", .size = 2, .record = energy};
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
        cmocka_unit_test(test_advance),
        cmocka_unit_test(test_between_steps),
        cmocka_unit_test(test_normalised_later),
        cmocka_unit_test(test_columns),
        cmocka_unit_test(test_refused_columns),
        cmocka_unit_test(test_example),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
