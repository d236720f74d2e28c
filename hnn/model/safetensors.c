/* Reads files of the safetensors format (safetensors.h). */
#include "safetensors.h"
#include "autodiff/free.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_MOST = 100000000, LENGTH_BYTES = 8 };

/* ---- files ---- */

static int by_offset(const void *a, const void *b)
{
    const struct hnn_tensor *s = a, *t = b;
    return s->begin != t->begin ? (s->begin > t->begin) - (s->begin < t->begin)
                                : (s->end > t->end) - (s->end < t->end);
}

/* Tensors lie one after another and fill the file. */
static enum ad_status check_places(struct hnn_tensors *s, uint64_t bytes, struct ad_error *error)
{
    uint64_t at = 0;
    if (s->n)
        qsort(s->tensor, s->n, sizeof *s->tensor, by_offset);
    for (size_t k = 0; k < s->n; at = s->tensor[k++].end)
        if (s->tensor[k].begin != at)
            return ad_fail(error, AD_E_INPUT,
                           "%s: '%.100s' begins at byte %llu of the data; expected %llu, the end "
                           "of the one before it",
                           s->file, s->tensor[k].name, (unsigned long long)s->tensor[k].begin,
                           (unsigned long long)at);
    return at == bytes ? AD_OK
                       : ad_fail(error, AD_E_INPUT, "%s: has %llu bytes of data, expected %llu",
                                 s->file, (unsigned long long)bytes, (unsigned long long)at);
}

static enum ad_status read_open(FILE *in, struct hnn_tensors *s, struct ad_error *error)
{
    unsigned char length[LENGTH_BYTES];
    uint64_t n = 0;
    long size = -1;
    if (fread(length, 1, sizeof length, in) == sizeof length && fseek(in, 0, SEEK_END) == 0)
        size = ftell(in);
    for (int k = LENGTH_BYTES - 1; k >= 0 && size >= 0; k--)
        n = n << 8 | length[k];
    if (size < LENGTH_BYTES || n < 2 || n > HEADER_MOST || n > (uint64_t)size - LENGTH_BYTES)
        return ad_fail(error, AD_E_INPUT,
                       "%s: not a safetensors file: expected 8 bytes with the length of a header "
                       "of at most %d bytes, and that header",
                       s->file, HEADER_MOST);
    const size_t data = (size_t)size - LENGTH_BYTES - (size_t)n;
    char *header = malloc((size_t)n);
    s->bytes = malloc(data + 1);
    if (!header || !s->bytes)
        ad_fail(error, AD_E_MEMORY, "out of memory for %ld bytes", size);
    else if (fseek(in, LENGTH_BYTES, SEEK_SET) != 0 || fread(header, 1, (size_t)n, in) != n ||
             fread(s->bytes, 1, data, in) != data)
        ad_fail(error, AD_E_IO, "%s: cannot be read", s->file);
    else if (hnn_tensors_header(s, header, (size_t)n, error) == AD_OK)
        check_places(s, data, error);
    free(header);
    return error->status;
}

enum ad_status hnn_tensors_read(const char *file, struct hnn_tensors *s, struct ad_error *error)
{
    *s = (struct hnn_tensors){.file = file};
    FILE *in = fopen(file, "rb");
    if (!in)
        return ad_fail(error, AD_E_INPUT, "%s: cannot be read: %s", file, strerror(errno));
    read_open(in, s, error);
    fclose(in);
    return error->status;
}

void hnn_tensors_free(struct hnn_tensors *s)
{
    for (size_t k = 0; k < s->n; k++)
        free(s->tensor[k].name);
    for (size_t k = 0; k < s->n_metadata; k++) {
        AD_FREE(s->metadata[k].key, s->metadata[k].text);
    }
    AD_FREE(s->tensor, s->metadata, s->bytes);
}

const struct hnn_tensor *hnn_tensor_find(const struct hnn_tensors *s, const char *name)
{
    for (size_t k = 0; k < s->n; k++)
        if (strcmp(s->tensor[k].name, name) == 0)
            return &s->tensor[k];
    return NULL;
}

const char *hnn_metadata_find(const struct hnn_tensors *s, const char *key)
{
    for (size_t k = 0; k < s->n_metadata; k++)
        if (strcmp(s->metadata[k].key, key) == 0)
            return s->metadata[k].text;
    return NULL;
}

/* ---- elements, least byte first ---- */

static uint64_t bits_at(const unsigned char *p, size_t bytes)
{
    uint64_t bits = 0;
    for (size_t k = bytes; k-- > 0;)
        bits = bits << 8 | p[k];
    return bits;
}

static double from_f32(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

/* IEEE binary16: 1 sign, 5 exponent, 10 fraction. */
static double from_f16(uint64_t bits)
{
    const int exponent = (int)(bits >> 10 & 31);
    const double fraction = (double)(bits & 1023), sign = bits >> 15 ? -1 : 1;
    if (exponent == 31)
        return fraction > 0 ? (double)NAN : sign * (double)INFINITY;
    return sign * (exponent ? ldexp(1024 + fraction, exponent - 25) : ldexp(fraction, -24));
}

enum ad_status hnn_tensor_values(const struct hnn_tensors *s, const struct hnn_tensor *t,
                                 size_t first, size_t n, double *values, struct ad_error *error)
{
    if (!t->dtype)
        return ad_fail(error, AD_E_INPUT, "%s: '%.100s' is of whole numbers; expected %s", s->file,
                       t->name, "F64, F32, F16 or BF16");
    const size_t bytes = t->n ? (size_t)(t->end - t->begin) / t->n : 0;
    const unsigned char *p = s->bytes + t->begin + first * bytes;
    for (size_t k = 0; k < n; k++, p += bytes) {
        const uint64_t bits = bits_at(p, bytes);
        if (bytes == 8)
            memcpy(&values[k], &bits, sizeof bits);
        else if (bytes == 4)
            values[k] = from_f32((uint32_t)bits);
        else
            values[k] = t->dtype[0] == 'B' ? from_f32((uint32_t)bits << 16) : from_f16(bits);
    }
    return AD_OK;
}
