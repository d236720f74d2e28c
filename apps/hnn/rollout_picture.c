/* The picture of a rollout (rollout.h), after figure 2 of arXiv 1906.01563: the field of each model
   with the motion in it, then the error of the state, the model's H, and the true energy over time.
   With more than one coordinate the motion is shown in the plane of bodies, or over time. */
#include "field.h"
#include "rollout.h"
#include "apps/output/figure.h"

#include <math.h>

enum { ARROWS = 15, COLUMNS = 3, PANEL_HEIGHT = 330, ABOVE = 90 };

static const char *const colour[] = {"#0072b2", "#d55e00"};
static const char truth_colour[] = "#9a9a9a";

enum { SQUARE, MODEL_H, ENERGY, QUANTITIES };

/* ---- data: one row an output; then, a block each, the arrows of the models ---- */

/* Columns of curve c: 2 + c (states + 3) the state, then (a - truth)^2, H, energy. */
static size_t column(const struct rollout_run *run, size_t c, size_t k)
{
    return 2 + c * (run->model[0].ode.n + 3) + k;
}

static void write_row(const struct rollout_run *run, const struct rollout_curve *c, size_t i,
                      struct range range[QUANTITIES], FILE *out)
{
    const struct phys_ode *H = &run->model[0].ode; /* one H for all: the first model's */
    size_t states = c->path->states;
    const double value[QUANTITIES] = {
        run->truth.n ? hnn_path_square(c->path, &run->truth, i) : (double)NAN,
        hnn_path_energy(H, c->path, i), hnn_path_energy(&run->energy, c->path, i)};
    for (size_t k = 0; k < states; k++)
        fprintf(out, " %.9g", c->path->x[i * states + k]);
    for (size_t k = 0; k < QUANTITIES; k++) {
        range_widen(&range[k], value[k]);
        fprintf(out, " %.9g", value[k]);
    }
}

/* With the range of each quantity; one that is constant to rounding does not fill its panel. */
static void write_rows(const struct rollout_run *run, const struct rollout_curve *curve, size_t n,
                       struct range range[QUANTITIES], FILE *out)
{
    for (size_t k = 0; k < QUANTITIES; k++)
        range[k] = (struct range){INFINITY, -INFINITY};
    fputs("# t; of every curve the state, squared error, H of the first model, true energy\n", out);
    for (size_t i = 0; i < run->settings.n; i++) {
        fprintf(out, "%.9g", run->t[i]);
        for (size_t c = 0; c < n; c++)
            write_row(run, &curve[c], i, range, out);
        fputc('\n', out);
    }
    for (size_t k = 0; k < QUANTITIES; k++) {
        double size = fmax(fabs(range[k].low), fabs(range[k].high));
        bool constant = range[k].high - range[k].low < 1e-6 * size;
        range[k] = range_with_margins(range[k], 0.05, 0.05);
        if (constant)
            range[k] = (struct range){range[k].low - 0.01 * size, range[k].high + 0.01 * size};
    }
}

/* ---- the motion ---- */

enum view { PHASE_PLANE, ORBITS, OVER_TIME };

static enum view view_of(const struct rollout_run *run)
{
    size_t dof = run->model[0].ode.n / 2;
    return dof == 1                                               ? PHASE_PLANE
           : run->task && !run->task->unit_masses && dof % 2 == 0 ? ORBITS
                                                                  : OVER_TIME;
}

/* Over components first ... end-1 of all curves. */
static struct range span(const struct rollout_curve *curve, size_t n, size_t first, size_t end)
{
    struct range range = {INFINITY, -INFINITY};
    for (size_t c = 0; c < n; c++)
        for (size_t i = 0; i < curve[c].path->n; i++)
            for (size_t k = first; k < end; k++)
                range_widen(&range, curve[c].path->x[i * curve[c].path->states + k]);
    return range_with_margins(range, 0.12, 0.12);
}

static void draw_motion(struct figure *figure, const struct rollout_run *run, enum view view,
                        size_t c, const char *hue, double width, const char *title)
{
    size_t dof = run->model[0].ode.n / 2;
    size_t n = view == PHASE_PLANE ? 1 : view == ORBITS ? dof / 2 : dof;
    for (size_t k = 0; k < n; k++)
        figure_draw(figure, STYLE(hue, 0, width, 0), k ? NULL : title, "data index 0 using %zu:%zu",
                    view == OVER_TIME ? 1 : column(run, c, k),
                    column(run, c,
                           view == PHASE_PLANE ? 1
                           : view == ORBITS    ? dof / 2 + k
                                               : k));
}

/* ---- panels ---- */

/* A field that is the same all the time, in the plane of the motion. */
static bool has_arrows(const struct rollout_run *run, size_t k)
{
    const struct rollout_model *m = &run->model[k];
    const struct hnn_settings *s = hnn_model_settings(m->model);
    return view_of(run) == PHASE_PLANE && s->kind != HNN_SYMPNET &&
           (!s->inputs || (!s->time && hnn_inputs_constant(&m->inputs, s->inputs)));
}

