/* The published systems: equations and energy by hand, noise, and the distribution of their
   observations against the published files. */
#include "observed.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <stdio.h>

enum { STATES_MOST = 12 };

static double spring_field(double k, const double *y, double *rate)
{
    rate[0] = 2 * y[1];
    rate[1] = -2 * k * y[0];
    return y[1] * y[1] + k * y[0] * y[0];
}

static double pendulum_field(double k, const double *y, double *rate)
{
    rate[0] = 2 * y[1];
    rate[1] = -k * sin(y[0]);
    return y[1] * y[1] + k * (1 - cos(y[0]));
}

static double gravity_field(size_t bodies, double k, const double *y, double *rate)
{
    const double *p = y + 2 * bodies;
    double energy = 0, *force = rate + 2 * bodies;
    for (size_t c = 0; c < 2 * bodies; c++) {
        energy += p[c] * p[c] / 2;
        rate[c] = p[c];
        force[c] = 0;
    }
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = 0; j < bodies; j++) {
            double x = y[j] - y[i], z = y[bodies + j] - y[bodies + i], r = hypot(x, z);
            if (i == j)
                continue;
            force[i] += k * x / pow(r, 3);
            force[bodies + i] += k * z / pow(r, 3);
            energy -= k / r / 2;
        }
    return energy;
}

static double two_body_field(double k, const double *y, double *rate)
{
    return gravity_field(2, k, y, rate);
}

static double three_body_field(double k, const double *y, double *rate)
{
    return gravity_field(3, k, y, rate);
}

static const struct by_hand {
    const char *name, *reference; /* published files, without _train.csv */
    double (*field)(double k, const double *y, double *rate);
    double strength;
} tasks[] = {
    {"spring", "spring", spring_field, 1.3},
    {"pendulum", "pend", pendulum_field, 2.4},
    {"twobody", "2body", two_body_field, 0.8},
    {"threebody", NULL, three_body_field, 1.1},
};

/* Without noise: rates are those of the equations, and energy stays, at any strength. */
static void test_motion(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(tasks); k++) {
        struct hnn_sampling s = published_sampling(tasks[k].name);
        s.noise = 0;
        s.trials = 40;
        s.strength = tasks[k].strength;
        struct hnn_observations o = observed(tasks[k].name, &s, 3);
        size_t states = 2 * o.dof;
        double first = 0, worst = 0;
        assert_int_equal(o.rows, s.trials * s.points);
        for (size_t i = 0; i < o.rows; i++) {
            double y[STATES_MOST], rate[STATES_MOST];
            for (size_t c = 0; c < states; c++)
                y[c] = observed_at(&o, c, i);
            double energy = tasks[k].field(s.strength, y, rate);
            for (size_t c = 0; c < states; c++)
                assert_close(observed_at(&o, states + c, i), rate[c], 1e-12, 1e-12);
            assert_close(observed_at(&o, 2 * states, i), (double)(i / s.points), 0, 0);
            assert_close(observed_at(&o, 2 * states + 1, i),
                         s.time * (double)(i % s.points) / (double)(s.points - 1), 1e-12, 1e-12);
            first = i % s.points == 0 ? energy : first;
            worst = fmax(worst, fabs(energy - first) / fabs(first));
        }
        assert_close(worst, 0, 0, 3e-9);
        hnn_observations_free(&o);
    }
}

/* Columns have the names of the published files, trial and time behind them. */
static void test_names(void **state)
{
    (void)state;
    static const char *const two[] = {"q1x",    "q2x",    "q1y",    "q2y",    "p1x",    "p2x",
                                      "p1y",    "p2y",    "dq1xdt", "dq2xdt", "dq1ydt", "dq2ydt",
                                      "dp1xdt", "dp2xdt", "dp1ydt", "dp2ydt", "trial",  "t"};
    struct hnn_sampling s = published_sampling("twobody");
    s.trials = 1;
    struct hnn_observations o = observed("twobody", &s, 0);
    assert_int_equal(o.cols, LENGTH(two));
    for (size_t k = 0; k < o.cols; k++)
        assert_string_equal(o.names[k], two[k]);
    hnn_observations_free(&o);
}

/* Rates carry no noise, so those of the spring tell where it was: q = -p'/2, p = q'/2. */
static double spring_noise(size_t rows, const double *q, const double *p, const double *dq,
                           const double *dp)
{
    double squares = 0;
    for (size_t i = 0; i < rows; i++)
        squares += pow(q[i] + dp[i] / 2, 2) + pow(p[i] - dq[i] / 2, 2);
    return sqrt(squares / (2 * (double)rows));
}

static void test_noise(void **state)
{
    (void)state;
    static const double sigmas[] = {0.1, 0.37};
    for (size_t k = 0; k < 2; k++) {
        struct hnn_sampling s = published_sampling("spring");
        s.noise = sigmas[k];
        struct hnn_observations o = observed("spring", &s, 17);
        const double *x = o.values;
        double found = spring_noise(o.rows, x, x + o.rows, x + 2 * o.rows, x + 3 * o.rows);
        assert_close(found, sigmas[k], 5 / sqrt(4.0 * (double)o.rows), 0);
        hnn_observations_free(&o);
    }
}

/* What is compared: all columns, and all products of two. Their means over a trajectory are drawn
   independently, so that the spread over ours tells how far those of a file may be off. */
enum { COLUMNS_MOST = 16, FEATURES_MOST = COLUMNS_MOST * (COLUMNS_MOST + 3) / 2 };

