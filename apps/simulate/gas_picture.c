/* The picture of a gas (simulate.h). Data: a block of bodies a frame, then the pair
   distributions, then the order of all samples. */
#include "apps/output/axes.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>

enum { FRAMES = 80 };

struct frames {
    size_t n;       /* the last one is the end */
    size_t *sample; /* which sample each shows */
};

static bool choose_frames(const struct phys_motion_solution *s, bool animated,
                          struct frames *frames)
{
    frames->n = !animated ? 1 : s->n < FRAMES ? s->n : FRAMES;
    frames->sample = malloc(frames->n * sizeof *frames->sample);
    for (size_t f = 0; frames->sample && f < frames->n; f++)
        frames->sample[f] = frames->n > 1 ? f * (s->n - 1) / (frames->n - 1) : s->n - 1;
    return frames->sample != NULL;
}

static enum ad_status write_bodies(const struct phys_system *system, const double *q, FILE *out,
                                   struct ad_error *error)
{
    struct phys_order order;
    uint32_t *neighbours = malloc(system->bodies * sizeof *neighbours);
    if (!neighbours)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_order(system->bodies, q, phys_gas_shell(system), neighbours, NULL, &order, error) ==
        AD_OK)
        for (size_t i = 0; i < system->bodies; i++)
            fprintf(out, "%.6g %.6g %u\n", q[2 * i], q[2 * i + 1], neighbours[i]);
    fputs("\n\n", out);
    free(neighbours);
    return error->status;
}

static void write_distributions(const struct simulate_run *run, FILE *out)
{
    double sigma = phys_system_get(&run->system, "sigma");
    fputs("# r / sigma, g at the start; the same at the end\n", out);
    for (size_t k = 0; k < PHYS_GAS_BINS; k++) {
        double middle = ((double)k + 0.5) / PHYS_GAS_BINS / sigma;
        fprintf(out, "%.6g %.6g %.6g %.6g\n", middle * run->order_start.reach,
                run->order_start.g[k], middle * run->order_end.reach, run->order_end.g[k]);
    }
    fputs("\n\n", out);
}

static enum ad_status write_orders(const struct phys_motion_solution *s, FILE *out,
                                   struct ad_error *error)
{
    enum { MOST = 200 };
    const struct phys_system *system = s->system;
    size_t stride = (s->n + MOST - 1) / MOST;
    struct phys_order order;
    fputs("# t, neighbours, hexatic order\n", out);
    for (size_t i = 0; i < s->n; i += stride) {
        if (phys_order(system->bodies, s->x + 2 * i * system->dof, phys_gas_shell(system), NULL,
                       NULL, &order, error) != AD_OK)
            break;
        fprintf(out, "%.9g %.6g %.6g\n", s->t[i], order.neighbours, order.hexatic);
    }
    return error->status;
}

/* All frames share one square. */
static void bodies_axes(const struct phys_motion_solution *s, const struct frames *frames,
                        FILE *out)
{
    struct range x = {INFINITY, -INFINITY}, y = x;
    for (size_t f = 0; f < frames->n; f++)
        for (size_t k = 0; k < s->system->dof; k += 2) {
            range_widen(&x, s->x[2 * frames->sample[f] * s->system->dof + k]);
            range_widen(&y, s->x[2 * frames->sample[f] * s->system->dof + k + 1]);
        }
    fputs("set size ratio -1\n", out);
    axis_set(out, "x", "x", "1", range_with_margins(x, 0.03, 0.03), 0);
    axis_set(out, "y", "y", "1", range_with_margins(y, 0.03, 0.03), 0);
}

static void write_script(const struct simulate_run *run, const struct frames *frames, FILE *out)
{
    const struct phys_motion_solution *s = &run->motion;
    double radius = 0.5 * phys_system_get(&run->system, "sigma");
    fputs(""
          "set palette defined (0 '#d9d9d9', 1 '#f2c879', 2 '#f2b134', 3 '#e8743b', 4 '#8fc7e8', "
          "5 '#3c8dc5', 6 '#0b4f8a', 7 '#3f0a50') maxcolors 8\nset cbrange [-0.5:7.5]\n",
          out);
    fprintf(out, "array time[%zu] = [", frames->n);
    for (size_t f = 0; f < frames->n; f++)
        fprintf(out, "%s%.6g", f ? "," : "", s->t[frames->sample[f]]);
    fprintf(out,
            "]\ndo for [f = 0:%zu] {\n"
            "set multiplot title sprintf('gas: %zu bodies, friction %g, t = %%g', time[f + 1])\n"
            "set origin 0,0\nset size 0.54,0.94\nset lmargin 8\nset rmargin 11\n"
            "set cblabel 'neighbours' offset 0.5\nset cbtics 0,1,7\nunset key\n",
            frames->n - 1, run->system.bodies, phys_system_get(&run->system, "friction"));
    bodies_axes(s, frames, out);
    fprintf(
        out,
        "plot data index f using 1:2:(%.6g):3 with circles fs solid noborder lc palette notitle\n"
        "set size noratio\nset size 0.46,0.47\nset origin 0.54,0.47\nset rmargin 9\n"
        "set xrange [0:5]\nset yrange [0:*]\nset xlabel 'r / {/Symbol s}' offset 0,0.5\n"
        "set ylabel 'g(r)'\nset key inside top right\n"
        "plot 1 lc rgb '#b0b0b0' dt 2 notitle, \\\n"
        "    data index %zu using 1:2 with lines lw 1.5 lc rgb '#e8a33d' title 'start', \\\n"
        "    data index %zu using 3:4 with lines lw 1.8 lc rgb '#1f4e79' title 'end'\n",
        radius, frames->n, frames->n);
    fprintf(out,
            "set origin 0.54,0\nset xrange [0:%.9g]\nset yrange [0:6.3]\nset y2range [0:1.05]\n"
            "set ytics 0,1,6\nset y2tics 0,0.2,1\nset border 11\nset xlabel 't' offset 0,0.5\n"
            "set ylabel 'neighbours'\nset y2label 'hexatic order'\nset key at graph 0.98,0.36\n"
            "plot data index %zu using 1:2 with lines lw 1.8 lc rgb '#1f4e79' title 'neighbours', "
            "\\\n    data index %zu using 1:3 axes x1y2 with lines lw 1.8 lc rgb '#c0392b' title "
            "'hexatic order', \\\n    '+' using (time[f + 1]):(0):(0):(6.3) every ::0::0 with "
            "vectors nohead lc rgb '#b0b0b0' notitle\n"
            "unset y2tics\nunset y2label\nset border 3\nset ytics autofreq\n"
            "unset multiplot\n}\n",
            s->t[s->n - 1], frames->n + 1, frames->n + 1);
}

enum ad_status simulate_gas_picture(const struct simulate_run *run, struct plot *plot,
                                    struct ad_error *error)
{
    const struct phys_motion_solution *s = &run->motion;
    struct frames frames;
    plot->height = 520;
    if (!choose_frames(s, plot->animated, &frames))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t f = 0; f < frames.n && error->status == AD_OK; f++)
        write_bodies(&run->system, s->x + 2 * frames.sample[f] * s->system->dof, plot->data, error);
    write_distributions(run, plot->data);
    if (error->status == AD_OK && write_orders(s, plot->data, error) == AD_OK)
        write_script(run, &frames, plot->script);
    free(frames.sample);
    return error->status;
}
