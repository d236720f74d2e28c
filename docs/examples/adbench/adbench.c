/* Runs the problems: the time of a gradient (or Jacobian) beside that of a value, of machine code
   beside the interpreter, of compiling, and of derivatives by hand, where there are some; results
   against stored values by complex steps in Python (reference.py). Ends with 1 if one is off by
   more than 1e-10.

       adbench REFERENCE.csv */
#include "adbench.h"

#include <autodiff/derivatives.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---- what the problems share ---- */

static double *numbers(size_t n, uint64_t series, double offset, double scale)
{
    double *v = malloc(n * sizeof *v);
    if (!v)
        abort();
    for (size_t k = 0; k < n; k++)
        v[k] = offset + scale * number(series, k);
    return v;
}

ad_var adbench_input(struct problem *p, size_t rows, size_t cols, uint64_t series, double offset,
                     double scale)
{
    p->at[p->n] = numbers(rows * cols, series, offset, scale);
    return p->x[p->n++] = ad_input(p->tape, rows, cols, NULL);
}

ad_var adbench_constant(struct problem *p, size_t rows, size_t cols, uint64_t series, double offset,
                        double scale)
{
    free(p->fixed);
    p->fixed = numbers(rows * cols, series, offset, scale);
    return ad_const(p->tape, rows, cols, p->fixed);
}

ad_var adbench_rotate(ad_var r, ad_var v)
{
    ad_var angle = ad_sqrt(ad_sum_rows(ad_square(r))), axis = ad_div(r, angle);
    ad_var c = ad_cos(angle), along = ad_sum_rows(ad_mul(axis, v));
    static const uint32_t next[] = {1, 2, 0}, last[] = {2, 0, 1};
    ad_var cross = ad_sub(ad_mul(ad_gather_rows(axis, 3, next), ad_gather_rows(v, 3, last)),
                          ad_mul(ad_gather_rows(axis, 3, last), ad_gather_rows(v, 3, next)));
    return ad_add(ad_add(ad_mul(v, c), ad_mul(cross, ad_sin(angle))),
                  ad_mul(axis, ad_mul(along, ad_sub(1.0, c))));
}

/* ---- measuring ---- */

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* What is timed, in turn with others. */
struct job {
    void (*run)(void *);
    void *what;
    double ms; /* of CPU time, the least of some runs */
};

static void time_in_turn(size_t n, struct job jobs[])
{
    enum { ROUNDS = 5 };
    static const double LEAST_SECONDS = 0.3;
    for (size_t i = 0; i < n; i++)
        jobs[i].ms = INFINITY;
    double began = now();
    for (size_t round = 0; round < ROUNDS || now() < began + LEAST_SECONDS; round++)
        for (size_t i = 0; i < n; i++) {
            double from = now();
            jobs[i].run(jobs[i].what);
            jobs[i].ms = fmin(jobs[i].ms, 1e3 * (now() - from));
        }
}

static void run_program(void *p) { ad_run(p); }
static void run_jacobian(void *j) { ad_jacobian_run(j); }

/* ---- one problem ---- */

enum { RUNS = 1000, DIRECTIONS = 3, FIRST_DIRECTION = 101, WEIGHTS = 100 };

static size_t size_of(ad_var x) { return ad_rows(x) * ad_cols(x); }

/* The derivative along direction i: of y, or of its weighted sum where it is a vector. */
static double along(const struct problem *p, size_t i, const double *gradient)
{
    double s = 0;
    for (size_t k = 0, j = 0; k < p->n; k++)
        for (size_t e = 0; e < size_of(p->x[k]); e++, j++)
            s += gradient[j] * number(FIRST_DIRECTION + i, j);
    return s;
}

/* A gradient, or the entries of a Jacobian, by hand. */
typedef void by_hand(const struct problem *p, const size_t size[3], double *value);

struct hand_run {
    by_hand *run;
    const struct problem *p;
    const size_t *size;
    double *value;
};

static void run_by_hand(void *context)
{
    const struct hand_run *h = context;
    h->run(h->p, h->size, h->value);
}

static void *checked(enum ad_status status, const struct problem *p, void *made)
{
    if (status == AD_OK)
        return made;
    fprintf(stderr, "adbench: %s\n", ad_tape_error(p->tape)->message);
    exit(1);
}

