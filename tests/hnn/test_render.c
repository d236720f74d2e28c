/* The renderer against exact areas of simple shapes. */
#include "hnn/pixels/pixels.h"
#include "tests/close.h"

#include <stdlib.h>

static const double pi = 3.14159265358979323846;

enum { SIDE = 40 };

/* A rod in a frame that shows x and y from -view to view. */
static struct hnn_rod rod_of(double length, double radius, double axle, double view)
{
    struct hnn_rod rod = hnn_rod_published();
    rod.length = length;
    rod.radius = radius;
    rod.axle = axle;
    rod.shade = 1;
    rod.left = rod.bottom = -view;
    rod.right = rod.top = view;
    return rod;
}

/* Area of what was drawn. */
static double total(const struct hnn_rod *rod, double angle, size_t height, size_t width)
{
    float *pixels = malloc(height * width * sizeof *pixels);
    double sum = 0;
    hnn_rod_draw(rod, angle, height, width, pixels);
    for (size_t k = 0; k < height * width; k++)
        sum += pixels[k];
    free(pixels);
    return sum * (rod->right - rod->left) * (rod->top - rod->bottom) / (double)(height * width);
}

/* Each pixel carries a float's rounding; inside ones are exact. */
static void test_areas(void **state)
{
    (void)state;
    static const size_t sizes[][2] = {{1, 1}, {3, 2}, {7, 13}, {28, 28}, {101, 64}};
    static const double angles[] = {0, 0.3, -0.7, 1.5707963267948966, 2.5, 3.14159265358979};
    for (size_t s = 0; s < LENGTH(sizes); s++)
        for (size_t a = 0; a < LENGTH(angles); a++) {
            struct hnn_rod capsule = rod_of(1, 0.17, 0.11, 1.31), disc = rod_of(1e-9, 0.83, 0, 1);
            assert_close(total(&capsule, angles[a], sizes[s][0], sizes[s][1]),
                         2 * 0.17 + pi * (0.17 * 0.17 - 0.11 * 0.11), 1e-7, 1e-7);
            assert_close(total(&disc, angles[a], sizes[s][0], sizes[s][1]), pi * 0.83 * 0.83, 1e-7,
                         1e-7);
        }
}

/* int_a^b sqrt(1 - x^2) dx */
static double under_circle(double a, double b)
{
    return (b * sqrt(1 - b * b) + asin(b) - a * sqrt(1 - a * a) - asin(a)) / 2;
}

/* Single pixels of the unit disc: a quarter of it, strips under the arc, a corner in the arc. */
static void test_pixels_of_a_disc(void **state)
{
    (void)state;
    static const struct {
        double left, right, bottom, top;
    } view[] = {{0, 1, 0, 1},     {0.2, 0.6, 0, 2}, {-0.9, 0.1, -1, 0},
                {0.6, 1, 0.5, 1}, {0, 0.3, 0, 0.4}, {0.8, 0.9, 0.8, 0.9}};
    const double corner = under_circle(0.6, sqrt(0.75)) - 0.5 * (sqrt(0.75) - 0.6);
    const double area[] = {pi / 4, under_circle(0.2, 0.6), under_circle(-0.9, 0.1), corner, 0.12,
                           0};
    for (size_t k = 0; k < LENGTH(view); k++) {
        struct hnn_rod rod = rod_of(1e-12, 1, 0, 1);
        rod.left = view[k].left, rod.right = view[k].right;
        rod.bottom = view[k].bottom, rod.top = view[k].top;
        assert_close(total(&rod, 0.4, 1, 1), area[k], 1e-7, 1e-9);
    }
}

/* Part of the rectangle [x, x+w] x [y, y+h] where nx x + ny y <= c, nx, ny > 0: a triangle less the
   two that stick out, and what these have in common. */
static double half_plane(double nx, double ny, double c, double x, double y, double w, double h)
{
    double a = nx * w, b = ny * h, r = c - nx * x - ny * y;
    double cut[4] = {r, r - a, r - b, r - a - b}, sum = 0;
    for (size_t k = 0; k < 4; k++)
        sum += (k == 0 || k == 3 ? 1 : -1) * pow(fmax(cut[k], 0), 2);
    return sum / (2 * a * b);
}

/* The side of a rod much larger than the frame is a straight line: every pixel is known. */
static void test_half_plane(void **state)
{
    (void)state;
    static const double angles[] = {0.05, 0.4, 0.785398163397448, 1.2, 1.56};
    static float pixels[SIDE * SIDE];
    for (size_t a = 0; a < LENGTH(angles); a++) {
        struct hnn_rod rod = rod_of(2000, 3, 0, 1);
        double c = cos(angles[a]), s = sin(angles[a]), worst = 0;
        double x = 1000 * s + 2.8 * c, y = -1000 * c + 2.8 * s; /* 0.2 inside, halfway down */
        rod.left = x - 1, rod.right = x + 1, rod.bottom = y - 1, rod.top = y + 1;
        hnn_rod_draw(&rod, angles[a], SIDE, SIDE, pixels);
        for (size_t i = 0; i < SIDE; i++)
            for (size_t j = 0; j < SIDE; j++) {
                double step = 2.0 / SIDE, px = (double)j * step - 1;
                double py = 1 - ((double)i + 1) * step;
                double part = half_plane(c, s, 0.2, px, py, step, step);
                worst = fmax(worst, fabs(pixels[i * SIDE + j] - part));
            }
        assert_close(worst, 0, 0, 1e-7);
    }
}

