/* Compares gradients on the tape with central differences extrapolated to step zero. C. J. F.
   Ridders, "Accurate computation of F'(x) and F'(x)F''(x)", Adv. Eng. Softw. 4 (1982) 75: the error
   of a central difference is a series in h^2, so each row of Neville's scheme on halved steps
   removes one order, and neighbouring entries of the table show where rounding dominates. */
#include "autodiff/ascending.h"
#include "internal.h"
#include "ascending.h"

#include <math.h>
#include <stdlib.h>

enum {
    LEVELS = 8,    /* steps h, h/2, ... h/128 */
    NEAR_KINK = 16 /* kinks are looked for within h/16 */
};

static double central_difference(const struct ad_section *p, double h)
{
    double lo = *p->x - h, hi = *p->x + h;
    double y_lo = ad_section_value(p, lo), y_hi = ad_section_value(p, hi);
    return (y_hi - y_lo) / (hi - lo);
}

/* The entry of Neville's table with the smallest estimated error: truncation plus `noise`, the
   rounding of y, divided by the step, which is stored in *rounding. Stops at `good_enough`. */
static double extrapolate(const struct ad_section *p, double h, double good_enough, double noise,
                          double *rounding)
{
    double above[LEVELS], best = NAN, best_error = INFINITY;
    for (int k = 0; k < LEVELS && !(best_error <= good_enough); k++, h *= 0.5) {
        double left = central_difference(p, h), power = 1;
        double rounded = fmax(0x1p-50 * fabs(*p->y), noise) / h;
        if (k == 0)
            best = left, *rounding = rounded;
        for (int j = 0; j < k; j++) {
            power *= 4;
            double next = left + (left - above[j]) / (power - 1);
            double error = fmax(fabs(next - left), fabs(next - above[j])) + rounded;
            above[j] = left;
            left = next;
            if (error < best_error) {
                best_error = error;
                best = next;
                *rounding = rounded;
            }
        }
        above[k] = left;
    }
    return best;
}

/* Near a pole or a kink the differences may converge to a wrong value; those that disagree with the
   tape are computed again with smaller steps. */
static double nearest(const struct ad_section *p, double h, double tape, double tolerance)
{
    double good_enough = 1e-3 * tolerance, rounding;
    double far = extrapolate(p, h, good_enough, 0, &rounding);
    if (fabs(far - tape) <= tolerance)
        return far;
    double near = extrapolate(p, h / (1 << LEVELS), good_enough, 0, &rounding);
    return fabs(near - tape) < fabs(far - tape) ? near : far;
}

/* The rounding of y: the median of second differences over steps that leave nothing of a smooth
   function, and two of a jump (J. J. More, S. M. Wild, "Estimating computational noise", SIAM J.
   Sci. Comput. 33 (2011) 1292). */
static double noise_of(const struct ad_section *p, double h)
{
    enum { SECONDS = 7 };
    double y[SECONDS + 2];
    for (int k = 0; k < SECONDS + 2; k++)
        y[k] = ad_section_value(p, *p->x + h * 0x1p-20 * (k - SECONDS / 2 - 1));
    for (int k = 0; k < SECONDS; k++)
        y[k] = fabs(y[k] - 2 * y[k + 1] + y[k + 2]);
    qsort(y, SECONDS, sizeof *y, ad_ascending);
    return y[SECONDS / 2];
}

/* Whether terms of y cancel, and the tape's slope is within the rounding of the differences. */
static bool hidden(const struct ad_section *p, double h, double tape)
{
    double noise = noise_of(p, h), rounding;
    if (!(noise > 0x1p-46 * fabs(*p->y)))
        return false;
    double slope = extrapolate(p, h, 0, noise, &rounding);
    return fabs(slope - tape) <= 8 * rounding;
}

static double largest(size_t n, const double *a)
{
    double max = 0;
    for (size_t i = 0; i < n; i++)
        max = fmax(max, fabs(a[i]));
    return max;
}

struct comparison {
    ad_program *value, *gradient;
    const double *y;
    double tolerance;
    size_t entries;
    struct ad_check *report;
};

static void note(struct ad_check *r, double error, size_t input, size_t row, size_t col,
                 double tape, double difference, bool kink, bool cancels)
{
    r->entries++;
    if (r->entries > 1 && (kink < r->kink || (kink == r->kink && error <= r->worst)))
        return;
    r->worst = error;
    r->input = input;
    r->row = row;
    r->col = col;
    r->tape = tape;
    r->difference = difference;
    r->kink = kink;
    r->cancels = cancels;
}

/* The scale of the errors has a lower bound: differences cannot resolve slopes below the rounding
   of y. The first step is a fraction of the entry, or of its neighbours where the entry is near
   zero. */
