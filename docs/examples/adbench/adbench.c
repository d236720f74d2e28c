/* Runs the problems: the time of a gradient (or Jacobian) beside that of a value, and both against
   stored values by complex steps in Python (reference.py), and the derivatives of the mixture and
   of bundle adjustment beside those by hand. Ends with 1 if one is off by more than 1e-10.

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

/* Milliseconds of CPU time: the least of some runs. */
static double least_of(void (*run)(void *), void *what)
{
    double least = INFINITY;
    for (int k = 0; k < 5; k++) {
        double began = now();
        run(what);
        double took = now() - began;
        least = took < least ? took : least;
    }
    return 1e3 * least;
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

static ad_program *compiled(const struct problem *p, size_t n, const ad_var out[])
{
    ad_program *program;
    checked(ad_compile(p->tape, n, out, &program), p, NULL);
    for (size_t k = 0; k < p->n; k++)
        ad_set(program, p->x[k], p->at[k]);
    return program;
}

struct derivative {
    double took, by_hand, error; /* milliseconds; of the entries by hand. NaN: there are none */
    size_t runs;
};

/* Times n derivatives by hand, and compares them with ours, relative to the largest. */
static void compare_by_hand(struct derivative *d, const struct problem *p, const size_t size[3],
                            by_hand *run, size_t n, const double *ours)
{
    struct hand_run h = {run, p, size, numbers(n, 0, 0, 0)};
    double largest = 0, off = 0;
    d->by_hand = least_of(run_by_hand, &h);
    for (size_t e = 0; e < n; e++) {
        largest = fmax(largest, fabs(h.value[e]));
        off = fmax(off, fabs(h.value[e] - ours[e]));
    }
    d->error = off / largest;
    free(h.value);
}

/* The gradient of y into `all`, or of its weighted sum by way of its Jacobian. */
static struct derivative differentiate(const struct problem *p, double *all, const size_t size[3],
                                       by_hand *hand)
{
    struct derivative d = {.by_hand = NAN, .error = 0, .runs = 1};
    if (size_of(p->y) == 1) {
        ad_var g[MOST_INPUTS + 1];
        checked(ad_grad(p->y, p->n, p->x, g), p, NULL);
        g[p->n] = p->y;
        ad_program *program = compiled(p, p->n + 1, g);
        ad_native(program, RUNS, NULL);
        d.took = least_of(run_program, program);
        size_t n = 0;
        for (size_t k = 0; k < p->n; n += size_of(p->x[k++]))
            ad_get(program, g[k], all + n);
        if (hand)
            compare_by_hand(&d, p, size, hand, n, all);
        ad_program_free(program);
        return d;
    }
    ad_jacobian *j;
    checked(ad_jacobian_new(p->y, p->n, p->x, &j), p, NULL);
    for (size_t k = 0; k < p->n; k++)
        ad_set(ad_jacobian_program(j), p->x[k], p->at[k]);
    ad_native(ad_jacobian_program(j), RUNS, NULL);
    d.took = least_of(run_jacobian, j);
    d.runs = ad_jacobian_runs(j);
    const struct ad_sparse *m = ad_jacobian_matrix(j);
    if (hand)
        compare_by_hand(&d, p, size, hand, m->start[m->rows], m->value);
    memset(all, 0, m->cols * sizeof *all);
    for (size_t r = 0; r < m->rows; r++)
        for (size_t e = m->start[r]; e < m->start[r + 1]; e++)
            all[m->col[e]] += number(WEIGHTS, r) * m->value[e];
    ad_jacobian_free(j);
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
    ad_program *value = compiled(&p, 1, &p.y);
    ad_native(value, RUNS, NULL);
    double took = least_of(run_program, value), sum = 0, worst,
           *gradient = malloc(inputs * sizeof *gradient);
    if (!gradient)
        abort();
    const double *y = ad_data(value, p.y);
    for (size_t k = 0; k < outputs; k++)
        sum += outputs == 1 ? y[k] : number(WEIGHTS, k) * y[k];
    worst = error_of(reference, name, "value", sum);
    struct derivative d = differentiate(&p, gradient, size, hand);
    worst = fmax(worst, d.error);
    for (size_t i = 0; i < DIRECTIONS; i++) {
        char what[16];
        snprintf(what, sizeof what, "along %zu", i);
        double error = error_of(reference, name, what, along(&p, i, gradient));
        worst = error > worst ? error : worst;
    }
    printf("%-16s %8zu %8zu %6zu %10.3f %10.3f %8.1f", name, inputs, outputs, d.runs, took, d.took,
           d.took / took);
    if (hand)
        printf(" %10.3f %8.2f", d.by_hand, d.took / d.by_hand);
    else
        printf(" %10s %8s", "", "");
    printf("   %.1e\n", worst);
    ad_program_free(value);
    free(gradient);
    free(p.fixed);
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
        {"gmm d20 K50", adbench_gmm, {20, 50, 1000}, adbench_gmm_by_hand},
        {"ba 1", adbench_ba, {49, 7776, 31843}, adbench_ba_by_hand},
        {"lstm l2 c1024", adbench_lstm, {2, 14, 1024}, NULL},
        {"lstm loop", adbench_lstm_loop, {2, 14, 1024}, NULL},
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
    printf("%-16s %8s %8s %6s %10s %10s %8s %10s %8s   %s\n", "problem", "inputs", "outputs",
           "runs", "value ms", "deriv. ms", "ratio", "by hand", "ratio", "error");
    for (size_t k = 0; k < sizeof problems / sizeof *problems; k++)
        right &=
            run(argv[1], problems[k].name, problems[k].record, problems[k].size, problems[k].hand);
    if (!right)
        fputs("adbench: a value or a derivative is off by more than 1e-10\n", stderr);
    return !right;
}
