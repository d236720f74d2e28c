/* The picture of a simulation (simulate.h): left the motion with its start, end and events; right,
   against time and by powers of ten, the drift of the energy and of observables that are nearly
   constant, and the distance from the reference. A GIF shows the motion. */
#include "autodiff/ascending.h"
#include "apps/output/coordinates.h"
#include "apps/output/report.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>

/* FINE: points between two samples where the curve turns; MOST_FINE: such samples. */
enum { FRAMES = 100, FINE = 24, MOST_FINE = 1500 };

enum { MOST_KEPT = FIGURE_LEGEND - 2 };
static const double NEARLY = 1e-3; /* of the largest value: observables that change by less drift */

/* What is drawn by powers of ten: rows [2 + n x samples], and their names. */
struct errors {
    size_t n;
    double *row;
    const char *name[2 + MOST_KEPT];
};

static double largest(size_t n, const double *x, double from)
{
    double most = 0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i] - from));
    return most;
}

/* The drift of the energy; the distance from the reference in units of the largest coordinate; of
   observables their drift in units of their largest value. False: out of memory. */
static bool relative_errors(const struct simulate_run *run, struct errors *e)
{
    const struct phys_motion_solution *s = &run->motion;
    const size_t n = s->n, observables = run->observed ? s->system->scene->n_observables : 0;
    double E0 = fabs(s->energy[0]), most = 0;
    *e = (struct errors){.n = 2, .name = {"energy drift", s->distance ? "coordinates" : NULL}};
    if (!(e->row = calloc((2 + MOST_KEPT) * n, sizeof *e->row)))
        return false;
    for (size_t k = 0; k < 2 * n * s->system->dof; k++)
        if (k / s->system->dof % 2 == 0)
            most = fmax(most, fabs(s->x[k]));
    for (size_t i = 0; i < n; i++) {
        e->row[i] = fabs(s->energy[i] - s->energy[0]) / (E0 > 0 ? E0 : 1);
        e->row[n + i] = s->distance && most > 0 ? s->distance[i] / most : 0;
    }
    for (size_t k = 0; k < observables && e->n < 2 + MOST_KEPT; k++) {
        const double *value = run->observed + k * n, size = largest(n, value, 0);
        if (!(size > 0) || !(largest(n, value, value[0]) < NEARLY * size))
            continue;
        for (size_t i = 0; i < n; i++)
            e->row[e->n * n + i] = fabs(value[i] - value[0]) / size;
        e->name[e->n++] = s->system->scene->observables[k].name;
    }
    return true;
}

/* ---- data: samples; the curve, finer where it turns; events ---- */

static void write_row(double t, size_t dof, const double *x, size_t stride, FILE *out)
{
    fprintf(out, "%.12g", t);
    for (size_t k = 0; k < dof; k++)
        fprintf(out, " %.9g", x[k * stride]);
}

/* Whether a straight line from sample i to the next is seen to miss the curve: by the velocities at
   both ends, in units of the motion's span. */
static bool turns(const struct phys_motion_solution *s, size_t i, double span)
{
    size_t dof = s->system->dof;
    const double *x = s->x + 2 * i * dof, *next = x + 2 * dof, dt = s->t[i + 1] - s->t[i];
    double miss = 0;
    for (size_t k = 0; k < dof; k++) {
        double chord = next[k] - x[k];
        miss = fmax(miss, fmax(fabs(chord - dt * x[dof + k]), fabs(chord - dt * next[dof + k])));
    }
    return miss > 0.01 * span;
}

/* Points between samples i and i + 1, from the motion itself. */
static void write_between(const struct phys_motion_solution *s, size_t i,
                          const struct phys_ode *ode, double *room, FILE *out)
{
    size_t dof = s->system->dof;
    double *y = room, *path = room + 2 * dof;
    struct ad_error none = {0};
    struct phys_simulation_info info;
    struct phys_simulation how =
        phys_simulation_of(phys_integrator_find("dop853", &none), 1e-8, s->t[i + 1]);
    how.t0 = s->t[i];
    how.n_samples = FINE;
    for (size_t k = 0; k < 2 * dof; k++)
        y[k] = s->x[2 * i * dof + k];
    if (phys_trajectory(&how, ode, y, dof, FINE + 1, path, &info, &none) != AD_OK)
        return;
    for (size_t j = 1; j < FINE; j++) {
        write_row(s->t[i] + (s->t[i + 1] - s->t[i]) * (double)j / FINE, dof, path + j, FINE + 1,
                  out);
        fprintf(out, " %zu\n", i + 1);
    }
}

