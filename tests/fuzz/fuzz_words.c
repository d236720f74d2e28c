/* Fuzzer of option values: lists of numbers, scenes and their parameters, events, dates. The first
   byte chooses which, the rest is the word. */
#include "fuzz.h"

#include "apps/option_values.h"
#include "physics/ephemeris/horizons.h"
#include "physics/motion/solve.h"
#include "physics/physics.h"

#include <math.h>
#include <string.h>

static enum ad_status numbers(const char *word, struct ad_error *error)
{
    double values[3] = {0};
    size_t n = 1 + strlen(word) % 3;
    if (numbers_read("box", word, n, "A,B", values, error) == AD_OK)
        for (size_t k = 0; k < n; k++)
            fuzz_require(isfinite(values[k]));
    return error->status;
}

/* SCENE NAME=VALUE, and a question about it. */
static enum ad_status scene(const char *word, struct ad_error *error)
{
    char name[32];
    struct phys_system system;
    struct phys_crossing crossing;
    const char *rest = word + strcspn(word, " ");
    snprintf(name, sizeof name, "%.*s", (int)(rest - word), word);
    if (strchr(name, '/') || strstr(name, ".so"))
        return AD_OK;
    if (phys_system_open(name, &system, error) == AD_OK) {
        const char *question = rest + (*rest == ' '), *equals = strchr(question, '=');
        double value = equals ? strtod(equals + 1, NULL) : 0;
        struct ad_error other = {0};
        snprintf(name, sizeof name, "%.*s", (int)strcspn(question, "="), question);
        if (fabs(value) < 1000 && phys_system_set(&system, name, value, &other) == AD_OK)
            fuzz_require(phys_system_get(&system, name) == value && system.dof > 0);
        if (phys_crossing_read(&system, question, &crossing, error) == AD_OK)
            fuzz_require(isfinite(crossing.value) && crossing.quantity);
    }
    phys_system_close(&system);
    return error->status;
}

static enum ad_status date(const char *word, struct ad_error *error)
{
    static double jd[] = {2459945.5, 2459946.5, 2459947.5};
    const struct phys_horizons table = {.n = 3, .jd = jd};
    size_t index = 0;
    if (phys_horizons_epoch(&table, word, &index, error) == AD_OK)
        fuzz_require(index < table.n);
    return error->status;
}

int fuzz_words(const uint8_t *data, size_t size)
{
    static enum ad_status (*const readers[])(const char *, struct ad_error *) = {numbers, scene,
                                                                                 date};
    if (size == 0)
        return 0;
    struct ad_error error = {0};
    char *word = fuzz_text(data + 1, size - 1);
    if (readers[data[0] % 3](word, &error) != AD_OK)
        fuzz_require(error.status != AD_E_MEMORY && error.message[0]);
    free(word);
    return 0;
}
