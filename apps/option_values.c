/* Values of options: parsing, defaults, and what they own (option_values.h). */
#include "option_values.h"
#include "physics/io/grow.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A term of an angle at *text, which it passes: [+-] NUMBER, or [+-] [NUMBER [*]] pi [/NUMBER]. */
static bool read_term(const char **text, double *value)
{
    const char *p = *text + (**text == '+' || **text == '-');
    bool number = isdigit((unsigned char)*p) || *p == '.';
    char *end = (char *)p;
    double term = number ? strtod(p, &end) : 1, divisor = 1;
    p = end + (number && *end == '*' && strncmp(end + 1, "pi", 2) == 0);
    bool pi = strncmp(p, "pi", 2) == 0;
    p += pi ? 2 : 0;
    if (pi && *p == '/' && isdigit((unsigned char)p[1])) {
        divisor = strtod(p + 1, &end);
        p = end;
    }
    *value = (**text == '-' ? -1 : 1) * term * (pi ? M_PI : 1) / divisor;
    *text = p;
    return number || pi;
}

bool options_number(const char *text, double *value)
{
    char *end;
    double term;
    if (isspace((unsigned char)*text))
        return false;
    *value = strtod(text, &end);
    if (end != text && *end == '\0')
        return isfinite(*value);
    *value = 0;
    if (!strstr(text, "pi"))
        return false;
    for (const char *p = text; *p; *value += term)
        if ((p != text && *p != '+' && *p != '-') || !read_term(&p, &term))
            return false;
    return isfinite(*value);
}

bool options_range(const char *text, char *name, size_t size, double *from, double *to)
{
    const char *equals = strchr(text, '='), *colon = equals ? strchr(equals, ':') : NULL;
    char low[64];
    if (!colon || (size_t)(equals - text) >= size || colon - equals > (ptrdiff_t)sizeof low)
        return false;
    snprintf(name, size, "%.*s", (int)(equals - text), text);
    snprintf(low, sizeof low, "%.*s", (int)(colon - equals - 1), equals + 1);
    return options_number(low, from) && options_number(colon + 1, to);
}

bool options_integer(const char *text, uint64_t most, uint64_t *value)
{
    if (*text == '\0' || strspn(text, "0123456789") != strlen(text))
        return false;
    errno = 0;
    unsigned long long parsed = strtoull(text, NULL, 10);
    *value = parsed;
    return errno == 0 && parsed <= most;
}

static enum ad_status add_setting(const char *option, struct settings *settings, const char *text,
                                  struct ad_error *error)
{
    const char *equals = strchr(text, '=');
    double value;
    if (!equals || equals == text || !options_number(equals + 1, &value))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--%s: expected NAME=VALUE with a number, as in mass=1.5, got '%s'", option,
                       text);
    if (!phys_grow(&settings->setting, settings->n, sizeof *settings->setting))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    char *name = strndup(text, (size_t)(equals - text));
    if (!name)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    settings->setting[settings->n++] = (struct phys_setting){name, value};
    return AD_OK;
}

static enum ad_status add_text(struct texts *texts, const char *text, struct ad_error *error)
{
    if (!phys_grow(&texts->text, texts->n, sizeof *texts->text))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    texts->text[texts->n++] = text;
    return AD_OK;
}

static const struct kind {
    const char *form, *range; /* expected by messages: as a word, as a number */
    size_t least;
} kinds[OPTION_SETTINGS + 1] = {
    [OPTION_NUMBER] = {"a number such as 0.5", NULL, 0},
    [OPTION_POSITIVE] = {"a number such as 0.5", "more than 0", 0},
    [OPTION_SIZE] = {"a number such as 0.5", "at least 0", 0},
    [OPTION_COUNT] = {"a whole number such as 10", NULL, 0},
    [OPTION_SOME] = {"a whole number such as 10", "at least 1", 1},
    [OPTION_TWO] = {"a whole number such as 10", "at least 2", 2},
    [OPTION_SLICES] = {"a whole number such as 10", "at least 3", 3},
    [OPTION_SEED] = {"a whole number such as 10", NULL, 0},
};

