/* Data sets: rates by differences, rollouts, trajectories kept apart, splits, test files, HDF5. */
#include "../../hnn/data.h"
#include "../../physics/runfile.h"
#include "../close.h"
#include "../files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

static struct hnn_dataset read_dataset(const struct hnn_dataset_settings *settings)
{
    struct hnn_dataset d;
    struct ad_error error = {0};
    if (hnn_dataset_read(settings, &d, &error) != AD_OK)
        fail_msg("%s", error.message);
    return d;
}

static void assert_refused(const struct hnn_dataset_settings *settings, enum ad_status status,
                           const char *says)
{
    struct hnn_dataset d;
    struct ad_error error = {0};
    enum ad_status found = hnn_dataset_read(settings, &d, &error);
    hnn_dataset_free(&d);
    if (found != status || !strstr(error.message, says))
        fail_msg("expected '%s', got %d '%s'", says, found, error.message);
}

/* ---- trajectories: parabolas and cubics, at uneven times ---- */

enum { TRIALS = 7, SHORTEST = 1 };

/* Uneven, and the same bits in every loop: vector sines of some compilers differ in the last. */
static double time_at(size_t trial, size_t i)
{
    return 0.3 * (double)i + 0.1 * fmod(0.618033988749895 * (double)(i * i + trial), 1);
}

static double q_at(size_t trial, double t) { return 1.7 - 0.4 * t + (0.3 + (double)trial) * t * t; }

static double q_rate(size_t trial, double t) { return -0.4 + 2 * (0.3 + (double)trial) * t; }

static double p_at(size_t trial, double t) { return (double)trial + 0.11 * t * t * t; }

/* Trajectory k has SHORTEST + 2 k observations, and the number 10 k in its column. */
static size_t length_of(size_t trial) { return SHORTEST + 2 * trial; }

static struct path write_trajectories(void)
{
    struct path file = files_temporary("trajectories.csv");
    FILE *out = fopen(file.text, "w");
    fputs("t,q,p,trial\n", out);
    for (size_t k = 0; k < TRIALS; k++)
        for (size_t i = 0; i < length_of(k); i++) {
            double t = time_at(k, i);
            fprintf(out, "%.17g,%.17g,%.17g,%zu\n", t, q_at(k, t), p_at(k, t), 10 * k);
        }
    fclose(out);
    return file;
}

/* The published formula, (x[i+1] - x[i])/(t[i+1] - t[i]) at x[i], never across trajectories. */
static void test_forward_differences(void **state)
{
    (void)state;
    struct path file = write_trajectories();
    struct hnn_dataset d =
        read_dataset(&(struct hnn_dataset_settings){.file = file.text, .time = "t"});
    size_t n = d.train.n, s = 0;
    assert_string_equal(d.state_names, "q,p");
    assert_int_equal(d.trials, TRIALS);
    for (size_t k = 0; k < TRIALS; k++)
        for (size_t i = 0; i + 1 < length_of(k); i++, s++) {
            double t = time_at(k, i), next = time_at(k, i + 1);
            assert_true(d.train.x[s] == q_at(k, t) && d.train.x[n + s] == p_at(k, t));
            assert_close(d.train.target[s], (q_at(k, next) - q_at(k, t)) / (next - t), 1e-15, 0);
            assert_close(d.train.target[n + s], (p_at(k, next) - p_at(k, t)) / (next - t), 1e-15,
                         0);
        }
    assert_int_equal(s, n);
    hnn_dataset_free(&d);
}

/* Second order: exact for parabolas at any times; for cubics the error is x'''/6 times both
   steps. */
static void test_central_differences(void **state)
{
    (void)state;
    struct path file = write_trajectories();
    struct hnn_dataset d = read_dataset(
        &(struct hnn_dataset_settings){.file = file.text, .time = "t", .differences = HNN_CENTRAL});
    size_t n = d.train.n, s = 0;
    for (size_t k = 0; k < TRIALS; k++)
        for (size_t i = 1; i + 1 < length_of(k); i++, s++) {
            double t = time_at(k, i);
            double steps = (t - time_at(k, i - 1)) * (time_at(k, i + 1) - t);
            assert_close(d.train.target[s], q_rate(k, t), 0, 1e-13 * (1 + fabs(q_at(k, t))));
            assert_close(d.train.target[n + s], 0.33 * t * t + 0.11 * steps, 1e-12, 1e-12);
        }
    assert_int_equal(s, n);
    hnn_dataset_free(&d);
}

