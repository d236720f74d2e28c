/* leastaction chart tape: programs of scalars, LU decomposition and Burgers' equation, recorded
   number by number: CPU time and memory per operation against the number of operations. */
#include "autodiff/free.h"
#include "chart.h"
#include "apps/bench/measure/timing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double step = 1e-5, tolerance = 1e-6;

/* How often a measurement is repeated. */
static const struct effort {
    double most, rounds, seconds; /* operations; recordings, and for how long each is run */
} thorough = {1e7, 5, 0.05}, quick = {1e4, 1, 0.005};

#define NS .shown = 1, .fixed = true
static const struct column columns[] = {
    {.key = "program", .title = "program", .width = -8},
    {.key = "operations", .digits = 9, .title = "operations", .width = 10, .shown = 9},
    {.key = "record_ns", .title = "record (ns)", .width = 11, NS},
    {.key = "gradient_ns", .title = "gradient (ns)", .width = 13, NS},
    {.key = "again_ns", .title = "again (ns)", .width = 10, NS},
    {.key = "compile_ns", .title = "compile (ns)", .width = 12, NS},
    {.key = "replay_ns", .title = "replay (ns)", .width = 11, NS},
    {.key = "bytes", .title = "memory (B)", .width = 10, NS},
    {.key = "error", .digits = 3, .title = "error", .width = 9, .shown = 2},
    {.key = NULL},
};

/* ---- the programs ---- */

struct recorded {
    ad_tape *tape;
    size_t n, operations;
    ad_var *x, y;
    double *values;
    const double **at;
};

/* The logarithm of the determinant of the side x side matrix a, which is overwritten. */
static ad_var lu(size_t side, ad_var a[])
{
    for (size_t k = 0; k < side; k++)
        for (size_t i = k + 1; i < side; i++) {
            ad_var *row = a + i * side;
            row[k] = ad_div(row[k], a[k * side + k]);
            for (size_t j = k + 1; j < side; j++)
                row[j] = ad_sub(row[j], ad_mul(row[k], a[k * side + j]));
        }
    ad_var y = ad_log(a[0]);
    for (size_t k = 1; k < side; k++)
        y = ad_add(y, ad_log(a[k * side + k]));
    return y;
}

/* The next component of the velocity u + i v at a point of the torus. */
static ad_var burgers_point(size_t side, const ad_var *u, const ad_var *v, const ad_var *w,
                            size_t row, size_t col)
{
    size_t at = row * side + col, east = row * side + (col + 1) % side,
           west = row * side + (col + side - 1) % side, north = (row + 1) % side * side + col,
           south = (row + side - 1) % side * side + col;
    ad_var drift =
        ad_add(ad_mul(u[at], ad_sub(w[east], w[west])), ad_mul(v[at], ad_sub(w[north], w[south])));
    ad_var around = ad_add(ad_add(w[east], w[west]), ad_add(w[north], w[south]));
    ad_var spread = ad_sub(around, ad_mul(4.0, w[at]));
    return ad_add(w[at], ad_sub(ad_mul(0.01, spread), ad_mul(0.005, drift)));
}

/* The energy after `side` explicit steps on side x side points. */
static ad_var burgers(size_t side, ad_var now[])
{
    size_t points = side * side;
    ad_var *next = now + 2 * points, *swap;
    for (size_t k = 0; k < side; k++, swap = now, now = next, next = swap)
        for (size_t i = 0; i < 2 * points; i++)
            next[i] = burgers_point(side, now, now + points, now + i / points * points,
                                    i % points / side, i % side);
    ad_var y = ad_square(now[0]);
    for (size_t i = 1; i < 2 * points; i++)
        y = ad_add(y, ad_square(now[i]));
    return y;
}

static const struct scalars {
    const char *name, *title;
    size_t fields, copies; /* inputs and room in units of side^2 */
    double share;          /* operations in units of side^3 */
    double diagonal;       /* of the matrix, in units of side */
    ad_var (*y)(size_t side, ad_var x[]);
} programs[] = {
    {"lu", "LU decomposition", 1, 1, 2.0 / 3, 1, lu},
    {"burgers", "Burgers' equation on a torus", 2, 4, 28, 0, burgers},
};
enum { N_PROGRAMS = sizeof programs / sizeof *programs };

