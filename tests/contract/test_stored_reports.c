/* Each number of the JSON of short runs is as in tests/data/reports.txt, to the digits stored there
   or below a bound. It holds estimates, counts, signs and costs of which no closed form is known.
   After a change that is meant, remove the file and run with STORE=1; again, by a build of other
   options, and with other kernels of OpenBLAS (OPENBLAS_CORETYPE=Nehalem, Haswell, SkylakeX) and
   ours (LEASTACTION_ISA), to keep only the digits in which all agree. */
#include "tests/close.h"
#include "tests/apps/shell.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 5, LINE = 512, KEY = 128 };

static const double rounding = 1e-11; /* smaller numbers are only bounded */

/* Times differ from run to run; what is compiled, and how often, from processor to processor. */
static const char *const passing[] = {"seconds", "native",  "version",
                                      "ms_per",  "machine", "threads"};

static const char *const before[] = {
    "$LA dataset spring --trials 6 --quiet --out d.csv",
    "$LA dataset wave --trials 2 --points 6 --quiet --out wave.csv",
    "$LA simulate pendulum --time 3 --samples 30 --csv motion.csv --no-reference --quiet",
    "$LA simulate ephemeris --data $ROOT/tests/data/horizons --days 2 --quiet",
    "printf 'e\\n.1\\n.3\\n' >starts.csv",
};

static const char *const runs[] = {
    "quantum --packet=-2,.5,1 --packet=2,.5,-1",
    "quantum --scene harmonic --rule midpoint --dt 4 --steps 1 --points 128",
    "quantum --scene pendulum --method fft --dt .1 --steps 2 --force",
    "quantum --scene double-well --sweep method=kernel,fft,crank-nicolson --points 65 --steps 9 "
    "--force",
    "quantum --scene gravity --sweep rule=left,midpoint,trapezoid --points 129 --steps 5 --force",
    "quantum --scene free --walls ring --points 65 --steps 7 --method fft --force",
    "quantum --scene free --absorb 2 --points 129 --steps 9 --method crank-nicolson",
    "quantum --scene harmonic --power 3 --points 129 --force",
    "quantum --scene double-slit --points 172 --steps 75",
    "path pendulum",
    "path pendulum --tol 1e-5",
    "path pendulum --all",
    "path kepler --all --slices 8",
    "path double-well --all --slices 40",
    "path pendulum --all --end theta=free",
    "path kepler --rule gauss3 --noise 0.001 --seed 4",
    "path kepler --rule gauss2 --ends start --init ode",
    "path spring --relate 'q(T)=-q(0)+1' --time 1.4",
    "path pendulum --continue g=9.81:12 --tol 1e-3",
    "path kepler --all --energy=-.5027 --slices 40",
    "path kepler --time free --energy=-.45",
    "path spring --start q=free --end q=1 --tol 1e-9",
    "path pendulum --sweep rule=left,midpoint,trapezoid,gauss2,gauss3,gauss4",
    "path dblpend --sweep slices=10:40:3",
    "path threebody --sweep solver=newton,lbfgs,adam,sgd --steps 20 --slices 20",
    "path kepler --scan e=.1:.9:4 --tol 1e-6",
    "path arenstorf --tol 1e-4 --init ode --time 2",
    "path figure8 --tol 1e-5 --time 1",
    "path sine-gordon --slices 20",
    "path freebody --tol 1e-6",
    "path pendulum --solver adam --steps 30 --hold 3 --energy-loss local --lr 0.01",
    "path brachistochrone",
    "path dblpend --solver lbfgs --steps 20 --grad-tol 0.5",
    "path kepler --slices 12 --solver adam --steps 3",
    "path pendulum --slices 12 --rule gauss2 --blocks",
    "path threebody --solver lbfgs --slices 30 --steps 40",
    "path ephemeris --data $ROOT/tests/data/horizons --days 9 --init ode",
    "simulate pendulum --event theta=1.57 --event v_theta=0.1 --lyapunov 2",
    "simulate figure8 --tol 1e-8 --reverse",
    "simulate dblpend --integrator rk4 --dt 0.02 --time 20",
    "simulate dblpend --time 1 --lyapunov 2",
    "simulate kepler --set e=.9 --tol 1e-6",
    "simulate kepler --ensemble starts.csv --time 1 --samples 4 --event x=0",
    "simulate kepler --integrator gauss3 --dt .1 --time 1",
    "simulate kepler --sweep "
    "integrator=dopri5,dop853,taylor,adaptive-verlet,verlet,yoshida4,rk4,gauss2,implicit-midpoint "
    "--time 4",
    "simulate dblpend --sweep tol=1e-4,1e-7,1e-10 --time 8",
    "simulate kepler --sweep integrator=variational-left,variational-midpoint,variational-gauss2 "
    "--dt .05 --time 3",
    "simulate pythagorean --time 10 --tol 1e-6",
    "simulate arenstorf --event y=0 --horizon 1e-9",
    "simulate dimer --time 2",
    "simulate fall --time 1.1",
    "simulate sine-gordon --time 2 --samples 5",
    "simulate kepler --section y=0 --time 30",
    "simulate pendulum --until theta=0 --time 9",
    "simulate dblpend --sensitivity --time 2 --by g",
    "simulate gas --set bodies=12 --integrator verlet --dt 0.1 --time 1",
    "simulate kepler --periodic 6.3",
    "simulate cr3bp --periodic 3 --samples 20",
    "simulate pendulum --set l=1 --mode 1 --continue energy=-9.7",
    "simulate pendulum --time 1 --sensitivity",
    "simulate ephemeris --data $ROOT/tests/data/horizons --days 20 --reverse",
    "simulate ephemeris --data $ROOT/tests/data/horizons --days 5 --tol 1e6",
    "modes dblpend",
    "modes cr3bp",
    "modes dimer",
    "modes double-well",
    "fit pendulum motion.csv --free l --tries 2",
    "fit pendulum motion.csv --free g,l --noise .01 --hold-out .2 --stretch 10",
    "train d.csv --hidden 8 --steps 30 --out hnn.h5",
    "train d.csv --hidden 8 --steps 30 --model baseline --test-fraction .3 --out base.h5",
    "train wave.csv --lattice ring --hidden 4 --steps 5 --out wave.h5",
    "train d.csv --hidden 6,5 --sweep model=hnn,lnn,baseline,sympnet --steps 5 --precision f64 "
    "--out m.h5 --trial trial --time t --state q,p",
    "train d.csv --hidden 6 --sweep activation=tanh,relu,sigmoid,softplus,sine,swish,gelu,elu "
    "--steps 5 --precision f64 --out m.h5",
    "train d.csv --hidden 6 --sweep optimiser=adam,adamw,sgd,lbfgs --steps 6 --precision f64 --out "
    "m.h5 --normalise --clip .1",
    "train d.csv --hidden 6 --sweep schedule=constant,cosine,step,onecycle,warmup --steps 9 "
    "--precision f64 --out m.h5 --batch 20 --split random --test-fraction .2",
    "train d.csv --hidden 6 --sweep stepping=runge-kutta,leapfrog,midpoint --separable --rollout 2 "
    "--time t --trial trial --state q,p --steps 5 --precision f64 --out m.h5",
    "train d.csv --hidden 6 --sweep start=orthogonal,xavier,he --field both --steps 3 --precision "
    "f64 --out m.h5",
    "train d.csv --hidden 6 --free-starts --rollout 3 --time t --trial trial --state q,p --steps 5 "
    "--precision f64 --out m.h5",
    "rollout hnn.h5 --truth spring --x0 0.9,0 --against base.h5 --time 3",
    "rollout base.h5 --truth d.csv --time-column t --state q,p",
    "field hnn.h5 --grid 5",
    "rollout hnn.h5 --x0 3,0 --reverse --time 2 --add-energy .01 --at 1",
    "rollout hnn.h5 --truth spring --starts 3 --time 2 --against base.h5",
    "dump hnn.h5",
};

