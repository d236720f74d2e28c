/* Renders coverage to the pixels of a frame: by area, or by the triangle filter that Pillow's
   "bilinear" uses when reducing pictures (P. Heckbert, "Fundamentals of texture mapping and image
   warping", 1989, 3.5): a pixel averages what lies within one pixel width in either direction, with
   weights 1 - |x|, 1 - |y| of the distances in widths, normalised within the frame. */
#include "hnn/model/internal.h"
#include "render.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static void draw_area(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                      float *pixels)
{
    const struct hnn_drawing d = hnn_drawing_of(rod, angle, height, width);
    for (size_t i = 0; i < height; i++)
        for (size_t j = 0; j < width; j++)
            pixels[i * width + j] = (float)(rod->shade * hnn_drawing_coverage(&d, i, j));
}

/* Cells of a pixel each way: the published screen had 6.07 or, of twice the density, 12.1. An even
   number. */
enum { CELLS = 6 };

/* Contribution of a cell to the two nearest pixels. */
struct share {
    size_t pixel[2];
    double weight[2];
};

/* Of cell i of a row or column of n pixels. Their weights have the sum CELLS, where the triangle
   sticks out at an end of the frame CELLS/8 less. */
static struct share share_of(size_t i, size_t n)
{
    const double x = ((double)i + 0.5) / CELLS - 0.5, low = floor(x), last = (double)n - 1;
    struct share s;
    for (int k = 0; k < 2; k++) {
        const double pixel = fmin(fmax(low + k, 0), last);
        const double sum = CELLS * (1 - ((pixel == 0) + (pixel == last)) / 8.0);
        s.pixel[k] = (size_t)pixel;
        s.weight[k] = pixel == low + k ? (1 - fabs(x - pixel)) / sum : 0;
    }
    return s;
}

static void shares_of(size_t pixel, size_t n, struct share share[CELLS])
{
    for (size_t k = 0; k < CELLS; k++)
        share[k] = share_of(CELLS * pixel + k, n);
}

/* Adds the value of a cell to the four nearest pixels. */
static void spread(double value, const struct share *row, const struct share *col, size_t width,
                   float *pixels)
{
    for (int k = 0; k < 4; k++)
        pixels[row->pixel[k / 2] * width + col->pixel[k % 2]] +=
            (float)(value * row->weight[k / 2] * col->weight[k % 2]);
}

/* Most pixels are dark or lit as a whole, and so are their cells. */
static void draw_bilinear(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                          float *pixels)
{
    const struct hnn_drawing coarse = hnn_drawing_of(rod, angle, height, width);
    const struct hnn_drawing fine = hnn_drawing_of(rod, angle, CELLS * height, CELLS * width);
    struct share row[CELLS], col[CELLS];
    memset(pixels, 0, height * width * sizeof *pixels);
    for (size_t i = 0; i < height; i++) {
        shares_of(i, height, row);
        for (size_t j = 0; j < width; j++) {
            const double whole = hnn_drawing_coverage(&coarse, i, j);
            if (whole == 0)
                continue;
            shares_of(j, width, col);
            for (size_t k = 0; k < CELLS * CELLS; k++) {
                const size_t down = k / CELLS, right = k % CELLS;
                double part = 1;
                if (whole < 1)
                    part = hnn_drawing_coverage(&fine, CELLS * i + down, CELLS * j + right);
                spread(rod->shade * part, &row[down], &col[right], width, pixels);
            }
        }
    }
}

const char *const hnn_filters[] = {"area", "bilinear", NULL};

static void (*const draw[])(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                            float *pixels) = {draw_area, draw_bilinear};
static_assert(LENGTH(draw) + 1 == LENGTH(hnn_filters), "a name for every filter");

enum ad_status hnn_filter_find(const char *name, enum hnn_filter *filter, struct ad_error *error)
{
    size_t k = HNN_AREA;
    if (!AD_LACKS(error, filter) && hnn_find("filter", name, hnn_filters, &k, error) == AD_OK)
        *filter = (enum hnn_filter)k;
    return error->status;
}

void hnn_rod_draw(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                  float *pixels)
{
    if (rod && pixels && (size_t)rod->filter < LENGTH(draw))
        draw[rod->filter](rod, angle, height, width, pixels);
}
