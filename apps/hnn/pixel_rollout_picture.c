/* The picture of a predicted video (pixel_rollout.h): above, a row of frames of the truth and of
   each model; below, the latent motion on contours of H, and the energy measured on the frames. A
   GIF plays the frames side by side, with the energy below.

   The data file is binary, 4-byte floats: the frames of all strips, a row [time, energy of each
   strip] a frame, H on a grid, the latent path. */
#include "apps/output/figure.h"
#include "pixel_rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    STRIPS = ROLLOUT_MODELS + 1,
    SNAPSHOTS = 12,
    GRID = 61,
    GIF_FRAMES = 150,
    ROW = 84,
    ABOVE = 40
};

static const char *const truth_colour = "#808080",
                         *const colours[] = {
                             [HNN_BASELINE] = "#d55e00", [HNN_HAMILTONIAN] = "#0072b2"};

/* The picture's parts, and the offsets of their data, in floats. */
struct drawing {
    size_t n_strips, n, height, width, area;
    struct frame_strip strip[STRIPS]; /* truth, baseline, model */
    const char *colour[STRIPS];
    const struct rollout_model *latent; /* whose path and H are shown */
    struct range q, p;                  /* of the grid */
    size_t table, grid, path;
};

static struct drawing choose(const struct pixel_rollout *rollout)
{
    struct drawing d = {.n = rollout->settings.n,
                        .height = rollout->source.height,
                        .width = rollout->source.width,
                        .area = rollout->source.height * rollout->source.width,
                        .n_strips = 1,
                        .strip = {rollout->truth},
                        .colour = {truth_colour},
                        .latent = &rollout->model[0]};
    for (int kind = HNN_BASELINE; kind <= HNN_HAMILTONIAN; kind++)
        for (size_t k = 0; k < rollout->n_models; k++) {
            const struct rollout_model *m = &rollout->model[k];
            if ((int)hnn_model_settings(m->model)->kind != kind)
                continue;
            d.colour[d.n_strips] = colours[kind];
            d.strip[d.n_strips++] = m->strip;
            d.latent = m;
        }
    d.table = d.n_strips * d.n * d.area;
    d.grid = d.table + d.n * (1 + d.n_strips);
    d.path = d.grid + GRID * GRID;
    return d;
}

/* ---- data ---- */

static void put(double value, FILE *out)
{
    float narrow = (float)value;
    fwrite(&narrow, sizeof narrow, 1, out);
}

/* A video that ends before the others stays black. */
static void write_frames(const struct drawing *d, FILE *out)
{
    for (size_t s = 0; s < d->n_strips; s++)
        for (size_t k = 0; k < d->n * d->area; k++)
            put(k < d->strip[s].n * d->area ? d->strip[s].pixels[k] : 0, out);
    for (size_t i = 0; i < d->n; i++) {
        put((double)i, out);
        for (size_t s = 0; s < d->n_strips; s++)
            put(i < d->strip[s].n ? d->strip[s].energy[i] : NAN, out);
    }
}

static double at(struct range range, size_t k)
{
    return range.low + (range.high - range.low) * (double)k / (GRID - 1);
}

/* Levels of H lie in the plane of a single coordinate. */
static bool has_levels(const struct drawing *d)
{
    const struct hnn_settings *s = hnn_model_settings(d->latent->model);
    return s->kind == HNN_HAMILTONIAN && s->dof == 1;
}