static void motion_panel(struct figure *figure, const struct rollout_run *run,
                         const struct rollout_curve *curve, size_t n, size_t model)
{
    enum view view = view_of(run);
    size_t dof = run->model[0].ode.n / 2, half = view == ORBITS ? dof / 2 : 1;
    const char *unit = hnn_model_noted(run->model[0].model, "unit");
    const char *name = rollout_name(&run->model[model]);
    struct panel panel = {.title = name,
                          .across = {"t", unit, {run->t[0], run->t[run->settings.n - 1]}, 0},
                          .up = {"q", unit, span(curve, n, 0, dof), 0},
                          .equal = view == ORBITS};
    if (view != OVER_TIME) {
        panel.across = (struct axis){view == ORBITS ? "x" : "q", unit, span(curve, n, 0, half), 0};
        panel.up =
            (struct axis){view == ORBITS ? "y" : "p", unit, span(curve, n, half, 2 * half), 0};
    }
    figure_panel(figure, &panel);
    size_t index = 0;
    for (size_t k = 0; k <= model; k++)
        index += has_arrows(run, k);
    if (has_arrows(run, model))
        figure_element(figure,
                       "data index %zu using 1:2:3:4 with vectors head size screen 0.005,20 filled "
                       "lw 0.8 lc rgb '#b8c4d0' notitle",
                       index);
    if (run->truth.n)
        draw_motion(figure, run, view, n - 1, truth_colour, 3.5, "truth");
    draw_motion(figure, run, view, model, colour[model], 1.3, name);
}

/* A quantity over time, of all curves that have it; the truth has no error. */
static void time_panel(struct figure *figure, const struct rollout_run *run,
                       const struct rollout_curve *curve, size_t n, const char *title,
                       size_t quantity, const struct range range[QUANTITIES])
{
    figure_panel(figure,
                 &(struct panel){.across = {"t", NULL, {run->t[0], run->t[run->settings.n - 1]}, 0},
                                 .up = {title, NULL, range[quantity], 0},
                                 .key = KEY_ABOVE});
    for (size_t c = n; c-- > 0;) {
        bool truth = !curve[c].model;
        if (!truth || quantity != SQUARE)
            figure_draw(figure, STYLE(truth ? truth_colour : colour[c], 0, truth ? 3.5 : 1.5, 0),
                        truth ? "truth" : rollout_name(curve[c].model), "data index 0 using 1:%zu",
                        column(run, c, run->model[0].ode.n + quantity));
    }
}

static void name_found(const struct rollout_run *run, struct line *line)
{
    for (size_t k = 0; k < run->n_models; k++) {
        const struct rollout_model *m = &run->model[k];
        if (isfinite(m->coordinate_mse))
            line_add(line, "%s: mean square error %.2g%s", rollout_name(m), m->coordinate_mse,
                     isfinite(m->energy_mse) ? "" : " of the state");
        if (isfinite(m->energy_mse))
            line_add(line, "%.2g of the energy", m->energy_mse);
    }
}

/* ---- the figure ---- */

static enum ad_status write_arrows(const struct rollout_run *run, const struct rollout_curve *curve,
                                   size_t n, FILE *out, struct ad_error *error)
{
    double at[2 + HNN_INPUTS_MOST] = {run->x0[0], run->x0[1]};
    struct field_plane plane = {0, 1, span(curve, n, 0, 1), span(curve, n, 1, 2), at};
    for (size_t k = 0; k < run->n_models && error->status == AD_OK; k++) {
        hnn_model *model = run->model[k].model;
        if (!has_arrows(run, k))
            continue;
        fputs("\n\n# arrows: from, along\n", out);
        if (hnn_model_settings(model)->inputs)
            hnn_model_inputs(model, run->t[0], at + 2, error);
        if (error->status == AD_OK)
            field_arrows(model, &plane, ARROWS, out, error);
    }
    return error->status;
}

enum ad_status rollout_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct rollout_run *run = context;
    struct rollout_curve curve[ROLLOUT_MODELS + 1];
    size_t n = rollout_curves(run, curve);
    bool H = run->model[0].ode.energy, energy = run->truth.n && run->energy.n;
    int panels = (int)run->n_models + (run->truth.n > 0) + H + energy;
    int columns = panels == 4        ? 2
                  : panels < COLUMNS ? panels
                                     : COLUMNS,
        rows = (panels + columns - 1) / columns;
    double width = 1.0 / columns, height = ABOVE + rows * PANEL_HEIGHT;
    char title[120];
    struct line line = {0};
    struct range range[QUANTITIES];
    struct layout layout = {
        .width = columns > 2 ? 1040 : 400 * columns,
        .height = (int)height,
        .title = title,
        .found = line.text,
        .rows = rows,
        .columns = columns,
        .room = {0.24 * width, 1 - 0.05 * width, 55 / height, 1 - ABOVE / height},
        .gap = {0.27 * width, 85 / height}};
    struct figure figure;
    snprintf(title, sizeof title, "motion of %zu network%s by %s, %zu outputs", run->n_models,
             run->n_models > 1 ? "s" : "", rollout_method(run), run->settings.n);
    name_found(run, &line);
    write_rows(run, curve, n, range, plot->data);
    figure_begin(&figure, plot, &layout);
    for (size_t k = run->n_models; k-- > 0;)
        motion_panel(&figure, run, curve, n, k);
    if (run->truth.n)
        time_panel(&figure, run, curve, n, "mean square error of the state", SQUARE, range);
    if (H)
        time_panel(&figure, run, curve, n, "H of the first model", MODEL_H, range);
    if (energy)
        time_panel(&figure, run, curve, n, "true energy", ENERGY, range);
    figure_end(&figure);
    return write_arrows(run, curve, n, plot->data, error);
}
