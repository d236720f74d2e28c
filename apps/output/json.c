/* Writes one JSON object as a stream (json.h). */
#include "json.h"
#include "apps/quote.h"

#include <math.h>
#include <stdlib.h>

static void member(struct json *json, const char *key)
{
    if (!json->first)
        fputs(", ", json->out);
    json->first = false;
    if (key) {
        quote_json(json->out, key);
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
        quote_json(json->out, text);
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

void json_base64(struct json *json, const char *key, size_t n, const unsigned char *bytes)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    member(json, key);
    fputc('"', json->out);
    for (size_t i = 0; i < n; i += 3) {
        const size_t left = n - i;
        const unsigned three = (unsigned)bytes[i] << 16 |
                               (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
                               (left > 2 ? (unsigned)bytes[i + 2] : 0);
        fputc(digit[three >> 18], json->out);
        fputc(digit[three >> 12 & 63], json->out);
        fputc(left > 1 ? digit[three >> 6 & 63] : '=', json->out);
        fputc(left > 2 ? digit[three & 63] : '=', json->out);
    }
    fputc('"', json->out);
}
