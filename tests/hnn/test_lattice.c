/* Chains of equal sites: the field against the same network written out site by site and taken as
   any other model, waves against their closed form, normalisation, files, what is refused. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/model/exchange.h"
#include "hnn/model/internal.h"
#include "hnn/rollout/rollout.h"
#include "hnn/train/train.h"

#include <stdlib.h>
#include <string.h>

enum { SITES = 5, SAMPLES = 4, WIDTH = 6 };
static const enum hnn_kind kinds[] = {HNN_BASELINE, HNN_HAMILTONIAN, HNN_LAGRANGIAN};

static struct hnn_settings chain(enum hnn_kind kind, enum hnn_lattice ends)
{
    struct hnn_settings s = hnn_defaults(kind, SITES);
    s.layers = 2;
    s.hidden[0] = WIDTH;
    s.precision = AD_F64;
    s.seed = 5;
    s.lattice = ends;
    return s;
}

/* Of all sites alike; the last number is that of the differences. */
static void units(double centre[2 * SITES + 1], double scale[2 * SITES + 1], double rate[2 * SITES])
{
    for (size_t k = 0; k < 2 * SITES; k++) {
        centre[k] = k < SITES ? 0.3 : -0.1;
        scale[k] = k < SITES ? 1.4 : 0.7;
        rate[k] = k < SITES ? 0.8 : 1.9;
    }
    centre[2 * SITES] = 0;
    scale[2 * SITES] = 0.6;
}

/* ---- the same model, written out ---- */

struct written {
    enum hnn_kind kind;
    enum hnn_lattice ends;
    bool normalised;
};

/* Coordinate i of a row of sites, from -1 (beyond the first) to SITES. */
static ad_var site(const struct written *w, ad_var x, size_t first, long i)
{
    long n = SITES;
    if (w->ends == HNN_RING)
        return ad_row(x, (uint32_t)(first + (size_t)((i + n) % n)));
    if (i >= 0 && i < n)
        return ad_row(x, (uint32_t)(first + (size_t)i));
    double wall = w->normalised ? (first ? 0.1 / 0.7 : -0.3 / 1.4) : 0;
    return ad_add(ad_mul(0.0, ad_row(x, 0)), wall);
}

static ad_var difference(const struct written *w, ad_var x, long from, long to)
{
    ad_var d = ad_sub(site(w, x, 0, to), site(w, x, 0, from));
    return w->normalised ? ad_mul(1.4 / 0.6, d) : d;
}

static ad_var written(void *context, ad_var parameters, ad_var x)
{
    const struct written *w = context;
    size_t in = w->kind == HNN_BASELINE ? 4 : 3, out = w->kind == HNN_BASELINE ? 2 : 1;
    ad_var A = ad_reshape(ad_slice_cols(parameters, 0, WIDTH * in), WIDTH, in);
    ad_var b = ad_reshape(ad_slice_cols(parameters, WIDTH * in, WIDTH), WIDTH, 1);
    ad_var B = ad_reshape(ad_slice_cols(parameters, WIDTH * (in + 1), out * WIDTH), out, WIDTH);
    ad_var sum = {0}, rates[2 * SITES];
    long first = w->ends == HNN_FIXED_ENDS && w->kind != HNN_BASELINE ? -1 : 0;
    for (long i = first; i < SITES; i++) {
        ad_var sees[] = {site(w, x, 0, i), site(w, x, SITES, i), difference(w, x, i, i + 1),
                         difference(w, x, i, i - 1)};
        ad_var h = ad_tanh(ad_add(ad_matmul(A, false, ad_concat_rows(in, sees), false), b));
        ad_var y = ad_matmul(B, false, h, false);
        sum = i > first ? ad_add(sum, y) : y;
        if (w->kind == HNN_BASELINE) {
            rates[i] = ad_row(y, 0);
            rates[SITES + i] = ad_row(y, 1);
        }
    }
    return w->kind == HNN_BASELINE ? ad_concat_rows(2 * SITES, rates) : sum;
}