/* ---- what is stored ---- */

struct entry {
    char run[LINE], key[KEY], value[32];
    bool seen;
};

static struct {
    struct entry *entry;
    size_t n, wrong;
    bool storing;
} stored;

static char path[1024];

static struct entry *add(const char *run, const char *key)
{
    if (stored.n % 256 == 0) {
        stored.entry = realloc(stored.entry, (stored.n + 256) * sizeof *stored.entry);
        assert_non_null(stored.entry);
    }
    struct entry *e = &stored.entry[stored.n++];
    *e = (struct entry){0};
    snprintf(e->run, sizeof e->run, "%s", run);
    snprintf(e->key, sizeof e->key, "%s", key);
    return e;
}

/* Most often the one after that found last. */
static struct entry *find(const char *run, const char *key)
{
    static size_t last;
    for (size_t k = 1; k <= stored.n; k++) {
        struct entry *e = &stored.entry[(last + k) % stored.n];
        if (strcmp(e->key, key) == 0 && strcmp(e->run, run) == 0) {
            last = (size_t)(e - stored.entry);
            return e;
        }
    }
    return NULL;
}

/* A line that is not indented names the run of those after it: key, value. */
static int read_stored(void **state)
{
    char line[LINE], run[LINE] = "", key[KEY], value[32];
    if (shell_setup(state) != 0)
        return -1;
    snprintf(path, sizeof path, "%s/tests/data/reports.txt", getenv("ROOT"));
    stored.storing = getenv("STORE") != NULL;
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = '\0';
        if (*line != ' ')
            snprintf(run, sizeof run, "%s", line);
        else if (sscanf(line, "%127s %31s", key, value) == 2)
            snprintf(add(run, key)->value, sizeof value, "%s", value);
    }
    if (file)
        fclose(file);
    return file || stored.storing ? 0 : -1;
}

static int write_stored(void **state)
{
    const char *run = "";
    FILE *file = stored.storing ? fopen(path, "w") : NULL;
    for (size_t k = 0; file && k < stored.n; k++) {
        const struct entry *e = &stored.entry[k];
        if (!e->seen)
            continue;
        if (strcmp(run, e->run) != 0)
            fprintf(file, "%s\n", run = e->run);
        fprintf(file, "  %s %s\n", e->key, e->value);
    }
    if (file)
        fclose(file);
    free(stored.entry);
    return shell_teardown(state);
}

