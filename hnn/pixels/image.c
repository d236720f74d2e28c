/* Reads a grey picture of 8 bits from a PGM or PNG file; the only file that calls libpng. */
#include "frames.h"

#include <ctype.h>
#include <errno.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PIXELS_MOST = 1 << 24 }; /* more is no frame to learn from: refused before room is made */

static enum ad_status make_room(const char *file, struct hnn_image *image, struct ad_error *error)
{
    if (!image->height || !image->width || image->height > PIXELS_MOST / image->width)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected a picture of 1 to %d pixels, found %zu x %zu", file,
                       PIXELS_MOST, image->height, image->width);
    image->pixels = malloc(image->height * image->width);
    return image->pixels ? AD_OK : ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
}

/* ---- PNG ---- */

/* libpng stops reading behind the pixels: whether the last chunk is there is for us to see. */
static bool has_end(FILE *stream)
{
    static const unsigned char end[12] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
    unsigned char found[sizeof end];
    return fseek(stream, -(long)sizeof end, SEEK_END) == 0 &&
           fread(found, 1, sizeof found, stream) == sizeof found &&
           memcmp(found, end, sizeof end) == 0;
}

static enum ad_status read_png(const char *file, FILE *stream, struct hnn_image *image,
                               struct ad_error *error)
{
    png_image png = {.version = PNG_IMAGE_VERSION};
    const png_uint_32 other = PNG_FORMAT_FLAG_COLOR | PNG_FORMAT_FLAG_ALPHA |
                              PNG_FORMAT_FLAG_LINEAR | PNG_FORMAT_FLAG_COLORMAP;
    if (!png_image_begin_read_from_stdio(&png, stream))
        return ad_fail(error, AD_E_INPUT, "%s: damaged PNG: %s", file, png.message);
    image->height = png.height;
    image->width = png.width;
    if (png.format & other)
        ad_fail(error, AD_E_INPUT, "%s: expected a grey PNG of 8 bits, found one %s", file,
                png.format & PNG_FORMAT_FLAG_LINEAR  ? "of 16 bits"
                : png.format & PNG_FORMAT_FLAG_ALPHA ? "with transparency"
                                                     : "in colours");
    else if (make_room(file, image, error) == AD_OK) {
        png.format = PNG_FORMAT_GRAY;
        if (!png_image_finish_read(&png, NULL, image->pixels, 0, NULL))
            ad_fail(error, AD_E_INPUT, "%s: damaged PNG: %s", file, png.message);
        else if (!has_end(stream))
            ad_fail(error, AD_E_INPUT, "%s: truncated PNG: expected it to end with IEND", file);
    }
    png_image_free(&png);
    return error->status;
}

/* ---- PGM (netpbm's pgm(5)): P5, width, height, largest value, one blank, the bytes ---- */

/* The next whole number of a header, behind blanks and comments; 0 where there is none. */
static size_t read_number(FILE *stream)
{
    size_t number = 0;
    int c = getc(stream);
    for (; isspace(c) || c == '#'; c = getc(stream))
        if (c == '#')
            while (c != '\n' && c != EOF)
                c = getc(stream);
    for (; isdigit(c) && number <= PIXELS_MOST; c = getc(stream))
        number = 10 * number + (size_t)(c - '0');
    return isspace(c) ? number : 0;
}

static enum ad_status read_pgm(const char *file, FILE *stream, struct hnn_image *image,
                               struct ad_error *error)
{
    image->width = read_number(stream);
    image->height = read_number(stream);
    size_t most = read_number(stream);
    if (!image->width || !image->height || !most)
        return ad_fail(error, AD_E_INPUT,
                       "%s: damaged PGM: expected width, height and largest value behind P5", file);
    if (most != 255)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected a PGM of 8 bits, largest value 255, found %zu", file, most);
    if (make_room(file, image, error) != AD_OK)
        return error->status;
    size_t n = image->height * image->width, found = fread(image->pixels, 1, n, stream);
    if (found != n)
        return ad_fail(error, AD_E_INPUT, "%s: truncated PGM: expected %zu x %zu bytes, found %zu",
                       file, image->height, image->width, found);
    if (getc(stream) != EOF)
        return ad_fail(error, AD_E_INPUT, "%s: expected a PGM to end after %zu x %zu bytes", file,
                       image->height, image->width);
    return AD_OK;
}

/* ---- either ---- */

enum ad_status hnn_image_read(const char *file, struct hnn_image *image, struct ad_error *error)
{
    unsigned char first[8] = {0};
    *image = (struct hnn_image){0};
    FILE *stream = fopen(file, "rb");
    if (!stream)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s", file, strerror(errno));
    size_t n = fread(first, 1, sizeof first, stream);
    bool png = png_sig_cmp(first, 0, sizeof first) == 0, pgm = n > 2 && memcmp(first, "P5", 2) == 0;
    if (fseek(stream, png ? 0 : 2, SEEK_SET) != 0 || !(png || pgm))
        ad_fail(error, AD_E_INPUT, "%s: expected a PNG, or a binary PGM (P5)", file);
    else
        (png ? read_png : read_pgm)(file, stream, image, error);
    fclose(stream);
    if (error->status != AD_OK) {
        free(image->pixels);
        *image = (struct hnn_image){0};
    }
    return error->status;
}
