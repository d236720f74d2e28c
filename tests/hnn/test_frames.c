/* Frames from files: HDF5, PGM, PNG; damaged ones are refused with their position. */
#include "hnn/pixels/frames.h"
#include "physics/io/hdf5_file.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <hdf5.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { H = 3, W = 5 };

static struct ad_error error;

static int fresh(void **state)
{
    (void)state;
    error = (struct ad_error){0};
    return 0;
}

/* Refused with these words in the message, and nothing is left. */
static void refused(struct path path, const char *says)
{
    struct hnn_frames f;
    error = (struct ad_error){0};
    assert_int_not_equal(hnn_frames_read(path.text, &f, &error), AD_OK);
    assert_mentions(error.message, says);
    hnn_frames_free(&f);
}

static struct hnn_frames accepted(struct path path)
{
    struct hnn_frames f;
    error = (struct ad_error){0};
    if (hnn_frames_read(path.text, &f, &error) != AD_OK)
        fail_msg("%s", error.message);
    return f;
}

/* ---- HDF5 ---- */

static struct path write_array(const char *name, const char *array, size_t rank,
                               const size_t dims[], const double *values)
{
    phys_hdf5 *file;
    struct path path = files_temporary(name);
    assert_int_equal(phys_hdf5_create(path.text, &file, &error), AD_OK);
    phys_hdf5_write(file, array, AD_F64, rank, dims, values);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    return path;
}

