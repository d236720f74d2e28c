/* The rendered pendulum: its motion, its starts, and the energy measured on frames. */
#include "hnn/pixels/pixel_energy.h"
#include "physics/io/random.h"
#include "tests/close.h"

#include <stdlib.h>

enum { TRIALS = 6 };

static struct hnn_frames video_by(enum hnn_filter filter, size_t trajectories, double angle_max,
                                  double speed_max, uint64_t seed)
{
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames frames;
    struct ad_error error = {0};
    settings.rod.filter = filter;
    settings.trajectories = trajectories;
    settings.angle_max = angle_max;
    settings.speed_max = speed_max;
    if (hnn_rod_video(&settings, seed, &frames, &error) != AD_OK)
        fail_msg("%s", error.message);
    return frames;
}

static struct hnn_frames video(size_t trajectories, double angle_max, double speed_max,
                               uint64_t seed)
{
    return video_by(HNN_AREA, trajectories, angle_max, speed_max, seed);
}

/* ---- motion ---- */

/* Gym's equations, with its angle from the upright. */
static void test_steps_are_those_of_gym(void **state)
{
    (void)state;
    struct hnn_rod rod = hnn_rod_published();
    const double pi = acos(-1);
    double angle = 0.4, speed = -0.7, theta = angle + pi, thdot = speed;
    for (int k = 0; k < 100; k++) {
        hnn_rod_step(&rod, &angle, &speed);
        thdot += -3 * 10. / 2 * sin(theta + pi) * 0.05;
        theta += thdot * 0.05;
        assert_close(angle, theta - pi, 0, 1e-12);
        assert_close(speed, thdot, 0, 1e-12);
    }
}

/* A pendulum of length 2 l/3 with the amplitude 1 has the period 6.69997566437 sqrt(2 l/(3 g)).
   Starting at rest half a step early makes the error second order. */
static void test_period(void **state)
{
    (void)state;
    struct hnn_rod rod = hnn_rod_published();
    const double period = 6.69997566437 / sqrt(15);
    double error[2];
    for (int k = 0; k < 2; k++) {
        int steps = 1000 << k;
        rod.dt = period / steps;
        double angle = 1, speed = rod.dt / 2 * 15 * sin(angle);
        for (int i = 0; i < steps; i++)
            hnn_rod_step(&rod, &angle, &speed);
        error[k] =
            fabs(speed - rod.dt / 2 * 15 * sin(1)); /* at rest, so to first order the time's */
    }
    assert_true(error[0] < 1e-4);
    assert_close(error[0] / error[1], 4, 0.02, 0);
}

/* The energy is the scheme's: its drift falls by 16 where dt is halved. */
static void test_energy_is_conserved(void **state)
{
    (void)state;
    struct hnn_rod rod = hnn_rod_published();
    double drift[2] = {0};
    for (int k = 0; k < 2; k++) {
        rod.dt = 0.05 / (1 << k);
        double angle = 0.5, speed = rod.dt / 2 * 15 * sin(angle);
        double start = hnn_rod_energy(&rod, angle, speed);
        assert_close(start, 5 * (1 - cos(0.5)), 0.01, 0);
        for (double t = 0; t < 3; t += rod.dt) {
            hnn_rod_step(&rod, &angle, &speed);
            drift[k] = fmax(drift[k], fabs(hnn_rod_energy(&rod, angle, speed) / start - 1));
        }
    }
    assert_true(drift[0] < 1e-4);
    assert_close(drift[0] / drift[1], 16, 0.1, 0);
}

/* ---- starts and frames ---- */

static void test_starts(void **state)
{
    (void)state;
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames f;
    struct ad_error error = {0};
    settings.trajectories = 4000;
    settings.frames = 3;
    settings.height = settings.width = 1;
    assert_int_equal(hnn_rod_video(&settings, 11, &f, &error), AD_OK);
    double angle2 = 0, speed2 = 0, both = 0, n = 4000;
    for (size_t i = 0; i < 4000; i++) {
        double a = f.angle[3 * i] / (acos(-1) / 6), s = f.speed[3 * i];
        assert_true(fabs(a) <= 1 && fabs(s) <= 1);
        angle2 += a * a / n;
        speed2 += s * s / n;
        both += a * s / n;
    }
    assert_close(angle2, 1. / 3, 0, 5 * 0.3 / sqrt(n)); /* x^2 has the deviation 0.298 */
    assert_close(speed2, 1. / 3, 0, 5 * 0.3 / sqrt(n));
    assert_close(both, 0, 0, 5. / 3 / sqrt(n));
    hnn_frames_free(&f);
}

