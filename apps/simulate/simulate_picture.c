/* The picture of a simulation (simulate.h): left the motion; right, against time and by powers of
   ten, the drift of the energy and the distance from the reference. A GIF shows the motion. */
#include "apps/output/coordinates.h"
#include "simulate.h"

#include <math.h>

enum { FRAMES = 100 };

static double drift(const struct phys_motion_solution *s, size_t i)
{
    double E0 = s->energy[0], d = fabs(s->energy[i] - E0);
    return E0 != 0 ? d / fabs(E0) : d;
}

/* One row per sample: time, coordinates, drift, distance. */
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

/* Curves up to sample n(f), and a mark at it. */
static void left(struct figure *figure, const struct phys_motion_solution *s)
{
    struct coordinates view;
    size_t dof = s->system->dof;
    coordinates_begin(&view, s->system, (struct range){s->t[0], s->t[s->n - 1]});
    coordinates_widen(&view, s->n, s->x, 1, 2 * dof);
    coordinates_panel(&view, figure);
    for (size_t c = 0; c < view.n; c++) {
        const char *colour = figure_colours[c % 8];
        coordinates_draw(&view, figure, c, "every ::::n(f)", STYLE(colour, 0, 1.2, 0), NULL);
        coordinates_draw(&view, figure, c, "every ::n(f)::n(f)", STYLE(colour, 7, 0, 0.8), NULL);
    }
}

static void right(struct figure *figure, const struct phys_motion_solution *s)
{
    size_t column = s->system->dof + 2;
    figure_panel(
        figure,
        &(struct panel){.across = {"t", s->system->scene->time_unit, {s->t[0], s->t[s->n - 1]}, 0},
                        .log = "y",
                        .key = KEY_ABOVE});
    figure_draw(figure, STYLE("#c0392b", 0, 1.5, 0), "energy drift",
                "data using 1:($%zu > 0 ? $%zu : 1e-17)", column, column);
    if (s->distance)
        figure_draw(figure, STYLE("#1f4e79", 0, 1.5, 0), "error",
                    "data using 1:($%zu > 0 ? $%zu : NaN)", column + 1, column + 1);
}

enum ad_status simulate_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct simulate_run *run = context;
    FILE *out = plot->script;
    const struct phys_motion_solution *s = &run->motion;
    struct layout layout = figure_pair;
    struct figure figure;
    if (run->has_order)
        return simulate_gas_picture(run, plot, error);
    layout.frames = plot->animated ? FRAMES : 1;
    write_data(s, plot->data);
    fputs("name = ", out);
    quote_gnuplot_label(out, run->system.scene->name);
    fputs("\nmethod = ", out);
    quote_gnuplot_label(out, s->integrator->name);
    fprintf(out, "\nn(f) = %zu * (f + 1) / %zu\n", s->n - 1, layout.frames);
    layout.expression = "sprintf('%s by %s', name, method)";
    figure_begin(&figure, plot, &layout);
    left(&figure, s);
    right(&figure, s);
    figure_end(&figure);
    return error->status;
}
