/* Text, JSON and HDF5 of one run agree: every number of the text is, to its printed digits, in the
   JSON, and every number of the JSON is, to the last bit, in the file under the same name. A3:
   |gradient| differed between them. */
#include "tests/close.h"
#include "shell.h"
#include "physics/io/hdf5_file.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is left out: times, which differ from run to run. */
static const char *const passing[] = {"seconds", "setup_seconds", "ms_per_step", "native"};

static const char *const runs[] = {
    "quantum",
    "quantum --packet=-2,.5,1 --packet=2,.5,-1 --no-reference",
    "quantum --scene harmonic --rule midpoint --dt 4 --steps 1 --points 128",
    "quantum --preset paper --scale 0.3",
    "quantum --scene double-slit --points 172 --steps 75",
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
    "simulate pendulum",
    "simulate figure8 --tol 1e-8 --reverse",
    "simulate pendulum --event theta=1.57 --event v_theta=0.1 --horizon 1e-9 --lyapunov 2",
    "simulate dblpend --integrator rk4 --dt 0.02 --time 20",
    "simulate gas --set bodies=12 --integrator verlet --dt 0.1 --time 1",
    "simulate ephemeris --data $ROOT/tests/data/horizons --days 20 --reverse",
    "simulate ephemeris --data $ROOT/tests/data/horizons --days 5 --tol 1e6",
};

/* Models and data for the runs below. */
static const char *const learning[] = {
    "$LA dataset spring --trials 6 --quiet --out d.csv",
    "$LA train d.csv --hidden 8 --steps 30 --quiet --out hnn.h5",
    "$LA train d.csv --hidden 8 --steps 30 --model baseline --quiet --out base.h5",
    "$LA dataset pixels --trials 3 --points 20 --size 8 --quiet --out f.h5",
    "$LA train f.h5 --model pixel-hnn --hidden 8 --steps 4 --quiet --out p.h5",
    "$LA train f.h5 --model pixel-baseline --hidden 8 --steps 4 --quiet --out b.h5",
};

static const char *const learnt[] = {
    "rollout hnn.h5 --truth spring --x0 0.9,0 --against base.h5 --time 3",
    "rollout hnn.h5 --x0 3,0 --reverse --time 2",
    "rollout base.h5 --truth d.csv --time-column t --state q,p",
    "rollout p.h5 --against b.h5 --truth f.h5 --time 9",
    "rollout p.h5 --truth pixels --time 9 --add-energy 0.01 --at 4",
    "field hnn.h5 --grid 5",
    "field base.h5 --grid 5",
};

/* Without a file, or with one that is their product and has other numbers than the report. */
static const char *const made[] = {
    "rollout hnn.h5 --against base.h5 --truth spring --starts 3 --time 2",
    "rollout p.h5 --truth f.h5 --starts 2 --time 9",
    "dataset pendulum --trials 3 --out made.h5",
    "dataset pixels --trials 2 --points 5 --size 8 --out made.h5",
    "train d.csv --hidden 8 --steps 20 --test-fraction 0.3 --out made.h5",
    "train f.h5 --model pixel-hnn --hidden 8 --steps 4 --out made.h5",
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
    assert_true(n > 0);
}

/* ---- JSON against the file ---- */

struct file {
    const char *run;
    phys_hdf5 *file;
    size_t compared;
};

static bool is_passing(const char *key)
{
    for (size_t k = 0; k < LENGTH(passing); k++)
        if (strcmp(key, passing[k]) == 0)
            return true;
    return false;
}

static double list_number(const struct file *f, const char *object, const char *key, size_t k);

static void compare(struct file *f, const char *object, const char *key, double value)
{
    double stored = NAN;
    struct ad_error error = {0};
    if (is_passing(key))
        return;
    bool event = strncmp(object, "events/", 7) == 0;
    enum ad_status status = event ? AD_OK : phys_hdf5_get(f->file, object, key, &stored, &error);
    if (event)
        stored = list_number(f, object, key, 0);
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

/* Number k of a list. Crossings are rows of datasets: their times, touches and states. */
static double list_number(const struct file *f, const char *object, const char *key, size_t k)
{
    struct ad_error error = {0};
    double row[2 * 64], stored = NAN;
    if (strncmp(object, "events/", 7) != 0) {
        phys_hdf5_read(f->file, key, k, 1, &stored, &error);
        return stored;
    }
    struct phys_hdf5_item item;
    const char *name = strcmp(key, "t") == 0               ? "events/time"
                       : strcmp(key, "t_uncertainty") == 0 ? "events/uncertainty"
                       : strcmp(key, "touch") == 0         ? "events/touch"
                                                           : "events/state";
    assert_int_equal(phys_hdf5_shape(f->file, name, &item, &error), AD_OK);
    phys_hdf5_read(f->file, name, strtoul(object + 7, NULL, 10), 1, row, &error);
    return row[strcmp(key, "v") == 0 ? item.dims[1] / 2 + k : k];
}

static const char *list(struct file *f, const char *at, const char *object, const char *key)
{
    for (size_t k = 0; *at != ']'; k++, at += strspn(at, ", ")) {
        if (*at == '"') {
            at = skip_text(at);
            continue;
        }
        char *end;
        double value = strtod(at, &end), stored = list_number(f, object, key, k);
        if (stored != value)
            fail_msg("%s: %s[%zu] of %s is %.17g in JSON, %.17g in the file", f->run, key, k,
                     object, value, stored);
        f->compared++;
        at = end;
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
            at = list(f, at + 1, object, key);
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
    assert_int_equal(phys_hdf5_open(shell_path("run.h5"), &f.file, &error), AD_OK);
    members(&f, json, "/");
    assert_true(f.compared > 0);
    phys_hdf5_close(f.file);
}

static void compare_run(const char *run, bool file)
{
    const char *out = file ? "--out run.h5" : "";
    int status = shell("$LA %s --json %s", run, out);
    char *json = strdup(shell_last_line());
    if (file)
        json_is_in_file(run, json);
    assert_int_equal(shell("$LA %s %s", run, out), status);
    text_is_in_json(run, shell_out(), json);
    free(json);
}

static void test_paths(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(runs); k++)
        compare_run(runs[k], true);
}

static void test_networks(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(learning); k++)
        shell_works("%s", learning[k]);
    for (size_t k = 0; k < LENGTH(learnt); k++)
        compare_run(learnt[k], true);
    for (size_t k = 0; k < LENGTH(made); k++)
        compare_run(made[k], false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_paths, shell_empty),
        cmocka_unit_test_teardown(test_networks, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
