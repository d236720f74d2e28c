/* The header of a file of the safetensors format (safetensors.h): JSON (RFC 8259), of the shape
   that the format has. */
#include "safetensors.h"
#include "autodiff/free.h"
#include "physics/io/grow.h"
#include "physics/io/utf8.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { NAMES_MOST = 4096 };

/* ---- text ---- */

struct reading {
    struct hnn_tensors *tensors;
    const char *begin, *at, *end;
    struct ad_error *error;
};

static bool refuse(const struct reading *r, const char *what)
{
    ad_fail(r->error, AD_E_INPUT, "%s: byte %td of the header: %s", r->tensors->file,
            r->at - r->begin, what);
    return false;
}

static void skip_blanks(struct reading *r)
{
    while (r->at < r->end && strchr(" \t\n\r", *r->at) && *r->at)
        r->at++;
}

/* Whether this character comes next; it is passed. */
static bool take(struct reading *r, char c)
{
    skip_blanks(r);
    const bool is = r->at < r->end && *r->at == c;
    r->at += is;
    return is;
}

static bool expect(struct reading *r, char c)
{
    const char what[] = {'e', 'x', 'p', 'e', 'c', 't', 'e', 'd', ' ', '\'', c, '\'', '\0'};
    return take(r, c) || refuse(r, what);
}

static bool read_hex(struct reading *r, unsigned *code)
{
    *code = 0;
    for (int k = 0; k < 4; k++, r->at++) {
        const char *digits = "0123456789abcdef", *found = NULL;
        if (r->at < r->end && *r->at)
            found = strchr(digits, *r->at >= 'A' && *r->at <= 'F' ? *r->at + 32 : *r->at);
        if (!found)
            return refuse(r, "expected four hexadecimal digits");
        *code = 16 * *code + (unsigned)(found - digits);
    }
    return true;
}

static char *put_utf8(char *to, unsigned code)
{
    const int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    const unsigned first[] = {0, 0xc0, 0xe0, 0xf0};
    *to++ = (char)(first[more] | code >> 6 * more);
    for (int k = more - 1; k >= 0; k--)
        *to++ = (char)(0x80 | (code >> 6 * k & 0x3f));
    return to;
}

/* Behind the backslash; NULL: refused. */
static char *read_escape(struct reading *r, char *to)
{
    static const char from[] = "\"\\/bfnrt", means[] = "\"\\/\b\f\n\r\t";
    unsigned code, low;
    const char c = r->at < r->end ? *r->at : '\0', *plain = c ? strchr(from, c) : NULL;
    if (plain) {
        r->at++;
        *to = means[plain - from];
        return to + 1;
    }
    if (c != 'u')
        return refuse(r, "unknown escape") ? to : NULL;
    r->at++;
    if (!read_hex(r, &code))
        return NULL;
    if (code >= 0xd800 && code < 0xdc00) {
        if (r->end - r->at < 6 || r->at[0] != '\\' || r->at[1] != 'u')
            return refuse(r, "half a surrogate pair") ? to : NULL;
        r->at += 2;
        if (!read_hex(r, &low))
            return NULL;
        code = low >= 0xdc00 && low < 0xe000 ? 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00)
                                             : 0xd800;
    }
    if (code == 0 || (code >= 0xd800 && code < 0xe000))
        return refuse(r, "a character that is none") ? to : NULL;
    return put_utf8(to, code);
}

/* A string, to be freed; NULL: refused, or out of memory. */
static char *read_string(struct reading *r)
{
    if (!expect(r, '"'))
        return NULL;
    const char *stop = r->at;
    while (stop < r->end && *stop != '"')
        stop += *stop == '\\' && stop + 1 < r->end ? 2 : 1;
    char *text = malloc((size_t)(stop - r->at) + 1), *to = text;
    if (!text)
        ad_fail(r->error, AD_E_MEMORY, "out of memory");
    while (to && r->at < r->end && *r->at != '"') {
        if ((unsigned char)*r->at < 0x20)
            to = refuse(r, "a control character in a string") ? to : NULL;
        else if (*r->at == '\\')
            r->at++, to = read_escape(r, to);
        else
            *to++ = *r->at++;
    }
    if (to && expect(r, '"')) {
        *to = '\0';
        for (const char *p = text; *p; p += phys_utf8_length(p))
            if (phys_utf8_length(p) == 0) {
                refuse(r, "a string that is not UTF-8");
                break;
            }
        if (r->error->status == AD_OK)
            return text;
    }
    free(text);
    return NULL;
}

static bool read_integer(struct reading *r, uint64_t *value)
{
    skip_blanks(r);
    const char *first = r->at;
    *value = 0;
    for (; r->at < r->end && *r->at >= '0' && *r->at <= '9'; r->at++) {
        const unsigned digit = (unsigned)(*r->at - '0');
        if (*value > (UINT64_MAX - digit) / 10)
            return refuse(r, "a number over 2^64");
        *value = 10 * *value + digit;
    }
    return (r->at > first && (*first != '0' || r->at == first + 1)) ||
           refuse(r, "expected a whole number");
}

/* [N, N, ...]; *n of them, at most `most`. */
static bool read_integers(struct reading *r, size_t most, uint64_t values[], size_t *n)
{
    *n = 0;
    if (!expect(r, '['))
        return false;
    if (take(r, ']'))
        return true;
    do {
        if (*n == most)
            return refuse(r, "more numbers than expected");
        if (!read_integer(r, &values[(*n)++]))
            return false;
    } while (take(r, ','));
    return expect(r, ']');
}

