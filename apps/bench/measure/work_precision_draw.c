/* The picture of work-precision curves (work_precision.h). */
#include "work_precision.h"

#include <math.h>
#include <string.h>

enum { FIRST_DECADE = 1, LAST_DECADE = 13 }; /* errors 10^-k */

/* A method less than this factor slower than the fastest stays in the strip. */
static const double a_tie = 0.15;

/* Shades of one hue are one family, which the legend names; `brief` fits in the strip. */
static const struct work_family {
    const char *title, *colour;
    int mark;
    bool dashed;
} families[] = {
    {"taylor", "#1a1a1a", 11, false},
    {"dopri5, dop853", "#d55e00", 9, false},
    {"rk4", "#e69f00", 7, false},
    {"verlet, yoshida4, 6", "#0072b2", 5, false},
    {"euler, semi-implicit", "#6b6b6b", 2, false},
    {"gauss1 to gauss5", "#009e73", 9, true},
    {"variational", "#cc79a7", 8, true},
};

enum { TAYLOR, DORMAND_PRINCE, RUNGE_KUTTA, SPLITTING, EULER, GAUSS, VARIATIONAL, N_FAMILIES };

static const struct work_style {
    const char *name, *brief, *colour;
    int mark, family;
} styles[] = {
    {"euler", "Euler", "#9a9a9a", 1, EULER},
    {"semi-implicit", "s.-i.", "#6b6b6b", 2, EULER},
    {"verlet", "Verlet", "#8fc7e8", 7, SPLITTING},
    {"velocity-verlet", "v.-V.", "#56b4e9", 6, SPLITTING},
    {"wisdom-holman", "W.-H.", "#2b8cbe", 11, SPLITTING},
    {"wisdom-holman-corrected", "W.-H.-c.", "#1d6a96", 13, SPLITTING},
    {"yoshida4", "Y4", "#0072b2", 5, SPLITTING},
    {"yoshida6", "Y6", "#004a75", 9, SPLITTING},
    {"rk4", "RK4", "#e69f00", 7, RUNGE_KUTTA},
    {"dopri5", "DP5", "#ee8a45", 5, DORMAND_PRINCE},
    {"dop853", "DP853", "#d55e00", 9, DORMAND_PRINCE},
    {"taylor", "Taylor", "#1a1a1a", 11, TAYLOR},
    {"implicit-midpoint", "G1", "#8fd3bd", 7, GAUSS},
    {"gauss2", "G2", "#5fc2a3", 5, GAUSS},
    {"gauss3", "G3", "#2fb088", 9, GAUSS},
    {"gauss4", "G4", "#009e73", 11, GAUSS},
    {"gauss5", "G5", "#006a4d", 13, GAUSS},
    {"variational-left", "v.-l.", "#e8bfd4", 4, VARIATIONAL},
    {"variational-midpoint", "v.-m.", "#dda5c2", 6, VARIATIONAL},
    {"variational-trapezoid", "v.-t.", "#d48fb4", 8, VARIATIONAL},
    {"variational-gauss2", "v.-G2", "#cc79a7", 10, VARIATIONAL},
    {"variational-gauss3", "v.-G3", "#a8578a", 12, VARIATIONAL},
    {"variational-gauss4", "v.-G4", "#7d3364", 14, VARIATIONAL},
};

enum { N_STYLES = sizeof styles / sizeof *styles };

static struct work_style work_style_of(const char *name)
{
    for (size_t k = 0; k < N_STYLES; k++)
        if (strcmp(styles[k].name, name) == 0)
            return styles[k];
    return (struct work_style){name, name, "#000000", 3, VARIATIONAL};
}

static struct style line_of(const char *colour, int mark, bool dashed, double width, double size)
{
    return (struct style){.colour = colour,
                          .mark = mark,
                          .width = width,
                          .size = size,
                          .dash = dashed ? "(8,3)" : NULL};
}

void work_legend(struct figure *figure, size_t n, const struct work_curve curves[])
{
    for (int f = 0; f < N_FAMILIES; f++) {
        const struct style style =
            line_of(families[f].colour, families[f].mark, families[f].dashed, 1.5, 0.6);
        bool there = false;
        for (size_t c = 0; c < n; c++)
            there = there || (curves[c].n && work_style_of(curves[c].name).family == f);
        if (there)
            figure_draw(figure, &style, families[f].title, "NaN");
    }
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
                        double width, double size)
{
    struct work_style s = work_style_of(curve->name);
    const struct style style = line_of(s.colour, s.mark, families[s.family].dashed, width, size);
    figure_draw(figure, &style, NULL, "data index %zu using %s", figure->blocks++, columns);
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

/* Whether a name fits a box of this many decades, 33 pixels each. */
static bool fits(const char *name, int decades)
{
    return 6.5 * (double)strlen(name) < 33 * decades;
}

/* Decade k spans the errors around 10^-k; neighbours with one winner share a box. */
static void strip(size_t n, const struct work_curve curves[], const struct decades *d, FILE *out)
{
    int object = 11; /* the labels 1 and 2 are the title */
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
        bool whole = fits(name, next - k);
        fprintf(out,
                "set label %d '%s' at first 10**(-%g), graph 0.036 center textcolor rgb "
                "'white' font ',%d' front noenhanced\n",
                object, whole ? name : style.brief, 0.5 * (k + next - 1), whole ? 11 : 9);
        object++;
    }
}

/* ---- panels ---- */

static void curve_elements(struct figure *figure, size_t n, const struct work_curve curves[],
                           const struct decades *d, const char *columns, bool titles)
{
    for (size_t c = 0; c < n; c++) {
        bool best = wins(d, c);
        work_curve_element(figure, &curves[c], columns, best ? 3 : 1.5, best ? 0.9 : 0.6);
    }
    if (titles)
        work_legend(figure, n, curves);
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
    const struct layout layout = {.width = 1120,
                                  .height = 560,
                                  .title = title,
                                  .found = "strip: the fastest method to reach each error, drawn "
                                           "thick; darker shades are of higher order",
                                  .columns = 2,
                                  .room = {0.07, 0.81, 0.11, 0.85}};
    struct decades d = fastest(n, curves);
    struct figure figure;
    char seconds[48], evaluations[48];
    y_axis(n, curves, true, 0.11, seconds);
    y_axis(n, curves, false, 0, evaluations);
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure,
                 &(struct panel){.title = "CPU time",
                                 .x = "relative error at the end",
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
    figure_panel(&figure,
                 &(struct panel){.title = "field evaluations",
                                 .x = "relative error at the end",
                                 .log = "xy",
                                 .x_range = "[0.5:1e-14]",
                                 .x_tics = "('10^{-3}' 1e-3, '10^{-6}' 1e-6, '10^{-9}' 1e-9, "
                                           "'10^{-12}' 1e-12)",
                                 .y_range = evaluations,
                                 .key = "at screen 0.82, screen 0.85 left top Left reverse samplen "
                                        "2.5 spacing 1.25",
                                 .more = "set lmargin at screen 0.555\n"});
    curve_elements(&figure, n, curves, &d, "1:3", true);
    figure_end(&figure);
}