static void test_field(void **state)
{
    (void)state;
    double centre[2 * SITES + 1], scale[2 * SITES + 1], rate[2 * SITES];
    double *x = small_values(4, 2 * SITES, SAMPLES), field[2][2 * SITES * SAMPLES], H[2][SAMPLES];
    units(centre, scale, rate);
    for (size_t how = 0; how < 4 * LENGTH(kinds); how++) {
        struct ad_error error = {0};
        struct written w = {kinds[how / 4], how % 2 ? HNN_RING : HNN_FIXED_ENDS, how % 4 > 1};
        struct hnn_settings s = chain(w.kind, w.ends);
        hnn_model *model[2] = {small_model(&s), NULL};
        const struct hnn_network network = {.name = "chain",
                                            .size = hnn_model_size(model[0]),
                                            .start = hnn_model_parameters(model[0]),
                                            .record = written,
                                            .context = &w};
        s.lattice = HNN_NO_LATTICE;
        s.network = &network;
        model[1] = small_model(&s);
        for (size_t k = 0; k < 2; k++) {
            if (w.normalised)
                hnn_model_normalise(model[k], centre, scale, rate, &error);
            assert_int_equal(hnn_model_evaluate(model[k], SAMPLES, x, field[k], H[k], &error),
                             AD_OK);
            hnn_model_free(model[k]);
        }
        for (size_t k = 0; k < 2 * SITES * SAMPLES; k++)
            assert_close(field[0][k], field[1][k], 1e-11, 1e-11);
        for (size_t k = 0; k < SAMPLES && w.kind != HNN_BASELINE; k++)
            assert_close(H[0][k], H[1][k], 1e-12, 1e-12);
    }
    free(x);
}

static void test_gradient(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    training.dt = 0.1;
    for (size_t how = 0; how < 4 * LENGTH(kinds); how++) {
        struct hnn_settings s = chain(kinds[how / 4], how % 2 ? HNN_RING : HNN_FIXED_ENDS);
        hnn_model *model = small_model(&s);
        training.rollout = how % 4 / 2;
        ad_tape *tape = ad_tape_new(AD_F64);
        size_t rows = hnn_target_rows(model, &training);
        double *states = small_values(5, 2 * SITES, SAMPLES), *to = small_values(6, rows, SAMPLES);
        const double *at = hnn_model_parameters(model);
        ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
        ad_var loss = ad_mean(hnn_record_losses(model, &training, p,
                                                ad_const(tape, 2 * SITES, SAMPLES, states),
                                                ad_const(tape, rows, SAMPLES, to)));
        struct ad_check report = {0};
        if (ad_check_gradient(loss, 1, &p, &at, 2e-7, 0, &report) != AD_OK || !report.passed)
            fail_msg("%zu: %s; entry %zu: %.12g on the tape, %.12g by differences", how,
                     ad_tape_error(tape)->message, report.col, report.tape, report.difference);
        free(states);
        free(to);
        ad_tape_free(tape);
        hnn_model_free(model);
    }
}

/* Values of sites are pooled; a state that is moved along a ring has moved rates. */
static void test_normalisation(void **state)
{
    (void)state;
    struct ad_error error = {0};
    double centre[2 * SITES + 1], scale[2 * SITES + 1], rate[2 * SITES], moved[2 * SITES],
        field[2][2 * SITES], *x = small_values(9, 2 * SITES, 1);
    struct hnn_settings s = chain(HNN_LAGRANGIAN, HNN_RING);
    hnn_model *model = small_model(&s);
    units(centre, scale, rate);
    for (size_t k = 0; k < 2 * SITES; k++) {
        centre[k] += 0.1 * (double)(k % SITES);
        rate[k] = 1 + (double)(k % SITES);
        moved[k] = x[k / SITES * SITES + (k + 2) % SITES];
    }
    assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
    const struct hnn_scaling *to = &model->scaling;
    for (size_t k = 0; k < SITES; k++) {
        assert_close(to->centre[k], 0.5, 1e-15, 0);
        assert_close(to->scale[k], sqrt(1.4 * 1.4 + 0.02), 1e-15, 0);
        assert_close(to->scale[SITES + k], sqrt(0.7 * 0.7 + 0.02), 1e-15, 0);
        assert_close(to->rate[k], sqrt(11), 1e-15, 0);
    }
    assert_true(to->scale[2 * SITES] == 0.6);
    hnn_model_field(model, x, field[0]);
    hnn_model_field(model, moved, field[1]);
    for (size_t k = 0; k < 2 * SITES; k++)
        assert_close(field[1][k], field[0][k / SITES * SITES + (k + 2) % SITES], 1e-13, 1e-13);
    struct hnn_mass mass;
    assert_int_equal(hnn_model_mass(model, 1, x, &mass, &error), AD_OK);
    assert_true(mass.condition == 1 && mass.negative_most <= 1);
    hnn_model_free(model);
    free(x);
}

