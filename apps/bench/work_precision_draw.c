/* The picture of work against accuracy (work.h). */
#include "work_precision.h"

#include <math.h>
#include <string.h>

enum { FIRST_DECADE = 1, LAST_DECADE = 13 }; /* errors 10^-k */

/* What is this little slower than the fastest stays in the strip, for a change has to be worth it.
 */
static const double a_tie = 0.15;

static const struct work_style styles[] = {
    {"euler", "#9a9a9a", 1, false},
    {"semi-implicit", "#6b6b6b", 2, false},
    {"verlet", "#8fc7e8", 7, false},
    {"velocity-verlet", "#62acd8", 6, false},
    {"yoshida4", "#3c8dc5", 5, false},
    {"yoshida6", "#0b4f8a", 9, false},
    {"rk4", "#f2b134", 7, false},
    {"dopri5", "#e8743b", 5, false},
    {"dop853", "#b8261b", 9, false},
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

struct work_style work_style_of(const char *name)
{
    for (size_t k = 0; k < N_STYLES; k++)
        if (strcmp(styles[k].name, name) == 0)
            return styles[k];
    return (struct work_style){name, "#000000", 3, true};
}

/* ---- data: a block a curve, `error seconds evaluations` ---- */

void work_write_curve(const struct work_curve *curve, FILE *out)
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

/* Of a name in a box of so many decades, 35 pixels each; 0: none is small enough, and the legend
   has it in bold. */
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

static void curve_elements(size_t n, const struct work_curve curves[], const struct decades *d,
                           int column, bool titles, FILE *out)
{
    fputs("plot ", out);
    for (size_t c = 0; c < n; c++) {
        struct work_style s = work_style_of(curves[c].name);
        bool best = wins(d, c);
        fprintf(out,
                "data index %zu using 1:%d with linespoints lw %g dt %s pt %d ps %g lc rgb '%s' ",
                c, column, best ? 3 : 1.5, s.dashed ? "(8,3)" : "1", s.mark, best ? 0.9 : 0.6,
                s.colour);
        if (titles)
            fprintf(out, "title '%s%s%s', \\\n    ", best ? "{/:Bold " : "", s.name,
                    best ? "}" : "");
        else
            fputs("notitle, \\\n    ", out);
    }
    fputs("NaN notitle\n", out);
}

static double least(size_t n, const struct work_curve curves[], bool seconds)
{
    double low = INFINITY;
    for (size_t c = 0; c < n; c++)
        for (size_t k = 0; k < curves[c].n; k++)
            if (curves[c].point[k].error < 0.3)
                low = fmin(low,
                           seconds ? curves[c].point[k].seconds : curves[c].point[k].evaluations);
    return isfinite(low) ? low : 1;
}

static double greatest(size_t n, const struct work_curve curves[], bool seconds)
{
    double high = 0;
    for (size_t c = 0; c < n; c++)
        for (size_t k = 0; k < curves[c].n; k++)
            high =
                fmax(high, seconds ? curves[c].point[k].seconds : curves[c].point[k].evaluations);
    return high > 0 ? high : 2;
}

/* `room`: a share of the height, below all curves. */
static void y_axis(size_t n, const struct work_curve curves[], bool seconds, double room, FILE *out)
{
    double low = least(n, curves, seconds) / 1.3, high = greatest(n, curves, seconds) * 1.3;
    fprintf(out, "set yrange [%.3g:%.3g]\n", low * pow(high / low, -room / (1 - room)), high);
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
    FILE *out = plot->script;
    struct decades d = fastest(n, curves);
    plot->width = 1120;
    plot->height = 540;
    for (size_t c = 0; c < n; c++)
        work_write_curve(&curves[c], plot->data);
    fputs("set multiplot\nset title '", out);
    fprintf(out,
            "%s' font ',15' offset 0,0.3\nset logscale xy\nset xrange [0.5:1e-14]\n"
            "set format y '10^{%%T}'\nset xtics ('10^{-1}' 1e-1, '10^{-3}' 1e-3, '10^{-5}' 1e-5, "
            "'10^{-7}' 1e-7, '10^{-9}' 1e-9, '10^{-11}' 1e-11, '10^{-13}' 1e-13)\n"
            "set grid xtics ytics lc rgb '#e6e6e6' lt 1\nset border 3\n"
            "set tics nomirror\nset key off\nset xlabel 'error at the end, relative'\n",
            title);
    doubtful(doubt, out);
    strip(n, curves, &d, out);
    y_axis(n, curves, true, 0.11, out);
    fputs("set lmargin at screen 0.07\nset rmargin at screen 0.5\n"
          "set ylabel 'seconds of the processor' offset 1\n",
          out);
    curve_elements(n, curves, &d, 2, false, out);
    fputs("unset object\nunset label\nset title 'field evaluations' font ',12'\nunset ylabel\n",
          out);
    y_axis(n, curves, false, 0, out);
    fputs("set lmargin at screen 0.555\nset rmargin at screen 0.79\nset xtics ('10^{-3}' 1e-3, "
          "'10^{-6}' 1e-6, '10^{-9}' 1e-9, '10^{-12}' 1e-12)\n"
          "set key at screen 0.995, screen 0.93 right top Left reverse samplen 2.5 spacing 1.25 "
          "font ',11'\n",
          out);
    curve_elements(n, curves, &d, 3, true, out);
    fputs("unset multiplot\n", out);
}
