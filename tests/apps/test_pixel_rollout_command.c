/* leastaction rollout for models of pixels, from outside. The model is small and hardly trained:
   its predictions are poor, but the report on them must be exact. */
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixel_energy.h"
#include "physics/io/hdf5_file.h"
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <string.h>

static const char *const training = "--hidden 12 --steps 60 --batch 20 --quiet --threads 1";

/* Frames and two models, which the tests read and leave alone. */
static int setup(void **state)
{
    shell_setup(state);
    return shell("$LA dataset pixels --trials 6 --points 8 --size 8 --quiet --out f.h5") ||
           shell("$LA train f.h5 --model pixel-hnn %s --out m.h5", training) ||
           shell("$LA train f.h5 --model pixel-baseline %s --out b.h5", training);
}

/* The report is what a user of the library gets: encoded, followed, decoded, measured. */
static void test_as_from_c(void **state)
{
    (void)state;
    enum { N = 21, AREA = 64 };
    struct hnn_frames f;
    hnn_model *model;
    struct hnn_path path;
    struct hnn_rollout_info info;
    struct ad_error error = {0};
    static float foreseen[N * AREA], truth[N * AREA];
    double t[N], angle[N], energy[N - 2], pixels = 0, energies = 0;
    shell_works("$LA rollout m.h5 --truth f.h5 --trial 3 --time 20 --json");
    assert_int_equal(hnn_frames_read(shell_path("f.h5"), &f, &error), AD_OK);
    assert_int_equal(hnn_model_load(shell_path("m.h5"), &model, &error), AD_OK);
    hnn_times(0, N - 1, N, t);
    size_t first = 2 * f.frames;
    assert_int_equal(
        hnn_pixels_predict(model, hnn_frames_pair(&f, first),
                           &(struct hnn_rollout_settings){
                               .size = sizeof(struct hnn_rollout_settings), .n = N, .t = t},
                           AREA, &path, foreseen, &info, &error),
        AD_OK);
    double a = f.angle[first], w = f.speed[first], E = hnn_rod_energy(&f.rod, a, w);
    for (size_t k = 0; k < N; k++, hnn_rod_step(&f.rod, &a, &w))
        hnn_rod_draw(&f.rod, a, 8, 8, truth + k * AREA);
    assert_memory_equal(truth, hnn_frames_pair(&f, first), f.frames * AREA * sizeof *truth);
    for (size_t k = 0; k < N * AREA; k++)
        pixels += pow((double)foreseen[k] - truth[k], 2) / (N * AREA);
    assert_int_equal(hnn_rod_angles(&f.rod, 8, 8, N, foreseen, angle, &error), AD_OK);
    hnn_rod_energies(&f.rod, N, angle, energy);
    for (size_t k = 0; k < N - 2; k++)
        energies += pow(energy[k] - E, 2) / (N - 2);
    assert_close(shell_number("true_energy"), E, 1e-12, 0);
    assert_close(shell_number("coordinate_mse"), pixels, 1e-9, 0);
    assert_close(shell_number("energy_mse"), energies, 1e-9, 0);
    hnn_path_free(&path);
    hnn_model_free(model);
    hnn_frames_free(&f);
}

static void test_added_energy(void **state)
{
    (void)state;
    shell_works("$LA rollout m.h5 --truth pixels --seed 2 --time 12 --add-energy 0.01 --at 5 --csv "
                "a.csv --json");
    assert_true(shell_number("conserved_drift") < 1e-6);
    assert_true(isnan(shell_number("energy_mse")));
    assert_int_equal(shell("cut -d, -f4 a.csv | sed -n '7p;8p' | paste -sd,"), 0);
    double H[2];
    assert_int_equal(sscanf(shell_out(), "%lf,%lf", &H[0], &H[1]), 2);
    assert_close(H[1] - H[0], 0.01, 1e-4, 0);
}

/* Means over starts are means of what each start gives. */
static void test_starts(void **state)
{
    (void)state;
    double sum = 0;
    for (int k = 1; k <= 3; k++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments,
                 "m.h5 --against b.h5 --truth f.h5 --trial %d --time 9 --json", k);
        shell_works("$LA rollout %s", arguments);
        sum += shell_number("energy_mse") / 3;
    }
    shell_works("$LA rollout m.h5 --against b.h5 --truth f.h5 --starts 3 --time 9 --json");
    assert_close(shell_number("energy_mse"), sum, 1e-12, 0);
    shell_works("$LA rollout m.h5 --truth pixels --starts 2 --time 9 --json");
}