static void set(const struct problem *p, ad_program *program, bool native)
{
    for (size_t k = 0; k < p->n; k++)
        ad_set(program, p->x[k], p->at[k]);
    if (native)
        ad_native(program, RUNS, NULL);
}

static ad_program *compiled(const struct problem *p, size_t n, const ad_var out[], bool native)
{
    ad_program *program;
    checked(ad_compile(p->tape, n, out, &program), p, NULL);
    set(p, program, native);
    return program;
}

struct derivative {
    /* milliseconds: as machine code, interpreted, by hand (NAN: there is none), to compile */
    double took, interpreted, by_hand, compile;
    double error; /* of the entries by hand, relative to the largest */
    size_t runs;
};

/* Times a derivative both ways, and n numbers by hand, which are compared with ours. */
static void time_derivative(struct derivative *d, void (*run)(void *), void *native, void *plain,
                            const struct problem *p, const size_t size[3], by_hand *hand, size_t n,
                            const double *ours)
{
    struct hand_run h = {hand, p, size, numbers(n, 0, 0, 0)};
    struct job jobs[] = {{run, native, 0}, {run, plain, 0}, {run_by_hand, &h, NAN}};
    double largest = 0, off = 0;
    time_in_turn(hand ? 3 : 2, jobs);
    d->took = jobs[0].ms;
    d->interpreted = jobs[1].ms;
    d->by_hand = jobs[2].ms;
    for (size_t e = 0; hand && e < n; e++) {
        largest = fmax(largest, fabs(h.value[e]));
        off = fmax(off, fabs(h.value[e] - ours[e]));
    }
    d->error = hand ? off / largest : 0;
    free(h.value);
}

static struct derivative of_gradient(const struct problem *p, double *all, const size_t size[3],
                                     by_hand *hand)
{
    struct derivative d = {.runs = 1};
    ad_var g[MOST_INPUTS + 1];
    double began = now();
    checked(ad_grad(p->y, p->n, p->x, g), p, NULL);
    g[p->n] = p->y;
    ad_program *plain = compiled(p, p->n + 1, g, false);
    d.compile = 1e3 * (now() - began);
    ad_program *native = compiled(p, p->n + 1, g, true);
    size_t n = 0;
    ad_run(native);
    for (size_t k = 0; k < p->n; n += size_of(p->x[k++]))
        ad_get(native, g[k], all + n);
    time_derivative(&d, run_program, native, plain, p, size, hand, n, all);
    ad_program_free(plain);
    ad_program_free(native);
    return d;
}

/* The gradient of the weighted sum of y into `all`, by way of its Jacobian. */
static struct derivative of_jacobian(const struct problem *p, double *all, const size_t size[3],
                                     by_hand *hand)
{
    struct derivative d = {0};
    ad_jacobian *native, *plain;
    double began = now();
    checked(ad_jacobian_new(p->y, p->n, p->x, &plain), p, NULL);
    d.compile = 1e3 * (now() - began);
    checked(ad_jacobian_new(p->y, p->n, p->x, &native), p, NULL);
    set(p, ad_jacobian_program(plain), false);
    set(p, ad_jacobian_program(native), true);
    d.runs = ad_jacobian_runs(native);
    ad_jacobian_run(native);
    const struct ad_sparse *m = ad_jacobian_matrix(native);
    memset(all, 0, m->cols * sizeof *all);
    for (size_t r = 0; r < m->rows; r++)
        for (size_t e = m->start[r]; e < m->start[r + 1]; e++)
            all[m->col[e]] += number(WEIGHTS, r) * m->value[e];
    time_derivative(&d, run_jacobian, native, plain, p, size, hand, m->start[m->rows], m->value);
    ad_jacobian_free(plain);
    ad_jacobian_free(native);
    return d;
}

/* How far `got` is from the stored value, relative to it and at least to 1e-3. */
static double error_of(const char *file, const char *name, const char *what, double got)
{
    char line[256], of[64], quantity[64];
    name = strcmp(name, "lstm loop") ? name : "lstm l2 c1024"; /* the same, not unrolled */
    double value;
    FILE *f = fopen(file, "r");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "%63[^,],%63[^,],%lf", of, quantity, &value) == 3 && !strcmp(of, name) &&
            !strcmp(quantity, what)) {
            fclose(f);
            return fabs(got - value) / fmax(fabs(value), 1e-3);
        }
    if (f)
        fclose(f);
    return INFINITY;
}

