/* Ranks that each read their share of a file: they hold no more, hold what one process reads there,
   and training on it ends in the same file, to the last bit; of states with rates, and of motions.
 */
#include "small.h"
#include "hnn/data/data.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/random.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "tests/ranks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 60000, COLUMNS = 4, INPUTS = 2, MARGIN = 8192, MOST = 4, MOTION_ROWS = 40000 };

struct job {
    const char *name;
    const char *file[MOST]; /* of each rank */
    struct hnn_dataset_settings data;
    size_t kind, batch; /* of small_kinds */
    bool hold;
    struct path out;
    struct hnn_dataset read[MOST];
    struct ad_error error[MOST];
};

static void work(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct hnn_dataset *data = &j->read[rank];
    struct hnn_dataset_settings settings = j->data;
    struct hnn_settings net = small_settings(&small_kinds[j->kind], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    settings.ranks = training.ranks = ranks;
    settings.file = j->file[rank];
    training.steps = 4;
    training.every = 2;
    training.batch = j->batch;
    training.rollout = j->data.rollout;
    training.dt = j->data.dt;
    training.hold = j->hold;
    if (j->data.inputs)
        net.inputs = INPUTS, net.time = true;
    if (hnn_dataset_read(&settings, data, error) == AD_OK &&
        hnn_model_new(&net, &model, error) == AD_OK &&
        hnn_dataset_normalise(data, model, error) == AD_OK &&
        hnn_trainer_new(model, &training, &data->train, &data->test, &trainer, error) == AD_OK &&
        hnn_trainer_run(trainer, NULL, error) == AD_OK)
        hnn_trainer_save(trainer, j->out.text, "x", error);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
}

static void run(struct job *job, size_t count)
{
    with_ranks(count, work, job);
    for (size_t k = 0; k < count + !count; k++)
        if (job->error[k].status != AD_OK)
            fail_msg("%s, rank %zu of %zu: %s", job->name, k, count, job->error[k].message);
}

static void check_rows(size_t rows, const double *part, size_t held, const double *whole, size_t n)
{
    for (size_t r = 0; r < rows; r++)
        assert_memory_equal(part + r * held, whole + r * n, held * sizeof *part);
}

/* A part holds its share of the whole. */
static void check_held(const struct job *job, const struct hnn_samples *part,
                       const struct hnn_samples *whole, size_t count)
{
    const size_t held = hnn_samples_held(part), n = whole->n, at = part->begin,
                 steps = job->data.rollout, inputs = job->data.inputs ? INPUTS : 0;
    assert_int_equal(part->n, n);
    assert_in_range(held, n / count, n / count + 2 * MARGIN + 1);
    check_rows(2 + inputs * (1 + steps), part->x, held, whole->x + at, n);
    check_rows(2 * (steps ? steps : 1), part->target, held, whole->target + at, n);
    assert_int_equal(part->steps == NULL, whole->steps == NULL);
    if (whole->steps)
        check_rows(steps ? steps : 1, part->steps, held, whole->steps + at, n);
}

static void check(struct job *job)
{
    size_t whole_bytes, bytes;
    job->out = files_temporary("model.h5");
    run(job, 0);
    char *whole = files_read(job->out.text, &whole_bytes);
    struct hnn_dataset one = job->read[0];
    for (size_t count = 1; count <= MOST; count++) {
        run(job, count);
        char *parts = files_read(job->out.text, &bytes);
        assert_int_equal(bytes, whole_bytes);
        assert_memory_equal(parts, whole, bytes);
        free(parts);
        for (size_t k = 0; k < count; k++) {
            const struct hnn_dataset *read = &job->read[k];
            check_held(job, &read->train, &one.train, count);
            check_held(job, &read->test, &one.test, count);
            assert_true(read->trials == one.trials && read->gaps == one.gaps &&
                        read->varied == one.varied && read->missing == one.missing);
            hnn_dataset_free(&job->read[k]);
        }
    }
    free(whole);
    hnn_dataset_free(&one);
}

/* The same numbers as CSV and, in one array, HDF5. */
static void write_files(size_t bad, struct path *csv, struct path *hdf5)
{
    struct hnn_samples s = small_pendulum(7, ROWS, 0);
    double *rows = malloc(ROWS * COLUMNS * sizeof *rows);
    struct ad_error error = {0};
    phys_hdf5 *file;
    for (size_t k = 0; k < ROWS; k++)
        for (size_t c = 0; c < COLUMNS; c++)
            rows[k * COLUMNS + c] = (c < 2 ? s.x : s.target)[c % 2 * ROWS + k];
    if (bad < ROWS)
        rows[bad * COLUMNS] = (double)NAN;
    if (csv)
        files_write_csv(csv->text, "q,p,dqdt,dpdt", ROWS, COLUMNS, rows);
    assert_int_equal(phys_hdf5_create(hdf5->text, &file, &error), AD_OK);
    phys_hdf5_write(file, "data", AD_F64, 2, (size_t[]){ROWS, COLUMNS}, rows);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    free(rows);
    small_samples_free(&s);
}

static void test_shares(void **state)
{
    (void)state;
    struct path csv = files_temporary("data.csv"), hdf5 = files_temporary("data.h5");
    struct hnn_dataset_settings data = {
        .size = sizeof data, .state = "1,2", .rate = "3,4", .test_fraction = 0.3};
    write_files(ROWS, &csv, &hdf5);
    for (int of = 0; of < 4; of++) {
        struct job job = {
            .name = of % 2 ? "HDF5" : "CSV", .kind = 1, .data = data, .batch = of < 2 ? 0 : 5003};
        job.data.split = of % 2 ? HNN_SPLIT_RANDOM : HNN_SPLIT_TAIL;
        for (size_t k = 0; k < MOST; k++)
            job.file[k] = of % 2 ? hdf5.text : csv.text;
        check(&job);
    }
}

/* Motions from random starts: their lengths, steps of time and inputs differ, and there are gaps;
   `missing`: and rows that lack a value, of every column. */
static void write_motions(bool missing, struct path *csv, struct path *hdf5)
{
    static const char names[] = "run,t,q,p,u,dqdt,dpdt";
    enum { WIDE = 7 };
    double *rows = malloc(MOTION_ROWS * WIDE * sizeof *rows), t = 0, run = 0, phase = 0, size = 1;
    struct phys_random random;
    struct ad_error error = {0};
    phys_hdf5 *file;
    phys_random_seed(&random, 5);
    for (size_t k = 0; k < MOTION_ROWS; k++) {
        const double chance = phys_random_uniform(&random);
        t += chance < 0.002 ? 1 : 0.05 + 0.02 * phys_random_uniform(&random);
        if (k % 9000 == 0 || chance > 0.998) {
            run++;
            t = phys_random_uniform(&random);
            phase = 6 * phys_random_uniform(&random);
            size = 0.5 + phys_random_uniform(&random);
        }
        const double q = size * sin(t + phase), p = size * cos(t + phase);
        memcpy(rows + k * WIDE, (double[]){run, t, q, p, floor(20 * chance), p, -q},
               WIDE * sizeof *rows);
        if (missing && chance > 0.9 && chance < 0.93)
            rows[k * WIDE + k % WIDE] = (double)NAN;
    }
    files_write_csv(csv->text, names, MOTION_ROWS, WIDE, rows);
    assert_int_equal(phys_hdf5_create(hdf5->text, &file, &error), AD_OK);
    phys_hdf5_write(file, "data", AD_F64, 2, (size_t[]){MOTION_ROWS, WIDE}, rows);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    free(rows);
}

/* Samples that need rows before and after their own, and times, trials and inputs. */
static void test_motions(void **state)
{
    (void)state;
    struct path csv[] = {files_temporary("motions.csv"), files_temporary("missing.csv")};
    struct path hdf5[] = {files_temporary("motions.h5"), files_temporary("missing.h5")};
    const struct job jobs[] = {
        {.name = "forward", .data = {.time = "2", .trial = "1"}, .batch = 1003},
        {.name = "forward, lnn", .kind = 7, .data = {.time = "2", .trial = "1"}},
        {.name = "central, random",
         .data = {.time = "2", .differences = HNN_CENTRAL, .split = HNN_SPLIT_RANDOM}},
        {.name = "trials", .data = {.rate = "6,7", .trial = "1", .split = HNN_SPLIT_TRIAL}},
        {.name = "inputs", .data = {.rate = "6,7", .time = "2", .inputs = "2,5"}, .batch = 1003},
        {.name = "rollouts", .data = {.time = "2", .trial = "1", .rollout = 2}},
        {.name = "equal steps", .data = {.trial = "", .rollout = 3, .dt = 0.06}, .batch = 1003},
        {.name = "rollouts with inputs",
         .data = {.time = "2", .rollout = 2, .inputs = "2,5", .split = HNN_SPLIT_TRIAL},
         .batch = 1003,
         .hold = true},
        {.name = "missing",
         .data = {.time = "2", .trial = "1", .inputs = "2,5", .skip_missing = true},
         .batch = 1003},
        {.name = "missing, rollouts", .data = {.time = "2", .rollout = 2, .skip_missing = true}},
        {.name = "missing, rates", .data = {.rate = "6,7", .skip_missing = true}},
        {.name = "missing, trials",
         .data = {.rate = "6,7", .trial = "1", .skip_missing = true, .split = HNN_SPLIT_TRIAL}},
    };
    for (int missing = 0; missing < 2; missing++)
        write_motions(missing, &csv[missing], &hdf5[missing]);
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++) {
        struct job job = jobs[i];
        job.kind = job.kind ? job.kind : 1;
        job.data.size = sizeof job.data;
        job.data.state = "3,4";
        job.data.test_fraction = 0.45;
        for (size_t k = 0; k < MOST; k++)
            job.file[k] = (i % 2 ? hdf5 : csv)[job.data.skip_missing].text;
        check(&job);
    }
}