/* Areas add up: a frame is the average of one twice as fine, to the last digits of a float. */
static void test_finer_frames_average_to_coarse_ones(void **state)
{
    (void)state;
    static float coarse[28 * 28], fine[56 * 56];
    struct hnn_rod rod = hnn_rod_published();
    for (double angle = -1; angle < 1; angle += 0.0837) {
        hnn_rod_draw(&rod, angle, 28, 28, coarse);
        hnn_rod_draw(&rod, angle, 56, 56, fine);
        for (size_t i = 0; i < 28; i++)
            for (size_t j = 0; j < 28; j++) {
                const float *f = fine + 2 * i * 56 + 2 * j;
                assert_close(coarse[i * 28 + j], ((double)f[0] + f[1] + f[56] + f[57]) / 4, 0,
                             1e-7);
            }
    }
}

/* Points inside and outside, and the way things face: the rod hangs at angle 0, swings to the right
   with it, and its mirror image is that of the opposite angle. */
static void test_where_things_are(void **state)
{
    (void)state;
    static float a[SIDE * SIDE], b[SIDE * SIDE];
    struct hnn_rod rod = rod_of(1, 0.2, 0.1, 1.5);
    rod.shade = 0.5;
    for (double angle = -3; angle < 3.1; angle += 0.31) {
        hnn_rod_draw(&rod, angle, SIDE, SIDE, a);
        hnn_rod_draw(&rod, -angle, SIDE, SIDE, b);
        for (size_t i = 0; i < SIDE; i++)
            for (size_t j = 0; j < SIDE; j++) {
                double x = -1.5 + ((double)j + 0.5) * 3 / SIDE, reach = 1.5 * sqrt(2) / SIDE;
                double y = 1.5 - ((double)i + 0.5) * 3 / SIDE;
                double along = fmin(fmax(x * sin(angle) - y * cos(angle), 0), 1);
                double away = hypot(x - along * sin(angle), y + along * cos(angle));
                assert_close(a[i * SIDE + j], b[i * SIDE + SIDE - 1 - j], 0, 1e-7);
                if (away > 0.2 + reach || hypot(x, y) < 0.1 - reach)
                    assert_close(a[i * SIDE + j], 0, 0, 0);
                if (away < 0.2 - reach && hypot(x, y) > 0.1 + reach)
                    assert_close(a[i * SIDE + j], 0.5, 0, 0);
            }
    }
}

/* ---- the triangle ---- */

/* int_-inf^u max(0, 1 - |x|) dx */
static double under_triangle(double u)
{
    const double x = fmin(fmax(u, -1), 1);
    return x < 0 ? (1 + x) * (1 + x) / 2 : 1 - (1 - x) * (1 - x) / 2;
}

/* The part of a pixel's weights left of c, in pixels from the frame's left side, on which it has n:
   the triangle about its middle, less what of it is outside. */
static double left_of(double c, size_t j, size_t n)
{
    const double middle = (double)j + 0.5, begin = under_triangle(-middle);
    return (under_triangle(c - middle) - begin) / (under_triangle((double)n - middle) - begin);
}

/* Everything left of an upright side, at the cells' sides, of which there are six a pixel: the sums
   over cells are then those integrals. */
static void test_bilinear_side(void **state)
{
    (void)state;
    enum { W = 7, H = 3 };
    float pixels[W * H];
    for (int c = 0; c <= 6 * W; c++) {
        struct hnn_rod rod = rod_of(2000, 3, 0, 1);
        rod.filter = HNN_BILINEAR;
        rod.right = rod.radius + (1 - c / (6.0 * W)) * 2;
        rod.left = rod.right - 2;
        rod.top = -1000, rod.bottom = -1001;
        hnn_rod_draw(&rod, 0, H, W, pixels);
        for (size_t k = 0; k < W * H; k++)
            assert_close(pixels[k], left_of(c / 6.0, k % W, W), 0, 1e-6);
    }
}

/* Tilted, and with both ends: the weighted mean, pixel by pixel, of a frame by areas that is six
   times as fine. The second view cuts the rod. */
static void test_bilinear_of_finer_frames(void **state)
{
    (void)state;
    enum { H = 9, W = 12 };
    static float fine[36 * H * W], pixels[H * W];
    for (int view = 0; view < 2; view++) {
        struct hnn_rod rod = rod_of(1, 0.2, 0.1, view ? 0.7 : 1.3);
        hnn_rod_draw(&rod, 0.6, 6 * H, 6 * W, fine);
        rod.filter = HNN_BILINEAR;
        hnn_rod_draw(&rod, 0.6, H, W, pixels);
        for (size_t k = 0; k < H * W; k++) {
            double sum = 0, weights = 0;
            for (size_t i = 0; i < 6 * H; i++)
                for (size_t j = 0; j < 6 * W; j++) {
                    double x = ((double)j + 0.5) / 6 - (double)(k % W) - 0.5;
                    double y = ((double)i + 0.5) / 6 - (double)(k / W) - 0.5;
                    double weight = fmax(0, 1 - fabs(x)) * fmax(0, 1 - fabs(y));
                    sum += weight * fine[i * 6 * W + j];
                    weights += weight;
                }
            assert_close(pixels[k], sum / weights, 0, 1e-6);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_areas),
        cmocka_unit_test(test_pixels_of_a_disc),
        cmocka_unit_test(test_half_plane),
        cmocka_unit_test(test_finer_frames_average_to_coarse_ones),
        cmocka_unit_test(test_where_things_are),
        cmocka_unit_test(test_bilinear_side),
        cmocka_unit_test(test_bilinear_of_finer_frames),
    };
    return cmocka_run_group_tests_name("renderer", tests, NULL, NULL);
}