/* Without a trial column time goes back; as one trajectory it must not. */
static void test_trials_are_asked_for(void **state)
{
    (void)state;
    struct path file = write_trajectories();
    assert_refused(
        &(struct hnn_dataset_settings){.file = file.text, .state = "q,p", .time = "t", .trial = ""},
        AD_E_INPUT, "need a trial column");
    assert_refused(&(struct hnn_dataset_settings){.file = file.text, .time = "t", .trial = "trail"},
                   AD_E_INPUT, "did you mean 'trial'?");
}

/* The real pendulum: one trajectory, columns named after trial and time; the first test row of the
   published split follows the first 80 percent. */
static void test_real_pendulum(void **state)
{
    (void)state;
    struct path file = files_shared("data/schmidt-lipson/real_pend_h_1.txt");
    struct hnn_dataset_settings s = {.file = file.text, .time = "t", .test_fraction = 0.2};
    struct hnn_dataset d = read_dataset(&s);
    assert_string_equal(d.state_names, "o,v");
    assert_int_equal(d.trials, 1);
    assert_int_equal(d.train.n, 444);
    assert_int_equal(d.test.n, 111);
    double dt = 5.1666666666666670e+000 - 5;
    assert_close(d.train.x[0], 1.1383885512243586, 0, 0);
    assert_close(d.train.target[0], (1.2753554896511765 - 1.1383885512243586) / dt, 1e-15, 0);
    assert_close(d.train.target[444], (7.1937977921297058e-1 - 9.1977959058677250e-1) / dt, 1e-15,
                 0);
    hnn_dataset_free(&d);
}

/* ---- rollouts ---- */

/* Rows k = 0 ... of `n` a trajectory: state (row, -row), trial row / n, time 0.25 row. */
static struct path write_rows(const char *name, size_t rows, size_t each)
{
    struct path file = files_temporary(name);
    FILE *out = fopen(file.text, "w");
    fputs("q,p,dqdt,dpdt,trial,t\n", out);
    for (size_t i = 0; i < rows; i++)
        fprintf(out, "%zu,-%zu,%zu,7,%zu,%.9g\n", i, i, 3 * i, i / each, 0.25 * (double)i);
    fclose(out);
    return file;
}

static void test_rollouts(void **state)
{
    (void)state;
    struct path file = write_rows("rollout.csv", 60, 15);
    struct hnn_dataset_settings s = {
        .file = file.text, .time = "t", .rollout = 3, .test_fraction = 0.25};
    struct hnn_dataset d = read_dataset(&s);
    assert_close(d.dt, 0.25, 0, 0);
    assert_null(d.rate);
    const struct hnn_samples *parts[] = {&d.train, &d.test};
    for (size_t part = 0; part < 2; part++)
        for (size_t i = 0; i < parts[part]->n; i++) {
            size_t n = parts[part]->n;
            double q = parts[part]->x[i];
            assert_true((size_t)q / 15 == (size_t)(q + 3) / 15);
            for (size_t k = 1; k <= 3; k++) {
                assert_true(parts[part]->target[(k - 1) * 2 * n + i] == q + (double)k);
                assert_true(parts[part]->target[((k - 1) * 2 + 1) * n + i] == -q - (double)k);
            }
        }
    assert_int_equal(d.test.n, 12); /* of 4 (15 - 3), all in the last trajectory */
    assert_true(d.test.x[0] == 45);
    assert_int_equal(d.train.n, 36);
    hnn_dataset_free(&d);
}

/* No target of the training is a state of the test. */
static void test_rollouts_do_not_see_the_test(void **state)
{
    (void)state;
    struct path file = write_rows("rollout.csv", 60, 60);
    struct hnn_dataset_settings s = {
        .file = file.text, .rollout = 3, .dt = 0.1, .test_fraction = 0.25};
    struct hnn_dataset d = read_dataset(&s);
    assert_close(d.dt, 0.1, 0, 0);
    assert_true(d.train.x[d.train.n - 1] + 3 < d.test.x[0]);
    assert_true(d.train.x[d.train.n - 1] + 4 == d.test.x[0]);
    hnn_dataset_free(&d);
    s.split = HNN_SPLIT_RANDOM;
    assert_refused(&s, AD_E_ARGUMENT, "rollouts share states");
    s.dt = 0;
    assert_refused(&s, AD_E_ARGUMENT, "a loss on rollouts needs the time column, or the time step");
}