static void test_pairs_and_seed(void **state)
{
    (void)state;
    struct hnn_frames a = video(3, 0.5, 1, 7), b = video(3, 0.5, 1, 7), c = video(3, 0.5, 1, 8);
    size_t area = 28 * 28, n = 3 * 102;
    float drawn[28 * 28];
    assert_memory_equal(a.pixels, b.pixels, n * area * sizeof *a.pixels);
    assert_true(c.angle[0] < a.angle[0] || c.angle[0] > a.angle[0]);
    for (size_t k = 0; k < n - 1; k += 29) {
        const float *pair = hnn_frames_pair(&a, k);
        for (size_t which = 0; which < 2; which++) {
            hnn_rod_draw(&a.rod, a.angle[k + which], 28, 28, drawn);
            assert_memory_equal(pair + which * area, drawn, sizeof drawn);
        }
    }
    hnn_frames_free(&a);
    hnn_frames_free(&b);
    hnn_frames_free(&c);
}

static void test_refused(void **state)
{
    (void)state;
    struct hnn_video_settings wrong[7];
    for (size_t k = 0; k < LENGTH(wrong); k++)
        wrong[k] = hnn_video_published();
    wrong[0].frames = 2;
    wrong[1].trajectories = 0;
    wrong[2].width = 0;
    wrong[3].angle_max = NAN;
    wrong[4].rod.dt = 0.52; /* over 2/sqrt(15) */
    wrong[5].rod.axle = 0.2;
    wrong[6].rod.filter = (enum hnn_filter)2;
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct hnn_frames f;
        struct ad_error error = {0};
        assert_int_equal(hnn_rod_video(&wrong[k], 1, &f, &error), AD_E_ARGUMENT);
        hnn_frames_free(&f);
    }
}

/* ---- splitting ---- */

static void test_split(void **state)
{
    (void)state;
    struct hnn_frames f = {.trajectories = 30, .frames = 7};
    struct hnn_split_pairs a, b;
    struct ad_error error = {0};
    assert_int_equal(hnn_frames_split(&f, 0.2, 3, &a, &error), AD_OK);
    assert_int_equal(a.n_train, 24 * 5);
    assert_int_equal(a.n_test, 6 * 5);
    int part[30] = {0}, seen[30 * 7] = {0};
    for (size_t k = 0; k < 30 * 5; k++) {
        size_t trajectory = a.train[k] / 7, frame = a.train[k] % 7;
        int here = k < a.n_train ? 1 : 2;
        assert_true(frame < 5 && seen[a.train[k]]++ == 0);
        assert_true(part[trajectory] == 0 || part[trajectory] == here);
        part[trajectory] = here;
    }
    assert_int_equal(hnn_frames_split(&f, 0.2, 4, &b, &error), AD_OK);
    assert_memory_not_equal(a.train, b.train, 30 * 5 * sizeof *a.train);
    hnn_split_pairs_free(&b);
    assert_int_equal(hnn_frames_split(&f, 0.2, 3, &b, &error), AD_OK);
    assert_memory_equal(a.train, b.train, 30 * 5 * sizeof *a.train);
    hnn_split_pairs_free(&a);
    hnn_split_pairs_free(&b);
    static const double wrong[] = {-0.1, 1, 0.001, 0.999, NAN};
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct ad_error refused = {0};
        assert_int_equal(hnn_frames_split(&f, wrong[k], 3, &a, &refused), AD_E_ARGUMENT);
        hnn_split_pairs_free(&a);
    }
    assert_int_equal(hnn_frames_split(&f, 0, 3, &a, &error), AD_OK);
    assert_int_equal(a.n_test, 0);
    hnn_split_pairs_free(&a);
}

/* ---- measuring ---- */