/* ---- a number against what is stored ---- */

/* Half a unit more than that of the last digit. */
static double known_to(const char *value)
{
    const char *e = strchr(value, 'e');
    const int digits = (int)(e - value) - (*value == '-') - (strchr(value, '.') ? 1 : 0);
    return 1.5 * pow(10, atoi(e + 1) - digits + 1);
}

static bool agrees(const char *value, double x)
{
    if (*value == '<')
        return fabs(x) <= atof(value + 1);
    if (!strchr(value, 'e'))
        return isnan(x) ? strcmp(value, "null") == 0 : x == strtod(value, NULL);
    return fabs(x - atof(value)) <= known_to(value);
}

/* Counts whole, others to the most digits, or to those in which the old value is the same. */
static void keep(struct entry *e, double x)
{
    char text[32];
    const bool count = x == nearbyint(x) && fabs(x) < 1e6;
    if (!*e->value && (count || isnan(x))) {
        snprintf(e->value, sizeof e->value, isnan(x) ? "null" : "%.0f", x);
        return;
    }
    if (*e->value && agrees(e->value, x))
        return;
    if (!*e->value && fabs(x) < rounding) {
        snprintf(e->value, sizeof e->value, "<%.0e", rounding);
        return;
    }
    const double old = atof(e->value + (*e->value == '<'));
    for (int digits = MOST; digits > 0; digits--) {
        snprintf(text, sizeof text, "%.*e", digits - 1, *e->value ? old : x);
        if (*e->value != '<' && agrees(text, x) && (digits > 1 || fabs(x) < 1.5 * fabs(old))) {
            snprintf(e->value, sizeof e->value, "%s", text);
            return;
        }
    }
    snprintf(e->value, sizeof e->value, "<%.0e", 10 * fmax(fabs(x), fabs(old)));
}

static void compare(const char *run, const char *key, double x)
{
    for (size_t k = 0; k < LENGTH(passing); k++)
        if (strstr(key, passing[k]))
            return;
    struct entry *e = find(run, key);
    if (stored.storing)
        keep(e = e ? e : add(run, key), x);
    else if (e && !agrees(e->value, x)) {
        print_error("%s: %s is %.12g, stored as %s\n", run, key, x, e->value);
        stored.wrong++;
    }
    if (e)
        e->seen = true;
}

/* ---- JSON ---- */

static const char *skip_text(const char *at)
{
    for (at++; *at != '"'; at++)
        at += *at == '\\';
    return at + 1;
}

/* The value at `at`; a list of numbers is its length and a sum by weights. */
static const char *value(const char *run, const char *key, const char *at)
{
    char inner[2 * KEY], name[KEY];
    if (*at == '"')
        return skip_text(at);
    if (*at == '{' || *at == '[') {
        const char close = *at == '{' ? '}' : ']';
        double n = 0, sum = 0;
        for (at++; *at != close; at += strspn(at, ", \n"), n++) {
            snprintf(name, sizeof name, "%.0f", n);
            if (close == '}') {
                const char *end = skip_text(at);
                snprintf(name, sizeof name, "%.*s", (int)(end - at - 2), at + 1);
                at = end + strspn(end, ": ");
            }
            snprintf(inner, sizeof inner, "%.60s/%.60s", key, name);
            if (close == ']' && (isdigit((unsigned char)*at) || *at == '-')) {
                char *end;
                sum += (1 + n / 7) * strtod(at, &end);
                at = end;
            } else {
                at = value(run, inner, at);
            }
        }
        snprintf(inner, sizeof inner, "%.100s#", key);
        if (close == ']')
            compare(run, inner, n);
        snprintf(inner, sizeof inner, "%.100s+", key);
        if (close == ']')
            compare(run, inner, sum);
        return at + 1;
    }
    const bool word = isalpha((unsigned char)*at);
    char *end = (char *)(uintptr_t)at + strspn(at, "truefalsn");
    compare(run, key, !word ? strtod(at, &end) : *at == 't' ? 1 : *at == 'f' ? 0 : (double)NAN);
    return end;
}

static void reports_are_as_stored(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(before); k++)
        shell_works("%s", before[k]);
    for (size_t k = 0; k < LENGTH(runs); k++) {
        print_message("%s\n", runs[k]);
        const int status = shell("$LA %s --json", runs[k]);
        const char *json = shell_last_line();
        if (status > 1 || *json != '{')
            fail_msg("%s: status %d: %s%s", runs[k], status, shell_out(), shell_err());
        compare(runs[k], "status", status);
        value(runs[k], "", json);
    }
    for (size_t k = 0; k < stored.n; k++)
        if (!stored.entry[k].seen && !stored.storing) {
            print_error("%s: no %s\n", stored.entry[k].run, stored.entry[k].key);
            stored.wrong++;
        }
    print_message("%zu numbers\n", stored.n);
    assert_int_equal(stored.wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(reports_are_as_stored)};
    return cmocka_run_group_tests(tests, read_stored, write_stored);
}