static void test_rollouts_need_equal_steps(void **state)
{
    (void)state;
    struct path file = files_write_text("uneven.csv", "t,q,p\n0,1,2\n1,2,3\n2.5,1,1\n4,1,1\n");
    assert_refused(&(struct hnn_dataset_settings){.file = file.text, .time = "t", .rollout = 1},
                   AD_E_INPUT, "rollouts need equal steps of time, found 1 and 1.5 (t = 2.5)");
    file = write_rows("even.csv", 9, 9);
    assert_refused(
        &(struct hnn_dataset_settings){.file = file.text, .time = "t", .rollout = 1, .dt = 0.5},
        AD_E_ARGUMENT, "the time step is 0.25 there, not 0.5");
}

/* ---- splits ---- */

enum { ROWS = 1000, EACH = 20 };

/* Every row is in one part, once, with its own rate, in the order of the file. */
static void assert_partition(const struct hnn_dataset *d, bool is_test[ROWS])
{
    const struct hnn_samples *parts[] = {&d->train, &d->test};
    bool seen[ROWS] = {0};
    assert_int_equal(d->train.n + d->test.n, ROWS);
    for (size_t part = 0; part < 2; part++) {
        double last = -1;
        for (size_t i = 0, n = parts[part]->n; i < n; i++) {
            double q = parts[part]->x[i];
            assert_true(q > last && !seen[(size_t)q]);
            assert_true(parts[part]->x[n + i] == -q && parts[part]->target[i] == 3 * q);
            seen[(size_t)q] = true;
            is_test[(size_t)q] = part == 1;
            last = q;
        }
    }
}

static void test_splits(void **state)
{
    (void)state;
    struct path file = write_rows("split.csv", ROWS, EACH);
    struct hnn_dataset_settings s = {.file = file.text, .test_fraction = 0.3};
    static const enum hnn_split kinds[] = {HNN_SPLIT_TAIL, HNN_SPLIT_RANDOM, HNN_SPLIT_TRIAL};
    for (size_t k = 0; k < LENGTH(kinds); k++) {
        bool first[ROWS] = {0}, again[ROWS] = {0}, other[ROWS] = {0};
        bool *results[] = {first, again, other};
        s.split = kinds[k];
        for (size_t run = 0; run < 3; run++) {
            s.seed = run == 2 ? 8 : 7;
            struct hnn_dataset d = read_dataset(&s);
            assert_int_equal(d.test.n, 300);
            assert_partition(&d, results[run]);
            hnn_dataset_free(&d);
        }
        assert_memory_equal(first, again, sizeof first);
        assert_true((memcmp(first, other, sizeof first) != 0) == (kinds[k] != HNN_SPLIT_TAIL));
        for (size_t i = 0; i < ROWS; i++) {
            if (kinds[k] == HNN_SPLIT_TAIL)
                assert_int_equal(first[i], i >= 700);
            if (kinds[k] == HNN_SPLIT_TRIAL)
                assert_int_equal(first[i], first[i - i % EACH]);
        }
    }
}

/* Over many seeds every row is chosen equally often: chi-squared of 1000 rows, 400 draws. */
static void test_random_is_fair(void **state)
{
    (void)state;
    enum { DRAWS = 400 };
    struct path file = write_rows("fair.csv", ROWS, EACH);
    static size_t times[ROWS];
    memset(times, 0, sizeof times);
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        struct hnn_dataset d = read_dataset(&(struct hnn_dataset_settings){
            .file = file.text, .split = HNN_SPLIT_RANDOM, .test_fraction = 0.3, .seed = seed});
        for (size_t i = 0; i < d.test.n; i++)
            times[(size_t)d.test.x[i]]++;
        hnn_dataset_free(&d);
    }
    double chi2 = 0;
    for (size_t i = 0; i < ROWS; i++)
        chi2 += pow((double)times[i] - 0.3 * DRAWS, 2) / (0.3 * 0.7 * DRAWS);
    assert_close(chi2, ROWS, 0, 5 * sqrt(2.0 * ROWS));
}