/* ---- waves ---- */

/* Mode m of a task at time t, by its closed form; amplitudes 1 of q and w/2 of p. */
static void mode(bool ring, size_t n, size_t m, double t, double *y)
{
    double h = ring ? 2 * M_PI / (double)n : M_PI / (double)(n + 1);
    double w = 2 / h * sin(0.5 * (double)m * h);
    for (size_t i = 0; i < n; i++) {
        double shape = sin((double)m * h * (double)(ring ? i : i + 1));
        y[i] = shape * (cos(w * t) + 0.5 * sin(w * t));
        y[n + i] = w * shape * (0.5 * cos(w * t) - sin(w * t));
    }
}

static void test_waves(void **state)
{
    (void)state;
    static const char *const names[] = {"wave", "string"};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error error = {0};
        const struct hnn_task *task = hnn_task_find(names[k % 2], &error);
        struct phys_ode ode;
        struct hnn_path path;
        double start[64], end[64];
        const struct hnn_rollout_settings r = {
            .size = sizeof r, .rtol = 1e-12, .n = 2, .t = (double[]){0, 3.7}};
        assert_int_equal(hnn_task_ode(task, 0, &ode, &error), AD_OK);
        mode(k % 2 == 0, task->dof, k < 2 ? 1 : 7, 0, start);
        mode(k % 2 == 0, task->dof, k < 2 ? 1 : 7, 3.7, end);
        assert_int_equal(hnn_rollout(&ode, &r, start, &path, NULL, &error), AD_OK);
        for (size_t i = 0; i < 2 * task->dof; i++)
            assert_close(path.x[2 * task->dof + i], end[i], 0, 1e-9);
        hnn_path_free(&path);
        phys_ode_free(&ode);
    }
}

/* A chain learns a wave's accelerations from ten trajectories. */
static void test_learning(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        struct ad_error error = {0};
        const struct hnn_task *task = hnn_task_find(k ? "string" : "wave", &error);
        struct hnn_sampling sampling = task->published;
        struct hnn_observations o;
        struct hnn_dataset data;
        sampling.trials = 10;
        assert_int_equal(hnn_task_observe(task, &sampling, 1, &o, &error), AD_OK);
        size_t n = 2 * task->dof;
        assert_int_equal(hnn_dataset_arrays(task->dof, o.rows, o.values, o.values + n * o.rows, 0.1,
                                            &data, &error),
                         AD_OK);
        struct hnn_settings s = hnn_defaults(k ? HNN_HAMILTONIAN : HNN_LAGRANGIAN, task->dof);
        s.lattice = k ? HNN_FIXED_ENDS : HNN_RING;
        s.hidden[0] = s.hidden[1] = 16;
        hnn_model *model = small_model(&s);
        assert_int_equal(hnn_dataset_normalise(&data, model, &error), AD_OK);
        struct hnn_training training = hnn_training_defaults();
        training.steps = 200;
        training.batch = 20;
        training.learning_rate = 1e-2;
        hnn_trainer *trainer = small_trainer(model, &training, &data.train, &data.test);
        double before = hnn_trainer_test_loss(trainer);
        small_run(trainer);
        assert_true(hnn_trainer_test_loss(trainer) < 0.02 * before);
        hnn_trainer_free(trainer);
        hnn_model_free(model);
        hnn_dataset_free(&data);
        hnn_observations_free(&o);
    }
}

