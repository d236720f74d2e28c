/* The picture of the double slit: left the density in the plane, square root, so that the fringes
   show beside the packet that made them; right the intensity along the screen over the closed form.
   A GIF shows the left side moving. */
#include "apps/output/figure.h"
#include "quantum.h"

#include <math.h>

enum { ACROSS = 256 };

/* Block 0: the screen. Then a block a frame: x y sqrt(density), a scan an x. */
static void write_data(const struct qm_slit *s, size_t first, FILE *out)
{
    size_t nx = s->x.n, ny = s->y.n, skip = nx / ACROSS + (nx % ACROSS != 0);
    for (size_t b = 0; b < ny; b++)
        fprintf(out, "%.6g %.6g %.6g\n", qm_x(&s->y, b), s->screen[b], s->expected[b]);
    for (size_t f = first; f < s->frames; f++) {
        fprintf(out, "\n\n# t = %g\n", s->time[f]);
        for (size_t a = 0; a < nx; a += skip, fputc('\n', out))
            for (size_t b = 0; b < ny; b += skip)
                fprintf(out, "%.5g %.5g %.4g\n", qm_x(&s->x, a), qm_x(&s->y, b),
                        sqrt(s->density[(f * nx + a) * ny + b]));
    }
}

static void plane(struct figure *figure, const struct qm_slit *s)
{
    FILE *out = figure->plot->script;
    double edges[] = {s->y.low, -s->setup->apart / 2, s->setup->apart / 2, s->y.high};
    double screen = s->setup->speed * s->setup->flight;
    figure_panel(figure,
                 &(struct panel){.across = {"x", NULL, {s->x.low, s->x.high}, 0},
                                 .up = {"y", NULL, {s->y.low, s->y.high}, 0},
                                 .more = "set cblabel 'square root of the density |\xcf\x88|^2'\n"
                                         "set cbrange [0:*]\n"});
    for (size_t k = 0; k < 3; k++) /* between the slits and beyond them */
        fprintf(out, "set arrow from 0,%g to 0,%g nohead lw 4 lc rgb '#303030' front\n",
                edges[k] + (k > 0 ? 1.5 * s->setup->sigma : 0),
                edges[k + 1] - (k < 2 ? 1.5 * s->setup->sigma : 0));
    fprintf(out, "set arrow from %g,%g to %g,%g nohead lw 1.5 dt (6,4) lc rgb '#d55e00' front\n",
            screen, s->y.low, screen, s->y.high);
    figure_element(figure, "data index 1+f using 1:2:3 with image");
}

static void screen(struct figure *figure, const struct qm_slit *s)
{
    char title[48];
    struct range most = {0, 0};
    for (size_t b = 0; b < s->y.n; b++)
        range_widen(&most, 1.25 * s->screen[b]);
    figure_panel(figure,
                 &(struct panel){.across = {"y along the screen", NULL, {s->y.low, s->y.high}, 0},
                                 .up = {"intensity", NULL, most, 0},
                                 .key = KEY_ABOVE});
    figure_draw(figure, STYLE("#f2c9ae", 0, 4, 0), "thin slits, same maximum",
                "data index 0 using 1:3");
    snprintf(title, sizeof title, "screen, fringe %.4g", s->fringe);
    figure_draw(figure, STYLE("#0b4f8a", 0, 1.8, 0), title, "data index 0 using 1:2");
}

enum ad_status slit_picture(const void *run, struct plot *plot, struct ad_error *error)
{
    const struct qm_slit *s = &((const struct slit_run *)run)->slit;
    char title[160];
    struct line line = {0};
    size_t first = plot->animated ? 0 : s->frames - 1;
    struct layout layout = figure_pair;
    struct figure figure;
    write_data(s, first, plot->data);
    snprintf(title, sizeof title, "double slit: two slits, %g apart and %g wide, hbar = %g",
             s->setup->apart, s->setup->sigma, s->setup->hbar);
    line_add(&line, "fringe %.4g, of thin slits %.4g", s->fringe, s->closed);
    line_add(&line, "the packet reaches the outer fringes later, so they are weaker");
    line_add(&line, "norm behind the slits %.3g", s->norm);
    fputs(DENSITY_PALETTE, plot->script);
    layout.title = title;
    layout.found = line.text;
    layout.frames = s->frames - first;
    figure_begin(&figure, plot, &layout);
    plane(&figure, s);
    screen(&figure, s);
    figure_end(&figure);
    return error->status;
}