static void test_splits_that_leave_nothing(void **state)
{
    (void)state;
    struct path file = write_rows("tiny.csv", 4, 2);
    struct hnn_dataset_settings s = {.file = file.text, .test_fraction = 0.1};
    assert_refused(&s, AD_E_ARGUMENT, "0.1 of 4 samples leaves none for the test");
    s.test_fraction = 0.9;
    assert_refused(&s, AD_E_ARGUMENT, "leaves none to train on");
    s.test_fraction = 0.5;
    s.split = HNN_SPLIT_TRIAL;
    s.trial = "";
    assert_refused(&s, AD_E_ARGUMENT, "a split by trial needs a trial column");
    s.trial = NULL;
    s.test_fraction = 0.2;
    assert_refused(&s, AD_E_ARGUMENT, "0.2 of 2 trials leaves none for the test");
    s.test_fraction = 1;
    assert_refused(&s, AD_E_ARGUMENT, "less than 1, got 1");
    s.test_fraction = (double)NAN;
    assert_refused(&s, AD_E_ARGUMENT, "at least 0");
    s.test_fraction = 0.5;
    s.test_file = file.text;
    assert_refused(&s, AD_E_ARGUMENT, "got both");
}

static void test_test_file(void **state)
{
    (void)state;
    struct path file = write_rows("train.csv", 50, 50);
    struct path other = files_write_text("test.txt", "dpdt dqdt p q\n1 2 3 4\n5 6 7 8\n");
    struct hnn_dataset_settings s = {
        .file = file.text, .state = "q,p", .rate = "dqdt,dpdt", .test_file = other.text};
    struct hnn_dataset d = read_dataset(&s);
    static const double x[] = {4, 8, 3, 7}, rate[] = {2, 6, 1, 5};
    assert_int_equal(d.train.n, 50);
    assert_int_equal(d.test.n, 2);
    assert_memory_equal(d.test.x, x, sizeof x);
    assert_memory_equal(d.test.target, rate, sizeof rate);
    assert_true(d.train.x[49] == 49 && d.train.target[49] == 147);
    hnn_dataset_free(&d);
    other = files_write_text("test.txt", "q p dqdt\n1 2 3\n");
    assert_refused(&s, AD_E_INPUT, "test.txt: rate: no column 'dpdt'; did you mean 'dqdt'?");
}

/* ---- sizes ---- */

static void test_sizes(void **state)
{
    (void)state;
    struct path file = files_write_text(
        "sizes.csv", "q,p,dqdt,dpdt\n1,5,3,0\n2,5,-4,0\n6,5,0,0\n100,100,100,100\n");
    struct hnn_dataset_settings s = {.file = file.text, .test_fraction = 0.25};
    struct hnn_dataset d = read_dataset(&s);
    assert_close(d.centre[0], 3, 1e-15, 0);
    assert_close(d.scale[0], sqrt(14.0 / 3), 1e-15, 0);
    assert_close(d.rate[0], sqrt(25.0 / 3), 1e-15, 0);
    assert_close(d.centre[1], 5, 1e-15, 0);
    assert_close(d.scale[1], 1, 0, 0); /* never changes: keeps its unit */
    assert_close(d.rate[1], 1, 0, 0);
    hnn_dataset_free(&d);
}

/* One column for two purposes: unit mass, q' = p. */
static void test_shared_column(void **state)
{
    (void)state;
    struct path file = write_rows("shared.csv", 30, 30);
    struct hnn_dataset_settings s = {
        .file = file.text, .state = "q,p", .rate = "p,dpdt", .test_fraction = 0.5};
    struct hnn_dataset d = read_dataset(&s);
    for (size_t i = 0; i < 15; i++)
        assert_true(d.train.target[i] == d.train.x[15 + i] && d.train.target[15 + i] == 7 &&
                    d.test.target[i] == -(double)(15 + i));
    hnn_dataset_free(&d);
}

/* ---- HDF5 ---- */

