/* A stream as lines, in a buffer that holds the longest line and no more of the file. */
#include "data_source.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_BUFFER = 1 << 20, LONGEST_LINE = 1 << 24 };

void hnn_lines_open(struct hnn_lines *lines, const char *file, FILE *stream)
{
    *lines = (struct hnn_lines){.file = file, .stream = stream};
    setvbuf(stream, NULL, _IONBF, 0); /* the buffer here is enough */
}

void hnn_lines_close(struct hnn_lines *lines)
{
    if (lines->stream)
        fclose(lines->stream);
    free(lines->buffer);
    *lines = (struct hnn_lines){0};
}

/* Moves what is not yet given to the front; doubles the buffer where that is all of it. */
static enum ad_status make_room(struct hnn_lines *lines, struct ad_error *error)
{
    size_t kept = lines->n - lines->at;
    if (kept == lines->capacity) {
        size_t capacity = lines->capacity ? 2 * lines->capacity : FIRST_BUFFER;
        if (capacity > LONGEST_LINE)
            return ad_fail(error, AD_E_INPUT, "%s:%zu: expected lines shorter than %d bytes",
                           lines->file, lines->line + 1, LONGEST_LINE);
        char *buffer = realloc(lines->buffer, capacity);
        if (!buffer)
            return ad_fail(error, AD_E_MEMORY, "%s: out of memory", lines->file);
        lines->buffer = buffer;
        lines->capacity = capacity;
    }
    memmove(lines->buffer, lines->buffer + lines->at, kept);
    lines->at = 0;
    lines->n = kept;
    return AD_OK;
}

static enum ad_status fill(struct hnn_lines *lines, struct ad_error *error)
{
    if (make_room(lines, error) != AD_OK)
        return error->status;
    size_t room = lines->capacity - lines->n;
    size_t got = fread(lines->buffer + lines->n, 1, room, lines->stream);
    lines->n += got;
    lines->ended = got < room;
    if (ferror(lines->stream))
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected CSV or text", lines->file,
                       strerror(errno));
    return AD_OK;
}

enum ad_status hnn_lines_next(struct hnn_lines *lines, const char **start, const char **stop,
                              struct ad_error *error)
{
    size_t seen = 0; /* of this line, without an end */
    *start = *stop = NULL;
    if (!lines->buffer && fill(lines, error) != AD_OK)
        return error->status;
    for (;;) {
        const char *from = lines->buffer + lines->at;
        size_t left = lines->n - lines->at;
        const char *newline = left > seen ? memchr(from + seen, '\n', left - seen) : NULL;
        if (newline || (lines->ended && left)) {
            *start = from;
            *stop = newline ? newline : from + left;
            lines->at += (size_t)(*stop - from) + (newline != NULL);
            lines->line++;
            return AD_OK;
        }
        if (lines->ended)
            return AD_OK;
        seen = left;
        if (fill(lines, error) != AD_OK)
            return error->status;
    }
}
