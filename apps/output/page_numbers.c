/* Numbers of a page (page.h): which samples, and how they are written. Bytes are little-endian. */
#include "autodiff/free.h"
#include "page.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- which samples ---- */

/* Samples first .. last, and the one between them that the straight line misses most. */
struct stretch {
    size_t first, last, worst;
    double miss;
};

/* A sample without a number between two that have one is missed most of all. */
static double miss(const double *row, double span, size_t first, size_t i, size_t last)
{
    const double share = (double)(i - first) / (double)(last - first);
    const double miss = fabs(row[i] - row[first] - share * (row[last] - row[first])) / span;
    return isnan(miss) ? isfinite(row[first]) != isfinite(row[i]) : miss;
}

static struct stretch stretch(size_t n, size_t rows, const double *value, const double *span,
                              size_t first, size_t last)
{
    struct stretch s = {first, last, 0, -1};
    for (size_t i = first + 1; i < last; i++)
        for (size_t r = 0; r < rows; r++) {
            const double m = miss(value + r * n, span[r], first, i, last);
            if (m > s.miss)
                s = (struct stretch){first, last, i, m};
        }
    return s;
}

double page_span(size_t n, const double *row, size_t *least, size_t *most)
{
    *least = *most = 0;
    for (size_t i = 0; i < n; i++) {
        if (!(row[i] >= row[*least]) && isfinite(row[i]))
            *least = i;
        if (!(row[i] <= row[*most]) && isfinite(row[i]))
            *most = i;
    }
    const double span = row[*most] - row[*least];
    return span > 0 && isfinite(span) ? span : 1;
}

size_t page_pick(size_t n, size_t rows, const double *value, size_t keep, size_t index[])
{
    struct stretch *part = n > keep ? calloc(keep + 1, sizeof *part) : NULL;
    double *span = part ? calloc(rows + 1, sizeof *span) : NULL;
    bool *kept = span ? calloc(n, sizeof *kept) : NULL;
    size_t count = 0, parts = 0, least, most;
    for (size_t i = 0; i < n; i++)
        index[i] = i;
    if (!kept) { /* few enough, or no memory to choose in */
        AD_FREE(part, span);
        return n;
    }
    kept[0] = kept[n - 1] = true;
    for (size_t r = 0; r < rows; r++) {
        span[r] = page_span(n, value + r * n, &least, &most);
        if (2 * rows + 2 <= keep)
            kept[least] = kept[most] = true;
    }
    for (size_t i = 1, before = 0; i < n; i++)
        if (kept[i]) {
            part[parts++] = stretch(n, rows, value, span, before, i);
            before = i;
        }
    while (parts + 1 < keep) {
        struct stretch *worst = part;
        for (size_t p = 1; p < parts; p++)
            if (part[p].miss > worst->miss)
                worst = &part[p];
        if (worst->miss < 0)
            break;
        const struct stretch s = *worst;
        kept[s.worst] = true;
        *worst = stretch(n, rows, value, span, s.first, s.worst);
        part[parts++] = stretch(n, rows, value, span, s.worst, s.last);
    }
    for (size_t i = 0; i < n; i++)
        if (kept[i])
            index[count++] = i;
    AD_FREE(part, span, kept);
    return count;
}

/* ---- how they are written ---- */

static void put(unsigned char *to, size_t bytes, uint64_t bits)
{
    for (size_t b = 0; b < bytes; b++)
        to[b] = (unsigned char)(bits >> 8 * b);
}

void page_doubles(struct json *json, const char *key, size_t n, const double value[],
                  struct ad_error *error)
{
    unsigned char *bytes = malloc(8 * n + 1);
    for (size_t i = 0; bytes && i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &value[i], sizeof bits);
        put(bytes + 8 * i, 8, bits);
    }
    if (bytes)
        json_base64(json, key, 8 * n, bytes);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory");
    free(bytes);
}

void page_floats(struct json *json, const char *key, size_t n, const double value[],
                 struct ad_error *error)
{
    double least = INFINITY, most = -INFINITY;
    int exponent = 0;
    for (size_t i = 0; i < n; i++)
        if (isfinite(value[i])) {
            least = fmin(least, value[i]);
            most = fmax(most, value[i]);
        }
    /* Only where that is no loss to the smallest of them. */
    const bool shift = least * most > 0 && most - least <= fmin(fabs(least), fabs(most));
    const double offset = shift ? least + (most - least) / 2 : 0;
    /* The largest is near the largest float: there is room for 76 powers of ten below it. */
    if (least <= most)
        frexp(fmax(most - offset, offset - least), &exponent);
    const double scale = ldexp(1, exponent - 126 > -1022 ? exponent - 126 : -1022);
    unsigned char *bytes = malloc(4 * n + 1);
    for (size_t i = 0; bytes && i < n; i++) {
        const float f = isfinite(value[i]) ? (float)((value[i] - offset) / scale) : (float)NAN;
        uint32_t bits;
        memcpy(&bits, &f, sizeof bits);
        put(bytes + 4 * i, 4, bits);
    }
    json_object(json, key);
    json_number(json, "offset", offset);
    json_number(json, "scale", scale);
    if (bytes)
        json_base64(json, "values", 4 * n, bytes);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory");
    json_end_object(json);
    free(bytes);
}