/* q and p as arrays; rates as columns 2 and 4 of one [rows x 5]; and all as rows of [4 x rows]. */
static struct path write_hdf5(size_t rows, bool broken)
{
    struct path file = files_temporary("columns.h5");
    double *values = calloc(rows, 11 * sizeof *values);
    double *q = values, *p = q + rows, *wide = p + rows, *across = wide + 5 * rows;
    struct ad_error error = {0};
    phys_runfile *out;
    for (size_t i = 0; i < rows; i++) {
        q[i] = across[i] = (double)i / 3;
        p[i] = across[rows + i] = -(double)i;
        wide[5 * i + 1] = across[2 * rows + i] = sqrt((double)i);
        wide[5 * i + 3] = across[3 * rows + i] = 4.5;
    }
    if (broken)
        p[rows - 1] = (double)NAN;
    assert_int_equal(phys_runfile_create(file.text, &out, &error), AD_OK);
    phys_runfile_write(out, "motion/q", AD_F64, 1, &rows, q);
    phys_runfile_write(out, "motion/p", AD_F64, 1, &rows, p);
    phys_runfile_write(out, "rates", AD_F64, 2, (size_t[]){rows, 5}, wide);
    phys_runfile_write(out, "all", AD_F64, 2, (size_t[]){4, rows}, across);
    phys_runfile_text(out, "all", "axes", "coordinate, sample");
    phys_runfile_write(out, "short", AD_F64, 1, (size_t[]){rows - 1}, q);
    assert_int_equal(phys_runfile_commit(out, &error), AD_OK);
    free(values);
    return file;
}

static void test_hdf5(void **state)
{
    (void)state;
    enum { N = 10007 };
    struct path file = write_hdf5(N, false);
    static const struct {
        const char *state, *rate;
    } same[] = {{"motion/q,motion/p", "rates.2,rates.4"},
                {"all.1,all.2", "all.3,all.4"},
                {"6,5", "8,4"}}; /* in the order of names */
    for (size_t k = 0; k < LENGTH(same); k++) {
        struct hnn_dataset d = read_dataset(&(struct hnn_dataset_settings){
            .file = file.text, .state = same[k].state, .rate = same[k].rate});
        assert_int_equal(d.train.n, N);
        for (size_t i = 0; i < N; i++)
            if (d.train.x[i] != (double)i / 3 || d.train.x[N + i] != -(double)i ||
                d.train.target[i] != sqrt((double)i) || d.train.target[N + i] != 4.5)
                fail_msg("%s: row %zu differs", same[k].state, i);
        hnn_dataset_free(&d);
    }
}

static void test_hdf5_refused(void **state)
{
    (void)state;
    struct path file = write_hdf5(5000, true);
    struct hnn_dataset_settings s = {.file = file.text};
    assert_refused(&s, AD_E_INPUT, "which columns are the state?");
    s.state = "motion/q,motion/p";
    s.rate = "rates.1,rates.2";
    assert_refused(&s, AD_E_INPUT, "a finite number in row 5000 of 'motion/p', found nan");
    s.state = "motion/q,motion/r";
    assert_refused(&s, AD_E_INPUT, "no column 'motion/r'; did you mean 'motion/");
    s.state = "motion/q,short";
    assert_refused(&s, AD_E_INPUT, "'motion/q' has 5000 rows and 'short' 4999");
    file = files_write_text("text.h5", "q,p,dqdt,dpdt\n1,2,3,4\n");
    s.file = file.text;
    assert_refused(&s, AD_E_INPUT, "not an HDF5 file");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forward_differences),
        cmocka_unit_test(test_central_differences),
        cmocka_unit_test(test_trials_are_asked_for),
        cmocka_unit_test(test_real_pendulum),
        cmocka_unit_test(test_rollouts),
        cmocka_unit_test(test_rollouts_do_not_see_the_test),
        cmocka_unit_test(test_rollouts_need_equal_steps),
        cmocka_unit_test(test_splits),
        cmocka_unit_test(test_random_is_fair),
        cmocka_unit_test(test_splits_that_leave_nothing),
        cmocka_unit_test(test_test_file),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_shared_column),
        cmocka_unit_test(test_hdf5),
        cmocka_unit_test(test_hdf5_refused),
    };
    return cmocka_run_group_tests_name("data sets", tests, files_setup, files_teardown);
}