static void release(struct recorded *r)
{
    ad_tape_free(r->tape);
    AD_FREE(r->x, r->values, r->at);
    *r = (struct recorded){0};
}

static enum ad_status record(const struct scalars *s, size_t side, struct recorded *r,
                             struct ad_error *error)
{
    size_t points = side * side, n = s->fields * points;
    r->tape = ad_tape_new(AD_F64);
    r->n = n;
    r->x = malloc((n + s->copies * points) * sizeof *r->x);
    r->values = malloc(2 * n * sizeof *r->values);
    r->at = malloc(n * sizeof *r->at);
    if (!r->tape || !r->x || !r->values || !r->at)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu numbers", n);
    for (size_t i = 0; i < n; i++) {
        r->values[i] = sin((double)(i + 1)) + (i % (side + 1) ? 0 : s->diagonal * (double)side);
        r->at[i] = &r->values[i];
        r->x[i] = ad_input(r->tape, 1, 1, NULL);
    }
    memcpy(r->x + n, r->x, n * sizeof *r->x);
    r->y = s->y(side, r->x + n);
    r->operations = ad_tape_size(r->tape) - n;
    return AD_OK;
}

/* ---- one size ---- */

enum { BATCH = 200000 }; /* operations */
enum { RECORD, FIRST, AGAIN, COMPILE, REPLAY, TIMES };

struct measured {
    double seconds[TIMES]; /* the least of the rounds */
    double bytes, error;
    size_t operations;
};

static void keep_least(struct measured *m, int which, double began, size_t runs)
{
    m->seconds[which] = fmin(m->seconds[which], (processor_seconds() - began) / (double)runs);
}

/* Runs in a batch: a millisecond or more. */
static size_t batch(const struct recorded *r) { return 1 + BATCH / r->operations; }

/* The value of the program where each input k has moved by h cos(k). */
static double value_at(ad_program *p, const struct recorded *r, double h)
{
    for (size_t k = 0; k < r->n; k++)
        ad_set(p, r->x[k], (double[]){r->values[k] + h * cos((double)k)});
    ad_run(p);
    double y = NAN;
    ad_get(p, r->y, &y);
    return y;
}

/* The gradient along the cosines beside the difference of two values, relative to it or 1. */
static double error_of(ad_program *p, const struct recorded *r, const double *gradient)
{
    double along = 0, slope = (value_at(p, r, step) - value_at(p, r, -step)) / (2 * step);
    for (size_t k = 0; k < r->n; k++)
        along += gradient[k] * cos((double)k);
    return fabs(along - slope) / fmax(1, fabs(slope));
}

static enum ad_status measure_gradient(struct recorded *r, double *gradient[], double seconds,
                                       struct measured *m, struct ad_error *error)
{
    double y, began = processor_seconds();
    if (ad_gradient(r->n, r->x, r->at, r->y, &y, gradient, error) != AD_OK)
        return error->status;
    keep_least(m, FIRST, began, 1);
    for (double first = processor_seconds(); began < first + seconds;) {
        began = processor_seconds();
        for (size_t k = 0; k < batch(r); k++)
            ad_gradient(r->n, r->x, r->at, r->y, &y, gradient, error);
        keep_least(m, AGAIN, began, batch(r));
    }
    return error->status;
}

static enum ad_status measure_program(struct recorded *r, double *gradient, double seconds,
                                      struct measured *m, struct ad_error *error)
{
    ad_program *p;
    double began = processor_seconds();
    if (ad_compile(r->tape, 1, &r->y, &p) != AD_OK)
        return *error = *ad_tape_error(r->tape), error->status;
    keep_least(m, COMPILE, began, 1);
    m->error = error_of(p, r, gradient);
    for (double first = processor_seconds(); began < first + seconds;) {
        began = processor_seconds();
        for (size_t k = 0; k < batch(r); k++)
            ad_run(p);
        keep_least(m, REPLAY, began, batch(r));
    }
    ad_program_free(p);
    return AD_OK;
}

