/* Images of a page (page_parts.h), in bytes. */
#include "autodiff/free.h"
#include "page_parts.h"

#include <math.h>
#include <stdlib.h>

/* Densities in the plane, and frames of a video: [frames x rows x columns]. */
static const struct image {
    const char *dataset, *name, *over;
    bool density; /* [frames x x x y], and shown by its square root */
} images[] = {{"density", "density", "time", true},
              {"model/frames", "frames of the model", "frame", false},
              {"against/frames", "frames of the other", "frame", false},
              {"truth/frames", "true frames", "frame", false}};
enum { IMAGE_SIDE = 128, IMAGE_BYTES = 400000 };

/* The largest number of each block, between the least and the largest of all, in 255 steps. */
static void reduce(const double *value, size_t rows, size_t columns, size_t block, double *to)
{
    const size_t across = (columns + block - 1) / block, down = (rows + block - 1) / block;
    for (size_t k = 0; k < across * down; k++)
        to[k] = -INFINITY;
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < columns; c++) {
            double *cell = &to[r / block * across + c / block];
            *cell = fmax(*cell, value[r * columns + c]);
        }
}

/* Densities by the square root and each frame between its own numbers, since a packet that spreads
   pales; others between those of all frames. */
static void write_bytes(struct json *json, size_t frames, size_t size, const double *value,
                        bool density, struct ad_error *error)
{
    const size_t group = density ? size : frames * size;
    unsigned char *bytes = malloc(frames * size + 1);
    double *high = malloc(frames * sizeof *high), low = INFINITY;
    for (size_t f = 0; bytes && high && f < frames; f++) {
        const double *own = density ? value + f * size : value;
        size_t least = 0, most = 0;
        const double span = page_span(group, own, &least, &most);
        high[f] = own[most];
        low = fmin(low, own[least]);
        for (size_t k = f * size; k < (f + 1) * size; k++) {
            const double share = fmin(1, fmax(0, (value[k] - own[least]) / span));
            bytes[k] = (unsigned char)lround(255 * (density ? sqrt(share) : share));
        }
    }
    json_number(json, "low", low);
    if (bytes && high) {
        page_doubles(json, "high", frames, high, error);
        json_base64(json, "bytes", frames * size, bytes);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    AD_FREE(bytes, high);
}

static void write_image(phys_hdf5 *file, const struct image *image,
                        const struct phys_hdf5_item *item, struct json *json,
                        struct ad_error *error)
{
    const size_t F = item->dims[0], rows = item->dims[1], columns = item->dims[2];
    const size_t longest = rows > columns ? rows : columns;
    const size_t block = (longest + IMAGE_SIDE - 1) / IMAGE_SIDE;
    const size_t down = (rows + block - 1) / block, across = (columns + block - 1) / block;
    const size_t most = IMAGE_BYTES / (down * across), frames = F < most ? F : most;
    double *value = malloc(rows * columns * sizeof *value);
    double *all = malloc(frames * down * across * sizeof *all);
    size_t *frame = malloc(frames * sizeof *frame);
    if (!value || !all || !frame)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t f = 0; f < frames && error->status == AD_OK; f++) {
        frame[f] = frames > 1 ? f * (F - 1) / (frames - 1) : F - 1;
        if (phys_hdf5_read(file, image->dataset, frame[f], 1, value, error) == AD_OK)
            reduce(value, rows, columns, block, all + f * down * across);
    }
    if (error->status == AD_OK) {
        json_object(json, NULL);
        json_text(json, "name", image->name);
        json_bool(json, "density", image->density);
        json_count(json, "rows", down);
        json_count(json, "columns", across);
        page_write_axis(file, json, "frames", image->over, F, 0, frames, frame, error);
        write_bytes(json, frames, down * across, all, image->density, error);
        json_end_object(json);
    }
    AD_FREE(value, all, frame);
}

void page_write_images(phys_hdf5 *file, struct json *json, struct ad_error *error)
{
    struct phys_hdf5_item item;
    for (size_t k = 0; k < sizeof images / sizeof *images && error->status == AD_OK; k++)
        if (page_has(file, images[k].dataset, 3, &item))
            write_image(file, &images[k], &item, json, error);
}