/* A model trained on smooth frames is shown smooth ones, and its truth is drawn so, too. */
static void test_filter_of_the_training(void **state)
{
    (void)state;
    enum { SIDE = 8 };
    struct hnn_rod rod = hnn_rod_published();
    struct ad_error error = {0};
    phys_hdf5 *file;
    double angle[3], frames[3 * SIDE * SIDE];
    float shown[3 * SIDE * SIDE], drawn[SIDE * SIDE];
    rod.filter = HNN_BILINEAR;
    shell_works("$LA dataset pixels --trials 2 --points 3 --size 8 --filter bilinear --out s.h5");
    shell_works(
        "$LA train s.h5 --model pixel-hnn --steps 1 --batch 2 --test-fraction 0 --out n.h5");
    shell_works("$LA rollout n.h5 --truth pixels --seed 2 --time 2 --out r.h5");
    assert_int_equal(phys_hdf5_open(shell_path("r.h5"), &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_read(file, "truth/frames", 0, 3, frames, &error), AD_OK);
    phys_hdf5_close(file);
    for (size_t k = 0; k < LENGTH(frames); k++)
        shown[k] = (float)frames[k];
    assert_int_equal(hnn_rod_angles(&rod, SIDE, SIDE, 3, shown, angle, &error), AD_OK);
    for (size_t k = 0; k < 3; k++) {
        hnn_rod_draw(&rod, angle[k], SIDE, SIDE, drawn);
        for (size_t i = 0; i < SIDE * SIDE; i++)
            assert_close(shown[k * SIDE * SIDE + i], drawn[i], 0, 1e-6);
    }
}

/* A26: a training too short to move as the data do says so, and the model knows what it has seen.
 */
static void test_no_motion(void **state)
{
    (void)state;
    shell_works("$LA dataset pixels --trials 3 --points 20 --size 8 --out still.h5");
    shell_works(
        "$LA train still.h5 --model pixel-hnn --hidden 8 --steps 2 --test-fraction 0 --json "
        "--out still-model.h5");
    assert_null(strstr(shell_out(), "\"motion\": \"as the data\""));
    assert_true(shell_number("latent_spread") > 3 * shell_number("latent_spread_data"));
    assert_true(isfinite(shell_number("frame_energy_data")));
    assert_true(shell_number("frame_energy") > 0);
    shell_works("$LA rollout still-model.h5 --truth still.h5 --time 20 --json");
    assert_null(strstr(shell_out(), "\"motion\": \"as the data\""));
    assert_int_equal(shell("$LA dump still-model.h5 | grep -w range"), 0);
}

static void test_files(void **state)
{
    (void)state;
    struct phys_hdf5_item item;
    struct ad_error error = {0};
    phys_hdf5 *file;
    shell_works("$LA rollout m.h5 --against b.h5 --truth pixels --time 7 --csv r.csv --out r.h5");
    assert_non_null(strstr(shell_out(), "energy of frames, MSE"));
    assert_int_equal(shell("head -n 1 r.csv; wc -l < r.csv"), 0);
    assert_string_equal(shell_out(), "frame,energy_truth,energy,H,z1,z2,against_energy,against_H,"
                                     "against_z1,against_z2\n9\n");
    assert_int_equal(phys_hdf5_open(shell_path("r.h5"), &file, &error), AD_OK);
    static const char *const frames[] = {"truth/frames", "model/frames", "against/frames"};
    for (size_t k = 0; k < LENGTH(frames); k++) {
        assert_int_equal(phys_hdf5_shape(file, frames[k], &item, &error), AD_OK);
        assert_true(item.rank == 3 && item.dims[0] == 8 && item.dims[1] == 8 && item.dims[2] == 8);
    }
    phys_hdf5_close(file);
}

/* Frames of a user, of no rod: there is nothing to measure but pixels, as far as the video goes. */
static void test_frames_of_no_rod(void **state)
{
    (void)state;
    const size_t dims[] = {5, 8, 8};
    double values[5 * 64];
    struct ad_error error = {0};
    phys_hdf5 *file;
    for (size_t k = 0; k < LENGTH(values); k++)
        values[k] = sin(0.3 * (double)k) / 2;
    assert_int_equal(phys_hdf5_create(shell_path("u.h5"), &file, &error), AD_OK);
    phys_hdf5_write(file, "frames", AD_F64, 3, dims, values);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    shell_works("$LA rollout m.h5 --truth u.h5 --time 9 --json");
    assert_true(isnan(shell_number("true_energy")) && isnan(shell_number("energy_mse")));
    assert_true(shell_number("coordinate_mse") > 0);
}

static void test_pictures(void **state)
{
    (void)state;
    if (shell("command -v gnuplot >/dev/null") != 0) {
        print_message("gnuplot is not installed\n");
        skip();
    }
    shell_works("$LA rollout m.h5 --against b.h5 --truth pixels --time 5 --plot p.svg --quiet");
    shell_works("$LA rollout m.h5 --against b.h5 --truth pixels --time 5 --plot p.gif --quiet");
    shell_works("$LA rollout b.h5 --truth pixels --time 5 --plot p.png --quiet");
    assert_string_equal(shell_err(), "");
    assert_int_equal(shell("grep -q 'energy of the frames' p.svg && head -c 6 p.gif"), 0);
    assert_string_equal(shell_out(), "GIF89a");
}

static void test_refused(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *says;
    } wrong[] = {
        {"m.h5", "--truth pixels frames"},
        {"m.h5 --truth pixels --x0 1,0", "--x0 pixels"},
        {"m.h5 --truth pixels --time 2.5", "frames"},
        {"m.h5 --truth pixels --points 5", "--points frame"},
        {"m.h5 --truth f.h5 --trial 7", "trajectory 1 6 '7'"},
        {"m.h5 --truth f.h5 --starts 7", "6 trajectories f.h5 7"},
        {"m.h5 --truth none.h5", "none.h5"},
        {"m.h5 --truth m.h5", "m.h5 frames"},
        {"m.h5 --truth pixels --add-energy 1", "--add-energy --at"},
        {"b.h5 --truth pixels --add-energy 1 --at 2", "b.h5"},
        {"m.h5 --truth pixels --starts 2 --plot p.svg", "--plot --starts"},
    };
    size_t files = shell_files();
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        int status = shell("$LA rollout %s", wrong[k].arguments);
        if (status != 2 || !mentions(shell_err(), wrong[k].says))
            fail_msg("%s: %d, %s", wrong[k].arguments, status, shell_err());
        assert_int_equal(shell_files(), files);
    }
}

