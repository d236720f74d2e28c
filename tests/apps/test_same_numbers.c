/* Text, JSON and HDF5 of one run say the same numbers: every number of the text is, to its printed
   digits, in the JSON, and every number of the JSON is, to the last bit, in the file under the same
   name. A3: |gradient| was another one in each. */
#include "tests/close.h"
#include "shell.h"
#include "physics/io/hdf5_file.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is left out: times, which differ from run to run. */
static const char *const passing[] = {"seconds", "native"};

static const char *const runs[] = {
    "path pendulum",
    "path pendulum --solver adam --steps 30 --hold 3",
    "path pendulum --solver adam --steps 30 --hold 3 --energy-loss local --lr 0.01",
    "path threebody --preset paper --steps 20",
    "path pendulum --preset paper --stop-at-reference --steps 50",
    "path kepler --rule gauss3 --noise 0.001 --seed 4",
    "path kepler --rule gauss2 --ends start --init ode",
    "path pendulum --all",
    "path pendulum --init ode --tol 1e-5",
    "path brachistochrone",
    "path dblpend --solver lbfgs --steps 20 --grad-tol 0.5",
    "path ephemeris --init ode --rule midpoint",
};

/* ---- numbers of a text ---- */

/* The next number that is not part of a word, NULL: none; *digits are those it is known to. */
static const char *next_number(const char *at, double *value, int *digits)
{
    for (const char *text = at; *at; at++) {
        bool first = at == text || !(isalnum((unsigned char)at[-1]) || strchr("._-+", at[-1]));
        if (!first ||
            !(isdigit((unsigned char)*at) || (*at == '-' && isdigit((unsigned char)at[1]))))
            continue;
        char *end;
        *value = strtod(at, &end);
        *digits = 0;
        for (const char *c = at; c < end && *c != 'e'; c++)
            *digits += isdigit((unsigned char)*c) && (*digits > 0 || *c != '0');
        if (isalpha((unsigned char)*end)) /* 3x */
            continue;
        return at;
    }
    return NULL;
}

static bool contains(const char *json, double value, int digits)
{
    double candidate, close = 0.51 * pow(10, 1 - digits);
    int any;
    for (const char *at = json; (at = next_number(at, &candidate, &any)); at++)
        if (candidate == value || fabs(candidate - value) <= close * fabs(value))
            return true;
    return value == 0;
}

/* Seconds stand in "in 0.2 s". */
static bool is_time(const char *text, const char *at)
{
    return at - text >= 3 && strncmp(at - 3, "in ", 3) == 0;
}

static void text_is_in_json(const char *run, const char *text, const char *json)
{
    double value;
    int digits;
    size_t n = 0;
    for (const char *at = text; (at = next_number(at, &value, &digits)); n++) {
        if (!is_time(text, at) && !contains(json, value, digits))
            fail_msg("%s: the text says %.*s..., no number of %s", run, 40, at, json);
        at += strcspn(at, " ,\n");
    }
    assert_true(n > 3);
}

/* ---- JSON against the file ---- */

struct file {
    const char *run;
    phys_runfile *file;
    size_t compared;
};

static bool is_passing(const char *key)
{
    for (size_t k = 0; k < LENGTH(passing); k++)
        if (strcmp(key, passing[k]) == 0)
            return true;
    return false;
}

static void compare(struct file *f, const char *object, const char *key, double value)
{
    double stored = NAN;
    struct ad_error error = {0};
    if (is_passing(key))
        return;
    enum ad_status status = phys_runfile_get(f->file, object, key, &stored, &error);
    if (isnan(value) ? status == AD_OK && !isnan(stored) : status != AD_OK || stored != value)
        fail_msg("%s: %s of %s is %.17g in JSON, %.17g in the file: %s", f->run, key, object, value,
                 stored, error.message);
    f->compared++;
}

static const char *skip_text(const char *at)
{
    for (at++; *at != '"'; at++)
        at += *at == '\\';
    return at + 1;
}

static const char *list(struct file *f, const char *at, const char *key)
{
    struct ad_error error = {0};
    double stored;
    for (size_t k = 0; *at != ']'; k++) {
        char *end;
        double value = strtod(at, &end);
        if (phys_runfile_read(f->file, key, k, 1, &stored, &error) != AD_OK || stored != value)
            fail_msg("%s: %s[%zu] is %.17g in JSON: %s", f->run, key, k, value, error.message);
        f->compared++;
        at = end + strspn(end, ", ");
    }
    return at + 1;
}

/* The members of the object that begins at `at`, which is `object` of the file. */
static const char *members(struct file *f, const char *at, const char *object)
{
    char key[64], inner[128];
    for (at++; *at != '}'; at += strspn(at, ", ")) {
        const char *end = skip_text(at);
        snprintf(key, sizeof key, "%.*s", (int)(end - at - 2), at + 1);
        at = end + strspn(end, ": ");
        if (*at == '"') {
            at = skip_text(at);
        } else if (*at == '[' && at[1] == '{') {
            for (size_t k = 0; *at != ']'; k++) {
                snprintf(inner, sizeof inner, "%s/%zu", key, k);
                at = members(f, at + strspn(at, "[, "), inner);
            }
            at++;
        } else if (*at == '[') {
            at = list(f, at + 1, key);
        } else if (*at == '{') {
            at = members(f, at, key);
        } else {
            bool word = isalpha((unsigned char)*at);
            char *after;
            double value = !word        ? strtod(at, &after)
                           : *at == 't' ? 1
                           : *at == 'f' ? 0
                                        : (double)NAN;
            compare(f, object, key, value);
            at = word ? at + strspn(at, "truefalsn") : after;
        }
    }
    return at + 1;
}

static void json_is_in_file(const char *run, const char *json)
{
    struct file f = {.run = run};
    struct ad_error error = {0};
    assert_int_equal(phys_runfile_open(shell_path("run.h5"), &f.file, &error), AD_OK);
    members(&f, json, "/");
    assert_true(f.compared > 5);
    phys_runfile_close(f.file);
}

static void test_same_numbers(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(runs); k++) {
        int status = shell("$LA %s --json --out run.h5", runs[k]);
        char *json = strdup(shell_last_line());
        json_is_in_file(runs[k], json);
        assert_int_equal(shell("$LA %s", runs[k]), status);
        text_is_in_json(runs[k], shell_out(), json);
        free(json);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test_teardown(test_same_numbers, shell_empty)};
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