/* H around the path of the first q and p; rows of the grid have one p. Zero without levels. */
static enum ad_status write_latent(struct drawing *d, FILE *out, struct ad_error *error)
{
    const struct hnn_path *path = &d->latent->path;
    size_t n = GRID * GRID, momentum = path->states / 2;
    double *x = calloc(3 * n, sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *H = x + 2 * n;
    d->q = d->p = (struct range){INFINITY, -INFINITY};
    for (size_t i = 0; i < path->n; i++) {
        range_widen(&d->q, path->x[i * path->states]);
        range_widen(&d->p, path->x[i * path->states + momentum]);
    }
    d->q = range_with_margins(d->q, 0.2, 0.2);
    d->p = range_with_margins(d->p, 0.2, 0.2);
    for (size_t k = 0; k < n; k++) {
        x[k] = at(d->q, k % GRID);
        x[n + k] = at(d->p, k / GRID);
    }
    if (has_levels(d))
        hnn_model_evaluate(d->latent->model, n, x, NULL, H, error);
    for (size_t k = 0; k < n; k++)
        put(H[k], out);
    for (size_t k = 0; k < path->n * path->states; k += path->states) {
        put(path->x[k], out);
        put(path->x[k + momentum], out);
    }
    free(x);
    return error->status;
}

/* ---- gnuplot ---- */

/* Contours are lines in a table, made before the axes are: splot has others. */
static void contours(const struct drawing *d, FILE *out)
{
    double dq = (d->q.high - d->q.low) / (GRID - 1), dp = (d->p.high - d->p.low) / (GRID - 1);
    fprintf(out,
            "set contour base\nunset surface\nset cntrparam levels auto 14\n"
            "set xrange [*:*]\nset yrange [*:*]\nset table $levels\n"
            "splot data binary skip=%zu array=(%d,%d) format='%%float' origin=(%.9g,%.9g,0) "
            "dx=%.9g dy=%.9g\nunset table\nunset contour\nset surface\n",
            4 * d->grid, GRID, GRID, d->q.low, d->p.low, dq, dp);
}

static void settings(const struct drawing *d, size_t stride, FILE *out)
{
    float peak = 0;
    for (size_t k = 0; k < d->strip[0].n * d->area; k++)
        peak = fmaxf(peak, d->strip[0].pixels[k]);
    fprintf(out,
            "set palette gray\nunset colorbox\nset cbrange [0:%g]\nn = %zu\nw = %zu\nh = %zu\n"
            "stride = %zu\nshots = %d\nframe(s, i) = 4 * w * h * (s * n + i)\n",
            peak > 0 ? peak : 1, d->n, d->width, d->height, stride, SNAPSHOTS);
    if (has_levels(d))
        contours(d, out);
}

/* A strip of frames: without axes. */
static void strip_panel(struct figure *figure, const char *title, int columns, struct place place)
{
    figure_panel(figure, &(struct panel){.title = title, .place = place});
    fprintf(figure->plot->script,
            "unset tics\nset border 0\nset xrange [-0.5:%d*(w+1)-1.5]\nset yrange [-0.5:h-0.5]\n",
            columns);
}

/* The axes of the panels below the strips. */
static const char axes[] = "set border 3\nset xtics nomirror\nset ytics nomirror\n";

/* One frame; `each`: before the plot's words; frame and column are gnuplot's expressions. */
static void image(struct figure *figure, const struct drawing *d, const char *each, size_t strip,
                  const char *frame, const char *column)
{
    figure_element(figure,
                   "%sdata binary skip=frame(%zu,%s) array=(%zu,%zu) format='%%float' flipy "
                   "origin=(%s*(w+1),0) with image notitle",
                   each, strip, frame, d->width, d->height, column);
}

/* Energies up to the frame that gnuplot's expression `last` names. */
static void energies(struct figure *figure, const struct drawing *d, const char *last,
                     struct panel panel)
{
    struct range energy = {INFINITY, -INFINITY};
    char columns[8 * (STRIPS + 1)] = "";
    for (size_t s = 0; s < d->n_strips; s++)
        for (size_t i = 0; i < d->strip[s].n; i++)
            if (isfinite(d->strip[s].energy[i]))
                range_widen(&energy, d->strip[s].energy[i]);
    if (energy.low > energy.high)
        energy = (struct range){0, 1};
    panel.across = (struct axis){"frame", NULL, {0, (double)d->n - 1}, 0};
    panel.up.range = range_with_margins(energy, 0.1, 0.1);
    panel.more = axes;
    figure_panel(figure, &panel);
    for (size_t c = 0; c <= d->n_strips; c++)
        strcat(columns, "%float");
    for (size_t s = 0; s < d->n_strips; s++)
        figure_draw(figure, STYLE(d->colour[s], 0, 2, 0), d->strip[s].name,
                    "data binary skip=%zu record=%zu format='%s' using ($1 <= %s ? $1 : NaN):%zu",
                    4 * d->table, d->n, columns, last, s + 2);
}

static void latent(struct figure *figure, const struct drawing *d, struct place place)
{
    figure_panel(figure, &(struct panel){.place = place,
                                         .across = {"latent q", NULL, d->q, 0},
                                         .up = {"latent p", NULL, d->p, 0},
                                         .key = KEY_ABOVE,
                                         .more = axes});
    if (has_levels(d))
        figure_draw(figure, STYLE("#b0b0b0", 0, 0.7, 0), "H", "$levels");
    figure_draw(figure, STYLE(d->colour[d->n_strips - 1], 0, 1.5, 0), d->latent->strip.name,
                "data binary skip=%zu record=%zu format='%%float%%float' using 1:2", 4 * d->path,
                d->n);
}

/* ---- pictures ---- */

/* Heights are in pixels from below, of a picture that many high. */
static void still(struct figure *figure, const struct drawing *d, double height)
{
    for (size_t s = 0; s < d->n_strips; s++) {
        double bottom = (height - ABOVE - ROW * (double)(s + 1)) / height;
        double top = bottom + (ROW - 4) / height;
        strip_panel(figure, NULL, SNAPSHOTS, (struct place){0.1, 0.99, bottom, top});
        fputs("set label 3 ", figure->plot->script);
        quote_gnuplot(figure->plot->script, d->strip[s].name);
        fprintf(figure->plot->script, " at screen 0.09,%.4f right noenhanced\n",
                (bottom + top) / 2);
        image(figure, d, "for [j=0:shots-1] ", s, "int((n - 1) * j / (shots - 1.0))", "j");
    }
    latent(figure, d, (struct place){0.1, 0.42, 60 / height, 250 / height});
    energies(figure, d, "n",
             (struct panel){.place = {0.52, 0.98, 60 / height, 250 / height},
                            .up = {.name = "energy of the frames", .unit = "J"},
                            .key = KEY_ABOVE});
}

static void animation(struct figure *figure, const struct drawing *d)
{
    for (size_t s = 0; s < d->n_strips; s++) {
        double width = 1 / (double)d->n_strips, left = width * (double)s;
        strip_panel(figure, d->strip[s].name, 1,
                    (struct place){left + 0.04 * width, left + 0.96 * width, 0.5, 0.94});
        image(figure, d, "", s, "f * stride", "0");
    }
    energies(
        figure, d, "f * stride",
        (struct panel){.place = {0.13, 0.96, 0.11, 0.42}, .title = "energy of the frames / J"});
}

enum ad_status pixel_rollout_picture(const void *rollout, struct plot *plot, struct ad_error *error)
{
    struct drawing d = choose(rollout);
    write_frames(&d, plot->data);
    if (write_latent(&d, plot->data, error) != AD_OK)
        return error->status;
    size_t stride = (d.n + GIF_FRAMES - 1) / GIF_FRAMES;
    int strips = (int)d.n_strips;
    struct layout layout = {.title = "frames of the truth and as foreseen by networks",
                            .height = 300 + ABOVE + ROW * strips};
    struct figure figure;
    if (plot->animated)
        layout = (struct layout){
            .width = 220 * strips, .height = 480, .frames = (d.n + stride - 1) / stride};
    settings(&d, stride, plot->script);
    figure_begin(&figure, plot, &layout);
    if (plot->animated)
        animation(&figure, &d);
    else
        still(&figure, &d, layout.height);
    figure_end(&figure);
    return AD_OK;
}