/* Lagrangian models look at the velocities of all samples first. */
static void test_velocities(void **state)
{
    (void)state;
    struct path hdf5 = files_temporary("data.h5");
    write_files(ROWS, NULL, &hdf5);
    struct job job = {.name = "lnn",
                      .kind = 7,
                      .data = {.size = sizeof job.data, .state = "1,2", .rate = "3,4"},
                      .file = {hdf5.text, hdf5.text, hdf5.text, hdf5.text},
                      .batch = 5003};
    job.data.test_fraction = 0.3;
    check(&job);
    job.data.state = "1,4"; /* dp/dt is no velocity */
    job.data.rate = "3,2";
    struct job alone = job;
    work(&alone, NULL);
    with_ranks(MOST, work, &job);
    assert_mentions(alone.error[0].message, "times the rate of q1");
    hnn_dataset_free(&alone.read[0]);
    for (size_t k = 0; k < MOST; k++) {
        assert_string_equal(job.error[k].message, alone.error[0].message);
        hnn_dataset_free(&job.read[k]);
    }
}

/* A number that is none, in rows that the last rank alone reads; and a rank that sees another file.
 */
static void test_damaged(void **state)
{
    (void)state;
    struct path good = files_temporary("good.h5"), bad = files_temporary("bad.h5"),
                other = files_temporary("other.h5"), csv = files_temporary("good.csv");
    size_t bytes;
    write_files(ROWS, &csv, &good);
    write_files(ROWS - 10, NULL, &bad);
    write_files(17, NULL, &other);
    char *text = files_read(csv.text, &bytes), *digit = text + bytes - 6;
    *digit = *digit == '5' ? '6' : '5'; /* of the last number, which rank 1 alone takes */
    struct path changed = files_write("changed.csv", text, bytes);
    free(text);
    const struct hnn_dataset_settings data = {.size = sizeof data, .state = "1,2", .rate = "3,4"};
    struct job damaged = {
        .name = "damaged", .data = data, .file = {bad.text, bad.text, bad.text, bad.text}};
    struct job another = {.name = "another", .data = data, .file = {good.text, other.text}};
    struct job digits = {.name = "digits", .data = data, .file = {csv.text, changed.text}};
    with_ranks(4, work, &damaged);
    with_ranks(2, work, &another);
    with_ranks(2, work, &digits);
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(damaged.error[k].status, AD_E_INPUT);
        assert_mentions(damaged.error[k].message, "rank 3 bad.h5 row 59991");
        hnn_dataset_free(&damaged.read[k]);
    }
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(another.error[k].status, AD_E_INPUT);
        assert_mentions(another.error[k].message, "rank 1 other.h5");
        assert_int_equal(digits.error[k].status, AD_E_INPUT);
        assert_mentions(digits.error[k].message, "rank 1 changed.csv 60000 rows");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shares), cmocka_unit_test(test_motions),
        cmocka_unit_test(test_velocities), cmocka_unit_test(test_damaged)};
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
