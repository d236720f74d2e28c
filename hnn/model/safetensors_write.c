/* Writes files of the safetensors format (safetensors.h). */
#include "safetensors.h"
#include "physics/io/atomic_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void write_string(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++)
        if (*text == '"' || *text == '\\')
            fprintf(out, "\\%c", *text);
        else if ((unsigned char)*text < 0x20)
            fprintf(out, "\\u%04x", (unsigned)*text);
        else
            fputc(*text, out);
    fputc('"', out);
}

static size_t bytes_of(const struct hnn_tensor_source *t)
{
    size_t n = t->type == AD_F32 ? 4 : 8;
    for (size_t k = 0; k < t->rank; k++)
        n *= t->dims[k];
    return n;
}

/* Filled with blanks to a multiple of 8 bytes, as the format's own program does. */
static void write_header(FILE *out, size_t n, const struct hnn_tensor_source tensor[],
                         size_t n_metadata, const struct hnn_metadata metadata[])
{
    fputs("{\"__metadata__\":{", out);
    for (size_t k = 0; k < n_metadata; k++) {
        fputs(k ? "," : "", out);
        write_string(out, metadata[k].key);
        fputc(':', out);
        write_string(out, metadata[k].text);
    }
    fputc('}', out);
    for (size_t k = 0, at = 0; k < n; at += bytes_of(&tensor[k]), k++) {
        fputc(',', out);
        write_string(out, tensor[k].name);
        fprintf(out, ":{\"dtype\":\"%s\",\"shape\":[", tensor[k].type == AD_F32 ? "F32" : "F64");
        for (size_t d = 0; d < tensor[k].rank; d++)
            fprintf(out, "%s%zu", d ? "," : "", tensor[k].dims[d]);
        fprintf(out, "],\"data_offsets\":[%zu,%zu]}", at, at + bytes_of(&tensor[k]));
    }
    fputc('}', out);
    while (ftell(out) % 8)
        fputc(' ', out);
}

/* Elements of 4 or 8 bytes, least byte first. */
static void write_values(FILE *out, const struct hnn_tensor_source *t)
{
    const size_t width = t->type == AD_F32 ? 4 : 8, n = bytes_of(t) / width;
    const unsigned char *p = t->values;
    for (size_t k = 0; k < n; k++, p += width) {
        uint64_t bits = 0;
        uint32_t half;
        if (width == 8)
            memcpy(&bits, p, 8);
        else
            memcpy(&half, p, 4), bits = half;
        for (size_t i = 0; i < width; i++)
            fputc((int)(bits >> 8 * i & 255), out);
    }
}

enum ad_status hnn_tensors_write(const char *file, size_t n,
                                 const struct hnn_tensor_source tensor[], size_t n_metadata,
                                 const struct hnn_metadata metadata[], struct ad_error *error)
{
    struct phys_atomic_file target;
    char *header = NULL;
    size_t length = 0;
    FILE *text = open_memstream(&header, &length);
    if (!text)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    write_header(text, n, tensor, n_metadata, metadata);
    if (fclose(text) != 0 || !header) {
        free(header);
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    if (phys_atomic_file_begin(&target, file, error) == AD_OK) {
        FILE *out = fopen(target.temporary, "wb");
        for (int k = 0; k < 8 && out; k++)
            fputc((int)((uint64_t)length >> 8 * k & 255), out);
        if (out)
            fwrite(header, 1, length, out);
        for (size_t k = 0; k < n && out; k++)
            write_values(out, &tensor[k]);
        const bool failed = !out || ferror(out);
        if ((out && fclose(out) != 0) || failed)
            ad_fail(error, AD_E_IO, "%s: cannot be written: %s", file, strerror(errno));
        if (error->status == AD_OK)
            phys_atomic_file_commit(&target, error);
        else
            phys_atomic_file_abandon(&target);
    }
    free(header);
    return error->status;
}
