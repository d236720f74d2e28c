/* leastaction dataset, from outside: what it writes, reports and refuses. */
#include "tests/close.h"
#include "shell.h"
#include "hnn/data/data.h"
#include "hnn/pixels/pixels.h"
#include "physics/io/hdf5_file.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct hnn_dataset read_dataset(const char *name)
{
    struct hnn_dataset d;
    struct ad_error error = {0};
    char path[512];
    snprintf(path, sizeof path, "%s", shell_path(name));
    if (hnn_dataset_read(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                        .file = path},
                         &d, &error) != AD_OK)
        fail_msg("%s", error.message);
    return d;
}

/* CSV and HDF5 hold the same numbers, to the last bit, and are read without any choice. */
static void test_both_formats(void **state)
{
    (void)state;
    static const struct {
        const char *task;
        size_t dof, rows;
    } tasks[] = {
        {"spring", 1, 1500}, {"pendulum", 1, 2250}, {"twobody", 4, 200}, {"threebody", 6, 80}};
    for (size_t k = 0; k < LENGTH(tasks); k++) {
        char arguments[256];
        const char *few = tasks[k].dof > 1 ? "--trials 4" : "";
        snprintf(arguments, sizeof arguments, "%s %s --out a.csv", tasks[k].task, few);
        shell_works("$LA dataset %s", arguments);
        snprintf(arguments, sizeof arguments, "%s %s --out a.h5", tasks[k].task, few);
        shell_works("$LA dataset %s", arguments);
        struct hnn_dataset text = read_dataset("a.csv"), hdf5 = read_dataset("a.h5");
        assert_int_equal(text.dof, tasks[k].dof);
        assert_int_equal(text.train.n, tasks[k].rows);
        assert_int_equal(hdf5.train.n, text.train.n);
        assert_int_equal(hdf5.trials, text.trials);
        assert_string_equal(hdf5.state_names, text.state_names);
        assert_string_equal(hdf5.rate_names, text.rate_names);
        assert_memory_equal(hdf5.values, text.values,
                            4 * tasks[k].dof * text.train.n * sizeof *text.values);
        hnn_dataset_free(&text);
        hnn_dataset_free(&hdf5);
    }
}