static enum ad_status measure_round(const struct scalars *s, size_t side, double seconds,
                                    struct measured *m, struct ad_error *error)
{
    struct recorded r = {0};
    double began = processor_seconds();
    double *gradient = NULL, **into = NULL;
    if (record(s, side, &r, error) == AD_OK) {
        keep_least(m, RECORD, began, 1);
        gradient = &r.values[r.n];
        into = malloc(r.n * sizeof *into);
        for (size_t k = 0; into && k < r.n; k++)
            into[k] = gradient + k;
        if (!into)
            ad_fail(error, AD_E_MEMORY, "out of memory for %zu numbers", r.n);
    }
    if (error->status == AD_OK && measure_gradient(&r, into, seconds, m, error) == AD_OK) {
        m->operations = r.operations;
        m->bytes = (double)ad_tape_bytes(r.tape);
        measure_program(&r, gradient, seconds, m, error);
    }
    free(into);
    release(&r);
    return error->status;
}

static enum ad_status measure(const struct scalars *s, double wanted, const struct effort *effort,
                              struct sheet *sheet, struct ad_error *error)
{
    size_t side = (size_t)lround(cbrt(wanted / s->share));
    struct measured m = {.seconds = {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY}};
    for (double round = 0; round < fmin(effort->rounds, 1e6 / wanted) && error->status == AD_OK;
         round++)
        measure_round(s, side, effort->seconds, &m, error);
    double n = (double)m.operations, ns = 1e9 / n;
    return sheet_row(sheet,
                     ROW(NAME(s->name), NUMBER(n), NUMBER(ns * m.seconds[RECORD]),
                         NUMBER(ns * m.seconds[FIRST]), NUMBER(ns * m.seconds[AGAIN]),
                         NUMBER(ns * m.seconds[COMPILE]), NUMBER(ns * m.seconds[REPLAY]),
                         NUMBER(m.bytes / n), NUMBER(m.error)),
                     error);
}

/* ---- the picture: nanoseconds per operation against operations; level means linear ---- */

static void draw(const struct sheet *sheet, struct plot *plot)
{
    static const struct {
        const char *column, *title, *colour;
    } curves[] = {{"record_ns", "record", "#0072b2"},
                  {"gradient_ns", "first gradient", "#b8261b"},
                  {"again_ns", "gradient again", "#f2b134"},
                  {"compile_ns", "compile", "#555555"},
                  {"replay_ns", "compiled value", "#009e73"}};
    struct figure figure;
    struct layout layout = figure_pair;
    layout.title = "Cost of an operation of the tape";
    figure_begin(&figure, plot, &layout);
    for (size_t s = 0; s < N_PROGRAMS; s++) {
        figure_panel(&figure, &(struct panel){.title = programs[s].title,
                                              .x = "operations",
                                              .y = s ? NULL : "CPU time per operation (ns)",
                                              .log = "xy",
                                              .y_range = "[1:1000]",
                                              .key = s ? NULL : KEY_BESIDE});
        for (size_t c = 0; c < sizeof curves / sizeof *curves; c++)
            figure_curve(&figure, sheet, "operations", curves[c].column, curves[c].title,
                         STYLE(curves[c].colour, 7, 2, 0.6), "program", programs[s].name);
    }
    figure_end(&figure);
}

enum ad_status chart_tape(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "tape", columns, error);
    struct plot *plot = chart_picture(chart, "tape", error);
    const struct effort *effort = chart->quick ? &quick : &thorough;
    for (size_t s = 0; s < N_PROGRAMS; s++)
        for (double n = 1e3; n < 1.1 * effort->most && error->status == AD_OK; n *= 10)
            measure(&programs[s], n, effort, sheet, error);
    for (size_t r = 0; r < sheet->rows && error->status == AD_OK; r++)
        if (!(sheet_number(sheet, r, "error") <= tolerance))
            chart->missed = "a gradient differs from the difference of two values";
    if (error->status == AD_OK)
        draw(sheet, plot);
    return error->status;
}