/* Bytes as h5py would write them. */
static struct path write_integers(const char *name, hid_t type, const hsize_t dims[4],
                                  const int *values)
{
    struct path path = files_temporary(name);
    hid_t file = H5Fcreate(path.text, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t space = H5Screate_simple(4, dims, NULL);
    hid_t set = H5Dcreate2(file, "video", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Dwrite(set, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Fclose(file);
    return path;
}

static void test_drawn_frames_come_back(void **state)
{
    (void)state;
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames a;
    settings.trajectories = 2;
    settings.frames = 6;
    settings.width = 17;
    settings.rod.dt = 0.031;
    settings.rod.filter = HNN_BILINEAR;
    assert_int_equal(hnn_rod_video(&settings, 3, &a, &error), AD_OK);
    struct path path = files_temporary("drawn.h5");
    assert_int_equal(hnn_frames_save(&a, path.text, &error), AD_OK);
    struct hnn_frames b = accepted(path);
    assert_true(b.trajectories == 2 && b.frames == 6 && b.height == 28 && b.width == 17);
    assert_memory_equal(a.pixels, b.pixels, 2 * 6 * 28 * 17 * sizeof *a.pixels);
    assert_memory_equal(a.angle, b.angle, 12 * sizeof *a.angle);
    assert_memory_equal(a.speed, b.speed, 12 * sizeof *a.speed);
    assert_true(b.has_rod);
    assert_memory_equal(&a.rod, &b.rod, offsetof(struct hnn_rod, filter));
    assert_int_equal(b.rod.filter, HNN_BILINEAR);
    hnn_frames_free(&a);
    hnn_frames_free(&b);
}

static void test_arrays_of_a_user(void **state)
{
    (void)state;
    double values[2 * 4 * H * W];
    for (size_t k = 0; k < 2 * 4 * H * W; k++)
        values[k] = sin((double)k);
    struct hnn_frames f =
        accepted(write_array("four.h5", "any/name", 4, (size_t[]){2, 4, H, W}, values));
    assert_true(f.trajectories == 2 && f.frames == 4 && f.height == H && f.width == W);
    assert_true(!f.has_rod && !f.angle && !f.speed);
    for (size_t k = 0; k < 2 * 4 * H * W; k++)
        assert_close(f.pixels[k], values[k], 1e-7, 0);
    hnn_frames_free(&f);
    f = accepted(write_array("three.h5", "frames", 3, (size_t[]){8, H, W}, values));
    assert_true(f.trajectories == 1 && f.frames == 8 && f.height == H && f.width == W);
    assert_close(f.pixels[7 * H * W + 11], values[7 * H * W + 11], 1e-7, 0);
    hnn_frames_free(&f);
    int bytes[2 * 3 * H * W];
    for (int k = 0; k < 2 * 3 * H * W; k++)
        bytes[k] = k * 7 % 256;
    const hsize_t dims[] = {2, 3, H, W};
    f = accepted(write_integers("bytes.h5", H5T_STD_U8LE, dims, bytes));
    for (size_t k = 0; k < 2 * 3 * H * W; k++)
        assert_close(f.pixels[k], bytes[k] / 255., 1e-7, 0);
    hnn_frames_free(&f);
    bytes[2 * H * W + 1 * W + 3] = 256; /* trajectory 1, frame 3, row 2, column 4 */
    refused(write_integers("words.h5", H5T_STD_U16LE, dims, bytes),
            "0 255 256 'video' trajectory 1 frame 3 row 2 column 4");
}

static void test_damaged_arrays(void **state)
{
    (void)state;
    double values[2 * 4 * H * W] = {0};
    const size_t dims[] = {2, 4, H, W};
    static const double wrong[] = {NAN, INFINITY, 1.01, -1.01, 255};
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        values[(4 + 2) * H * W + 2 * W + 1] = wrong[k];
        refused(write_array("wrong.h5", "frames", 4, dims, values), "-1 1");
        assert_mentions(error.message, "trajectory 2 frame 3 row 3 column 2");
        values[(4 + 2) * H * W + 2 * W + 1] = 0;
    }
    refused(write_array("two.h5", "frames", 2, dims, values), "none");
    refused(write_array("few.h5", "frames", 3, (size_t[]){2, H, W}, values), "three frames");
    refused(write_array("empty.h5", "frames", 4, (size_t[]){0, 4, H, W}, values), "three frames");
    refused(files_temporary("nowhere.h5"), "nowhere.h5");
    refused(files_write_text("text.h5", "0.1,0.2\n"), "HDF5");
    size_t size;
    struct path whole = write_array("whole.h5", "frames", 4, dims, values);
    char *bytes = files_read(whole.text, &size);
    for (size_t keep = 0; keep < size; keep += size / 7)
        refused(files_write("cut.h5", bytes, keep), "cut.h5");
    free(bytes);
}

/* What stands beside the frames has to fit them. */
static void test_damaged_motion(void **state)
{
    (void)state;
    struct hnn_video_settings settings = hnn_video_published();
    settings.trajectories = 1;
    settings.frames = 4;
    settings.height = settings.width = 2;
    for (int damage = 0; damage < 5; damage++) {
        struct hnn_frames f;
        error = (struct ad_error){0};
        phys_hdf5 *file;
        struct path path = files_temporary("motion.h5");
        static const char *const says[] = {"finite 'angle' trajectory 1 frame 3", "axle", "gravity",
                                           "'speed'", "'bilinea' 'bilinear'"};
        assert_int_equal(hnn_rod_video(&settings, 3, &f, &error), AD_OK);
        assert_int_equal(phys_hdf5_create(path.text, &file, &error), AD_OK);
        double *speed = f.speed;
        if (damage == 0)
            f.angle[2] = NAN;
        if (damage == 1)
            f.rod.axle = 1;
        if (damage == 2 || damage == 4)
            f.has_rod = false, phys_hdf5_number(file, "/", "shade", 0.5, NULL);
        if (damage == 4)
            phys_hdf5_text(file, "/", "filter", "bilinea");
        if (damage == 3) {
            phys_hdf5_write(file, "angle", AD_F64, 2, (size_t[]){1, 4}, f.angle);
            phys_hdf5_write(file, "speed", AD_F64, 2, (size_t[]){2, 2}, f.speed);
            f.speed = NULL;
        }
        hnn_frames_write(&f, file);
        assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
        f.speed = speed;
        hnn_frames_free(&f);
        refused(path, says[damage]);
    }
}

/* ---- pictures ---- */

static const unsigned char picture[H * W] = {0,   17,  34,  51,  68,  85,  102, 119,
                                             136, 153, 170, 187, 204, 221, 255};

static struct path write_pgm(const char *name, const char *header, size_t bytes)
{
    char text[256];
    size_t n = (size_t)snprintf(text, sizeof text, "%s", header);
    memcpy(text + n, picture, bytes);
    return files_write(name, text, n + bytes);
}

static struct path write_png(const char *name, png_uint_32 format, size_t height, size_t width)
{
    static const unsigned char large[8 * H * W] = {1, 2, 3};
    png_image png = {.version = PNG_IMAGE_VERSION,
                     .width = (png_uint_32)width,
                     .height = (png_uint_32)height,
                     .format = format};
    struct path path = files_temporary(name);
    assert_true(png_image_write_to_file(&png, path.text, 0,
                                        format == PNG_FORMAT_GRAY ? picture : large, 0, NULL));
    return path;
}

static void picture_is(struct path path)
{
    struct hnn_image image;
    if (hnn_image_read(path.text, &image, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_true(image.height == H && image.width == W);
    assert_memory_equal(image.pixels, picture, H * W);
    free(image.pixels);
}

static void picture_refused(struct path path, const char *says)
{
    struct hnn_image image;
    error = (struct ad_error){0};
    assert_int_not_equal(hnn_image_read(path.text, &image, &error), AD_OK);
    assert_mentions(error.message, says);
    assert_null(image.pixels);
}

static void test_pictures(void **state)
{
    (void)state;
    picture_is(write_pgm("a.pgm", "P5\n5 3\n255\n", H * W));
    picture_is(write_pgm("b.pgm", "P5 # a remark\n#another\n5\t3 #one more\n\n255\n", H * W));
    picture_is(write_png("a.png", PNG_FORMAT_GRAY, H, W));
}

static void test_damaged_pgm(void **state)
{
    (void)state;
    picture_refused(write_pgm("a.pgm", "P5\n5 3\n255\n", H * W - 1), "3 x 5 14");
    picture_refused(write_pgm("a.pgm", "P5\n4 3\n255\n", H * W), "3 x 4");
    picture_refused(write_pgm("a.pgm", "P5\n5 3\n65535\n", H * W), "255 65535");
    picture_refused(write_pgm("a.pgm", "P5\n5 3\n", 0), "width height");
    picture_refused(write_pgm("a.pgm", "P5\n5 -3\n255\n", H * W), "width");
    picture_refused(write_pgm("a.pgm", "P5\n0 3\n255\n", H * W), "width");
    picture_refused(write_pgm("a.pgm", "P5\n99999999999999999999 3\n255\n", H * W), "expected");
    picture_refused(write_pgm("a.pgm", "P5\n16777216 16777216\n255\n", H * W), "1 to 16777216");
    picture_refused(write_pgm("a.pgm", "P2\n5 3\n255\n", H * W), "PNG PGM");
    picture_refused(write_pgm("a.pgm", "", 0), "PNG PGM");
}

static void test_damaged_png(void **state)
{
    (void)state;
    picture_refused(write_png("c.png", PNG_FORMAT_RGB, H, W), "colours");
    picture_refused(write_png("c.png", PNG_FORMAT_GA, H, W), "transparency");
    picture_refused(write_png("c.png", PNG_FORMAT_LINEAR_Y, H, W), "of 16 bits");
    size_t size;
    char *bytes = files_read(write_png("w.png", PNG_FORMAT_GRAY, H, W).text, &size);
    for (size_t keep = 0; keep < size; keep++)
        picture_refused(files_write("cut.png", bytes, keep), "cut.png");
    /* A bit may fall in a chunk that says nothing about pixels; but no picture is another one. */
    for (size_t bit = 0; bit < 8 * size; bit++) {
        struct hnn_image image;
        error = (struct ad_error){0};
        bytes[bit / 8] = (char)(bytes[bit / 8] ^ 1 << bit % 8);
        if (hnn_image_read(files_write("flip.png", bytes, size).text, &image, &error) == AD_OK)
            assert_memory_equal(image.pixels, picture, H * W);
        free(image.pixels);
        bytes[bit / 8] = (char)(bytes[bit / 8] ^ 1 << bit % 8);
    }
    free(bytes);
}

/* ---- folders ---- */

static struct path folder(const char *name)
{
    struct path path = files_temporary(name);
    assert_int_equal(mkdir(path.text, 0777), 0);
    return path;
}

static void test_folder_of_pictures(void **state)
{
    (void)state;
    struct path path = folder("one");
    static const char *const names[] = {"one/f10.pgm", "one/f2.pgm", "one/f1.pgm", "one/f010b.pgm"};
    static const unsigned char first[] = {10, 2, 1, 11};
    for (size_t k = 0; k < LENGTH(names); k++)
        files_write(names[k],
                    (char[]){'P', '5', ' ', '1', ' ', '1', ' ', '2', '5', '5', ' ', (char)first[k]},
                    12);
    files_write_text("one/notes.txt", "not a picture");
    files_write_text("one/.hidden.png", "nor this");
    struct hnn_frames f = accepted(path);
    assert_true(f.trajectories == 1 && f.frames == 4 && f.height == 1 && f.width == 1);
    static const double expected[] = {1, 2, 10, 11};
    for (size_t k = 0; k < 4; k++)
        assert_close(f.pixels[k], expected[k] / 255, 1e-7, 0);
    hnn_frames_free(&f);
    files_write("one/f3.pgm", "P5 2 1 255 ..", 13);
    refused(path, "f3.pgm 1 x pixels");
    files_write("one/f3.pgm", "P5 1 1 255 ", 11);
    refused(path, "f3.pgm: truncated PGM");
}

static void test_folder_of_trajectories(void **state)
{
    (void)state;
    struct path path = folder("many");
    refused(path, ".png .pgm 0");
    for (int i = 0; i < 3; i++) {
        char name[64];
        snprintf(name, sizeof name, "many/t%d", i + 9);
        folder(name);
        for (int k = 0; k < 4; k++) {
            snprintf(name, sizeof name, "many/t%d/%d.png", i + 9, k);
            write_png(name, PNG_FORMAT_GRAY, H, W);
        }
    }
    struct hnn_frames f = accepted(path);
    assert_true(f.trajectories == 3 && f.frames == 4 && f.height == H && f.width == W);
    for (size_t k = 0; k < 12 * H * W; k++)
        assert_close(f.pixels[k], picture[k % (H * W)] / 255., 1e-7, 0);
    hnn_frames_free(&f);
    assert_int_equal(unlink(files_temporary("many/t10/3.png").text), 0);
    refused(path, "t10 4 pictures 3");
    write_png("many/t10/3.png", PNG_FORMAT_GRAY, H, W - 1);
    refused(path, "t10/3.png 3 x 5 pixels");
    write_png("many/t10/3.png", PNG_FORMAT_RGB, H, W);
    refused(path, "t10/3.png grey PNG");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_drawn_frames_come_back, fresh),
        cmocka_unit_test_setup(test_arrays_of_a_user, fresh),
        cmocka_unit_test_setup(test_damaged_arrays, fresh),
        cmocka_unit_test_setup(test_damaged_motion, fresh),
        cmocka_unit_test_setup(test_pictures, fresh),
        cmocka_unit_test_setup(test_damaged_pgm, fresh),
        cmocka_unit_test_setup(test_damaged_png, fresh),
        cmocka_unit_test_setup(test_folder_of_pictures, fresh),
        cmocka_unit_test_setup(test_folder_of_trajectories, fresh),
    };
    return cmocka_run_group_tests_name("frames from files", tests, files_setup, files_teardown);
}
