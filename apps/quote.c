/* Quoting of text from outside (quote.h). */
#include "quote.h"
#include "physics/io/utf8.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SHOWN = 200 }; /* bytes of a text in a picture */

/* Writes one character, or one invalid byte, and returns its length. */
static size_t terminal_character(FILE *out, const char *text)
{
    size_t length = phys_utf8_printable(text);
    if (length)
        fwrite(text, 1, length, out);
    else
        fprintf(out, "\\x%02x", (unsigned char)*text);
    return length ? length : 1;
}

void quote_terminal(FILE *out, const char *text)
{
    while (*text)
        text += terminal_character(out, text);
}

void quote_shell(FILE *out, const char *before, const char *text)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
                                "_./+-,:@%";
    const bool quoted = strspn(text, plain) < strlen(text);
    fprintf(out, "%s%s", quoted ? "'" : "", before);
    while (*text)
        if (*text == '\'')
            fputs("'\\''", out), text++;
        else
            text += terminal_character(out, text);
    fputs(quoted ? "'" : "", out);
}

void quote_terminal_line(FILE *out, const char *before, const char *text)
{
    fputs(before, out);
    quote_terminal(out, text);
    fputc('\n', out);
}

static void csv_characters(FILE *out, const char *text)
{
    while (*text)
        if (strchr("\n\r\t\"", *text))
            fputs(*text == '"' ? "\"\"" : (char[]){*text, '\0'}, out), text++;
        else
            text += terminal_character(out, text);
}

void quote_csv(FILE *out, const char *text)
{
    fputc('"', out);
    csv_characters(out, text);
    fputc('"', out);
}

void quote_csv_name(FILE *out, const char *first, const char *second)
{
    bool quotes = strpbrk(first, ",\"\n\r") || strpbrk(second, ",\"\n\r");
    fputs(quotes ? "\"" : "", out);
    csv_characters(out, first);
    csv_characters(out, second);
    fputs(quotes ? "\"" : "", out);
}

void quote_json(FILE *out, const char *text)
{
    fputc('"', out);
    while (*text) {
        size_t length = phys_utf8_length(text);
        if (length == 0)
            fputs("\\ufffd", out);
        else if (*text == '"' || *text == '\\')
            fprintf(out, "\\%c", *text);
        else if (phys_utf8_printable(text) == 0 && length < 4)
            fprintf(out, "\\u%04x", (unsigned)phys_utf8_code(text));
        else if (phys_utf8_printable(text) == 0)
            fprintf(out, "\\u%04x\\u%04x", 0xd7c0u + (phys_utf8_code(text) >> 10),
                    0xdc00u + (phys_utf8_code(text) & 0x3ff));
        else
            fwrite(text, 1, length, out);
        text += length ? length : 1;
    }
    fputc('"', out);
}

/* ---- gnuplot ---- */

/* It replaces `...` and @name in double quotes before it reads the string; octal escapes come after
   that. A digit behind one would be read as a part of it. */
static void gnuplot_byte(FILE *out, char c, bool *escaped)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "0123456789 _./:,()=+-^{}";
    bool digit = c >= '0' && c <= '9';
    *escaped = (unsigned char)c < 0x80 && (!strchr(plain, c) || (digit && *escaped));
    fprintf(out, *escaped ? "\\%03o" : "%c", (unsigned char)c);
}

/* The bytes of an exponent such as -2 or 1/2 at the beginning of a text. */
static size_t exponent_length(const char *text)
{
    static const char digits[] = "0123456789";
    size_t sign = *text == '-', n = strspn(text + sign, digits);
    if (n == 0)
        return 0;
    n += sign;
    size_t below = text[n] == '/' ? strspn(text + n + 1, digits) : 0;
    return below > 0 ? n + 1 + below : n;
}

static void gnuplot_text(FILE *out, const char *text, bool markup)
{
    const char *start = text;
    bool escaped = false;
    fputc('"', out);
    while (*text && text - start < SHOWN) {
        size_t length = phys_utf8_printable(text);
        size_t exponent = markup && *text == '^' ? exponent_length(text + 1) : 0;
        if (exponent > 0) {
            fprintf(out, "^{%.*s}", (int)exponent, text + 1);
            escaped = false;
            text += 1 + exponent;
            continue;
        }
        if (markup && strchr("^_{}@&~\\", *text))
            gnuplot_byte(out, '\\', &escaped);
        for (size_t k = 0; k < length; k++)
            gnuplot_byte(out, text[k], &escaped);
        if (length == 0)
            fputs("\xef\xbf\xbd", out);
        escaped = escaped && length > 0;
        text += length ? length : 1;
    }
    fputs(*text ? "...\"" : "\"", out);
}

void quote_gnuplot(FILE *out, const char *text) { gnuplot_text(out, text, false); }
void quote_gnuplot_label(FILE *out, const char *text) { gnuplot_text(out, text, true); }

void quote_gnuplot_file(FILE *out, const char *name)
{
    bool escaped = false;
    fputs(*name == '/' ? "\"" : "\"./", out);
    while (*name)
        gnuplot_byte(out, *name++, &escaped);
    fputc('"', out);
}

char *text_joined(const char *first, const char *second)
{
    char *text = malloc(strlen(first) + strlen(second) + 1);
    if (text)
        strcpy(stpcpy(text, first), second);
    return text;
}

char *quote_path(const char *name) { return text_joined(*name == '/' ? "" : "./", name); }