enum ad_status option_store(const struct option *option, const char *text, char *values,
                            struct ad_error *error)
{
    void *at = values + option->offset;
    const struct kind *kind = &kinds[option->kind];
    uint64_t whole = 0;
    double number = 0;
    bool right = true, within = true;
    switch (option->kind) {
    case OPTION_FLAG:
        *(bool *)at = true;
        break;
    case OPTION_TEXT:
    case OPTION_INPUT:
    case OPTION_OUTPUT:
    case OPTION_PICTURE:
        *(const char **)at = text;
        break;
    case OPTION_NUMBER:
    case OPTION_POSITIVE:
    case OPTION_SIZE:
        right = options_number(text, &number);
        within = option->kind == OPTION_NUMBER || number > 0 ||
                 (option->kind == OPTION_SIZE && number == 0);
        *(double *)at = number;
        break;
    case OPTION_COUNT:
    case OPTION_SOME:
    case OPTION_TWO:
    case OPTION_SLICES:
        right = options_integer(text, OPTION_NO_COUNT - 1, &whole);
        within = whole >= kind->least;
        *(size_t *)at = (size_t)whole;
        break;
    case OPTION_SEED:
        right = options_integer(text, UINT64_MAX, at);
        break;
    case OPTION_TEXTS:
        return add_text(at, text, error);
    case OPTION_SETTINGS:
        return add_setting(option->name, at, text, error);
    }
    if (!right)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: expected %s, got '%s'", option->name,
                       kind->form, text);
    if (!within)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: expected %s, got %s", option->name, kind->range,
                       text);
    return AD_OK;
}

void option_store_default(const struct option *option, char *values)
{
    struct ad_error error = {0};
    void *at = values + option->offset;
    if (option->kind >= OPTION_NUMBER && option->kind <= OPTION_SIZE)
        *(double *)at = OPTION_NO_NUMBER;
    if (option->kind >= OPTION_COUNT && option->kind <= OPTION_SLICES)
        *(size_t *)at = OPTION_NO_COUNT;
    if (option->fallback)
        option_store(option, option->fallback, values, &error);
}

void option_release(const struct option *option, char *values)
{
    void *at = values + option->offset;
    if (option->kind == OPTION_TEXTS) {
        free(((struct texts *)at)->text);
        *(struct texts *)at = (struct texts){0};
    }
    if (option->kind != OPTION_SETTINGS)
        return;
    struct settings *settings = at;
    for (size_t k = 0; k < settings->n; k++)
        free((char *)settings->setting[k].name);
    free(settings->setting);
    *settings = (struct settings){0};
}

size_t options_choose(const char *option, const char *given, size_t n, const char *const names[],
                      struct ad_error *error)
{
    char all[160] = "";
    for (size_t k = 0; k < n; k++) {
        if (strcmp(given, names[k]) == 0)
            return k;
        snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s",
                 k == 0      ? ""
                 : k + 1 < n ? ", "
                             : " or ",
                 names[k]);
    }
    ad_fail(error, AD_E_ARGUMENT, "--%s: expected %s, got '%s'", option, all, given);
    return n;
}

/* ---- lists of numbers ---- */

const char *numbers_list(const char *text, size_t most, double *values, size_t *found)
{
    *found = 0;
    for (bool more = true; more; ++*found) {
        char *end;
        double value = strtod(text, &end);
        if (end == text || !isfinite(value) || (*end != ',' && *end != '\0'))
            return text;
        if (*found < most)
            values[*found] = value;
        more = *end == ',';
        text = end + more;
    }
    return NULL;
}

enum ad_status numbers_read(const char *option, const char *text, size_t n, const char *what,
                            double *values, struct ad_error *error)
{
    size_t found;
    const char *wrong = numbers_list(text, n, values, &found);
    if (wrong)
        return ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s, found '%.20s'", option, text,
                       what, wrong);
    return found == n
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected %s: %zu numbers, found %zu",
                         option, text, what, n, found);
}