static void compare_input(const struct comparison *c, size_t k, ad_var x, ad_var g,
                          const double *at)
{
    size_t cols = ad_cols(x), size = ad_rows(x) * cols;
    size_t count = c->entries && c->entries < size ? c->entries : size;
    const double *tape = ad_data(c->gradient, g);
    double *data = ad_data(c->value, x); /* NULL: y does not depend on x */
    double range = largest(size, at);
    if (range == 0)
        range = 1;
    double scale = largest(size, tape) + 0x1p-20 * fabs(*c->y) / range + 0x1p-1000;
    for (size_t e = 0; e < count; e++) {
        size_t i = e * size / count;
        double h = 0x1p-6 * fmax(fabs(at[i]), 0x1p-2 * range), difference = 0, mean;
        bool kink = false;
        if (data) {
            struct ad_section section = {c->value, c->y, data + i};
            difference = nearest(&section, h, tape[i], c->tolerance * scale);
            kink = ad_kink_near(&section, h / NEAR_KINK, c->tolerance * scale, &mean);
            difference = kink ? mean : difference;
        }
        double error = fabs(tape[i] - difference) / scale;
        bool cancels = data && !kink && isfinite(error) && error > c->tolerance &&
                       hidden(&(struct ad_section){c->value, c->y, data + i}, h, tape[i]);
        if (cancels)
            error = c->tolerance; /* as much as can be said */
        if (!isfinite(tape[i]) || !isfinite(error))
            error = INFINITY;
        note(c->report, error, k, i / cols, i % cols, tape[i], difference, kink, cancels);
    }
}

static enum ad_status compile_and_set(struct comparison *c, ad_var y, size_t n, const ad_var x[],
                                      const double *const at[], const ad_var g[])
{
    ad_tape *tape = y.tape;
    if (ad_compile(tape, 1, &y, &c->value) || ad_compile(tape, n, g, &c->gradient))
        return tape->error.status;
    for (size_t k = 0; k < n; k++)
        if (ad_set(c->value, x[k], at[k]) || ad_set(c->gradient, x[k], at[k]))
            return ad_fail(&tape->error, AD_E_TAPE, "check: x[%zu] is not an input of the tape", k);
    return AD_OK;
}

static bool can_check(ad_var y, size_t n, const ad_var x[], const double *const at[],
                      struct ad_check *report)
{
    ad_var none;
    if (report)
        *report = (struct ad_check){0};
    if (!ad_operands(AD_COMPOSITE_check, 1, &y, &none))
        return false;
    bool given = report && (!n || (x && at));
    for (size_t k = 0; given && k < n; k++)
        given = at[k] != NULL;
    if (!given)
        ad_refuse(y.tape, AD_E_ARGUMENT, "check: got no inputs, values or report (NULL)");
    return given;
}

enum ad_status ad_check_gradient(ad_var y, size_t n, const ad_var x[], const double *const at[],
                                 double tolerance, size_t entries, struct ad_check *report)
{
    ad_tape *tape = y.tape;
    if (!can_check(y, n, x, at, report))
        return tape ? tape->error.status : AD_E_TAPE;
    if (tape->type != AD_F64)
        return ad_fail(&tape->error, AD_E_ARGUMENT, "check: differences need a tape of type f64");
    if (ad_rows(y) != 1 || ad_cols(y) != 1)
        return ad_fail(&tape->error, AD_E_SHAPE, "check: y is %zux%zu, a scalar (1x1) is needed",
                       ad_rows(y), ad_cols(y));
    ad_var *g = calloc(n + !n, sizeof *g);
    if (!g)
        return ad_fail(&tape->error, AD_E_MEMORY, "check: out of memory");
    struct comparison c = {.tolerance = tolerance, .entries = entries, .report = report};
    enum ad_status status = ad_grad(y, n, x, g);
    if (status == AD_OK)
        status = compile_and_set(&c, y, n, x, at, g);
    if (status == AD_OK) {
        c.y = ad_data(c.value, y);
        ad_run(c.value);
        ad_run(c.gradient);
        for (size_t k = 0; k < n; k++)
            compare_input(&c, k, x[k], g[k], at[k]);
        report->passed = report->worst <= tolerance && !report->kink;
    }
    ad_program_free(c.value);
    ad_program_free(c.gradient);
    free(g);
    return status;
}

/* Sum of g*u for an irregular u in [0.5, 1.5): squares times the golden ratio, modulo 1. */
static ad_var irregular_dot(ad_var g, size_t *position)
{
    size_t rows = ad_rows(g), cols = ad_cols(g);
    double *u = calloc(rows * cols, sizeof *u);
    if (!u) {
        ad_fail(&g.tape->error, AD_E_MEMORY, "check: out of memory");
        return g;
    }
    for (size_t i = 0; i < rows * cols; i++) {
        double k = (double)++*position;
        u[i] = 0.5 + fmod(0.61803398874989485 * k * k, 1);
    }
    ad_var dot = ad_dot(g, ad_const(g.tape, rows, cols, u));
    free(u);
    return dot;
}

enum ad_status ad_check_second(ad_var y, size_t n, const ad_var x[], const double *const at[],
                               double tolerance, size_t entries, struct ad_check *report)
{
    ad_tape *tape = y.tape;
    if (!can_check(y, n, x, at, report))
        return tape ? tape->error.status : AD_E_TAPE;
    ad_var *g = calloc(n + !n, sizeof *g);
    if (!g)
        return ad_fail(&tape->error, AD_E_MEMORY, "check: out of memory");
    size_t position = 0;
    enum ad_status status = ad_grad(y, n, x, g);
    ad_var slope = ad_scalar(tape, 0);
    for (size_t k = 0; k < n && status == AD_OK; k++)
        slope = ad_add(slope, irregular_dot(g[k], &position));
    free(g);
    if (status == AD_OK)
        status = tape->error.status;
    if (status != AD_OK)
        return status;
    return ad_check_gradient(slope, n, x, at, tolerance, entries, report);
}
