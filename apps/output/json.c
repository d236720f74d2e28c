/* One JSON object, written as it comes (json.h). */
#include "json.h"

#include <math.h>
#include <stdlib.h>

/* Length of the UTF-8 sequence at `s` (RFC 3629), 0 if it is not one. */
static size_t utf8_length(const unsigned char *s)
{
    static const struct {
        unsigned char first, last, second_least, second_most;
        size_t length;
    } forms[] = {
        {0x00, 0x7f, 0, 0, 1},       {0xc2, 0xdf, 0x80, 0xbf, 2}, {0xe0, 0xe0, 0xa0, 0xbf, 3},
        {0xe1, 0xec, 0x80, 0xbf, 3}, {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
        {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4}, {0xf4, 0xf4, 0x80, 0x8f, 4}};
    size_t form = 0, n = sizeof forms / sizeof *forms;
    while (form < n && !(s[0] >= forms[form].first && s[0] <= forms[form].last))
        form++;
    if (form == n)
        return 0;
    size_t length = forms[form].length;
    if (length > 1 && !(s[1] >= forms[form].second_least && s[1] <= forms[form].second_most))
        return 0;
    for (size_t k = 2; k < length; k++)
        if ((s[k] & 0xc0) != 0x80)
            return 0;
    return length;
}

/* Bytes that are not UTF-8 (file names may hold any) become U+FFFD. */
static void quoted(FILE *out, const char *text)
{
    fputc('"', out);
    for (const unsigned char *s = (const unsigned char *)text; *s;) {
        size_t length = utf8_length(s);
        if (length == 0)
            fputs("\\ufffd", out);
        else if (*s == '"' || *s == '\\')
            fprintf(out, "\\%c", *s);
        else if (*s < 0x20 || *s == 0x7f)
            fprintf(out, "\\u%04x", *s);
        else
            fwrite(s, 1, length, out);
        s += length ? length : 1;
    }
    fputc('"', out);
}

static void member(struct json *json, const char *key)
{
    if (!json->first)
        fputs(", ", json->out);
    json->first = false;
    if (key) {
        quoted(json->out, key);
        fputs(": ", json->out);
    }
}

static void begin(struct json *json, const char *key, char bracket)
{
    member(json, key);
    fputc(bracket, json->out);
    json->first = true;
}

static void end(struct json *json, char bracket)
{
    fputc(bracket, json->out);
    json->first = false;
}

void json_open(struct json *json, FILE *out)
{
    *json = (struct json){out, true};
    fputc('{', out);
}

void json_close(struct json *json) { fputs("}\n", json->out); }

void json_text(struct json *json, const char *key, const char *text)
{
    member(json, key);
    if (text)
        quoted(json->out, text);
    else
        fputs("null", json->out);
}

/* The fewest digits that read back as the same number: 0.06, not 0.059999999999999998. */
static void shortest(FILE *out, double value)
{
    char text[40];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    fputs(text, out);
}

void json_number(struct json *json, const char *key, double value)
{
    member(json, key);
    if (isfinite(value))
        shortest(json->out, value);
    else
        fputs("null", json->out);
}

void json_count(struct json *json, const char *key, size_t value)
{
    member(json, key);
    fprintf(json->out, "%zu", value);
}

void json_bool(struct json *json, const char *key, bool value)
{
    member(json, key);
    fputs(value ? "true" : "false", json->out);
}

void json_null(struct json *json, const char *key) { json_text(json, key, NULL); }

void json_object(struct json *json, const char *key) { begin(json, key, '{'); }
void json_end_object(struct json *json) { end(json, '}'); }
void json_array(struct json *json, const char *key) { begin(json, key, '['); }
void json_end_array(struct json *json) { end(json, ']'); }