static void write_curve(const struct phys_motion_solution *s, FILE *out)
{
    size_t dof = s->system->dof, fine = 0;
    struct phys_ode ode = {0};
    struct ad_error none = {0};
    struct range span = {INFINITY, -INFINITY};
    double *room = malloc((2 + FINE + 1) * dof * sizeof *room);
    bool follows =
        room && dof <= PHYS_MOTION_FEW &&
        phys_ode_for(s->system, phys_integrator_find("dop853", &none), &ode, &none) == AD_OK;
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; k < dof; k++)
            range_widen(&span, s->x[2 * i * dof + k]);
    fputs("# time, coordinates, next sample\n", out);
    for (size_t i = 0; i < s->n; i++) {
        write_row(s->t[i], dof, s->x + 2 * i * dof, 1, out);
        fprintf(out, " %zu\n", i);
        if (follows && i + 1 < s->n && fine < MOST_FINE && turns(s, i, span.high - span.low)) {
            write_between(s, i, &ode, room, out);
            fine++;
        }
    }
    phys_ode_free(&ode);
    free(room);
}

static void write_errors(const struct errors *e, size_t samples, size_t i, FILE *out)
{
    for (size_t k = 0; k < e->n; k++)
        fprintf(out, " %.6g", e->row[k * samples + i]);
}

static void write_data(const struct phys_motion_solution *s, const struct errors *errors, bool map,
                       FILE *out)
{
    size_t dof = s->system->dof;
    fputs("# time, coordinates, relative change of the energy, relative distance from the "
          "reference, relative changes of observables\n",
          out);
    for (size_t i = 0; i < s->n; i++) {
        write_row(s->t[i], dof, s->x + 2 * i * dof, 1, out);
        if (!map)
            write_errors(errors, s->n, i, out);
        fputc('\n', out);
    }
    fputs("\n\n", out);
    if (map)
        for (size_t i = 0; i < s->n; i++) {
            fprintf(out, "%.12g", s->t[i]);
            write_errors(errors, s->n, i, out);
            fputc('\n', out);
        }
    else
        write_curve(s, out);
    fputs("\n\n# events: time, coordinates\n", out);
    for (size_t k = 0; k < s->crossed.n; k++) {
        write_row(s->crossed.t[k], dof, s->crossed.x + 2 * k * dof, 1, out);
        fputc('\n', out);
    }
}

/* ---- panels ---- */

/* Curves up to sample n(f), and marks at it. */
static void left(struct figure *figure, const struct phys_motion_solution *s,
                 struct coordinates *view)
{
    const struct style start = {.mark = 6, .size = 1}, end = {.mark = 7, .size = 0.8},
                       event = {.colour = "#000000", .mark = 12, .size = 1};
    bool still = figure->layout.frames <= 1, bodies = view->view != VIEW_TIME;
    char when[48];
    coordinates_widen(view, s->n, s->x, 1, 2 * s->system->dof);
    fprintf(figure->plot->script, "rows = %zu\n", s->n);
    coordinates_panel(view, figure);
    if (view->view == VIEW_MAP) {
        coordinates_draw(view, figure, "index 0", &start, 0);
        return;
    }
    snprintf(when, sizeof when, "$%zu <= n(f)", s->system->dof + 2);
    view->when = when;
    coordinates_draw(view, figure, "index 1", STYLE(NULL, 0, 1.4, 0), 0);
    view->when = NULL;
    if (s->crossed.n && still)
        coordinates_draw(view, figure, "index 2", &event, 0);
    if (bodies)
        coordinates_draw(view, figure, "index 0 every ::0::0", &start, 0);
    if (bodies || !still)
        coordinates_draw(view, figure, "index 0 every ::n(f)::n(f)", &end, 0);
    coordinates_legend(view, figure);
    if (bodies)
        figure_draw(figure, STYLE("#606060", 6, 0, 1), "start", "NaN");
    if (bodies && still)
        figure_draw(figure, STYLE("#606060", 7, 0, 0.8), "end", "NaN");
    if (s->crossed.n && still)
        figure_draw(figure, &event, "events", "NaN");
}