static bool run(const char *reference, const char *name,
                void (*record)(struct problem *p, const size_t size[3]), const size_t size[3],
                by_hand *hand)
{
    struct problem p = {.tape = ad_tape_new(AD_F64)};
    record(&p, size);
    size_t inputs = 0, outputs = size_of(p.y);
    for (size_t k = 0; k < p.n; k++)
        inputs += size_of(p.x[k]);
    ad_program *value = compiled(&p, 1, &p.y, true), *plain = compiled(&p, 1, &p.y, false);
    struct job jobs[] = {{run_program, value, 0}, {run_program, plain, 0}};
    double sum = 0, worst, *gradient = malloc(inputs * sizeof *gradient);
    if (!gradient)
        abort();
    time_in_turn(2, jobs);
    const double *y = ad_data(value, p.y);
    for (size_t k = 0; k < outputs; k++)
        sum += outputs == 1 ? y[k] : number(WEIGHTS, k) * y[k];
    worst = error_of(reference, name, "value", sum);
    struct derivative d = (outputs == 1 ? of_gradient : of_jacobian)(&p, gradient, size, hand);
    worst = fmax(worst, d.error);
    for (size_t i = 0; i < DIRECTIONS; i++) {
        char what[16];
        snprintf(what, sizeof what, "along %zu", i);
        double error = error_of(reference, name, what, along(&p, i, gradient));
        worst = error > worst ? error : worst;
    }
    printf("%-16s %8zu %8zu %6zu %10.3f %10.3f %8.1f %10.1f %8.2f %8.2f", name, inputs, outputs,
           d.runs, jobs[0].ms, d.took, d.took / jobs[0].ms, d.compile, jobs[0].ms / jobs[1].ms,
           d.took / d.interpreted);
    if (hand)
        printf(" %10.3f %8.2f", d.by_hand, d.took / d.by_hand);
    else
        printf(" %10s %8s", "", "");
    printf("   %.1e\n", worst);
    ad_program_free(plain);
    ad_program_free(value);
    free(gradient);
    free(p.fixed);
    free(p.start);
    for (size_t k = 0; k < p.n; k++)
        free(p.at[k]);
    ad_tape_free(p.tape);
    return worst <= 1e-10;
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        void (*record)(struct problem *p, const size_t size[3]);
        size_t size[3];
        by_hand *hand; /* NULL: there is none */
    } problems[] = {
        {"gmm d10 K25", adbench_gmm, {10, 25, 1000}, adbench_gmm_by_hand},
        {"gmm d10 K5 large", adbench_gmm, {10, 5, 100000}, adbench_gmm_by_hand},
        {"gmm d20 K50", adbench_gmm, {20, 50, 1000}, adbench_gmm_by_hand},
        {"ba 1", adbench_ba, {49, 7776, 31843}, adbench_ba_by_hand},
        {"lstm l2 c1024", adbench_lstm, {2, 14, 1024}, NULL},
        {"lstm loop", adbench_lstm_loop, {2, 14, 1024}, adbench_lstm_by_hand},
        {"lstm l2 c65536", adbench_lstm_loop, {2, 14, 65536}, adbench_lstm_by_hand},
        {"hand c100", adbench_hand, {100, false}, NULL},
        {"hand c100000", adbench_hand, {100000, false}, NULL},
        {"hand us c100", adbench_hand, {100, true}, NULL},
        {"hand us c10000", adbench_hand, {10000, true}, NULL},
    };
    bool right = true;
    if (argc != 2) {
        fputs("usage: adbench REFERENCE.csv\n", stderr);
        return 2;
    }
    printf("%-16s %8s %8s %6s %10s %10s %8s %10s %17s %10s %8s   %s\n", "problem", "inputs",
           "outputs", "runs", "value ms", "deriv. ms", "ratio", "compile ms", "/ interpreted",
           "by hand", "ratio", "error");
    for (size_t k = 0; k < sizeof problems / sizeof *problems; k++)
        right &=
            run(argv[1], problems[k].name, problems[k].record, problems[k].size, problems[k].hand);
    if (!right)
        fputs("adbench: a value or a derivative is off by more than 1e-10\n", stderr);
    return !right;
}