static void test_hdf5_says_what_it_is(void **state)
{
    (void)state;
    struct ad_error error = {0};
    phys_hdf5 *file;
    char *text = NULL;
    double noise = 0;
    shell_works("$LA dataset pendulum --seed 5 --noise 0.25 --out p.h5");
    assert_int_equal(phys_hdf5_open(shell_path("p.h5"), &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_get_text(file, "/", "command", &text, &error), AD_OK);
    assert_string_equal(text, "leastaction dataset pendulum --seed 5 --noise 0.25 --out p.h5");
    free(text);
    assert_int_equal(phys_hdf5_get_text(file, "dpdt", "unit", &text, &error), AD_OK);
    assert_string_equal(text, "1");
    free(text);
    assert_int_equal(phys_hdf5_get(file, "/", "noise", &noise, &error), AD_OK);
    assert_close(noise, 0.25, 0, 0);
    phys_hdf5_close(file);
}

/* The same seed gives the same bytes, another one others; options reach the data. */
static void test_seed_and_options(void **state)
{
    (void)state;
    shell_works("$LA dataset spring --seed 3 --out a.csv");
    shell_works("$LA dataset spring --seed 3 --out b.csv");
    shell_works("$LA dataset spring --seed 4 --out c.csv");
    assert_int_equal(shell("cmp a.csv b.csv"), 0);
    assert_int_equal(shell("cmp -s a.csv c.csv"), 1);
    shell_works(
        "$LA dataset spring --trials 3 --points 5 --time 2 --noise 0 --min-radius 2 --max-radius 2 "
        "--strength 1 --out o.csv");
    struct hnn_dataset d = read_dataset("o.csv");
    assert_int_equal(d.trials, 3);
    assert_int_equal(d.train.n, 15);
    for (size_t i = 0; i < 15; i++)
        assert_close(hypot(d.train.x[i], d.train.x[15 + i]), 2, 1e-9, 0);
    hnn_dataset_free(&d);
    assert_int_equal(shell("tail -n 1 o.csv | cut -d, -f5,6"), 0);
    assert_string_equal(shell_out(), "2,2\n");
}

/* Options reach the frames: the same as drawn from C, and what the screen's rows and columns mean.
 */
static void test_pixels(void **state)
{
    (void)state;
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames drawn, read;
    struct ad_error error = {0};
    shell_works("$LA dataset pixels --trials 3 --points 4 --size 20,30 --dt 0.02 --max-angle 1 "
                "--max-speed 2 --filter bilinear "
                "--rows 100,400 --columns 50,450 --seed 9 --json --out p.h5");
    assert_non_null(strstr(shell_last_line(), "\"frames\": 18"));
    settings.trajectories = 3;
    settings.frames = 6;
    settings.height = 20;
    settings.width = 30;
    settings.angle_max = 1;
    settings.speed_max = 2;
    settings.rod.dt = 0.02;
    assert_int_equal(hnn_frames_read(shell_path("p.h5"), &read, &error), AD_OK);
    assert_close(read.rod.left, -2.2 + 50 * 0.0088, 0, 1e-15);
    assert_close(read.rod.right, -2.2 + 450 * 0.0088, 0, 1e-15);
    assert_close(read.rod.top, 2.2 - 100 * 0.0088, 0, 1e-15);
    assert_close(read.rod.bottom, 2.2 - 400 * 0.0088, 0, 1e-15);
    settings.rod = read.rod;
    assert_int_equal(hnn_rod_video(&settings, 9, &drawn, &error), AD_OK);
    assert_memory_equal(drawn.pixels, read.pixels, (size_t)18 * 600 * sizeof *read.pixels);
    assert_memory_equal(drawn.angle, read.angle, 18 * sizeof *read.angle);
    assert_close(read.rod.dt, 0.02, 0, 0);
    hnn_frames_free(&drawn);
    hnn_frames_free(&read);
    shell_works("$LA dataset pixels --trials 1 --points 1 --out p.h5");
    assert_int_equal(hnn_frames_read(shell_path("p.h5"), &read, &error), AD_OK);
    struct hnn_rod published = hnn_rod_published();
    assert_memory_equal(&read.rod, &published, offsetof(struct hnn_rod, filter));
    assert_int_equal(read.rod.filter, HNN_AREA);
    hnn_frames_free(&read);
}

/* Discs of the values 1 and 1/2 lie where the bodies are: the light of a frame, exactly, and its
   centre, from the motion that the same options give as numbers. */
static void test_bodies(void **state)
{
    (void)state;
    enum { TRIALS = 3, POINTS = 7, SIZE = 24 };
    static const char *const sampling = "--trials 3 --points 7 --time 9 --spread 0.2 --seed 5";
    struct hnn_frames f;
    struct ad_error error = {0};
    double right, most = 0;
    phys_hdf5 *file;
    shell_works("$LA dataset twobody %s --size 24 --json --out f.h5", sampling);
    assert_non_null(strstr(shell_last_line(), "\"frames\": 21"));
    shell_works("$LA dataset twobody %s --out q.csv", sampling);
    struct hnn_dataset d = read_dataset("q.csv");
    assert_int_equal(hnn_frames_read(shell_path("f.h5"), &f, &error), AD_OK);
    assert_int_equal(phys_hdf5_open(shell_path("f.h5"), &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_get(file, "/", "right", &right, &error), AD_OK);
    phys_hdf5_close(file);
    const double pixel = 2 * right / SIZE, area = acos(-1) * pow(0.15 * right / pixel, 2);
    assert_true(f.trajectories == TRIALS && f.frames == POINTS && !f.has_rod && !f.angle);
    for (size_t i = 0; i < TRIALS * POINTS; i++) {
        const double q[] = {d.train.x[i], d.train.x[2 * TRIALS * POINTS + i]};
        double light = 0, centre[2] = {0};
        most = fmax(most, fmax(fabs(q[0]), fabs(q[1])));
        for (size_t k = 0; k < SIZE * SIZE; k++) {
            const double value = f.pixels[i * SIZE * SIZE + k];
            light += value;
            centre[0] += value * (((double)(k % SIZE) + 0.5) * pixel - right);
            centre[1] += value * (right - ((double)(k / SIZE) + 0.5) * pixel);
        }
        assert_close(light, 1.5 * area, 1e-5, 0); /* exact areas, in f32 */
        for (int c = 0; c < 2; c++)               /* body 2 is opposite: (q - q/2)/1.5 */
            assert_close(centre[c] / light, q[c] / 3, 0, 0.01 * pixel);
    }
    assert_close(right, most / 0.85, 1e-12, 0);
    hnn_frames_free(&f);
    hnn_dataset_free(&d);
}

static void test_standard_output(void **state)
{
    (void)state;
    shell_works("$LA dataset spring --trials 2 --points 3 --out -");
    assert_int_equal(strncmp(shell_out(), "q,p,dqdt,dpdt,trial,t\n", 22), 0);
    assert_int_equal(shell_files(), 0);
    shell_works("$LA dataset spring --quiet --out q.csv");
    assert_string_equal(shell_out(), "");
    shell_works("$LA dataset twobody --trials 2 --json --out t.h5");
    assert_non_null(strstr(shell_last_line(), "\"rows\": 100"));
    assert_non_null(strstr(shell_last_line(), "\"columns\": 18"));
}

static void test_refused(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *says;
    } wrong[] = {
        {"sprong --out a.csv", "'spring'"},
        {"pixel --out a.h5", "'pixels'"},
        {"spring", "missing --out"},
        {"spring --out nowhere/a.csv", "nowhere/a.csv"},
        {"spring --out a.csv --points 1", "points 2 1"},
        {"spring --out a.h5 --size 28", "size pixels twobody threebody spring"},
        {"pixels --out a.h5 --noise 0", "--noise pixels"},
        {"pixels --out a.csv", "--out FILE.h5"},
        {"pixels --out a.h5 --size 0", "1 4096 0"},
        {"pixels --out a.h5 --size 4,5,6", "N HEIGHT WIDTH 2 3"},
        {"pixels --out a.h5 --filter linear", "'linear' 'bilinear'"},
        {"spring --out a.h5 --filter area", "filter pixels"},
        {"pixels --out a.h5 --rows 30", "row 2 1"},
        {"pixels --out a.h5 --rows 30,20", "bottom top"},
        {"pixels --out a.h5 --points 0", "three"},
        {"pixels --out a.h5 --dt 1", "time step"},
        {"spring --out a.csv --noise -1", "noise 0 -1"},
        {"twobody --out a.h5 --size 8 --points 2", "three points 2"},
        {"twobody --out a.csv --size 8", "--out FILE.h5"},
        {"twobody --out a.h5 --size 8 --dt 1", "--dt pixels"},
        {"twobody --out a.csv --spread 1", "spread speeds 0 1"},
        {"spring --out a.csv --min-radius 2", "largest radius"},
    };
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        int status = shell("$LA dataset %s", wrong[k].arguments);
        if (status != 2 || !mentions(shell_err(), wrong[k].says))
            fail_msg("%s: %d, %s", wrong[k].arguments, status, shell_err());
        assert_int_equal(shell_files(), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_both_formats, shell_empty),
        cmocka_unit_test_setup(test_hdf5_says_what_it_is, shell_empty),
        cmocka_unit_test_setup(test_seed_and_options, shell_empty),
        cmocka_unit_test_setup(test_pixels, shell_empty),
        cmocka_unit_test_setup(test_bodies, shell_empty),
        cmocka_unit_test_setup(test_standard_output, shell_empty),
        cmocka_unit_test_setup(test_refused, shell_empty),
    };
    return cmocka_run_group_tests_name("leastaction dataset", tests, shell_setup, shell_teardown);
}
