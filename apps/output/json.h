/* A JSON object written as a stream (RFC 8259). Keys are string literals. */
#ifndef APPS_OUTPUT_JSON_H
#define APPS_OUTPUT_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

struct json {
    FILE *out;
    bool first; /* nothing written yet in the innermost object or array */
};

/* The object, opened and closed; closing ends the line. */
void json_open(struct json *json, FILE *out);
void json_close(struct json *json);

/* Members. Inside an array the key is NULL. */
void json_text(struct json *json, const char *key, const char *text); /* NULL: null */
void json_number(struct json *json, const char *key, double value); /* shortest exact; else null */
void json_count(struct json *json, const char *key, size_t value);
void json_bool(struct json *json, const char *key, bool value);
void json_null(struct json *json, const char *key);
void json_base64(struct json *json, const char *key, size_t n, const unsigned char *bytes);

/* Nested objects and arrays. */
void json_object(struct json *json, const char *key);
void json_end_object(struct json *json);
void json_array(struct json *json, const char *key);
void json_end_array(struct json *json);

#endif
