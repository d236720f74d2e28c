/* The picture of work-precision curves (work_precision.h). */
#include "work_precision.h"

#include <math.h>
#include <string.h>

enum { FIRST_DECADE = 1, LAST_DECADE = 13 }; /* errors 10^-k */

/* A method less than this factor slower than the fastest stays in the strip. */
static const double a_tie = 0.15;

static const struct work_style {
    const char *name, *colour;
    int mark;
    bool dashed;
} styles[] = {
    {"euler", "#9a9a9a", 1, false},
    {"semi-implicit", "#6b6b6b", 2, false},
    {"verlet", "#8fc7e8", 7, false},
    {"velocity-verlet", "#62acd8", 6, false},
    {"yoshida4", "#3c8dc5", 5, false},
    {"yoshida6", "#0b4f8a", 9, false},
    {"rk4", "#f2b134", 7, false},
    {"dopri5", "#e8743b", 5, false},
    {"dop853", "#b8261b", 9, false},
    {"taylor", "#1a1a1a", 11, false},
    {"implicit-midpoint", "#b9dba0", 7, true},
    {"gauss2", "#84bf63", 5, true},
    {"gauss3", "#4e9a37", 9, true},
    {"gauss4", "#2c7327", 11, true},
    {"gauss5", "#134a16", 13, true},
    {"variational-left", "#d9a3cf", 4, true},
    {"variational-midpoint", "#c77dbb", 6, true},
    {"variational-trapezoid", "#b05aa3", 8, true},
    {"variational-gauss2", "#94408c", 10, true},
    {"variational-gauss3", "#722a72", 12, true},
    {"variational-gauss4", "#4d1654", 14, true},
};

enum { N_STYLES = sizeof styles / sizeof *styles };

static struct work_style work_style_of(const char *name)
{
    for (size_t k = 0; k < N_STYLES; k++)
        if (strcmp(styles[k].name, name) == 0)
            return styles[k];
    return (struct work_style){name, "#000000", 3, true};
}

/* ---- data: a block a curve, `error seconds evaluations` ---- */

static void write_curve(const struct work_curve *curve, FILE *out)
{
    double best = INFINITY;
    fprintf(out, "# %s: error, seconds, evaluations\n", curve->name);
    for (size_t k = 0; k < curve->n; k++) {
        const struct work_point *p = &curve->point[k];
        if (!(p->error < best))
            continue;
        best = p->error;
        fprintf(out, "%.6g %.6g %.6g\n", p->error, p->seconds, p->evaluations);
    }
    if (curve->n == 0) /* gnuplot counts blocks that are there */
        fputs("NaN NaN NaN\n", out);
    fputs("\n\n", out);
}

void work_curve_element(struct figure *figure, const struct work_curve *curve, const char *columns,
                        double width, double size, const char *title)
{
    struct work_style s = work_style_of(curve->name);
    figure_draw(
        figure,
        &(const struct style){s.colour, s.mark, width, size, s.dashed ? "(8,3)" : NULL, NULL},
        title, "data index %zu using %s", figure->blocks++, columns);
    write_curve(curve, figure->plot->data);
}

/* ---- the strip that names the fastest ---- */

struct decades {
    size_t best[LAST_DECADE + 1]; /* of errors 10^-k; n: none */
};

static struct decades fastest(size_t n, const struct work_curve curves[])
{
    struct decades d;
    struct work_point at, incumbent;
    for (int k = 0; k <= LAST_DECADE; k++) {
        d.best[k] = work_best(n, curves, pow(10, -k), &at);
        size_t last = k > FIRST_DECADE ? d.best[k - 1] : n;
        if (last < n && work_at(&curves[last], pow(10, -k), &incumbent) &&
            incumbent.seconds < (1 + a_tie) * at.seconds)
            d.best[k] = last;
    }
    return d;
}

static bool wins(const struct decades *d, size_t curve)
{
    for (int k = FIRST_DECADE; k <= LAST_DECADE; k++)
        if (d->best[k] == curve)
            return true;
    return false;
}

/* Font size of a name in a box of this many decades, 35 pixels each; 0: none is small enough, and
   the legend has it in bold. */
static int font_of(const char *name, int decades)
{
    static const int fonts[] = {12, 9};
    for (size_t f = 0; f < sizeof fonts / sizeof *fonts; f++)
        if (0.6 * fonts[f] * (double)strlen(name) < 35 * decades)
            return fonts[f];
    return 0;
}