/* ---- files, and what is refused ---- */

static void test_files(void **state)
{
    (void)state;
    struct ad_error error = {0};
    double centre[2 * SITES + 1], scale[2 * SITES + 1], rate[2 * SITES], field[3][2 * SITES],
        *x = small_values(9, 2 * SITES, 1);
    struct hnn_settings s = chain(HNN_HAMILTONIAN, HNN_FIXED_ENDS);
    hnn_model *model = small_model(&s), *other[2];
    struct hnn_exchange exchange;
    struct path h5 = files_temporary("chain.h5"), tensors = files_temporary("chain.safetensors");
    units(centre, scale, rate);
    assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
    assert_int_equal(hnn_model_save(model, h5.text, NULL, &error), AD_OK);
    assert_int_equal(hnn_model_export(model, tensors.text, &error), AD_OK);
    assert_int_equal(hnn_model_load(h5.text, &other[0], &error), AD_OK);
    s = hnn_defaults(HNN_HAMILTONIAN, 1);
    if (hnn_model_import(tensors.text, &s, &other[1], &exchange, &error) != AD_OK)
        fail_msg("%s", error.message);
    hnn_model_field(model, x, field[2]);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(hnn_model_settings(other[k])->lattice, HNN_FIXED_ENDS);
        hnn_model_field(other[k], x, field[k]);
        assert_memory_equal(field[k], field[2], sizeof field[2]);
        hnn_model_free(other[k]);
    }
    /* a training of the same networks on a ring is another one */
    s = chain(HNN_HAMILTONIAN, HNN_RING);
    hnn_model *ring = small_model(&s);
    const struct hnn_samples samples = {.n = 1, .x = x, .target = field[0]};
    struct hnn_training training = hnn_training_defaults();
    training.steps = 1;
    hnn_trainer *trainer = small_trainer(ring, &training, &samples, NULL);
    small_run(trainer);
    assert_int_equal(hnn_trainer_save(trainer, h5.text, NULL, &error), AD_OK);
    hnn_trainer_free(trainer);
    s.lattice = HNN_FIXED_ENDS;
    hnn_model_free(model);
    model = small_model(&s);
    trainer = small_trainer(model, &training, &samples, NULL);
    assert_int_equal(hnn_trainer_resume(trainer, h5.text, &error), AD_E_INPUT);
    assert_mentions(error.message, "other model settings");
    hnn_trainer_free(trainer);
    hnn_model_free(ring);
    hnn_model_free(model);
    free(x);
}

static void test_refused(void **state)
{
    (void)state;
    for (size_t k = 0; k < 10; k++) {
        struct ad_error error = {0};
        hnn_model *model = NULL;
        struct hnn_settings s = chain(HNN_HAMILTONIAN, HNN_RING);
        s.kind = k == 0 ? HNN_SYMPNET : k == 1 ? HNN_LAGRANGIAN : HNN_HAMILTONIAN;
        s.quadratic = k == 1;
        s.separable = k == 2;
        s.dissipation = k == 3;
        s.angles = k == 4;
        s.inputs = k == 5;
        s.field = k == 6 ? HNN_BOTH : HNN_SYMPLECTIC;
        s.dof = k == 7 ? HNN_LATTICE_MOST + 1 : SITES;
        s.lattice = k == 8 ? (enum hnn_lattice)7 : HNN_RING;
        s.pixels = k == 9 ? 4 : 0;
        s.autoencoder = 4;
        assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, "lattice");
        assert_null(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_field),         cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_normalisation), cmocka_unit_test(test_waves),
        cmocka_unit_test(test_learning),      cmocka_unit_test(test_files),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("lattice", tests, files_setup, files_teardown);
}