/* From where nineteen values of twenty are: errors begin at zero and pass through it. Sorts them.
 */
static struct range magnitudes(size_t n, double *value)
{
    size_t kept = 0;
    for (size_t i = 0; i < n; i++)
        if (value[i] > 0 && isfinite(value[i]))
            value[kept++] = value[i];
    if (kept == 0)
        return (struct range){1e-17, 1};
    qsort(value, kept, sizeof *value, ad_ascending);
    return (struct range){pow(10, floor(log10(value[kept / 20]))),
                          pow(10, ceil(log10(2 * value[kept - 1])))};
}

static void right(struct figure *figure, const struct phys_motion_solution *s,
                  const struct errors *errors, bool map)
{
    struct range t = {s->t[0], s->t[s->n - 1]};
    size_t column = map ? 2 : s->system->dof + 2;
    int power = range_exponent(t);
    figure_panel(figure, &(struct panel){.across = {"t", s->system->scene->time_unit, t, power},
                                         .up = {"relative error", NULL,
                                                magnitudes(errors->n * s->n, errors->row), 0},
                                         .log = "y",
                                         .key = KEY_ABOVE});
    for (size_t k = 0; k < errors->n; k++, column++)
        if (errors->name[k])
            figure_draw(figure, STYLE(figure_colours[k < 2 ? !k : k], 0, 1.5, 0), errors->name[k],
                        "data index %d using ($1/1e%d):($%zu > 0 ? $%zu : NaN)", map, power, column,
                        column);
}

static void name_found(const struct simulate_run *run, struct line *line)
{
    const struct phys_motion_solution *s = &run->motion;
    const struct phys_scene *scene = s->system->scene;
    const char *E = unit_shown(scene->energy_unit), *q = unit_shown(scene->unit);
    if (s->keeps_energy && isfinite(s->energy[0]))
        line_add(line, "E = %.6g%s%.16s, largest relative drift %.2g", s->energy[0], unit_blank(E),
                 E, s->info.energy_drift);
    if (isfinite(s->error))
        line_add(line, "largest error %.2g%s%.16s", s->error, unit_blank(q), q);
    for (size_t k = 0; k < run->settings.n_crossings; k++) {
        size_t n = 0;
        for (size_t e = 0; e < s->crossed.n; e++)
            n += (size_t)s->crossed.which[e] == k + 1;
        line_add(line, "%.24s: %zu time%s", run->crossings[k].text, n, n == 1 ? "" : "s");
    }
}

enum ad_status simulate_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct simulate_run *run = context;
    const struct phys_motion_solution *s = &run->motion;
    struct layout layout = figure_pair;
    struct figure figure;
    struct coordinates view;
    struct line line = {0};
    char title[160];
    if (run->section.number)
        return simulate_section_picture(run, plot, error);
    if (run->family.n)
        return simulate_family_picture(run, plot, error);
    if (run->has_order)
        return simulate_gas_picture(run, plot, error);
    struct errors errors;
    if (!relative_errors(run, &errors))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    layout.frames = plot->animated ? FRAMES : 1;
    coordinates_begin(&view, s->system, (struct range){s->t[0], s->t[s->n - 1]},
                      run->settings.every == 0);
    write_data(s, &errors, view.view == VIEW_MAP, plot->data);
    name_found(run, &line);
    snprintf(title, sizeof title, "%.60s: motion by %s, %s %.2g", s->system->scene->name,
             s->integrator->name, s->integrator->adaptive ? "tolerance of a step" : "steps of",
             s->setting);
    fprintf(plot->script, "n(f) = %zu * (f + 1) / %zu\nf = 0\n", s->n - 1, layout.frames);
    layout.title = title;
    layout.room.top -=
        0.032 * (double)(errors.n > 4 ? (errors.n - 3) / 2 : 0); /* rows of the legend */
    layout.found = line.text;
    figure_begin(&figure, plot, &layout);
    left(&figure, s, &view);
    right(&figure, s, &errors, view.view == VIEW_MAP);
    figure_end(&figure);
    free(errors.row);
    return error->status;
}