/* ---- tensors ---- */

static const struct dtype {
    const char *name;
    size_t bytes;
} dtypes[] = {{"F64", 8}, {"F32", 4}, {"F16", 2}, {"BF16", 2}, {"BOOL", 1}, {"U8", 1}, {"I8", 1},
              {"I16", 2}, {"U16", 2}, {"I32", 4}, {"U32", 4},  {"I64", 8},  {"U64", 8}};
enum { FLOATS = 4, DTYPES = sizeof dtypes / sizeof *dtypes };

/* The elements of a tensor fill its bytes. */
static bool check_length(struct reading *r, struct hnn_tensor *t, const struct dtype *dtype,
                         const uint64_t dims[])
{
    uint64_t n = 1;
    for (size_t k = 0; k < t->rank; k++) {
        if (dims[k] && n > SIZE_MAX / 8 / dims[k])
            return refuse(r, "a shape that nothing holds");
        n *= dims[k];
        t->dims[k] = (size_t)dims[k];
    }
    t->n = (size_t)n;
    return (t->begin <= t->end && t->end - t->begin == n * dtype->bytes) ||
           refuse(r, "data_offsets that do not agree with dtype and shape");
}

/* {"dtype": ..., "shape": [...], "data_offsets": [begin, end]}, in any order. */
static bool read_tensor(struct reading *r, struct hnn_tensor *t)
{
    static const char *const keys[] = {"dtype", "shape", "data_offsets"};
    const struct dtype *dtype = NULL;
    uint64_t dims[HNN_TENSOR_RANK], offsets[2];
    unsigned seen = 0;
    size_t n = 0;
    if (!expect(r, '{'))
        return false;
    do {
        char *key = read_string(r);
        unsigned k = 0;
        while (key && k < 3 && strcmp(key, keys[k]) != 0)
            k++;
        free(key);
        if (!key || k == 3 || seen >> k & 1)
            return key && refuse(r, "expected dtype, shape and data_offsets, once each");
        seen |= 1u << k;
        char *text = expect(r, ':') && k == 0 ? read_string(r) : NULL;
        for (size_t i = 0; text && i < DTYPES; i++)
            if (strcmp(text, dtypes[i].name) == 0)
                dtype = &dtypes[i];
        free(text);
        if (r->error->status == AD_OK && k == 0 && !dtype)
            return refuse(r, "an unknown dtype");
        if (r->error->status != AD_OK ||
            (k == 1 && !read_integers(r, HNN_TENSOR_RANK, dims, &t->rank)) ||
            (k == 2 && !read_integers(r, 2, offsets, &n)))
            return false;
    } while (take(r, ','));
    if (!expect(r, '}'))
        return false;
    if (seen != 7 || n != 2)
        return refuse(r, "expected dtype, shape and two data_offsets");
    t->begin = offsets[0];
    t->end = offsets[1];
    t->dtype = dtype < dtypes + FLOATS ? dtype->name : NULL;
    return check_length(r, t, dtype, dims);
}

static bool read_metadata(struct reading *r)
{
    struct hnn_tensors *s = r->tensors;
    if (s->metadata)
        return refuse(r, "__metadata__ twice");
    if (!expect(r, '{') || take(r, '}'))
        return r->error->status == AD_OK;
    do {
        char *key = read_string(r), *text = key && expect(r, ':') ? read_string(r) : NULL;
        const bool twice = key && hnn_metadata_find(s, key);
        if (s->n_metadata == NAMES_MOST)
            refuse(r, "over 4096 keys of __metadata__");
        if (text && !twice && r->error->status == AD_OK &&
            phys_grow(&s->metadata, s->n_metadata, sizeof *s->metadata)) {
            s->metadata[s->n_metadata++] = (struct hnn_metadata){key, text};
            continue;
        }
        AD_FREE(key, text);
        return r->error->status != AD_OK ? false
               : twice                   ? refuse(r, "a key of __metadata__ twice")
               : text                    ? ad_fail(r->error, AD_E_MEMORY, "out of memory") == AD_OK
                                         : false;
    } while (take(r, ','));
    return expect(r, '}');
}

static bool read_member(struct reading *r)
{
    struct hnn_tensors *s = r->tensors;
    char *name = read_string(r);
    struct hnn_tensor t = {.name = name};
    const bool meta = name && strcmp(name, "__metadata__") == 0;
    if (name && expect(r, ':') && (meta ? read_metadata(r) : read_tensor(r, &t)) && !meta) {
        if (hnn_tensor_find(s, name))
            refuse(r, "a name twice");
        else if (s->n == NAMES_MOST)
            refuse(r, "over 4096 tensors");
        else if (!phys_grow(&s->tensor, s->n, sizeof *s->tensor))
            ad_fail(r->error, AD_E_MEMORY, "out of memory");
        else {
            s->tensor[s->n++] = t;
            name = NULL;
        }
    }
    free(name);
    return r->error->status == AD_OK;
}

enum ad_status hnn_tensors_header(struct hnn_tensors *s, const char *header, size_t length,
                                  struct ad_error *error)
{
    struct reading r = {s, header, header, header + length, error};
    if (expect(&r, '{') && !take(&r, '}')) {
        while (read_member(&r) && take(&r, ',')) {
        }
        if (error->status == AD_OK)
            expect(&r, '}');
    }
    skip_blanks(&r);
    if (error->status == AD_OK && r.at < r.end)
        refuse(&r, "text behind the object");
    return error->status;
}