/* Worst of |measured/true - 1| over a trajectory's energies. */
static double energy_error(const struct hnn_frames *f, size_t trajectory, const float *pixels)
{
    size_t first = trajectory * f->frames;
    double angle[102], energy[100], worst = 0;
    double truth = hnn_rod_energy(&f->rod, f->angle[first], f->speed[first]);
    struct ad_error error = {0};
    assert_int_equal(hnn_rod_angles(&f->rod, 28, 28, 102, pixels, angle, &error), AD_OK);
    hnn_rod_energies(&f->rod, 102, angle, energy);
    for (size_t k = 0; k < 100; k++)
        worst = fmax(worst, fabs(energy[k] / truth - 1));
    return worst;
}

/* A video drawn on from its start is the video, and its energies are those of the angles. */
static void test_measures_of_videos(void **state)
{
    (void)state;
    enum { N = 102, FRAME = 28 * 28 };
    struct hnn_frames f = video(2, acos(-1) / 6, 1, 1);
    struct ad_error error = {0};
    static float pixels[(N + 5) * FRAME];
    double energy[N + 5], truth;
    assert_int_equal(hnn_video_begin(&f, 1, N + 5, pixels, &truth), N + 5);
    assert_close(truth, hnn_rod_energy(&f.rod, f.angle[N], f.speed[N]), 1e-14, 0);
    assert_true(hnn_video_mse(N, FRAME, pixels, hnn_frames_pair(&f, N)) < 1e-12);
    assert_int_equal(hnn_video_energies(&f, N + 5, pixels, energy, &error), AD_OK);
    assert_true(isnan(energy[0]) && isnan(energy[N + 4]));
    assert_close(hnn_video_energy_mean(N + 5, energy, 0, N + 5, 0, 1), truth, 1e-3, 0);
    assert_true(hnn_video_energy_mean(N + 5, energy, 0, N + 5, truth, 2) < 1e-6 * truth * truth);
    assert_close(hnn_video_energy_mean(N + 5, energy, 7, 8, 0, 1), energy[7], 1e-15, 0);
    assert_true(isnan(hnn_video_energy_mean(N + 5, energy, 8, 8, 0, 1)));
    pixels[0] += 1; /* one pixel of two frames */
    assert_close(hnn_video_mse(2, FRAME, pixels, hnn_frames_pair(&f, N)), 1.0 / (2 * FRAME), 1e-6,
                 0);
    f.has_rod = false; /* a recorded video ends */
    assert_int_equal(hnn_video_begin(&f, 1, N + 5, pixels, &truth), N);
    assert_true(isnan(truth));
    assert_int_equal(hnn_video_energies(&f, N, pixels, energy, &error), AD_OK);
    assert_true(isnan(energy[3]));
    hnn_frames_free(&f);
}

/* The measurement on true frames must read the energy within 1 %; it does so within the drift of
   the shadow energy, 6e-5, a hundred times better. */
static void test_energy_of_true_frames(void **state)
{
    (void)state;
    struct hnn_frames f = video(TRIALS, acos(-1) / 6, 1, 1);
    for (size_t i = 0; i < TRIALS; i++)
        assert_true(energy_error(&f, i, hnn_frames_pair(&f, i * f.frames)) < 1e-4);
    hnn_frames_free(&f);
}

/* By the triangle frames are bytes, from the same starts; rounding is noise of 1/255/sqrt(12). */
static void test_smooth_frames(void **state)
{
    (void)state;
    struct hnn_frames f = video_by(HNN_BILINEAR, 1, 0.5, 1, 3), g = video(1, 0.5, 1, 3);
    float drawn[28 * 28];
    hnn_rod_draw(&f.rod, f.angle[40], 28, 28, drawn);
    for (size_t k = 0; k < 28 * 28; k++) {
        double level = 255 * (double)hnn_frames_pair(&f, 40)[k];
        assert_close(level, round(level), 0, 1e-4);
        assert_close(level, 255 * (double)drawn[k], 0, 0.5001);
    }
    assert_memory_equal(f.angle, g.angle, 102 * sizeof *f.angle);
    assert_true(energy_error(&f, 0, f.pixels) < 0.01);
    hnn_frames_free(&f);
    hnn_frames_free(&g);
}

/* Paler frames show the same energy; noise of 2 % of the rod's brightness in every pixel shifts
   angles by about sigma/|r'|, and energies of large swings by little. */
