/* The picture of a simulation (simulate.h): left the motion; right, against time and by powers of
   ten, the drift of the energy and the distance from the reference. A GIF shows the motion. */
#include "apps/output/axes.h"
#include "simulate.h"

#include <math.h>
#include <string.h>

enum { FRAMES = 100 };

/* What makes the curves of the left side: columns of the data (1: time, 2: first coordinate). */
struct curves {
    size_t n, x, y, step;
    bool plane;
    int x_power, y_power;
};

static struct curves choose_curves(const struct simulate_run *run)
{
    const struct phys_system *system = &run->system;
    if (system->scene->picture == PHYS_PICTURE_PLANE && system->dims >= 2)
        return (struct curves){system->bodies, 2, 3, system->dims, true, 0, 0};
    return (struct curves){system->dof, 1, 2, 1, false, 0, 0};
}

static double drift(const struct phys_motion_solution *s, size_t i)
{
    double E0 = s->energy[0], d = fabs(s->energy[i] - E0);
    return E0 != 0 ? d / fabs(E0) : d;
}

/* A row a sample: time, coordinates, drift, distance. */
static void write_data(const struct phys_motion_solution *s, FILE *out)
{
    size_t dof = s->system->dof;
    fputs("# time, coordinates, relative change of the energy, distance from the reference\n", out);
    for (size_t i = 0; i < s->n; i++) {
        fprintf(out, "%.12g", s->t[i]);
        for (size_t k = 0; k < dof; k++)
            fprintf(out, " %.9g", s->x[2 * i * dof + k]);
        fprintf(out, " %.6g %.6g\n", drift(s, i), s->distance ? s->distance[i] : 0);
    }
}

static struct range column_range(const struct phys_motion_solution *s, size_t column, size_t step,
                                 size_t n)
{
    struct range range = {INFINITY, -INFINITY};
    if (column == 1)
        return (struct range){s->t[0], s->t[s->n - 1]};
    for (size_t i = 0; i < s->n; i++)
        for (size_t c = 0; c < n; c++)
            range_widen(&range, s->x[2 * i * s->system->dof + column - 2 + c * step]);
    return range_with_margins(range, 0.04, 0.04);
}

static void left_axes(const struct simulate_run *run, const struct phys_motion_solution *s,
                      struct curves *c, FILE *out)
{
    const struct phys_scene *scene = run->system.scene;
    struct range x = column_range(s, c->x, c->step, c->n), y = column_range(s, c->y, c->step, c->n);
    c->x_power = range_exponent(x);
    c->y_power = range_exponent(y);
    if (c->plane)
        c->x_power = c->y_power = c->x_power > c->y_power ? c->x_power : c->y_power;
    fprintf(out, "unset logscale\nset format '%%g'\nset size %s\n",
            c->plane ? "ratio -1" : "noratio");
    axis_set(out, "x", c->plane ? "x" : "t", c->plane ? scene->unit : scene->time_unit, x,
             c->x_power);
    axis_set(out, "y",
             c->plane                                ? "y"
             : scene->picture == PHYS_PICTURE_ANGLES ? "angle"
                                                     : "coordinate",
             scene->unit, y, c->y_power);
}

/* Curves up to the sample that the gnuplot expression `last` names, and where they are then. */
static void left(const struct curves *c, const char *last, FILE *out)
{
    fputs("plot ", out);
    for (size_t k = 0; k < c->n; k++) {
        size_t x = c->plane ? c->x + k * c->step : 1, y = c->y + k * c->step;
        fprintf(out,
                "data every ::::%s using ($%zu/1e%d):($%zu/1e%d) with lines lw 1.2 lc %zu notitle, "
                "\\\n    data every ::%s::%s using ($%zu/1e%d):($%zu/1e%d) with points pt 7 ps 0.8 "
                "lc %zu notitle%s\n",
                last, x, c->x_power, y, c->y_power, k + 1, last, last, x, c->x_power, y, c->y_power,
                k + 1, k + 1 < c->n ? ", \\" : "");
    }
}

static void right(const struct simulate_run *run, FILE *out)
{
    const struct phys_motion_solution *s = &run->motion;
    struct range time = {s->t[0], s->t[s->n - 1]};
    size_t column = s->system->dof + 2;
    fputs("set size noratio\n", out);
    axis_set(out, "x", "t", run->system.scene->time_unit, time, 0);
    fputs("set logscale y\nset format y '10^{%T}'\nset yrange [*:*]\nunset ylabel\nplot ", out);
    fprintf(out,
            "data using 1:($%zu > 0 ? $%zu : 1e-17) with lines lw 1.5 lc rgb '#c0392b' title "
            "'energy drift'",
            column, column);
    if (s->distance)
        fprintf(out,
                ", \\\n    data using 1:($%zu > 0 ? $%zu : NaN) with lines lw 1.5 lc rgb '#1f4e79' "
                "title 'error'",
                column + 1, column + 1);
    fputc('\n', out);
}

void simulate_picture(const struct simulate_run *run, struct plot *plot)
{
    FILE *out = plot->script;
    const struct phys_motion_solution *s = &run->motion;
    struct curves curves = choose_curves(run);
    write_data(&run->motion, plot->data);
    fputs("set key outside top center horizontal "
          "samplen 1.5\n",
          out);
    fprintf(out, "name = ");
    quote_gnuplot(out, run->system.scene->name);
    fputs("\nmethod = ", out);
    quote_gnuplot(out, run->motion.integrator->name);
    fprintf(out, "\nlast = %zu\nframes = %d\n", s->n - 1, plot->animated ? FRAMES : 1);
    fputs("do for [f = 1:frames] {\nn = last * f / frames\n"
          "set multiplot layout 1,2 title sprintf('%s by %s', name, method) noenhanced\n",
          out);
    left_axes(run, s, &curves, out);
    left(&curves, "n", out);
    right(run, out);
    fputs("unset multiplot\n}\n", out);
}
