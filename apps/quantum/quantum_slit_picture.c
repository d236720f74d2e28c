/* The picture of the double slit: left the density in the plane, square root, so that the fringes
   show beside the packet that made them; right the intensity along the screen over the closed form.
   A GIF shows the left side moving. */
#include "apps/output/axes.h"
#include "apps/output/figure.h"
#include "quantum_slit.h"

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

static void plane(const struct qm_slit *s, FILE *out)
{
    axis_set(out, "x", "x", "1", (struct range){s->x.low, s->x.high}, 0);
    axis_set(out, "y", "y", "1", (struct range){s->y.low, s->y.high}, 0);
    fputs("unset key\nset colorbox\nset cblabel 'square root of the density'\nunset object\nunset "
          "arrow\n",
          out);
    double edges[] = {s->y.low, -s->setup.apart / 2, s->setup.apart / 2, s->y.high};
    for (size_t k = 0; k < 3; k++) /* between the slits and beyond them */
        fprintf(out, "set arrow from 0,%g to 0,%g nohead lw 4 lc rgb '#303030' front\n",
                edges[k] + (k > 0 ? 1.5 * s->setup.sigma : 0),
                edges[k + 1] - (k < 2 ? 1.5 * s->setup.sigma : 0));
    fprintf(out, "set arrow from %g,%g to %g,%g nohead lw 1.5 dt (6,4) lc rgb '#e8743b' front\n",
            s->setup.speed * s->setup.flight, s->y.low, s->setup.speed * s->setup.flight,
            s->y.high);
    fprintf(out, "set cbrange [0:*]\nplot data index 1+f using 1:2:3 with image, NaN notitle\n"
                 "unset arrow\n");
}

static void screen(const struct qm_slit *s, FILE *out)
{
    double most = 0;
    for (size_t b = 0; b < s->y.n; b++)
        most = fmax(most, s->screen[b]);
    axis_set(out, "x", "y along the screen", "1", (struct range){s->y.low, s->y.high}, 0);
    fprintf(out,
            "set yrange [0:%g]\nset ylabel 'intensity'\nset key top right\n"
            "plot data index 0 using 1:3 with lines lw 4 lc rgb '#f2c9ae' title 'thin slits (outer "
            "lobes arrive later)', \\\n"
            "    data index 0 using 1:2 with lines lw 1.8 lc rgb '#0b4f8a' title 'screen, fringe "
            "%.4g'\n",
            1.25 * most, s->fringe);
}

enum ad_status slit_picture(const void *run, struct plot *plot, struct ad_error *error)
{
    const struct qm_slit *s = &((const struct slit_run *)run)->slit;
    FILE *out = plot->script;
    size_t first = plot->animated ? 0 : s->frames - 1;
    write_data(s, first, plot->data);
    fputs(DENSITY_PALETTE, out);
    fprintf(out, "do for [f = 0:%zu] {\n", s->frames - 1 - first);
    fprintf(out,
            "set multiplot layout 1,2 title 'two slits, %g apart and %g wide, hbar = %g: fringe "
            "%.4g, of "
            "thin slits %.4g'\n",
            s->setup.apart, s->setup.sigma, s->setup.hbar, s->fringe, s->closed);
    plane(s, out);
    screen(s, out);
    fputs("unset multiplot\n}\n", out);
    return error->status;
}