static void test_energy_of_poor_frames(void **state)
{
    (void)state;
    struct hnn_frames f = video(TRIALS, 0.5, 1, 2);
    struct phys_random random;
    float *pixels = malloc(102 * 784 * sizeof *pixels);
    phys_random_seed(&random, 5);
    for (size_t i = 0; i < TRIALS; i++) {
        if (hnn_rod_energy(&f.rod, f.angle[i * 102], f.speed[i * 102]) < 0.2)
            continue;
        for (size_t k = 0; k < 102 * 784; k++)
            pixels[k] = 0.6f * f.pixels[i * 102 * 784 + k];
        assert_true(energy_error(&f, i, pixels) < 1e-4);
        for (size_t k = 0; k < 102 * 784; k++)
            pixels[k] = f.pixels[i * 102 * 784 + k] + (float)(0.01 * phys_random_normal(&random));
        assert_true(energy_error(&f, i, pixels) < 0.05);
    }
    free(pixels);
    hnn_frames_free(&f);
}

/* Any angle is found, as far as the frame shows it; a black frame has none. */
static void test_angles(void **state)
{
    (void)state;
    struct hnn_rod rod = hnn_rod_published();
    struct ad_error error = {0};
    static float pixels[40 * 30];
    rod.left = rod.bottom = -1.2;
    rod.right = rod.top = 1.2;
    for (double angle = -3.14; angle < 3.141; angle += 0.0613) {
        double found;
        hnn_rod_draw(&rod, angle, 40, 30, pixels);
        assert_int_equal(hnn_rod_angles(&rod, 40, 30, 1, pixels, &found, &error), AD_OK);
        assert_close(remainder(found - angle, 2 * acos(-1)), 0, 0, 1e-7);
    }
    for (size_t k = 0; k < LENGTH(pixels); k++)
        pixels[k] = 0;
    double found = 0;
    assert_int_equal(hnn_rod_angles(&rod, 40, 30, 1, pixels, &found, &error), AD_OK);
    assert_true(isnan(found));
}

/* E11: every template counts. Of a rod thinner than the angle between two of them each tells its
   own angle alone. */
static void test_every_template(void **state)
{
    (void)state;
    enum { N = 128, W = 64 };
    struct hnn_rod rod = hnn_rod_published();
    struct ad_error error = {0};
    float *pixels = malloc(N * W * W * sizeof *pixels);
    double found[N];
    rod.left = rod.bottom = -1.1;
    rod.right = rod.top = 1.1;
    rod.radius = rod.axle = 0.004;
    for (size_t k = 0; k < N; k++)
        hnn_rod_draw(&rod, 2 * acos(-1) * ((double)(k + 1) / N - 0.5), W, W, pixels + k * W * W);
    assert_int_equal(hnn_rod_angles(&rod, W, W, N, pixels, found, &error), AD_OK);
    for (size_t k = 0; k < N; k++)
        assert_close(found[k], 2 * acos(-1) * ((double)(k + 1) / N - 0.5), 0, 1e-9);
    free(pixels);
}

/* Angles may pass the top. */
static void test_energy_of_a_whirling_rod(void **state)
{
    (void)state;
    struct hnn_rod rod = hnn_rod_published();
    double angle = 0, speed = 9, angles[200], energy[198];
    double truth = hnn_rod_energy(&rod, angle, speed);
    for (size_t k = 0; k < 200; k++) {
        angles[k] = remainder(angle, 2 * acos(-1));
        hnn_rod_step(&rod, &angle, &speed);
    }
    assert_true(angle > 10);
    hnn_rod_energies(&rod, 200, angles, energy);
    for (size_t k = 0; k < 198; k++)
        assert_close(energy[k], truth, 0.01, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps_are_those_of_gym),
        cmocka_unit_test(test_period),
        cmocka_unit_test(test_energy_is_conserved),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_pairs_and_seed),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_split),
        cmocka_unit_test(test_measures_of_videos),
        cmocka_unit_test(test_energy_of_true_frames),
        cmocka_unit_test(test_smooth_frames),
        cmocka_unit_test(test_energy_of_poor_frames),
        cmocka_unit_test(test_angles),
        cmocka_unit_test(test_every_template),
        cmocka_unit_test(test_energy_of_a_whirling_rod),
    };
    return cmocka_run_group_tests_name("videos of the pendulum", tests, NULL, NULL);
}