/* Adds the features of `points` rows; column c of row i is x[c * stride + i]. */
static size_t add_features(size_t columns, size_t points, const double *x, size_t stride,
                           double *feature)
{
    size_t n = 0;
    for (size_t a = 0; a < columns; a++)
        for (size_t b = 0; b <= a + 1; b++, n++)
            for (size_t i = 0; i < points; i++)
                feature[n] += x[a * stride + i] * (b <= a ? x[b * stride + i] : 1);
    return n;
}

struct moments {
    size_t n;
    double mean[FEATURES_MOST], deviation[FEATURES_MOST];
};

static struct moments moments_of(size_t columns, size_t trials, size_t points, const double *x,
                                 size_t stride)
{
    struct moments m = {0};
    for (size_t trial = 0; trial < trials; trial++) {
        double feature[FEATURES_MOST] = {0};
        m.n = add_features(columns, points, x + trial * points, stride, feature);
        for (size_t f = 0; f < m.n; f++) {
            double mean = feature[f] / (double)points;
            m.mean[f] += mean / (double)trials;
            m.deviation[f] += mean * mean / (double)trials;
        }
    }
    for (size_t f = 0; f < m.n; f++)
        m.deviation[f] = sqrt(fmax(m.deviation[f] - m.mean[f] * m.mean[f], 0));
    return m;
}

/* The means of a file are ours within 4.5 of their standard deviations. */
static void compare_with_file(const struct by_hand *task, const char *part, size_t columns,
                              size_t points, const struct moments *ours)
{
    char name[64];
    snprintf(name, sizeof name, "hnn/%s_%s.csv", task->reference, part);
    struct path file = files_data(name);
    struct hnn_dataset_settings settings = {.size = sizeof settings, .file = file.text};
    struct hnn_dataset d;
    struct ad_error error = {0};
    if (hnn_dataset_read(&settings, &d, &error) != AD_OK)
        fail_msg("%s", error.message);
    size_t trials = d.train.n / points;
    assert_int_equal(trials * points, d.train.n);
    /* x and target stand one behind the other, as in a file */
    struct moments theirs = moments_of(columns, trials, points, d.train.x, d.train.n);
    for (size_t f = 0; f < ours->n; f++)
        assert_close(theirs.mean[f], ours->mean[f], 0,
                     4.5 * ours->deviation[f] / sqrt((double)trials) + 1e-6);
    hnn_dataset_free(&d);
}

static void test_distributions(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(tasks); k++) {
        if (!tasks[k].reference)
            continue;
        struct hnn_sampling s = published_sampling(tasks[k].name);
        s.trials = 3000;
        struct hnn_observations o = observed(tasks[k].name, &s, 23);
        size_t columns = 4 * o.dof;
        struct moments ours = moments_of(columns, s.trials, s.points, o.values, o.rows);
        compare_with_file(&tasks[k], "train", columns, s.points, &ours);
        compare_with_file(&tasks[k], "test", columns, s.points, &ours);
        hnn_observations_free(&o);
    }
}

/* The same noise as published, to the accuracy that 750 rows give. */
static void test_noise_as_published(void **state)
{
    (void)state;
    struct path file = files_data("hnn/spring_train.csv");
    struct hnn_dataset_settings settings = {.size = sizeof settings, .file = file.text};
    struct hnn_dataset d;
    struct ad_error error = {0};
    assert_int_equal(hnn_dataset_read(&settings, &d, &error), AD_OK);
    const double *x = d.train.x, *rate = d.train.target;
    size_t n = d.train.n;
    assert_close(spring_noise(n, x, x + n, rate, rate + n), published_sampling("spring").noise,
                 5 / sqrt(4.0 * (double)n), 0);
    hnn_dataset_free(&d);
}

static void test_refused(void **state)
{
    (void)state;
    struct ad_error error = {0};
    assert_null(hnn_task_find("sprung", &error));
    assert_mentions(error.message, "'spring'");
    const struct {
        struct hnn_sampling sampling;
        const char *says;
    } wrong[] = {
        {{sizeof(struct hnn_sampling), 0, 2, 1, 0, 1, 1, 0, 1}, "trials 1 0"},
        {{sizeof(struct hnn_sampling), 1, 1, 1, 0, 1, 1, 0, 1}, "points 2 1"},
        {{sizeof(struct hnn_sampling), 1, 2, 0, 0, 1, 1, 0, 1}, "time 0"},
        {{sizeof(struct hnn_sampling), 1, 2, 1, -1, 1, 1, 0, 1}, "noise 0 -1"},
        {{sizeof(struct hnn_sampling), 1, 2, 1, 0, 0, 1, 0, 1}, "smallest radius 0"},
        {{sizeof(struct hnn_sampling), 1, 2, 1, 0, 2, 1, 0, 1}, "largest radius 1"},
        {{sizeof(struct hnn_sampling), 1, 2, 1, 0, 1, 1, 1, 1}, "spread speeds 0 1"},
        {{sizeof(struct hnn_sampling), 1, 2, 1, 0, 1, 1, 0, -1}, "strength 0 -1"},
    };
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct hnn_observations o;
        struct ad_error refused = {0};
        assert_int_equal(hnn_task_observe(hnn_tasks[0], &wrong[k].sampling, 0, &o, &refused),
                         AD_E_ARGUMENT);
        assert_mentions(refused.message, wrong[k].says);
        hnn_observations_free(&o);
    }
    struct hnn_observations o;
    struct ad_error memory = {0};
    struct hnn_sampling huge = {.size = sizeof huge, SIZE_MAX / 8, 2, 1, 0, 1, 1, 0, 1};
    assert_int_equal(hnn_task_observe(hnn_tasks[0], &huge, 0, &o, &memory), AD_E_MEMORY);
    hnn_observations_free(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_motion),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_distributions),
        cmocka_unit_test(test_noise_as_published),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("published systems", tests, NULL, NULL);
}