/* Decade k spans the errors around 10^-k; neighbours with one winner share a box. */
static void strip(size_t n, const struct work_curve curves[], const struct decades *d, FILE *out)
{
    int object = 1;
    for (int k = FIRST_DECADE, next; k <= LAST_DECADE; k = next) {
        for (next = k; next <= LAST_DECADE && d->best[next] == d->best[k];)
            next++;
        if (d->best[k] == n)
            continue;
        const char *name = curves[d->best[k]].name;
        struct work_style style = work_style_of(name);
        fprintf(out,
                "set object %d rectangle from first 1e-%d*sqrt(10), graph 0 to first "
                "1e-%d*sqrt(10), graph 0.075 fs solid noborder fc rgb '%s' front\n",
                object, k, next, style.colour);
        int font = font_of(name, next - k);
        if (font)
            fprintf(out,
                    "set label %d '%s' at first 10**(-%g), graph 0.036 center textcolor rgb "
                    "'white' font ',%d' front\n",
                    object, name, 0.5 * (k + next - 1), font);
        object++;
    }
}

/* ---- panels ---- */

static void curve_elements(struct figure *figure, size_t n, const struct work_curve curves[],
                           const struct decades *d, const char *columns, bool titles)
{
    for (size_t c = 0; c < n; c++) {
        char bold[64];
        bool best = wins(d, c);
        snprintf(bold, sizeof bold, best ? "{/:Bold %s}" : "%s", curves[c].name);
        work_curve_element(figure, &curves[c], columns, best ? 3 : 1.5, best ? 0.9 : 0.6,
                           titles ? bold : NULL);
    }
    figure_element(figure, "NaN notitle");
}

/* `room`: a share of the height, below all curves. */
static void y_axis(size_t n, const struct work_curve curves[], bool seconds, double room,
                   char range[48])
{
    double low = INFINITY, high = 0;
    for (size_t c = 0; c < n; c++)
        for (const struct work_point *p = curves[c].point; p < curves[c].point + curves[c].n; p++) {
            double y = seconds ? p->seconds : p->evaluations;
            low = p->error < 0.3 ? fmin(low, y) : low;
            high = fmax(high, y);
        }
    low = (isfinite(low) ? low : 1) / 1.3;
    high = (high > 0 ? high : 2) * 1.3;
    snprintf(range, 48, "[%.3g:%.3g]", low * pow(high / low, -room / (1 - room)), high);
}

static void doubtful(double doubt, FILE *out)
{
    if (doubt > 1e-14)
        fprintf(out,
                "set object 90 rectangle from first %.3g, graph 0 to first 1e-14, graph 1 "
                "fs transparent solid 0.25 noborder fc rgb '#aaaaaa' behind\n"
                "set label 90 'beyond the reference' at first %.3g, graph 0.97 right rotate by 90 "
                "font ',9' textcolor rgb '#777777'\n",
                doubt, sqrt(doubt * 1e-14));
}

void work_draw(const char *title, size_t n, const struct work_curve curves[], double doubt,
               struct plot *plot)
{
    static const struct layout layout = {.width = 1120,
                                         .height = 540,
                                         .rows = 1,
                                         .columns = 2,
                                         .left = 0.07,
                                         .right = 0.79,
                                         .bottom = 0.11,
                                         .top = 0.92};
    struct decades d = fastest(n, curves);
    struct figure figure;
    char seconds[48], evaluations[48];
    y_axis(n, curves, true, 0.11, seconds);
    y_axis(n, curves, false, 0, evaluations);
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure,
                 &(struct panel){.title = title,
                                 .x = "error at the end, relative",
                                 .y = "CPU time (s)",
                                 .log = "xy",
                                 .x_range = "[0.5:1e-14]",
                                 .x_tics = "('10^{-1}' 1e-1, '10^{-3}' 1e-3, '10^{-5}' 1e-5, "
                                           "'10^{-7}' 1e-7, '10^{-9}' 1e-9, '10^{-11}' 1e-11, "
                                           "'10^{-13}' 1e-13)",
                                 .y_range = seconds,
                                 .more = "set rmargin at screen 0.5\n"});
    doubtful(doubt, plot->script);
    strip(n, curves, &d, plot->script);
    curve_elements(&figure, n, curves, &d, "1:2", false);
    figure_panel(&figure, &(struct panel){
                              .title = "field evaluations",
                              .x = "error at the end, relative",
                              .log = "xy",
                              .x_range = "[0.5:1e-14]",
                              .x_tics = "('10^{-3}' 1e-3, '10^{-6}' 1e-6, '10^{-9}' 1e-9, "
                                        "'10^{-12}' 1e-12)",
                              .y_range = evaluations,
                              .key = "at screen 0.995, screen 0.93 right top Left reverse samplen "
                                     "2.5 spacing 1.25 font ',11'",
                              .more = "set lmargin at screen 0.555\n"});
    curve_elements(&figure, n, curves, &d, "1:3", true);
    figure_end(&figure);
}
