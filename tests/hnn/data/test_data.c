/* Data sets: rates by differences, trajectories kept apart, sizes, HDF5. */
#include "datasets.h"
#include "physics/io/hdf5_file.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdio.h>
#include <stdlib.h>

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
    struct hnn_dataset d = dataset_of(&(struct hnn_dataset_settings){
        .size = sizeof(struct hnn_dataset_settings), .file = file.text, .time = "t"});
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
    struct hnn_dataset d =
        dataset_of(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                  .file = file.text,
                                                  .time = "t",
                                                  .differences = HNN_CENTRAL});
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
    dataset_refused(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                   .file = file.text,
                                                   .state = "q,p",
                                                   .time = "t",
                                                   .trial = ""},
                    AD_E_INPUT, "trial");
    dataset_refused(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                   .file = file.text,
                                                   .time = "t",
                                                   .trial = "trail"},
                    AD_E_INPUT, "'trial'");
}

/* The real pendulum: one trajectory, columns named after trial and time; the first test row of the
   published split follows the first 80 percent. */
static void test_real_pendulum(void **state)
{
    (void)state;
    struct path file = files_data("schmidt-lipson/real_pend_h_1.txt");
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .time = "t", .test_fraction = 0.2};
    struct hnn_dataset d = dataset_of(&s);
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

static void test_sizes(void **state)
{
    (void)state;
    struct path file = files_write_text(
        "sizes.csv", "q,p,dqdt,dpdt\n1,5,3,0\n2,5,-4,0\n6,5,0,0\n100,100,100,100\n");
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text, .test_fraction = 0.25};
    struct hnn_dataset d = dataset_of(&s);
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
    struct path file = dataset_rows("shared.csv", 30, 30);
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = file.text,
                                     .state = "q,p",
                                     .rate = "p,dpdt",
                                     .test_fraction = 0.5};
    struct hnn_dataset d = dataset_of(&s);
    for (size_t i = 0; i < 15; i++)
        assert_true(d.train.target[i] == d.train.x[15 + i] && d.train.target[15 + i] == 7 &&
                    d.test.target[i] == -(double)(15 + i));
    hnn_dataset_free(&d);
}

/* q and p as arrays; rates as columns 2 and 4 of one [rows x 5]; and all as rows of [4 x rows]. */
static struct path write_hdf5(size_t rows, bool broken)
{
    struct path file = files_temporary("columns.h5");
    double *values = calloc(rows, 11 * sizeof *values);
    double *q = values, *p = q + rows, *wide = p + rows, *across = wide + 5 * rows;
    struct ad_error error = {0};
    phys_hdf5 *out;
    for (size_t i = 0; i < rows; i++) {
        q[i] = across[i] = (double)i / 3;
        p[i] = across[rows + i] = -(double)i;
        wide[5 * i + 1] = across[2 * rows + i] = sqrt((double)i);
        wide[5 * i + 3] = across[3 * rows + i] = 4.5;
    }
    if (broken)
        p[rows - 1] = (double)NAN;
    assert_int_equal(phys_hdf5_create(file.text, &out, &error), AD_OK);
    phys_hdf5_write(out, "motion/q", AD_F64, 1, &rows, q);
    phys_hdf5_write(out, "motion/p", AD_F64, 1, &rows, p);
    phys_hdf5_write(out, "rates", AD_F64, 2, (size_t[]){rows, 5}, wide);
    phys_hdf5_write(out, "all", AD_F64, 2, (size_t[]){4, rows}, across);
    phys_hdf5_text(out, "all", "axes", "coordinate, sample");
    phys_hdf5_write(out, "short", AD_F64, 1, (size_t[]){rows - 1}, q);
    assert_int_equal(phys_hdf5_commit(out, &error), AD_OK);
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
        struct hnn_dataset d =
            dataset_of(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                      .file = file.text,
                                                      .state = same[k].state,
                                                      .rate = same[k].rate});
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
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
    dataset_refused(&s, AD_E_INPUT, "state");
    s.state = "motion/q,motion/p";
    s.rate = "rates.1,rates.2";
    dataset_refused(&s, AD_E_INPUT, "row 5000 'motion/p' nan");
    s.state = "motion/q,motion/r";
    dataset_refused(&s, AD_E_INPUT, "'motion/r'");
    s.state = "motion/q,short";
    dataset_refused(&s, AD_E_INPUT, "'motion/q' 5000 'short' 4999");
    file = write_hdf5(9, false);
    s = (struct hnn_dataset_settings){.size = sizeof s,
                                      .file = file.text,
                                      .state = "rates.2,rates.4",
                                      .time = "motion/p",
                                      .trial = "rates.1"};
    dataset_refused(&s, AD_E_INPUT, "row 2: time");
    file = files_write_text("text.h5", "q,p,dqdt,dpdt\n1,2,3,4\n");
    s.file = file.text;
    dataset_refused(&s, AD_E_INPUT, "HDF5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forward_differences),
        cmocka_unit_test(test_central_differences),
        cmocka_unit_test(test_trials_are_asked_for),
        cmocka_unit_test(test_real_pendulum),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_shared_column),
        cmocka_unit_test(test_hdf5),
        cmocka_unit_test(test_hdf5_refused),
    };
    return cmocka_run_group_tests_name("data sets", tests, files_setup, files_teardown);
}