/* Of two bodies: four numbers of a latent state, whose picture has no levels of H. */
static void test_two_coordinates(void **state)
{
    (void)state;
    shell_works("$LA dataset twobody --trials 8 --points 6 --size 6 --quiet --out two.h5");
    shell_works("$LA train two.h5 --model pixel-hnn --coordinates 2 %s --out two-m.h5", training);
    shell_works("$LA rollout two-m.h5 --truth two.h5 --time 4 --csv z.csv --out z.h5 --json");
    assert_true(shell_number("conserved_drift") < 1e-6);
    shell_works("head -n 1 z.csv");
    assert_string_equal(shell_out(), "frame,energy_truth,energy,H,z1,z2,z3,z4\n");
    shell_works("! command -v gnuplot >/dev/null || "
                "$LA rollout two-m.h5 --truth two.h5 --time 4 --plot z.svg --quiet");
    shell_works("$LA dataset spring --trials 2 --quiet --out s.csv");
    assert_int_equal(shell("$LA train s.csv --coordinates 2 --out x.h5"), 2);
    assert_non_null(strstr(shell_err(), "--coordinates"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_as_from_c),
        cmocka_unit_test(test_added_energy),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_filter_of_the_training),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_no_motion),
        cmocka_unit_test(test_frames_of_no_rod),
        cmocka_unit_test(test_pictures),
        cmocka_unit_test(test_two_coordinates),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("rollouts of pixels", tests, setup, shell_teardown);
}
