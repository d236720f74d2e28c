/* The picture of a gas (simulate.h). Data: a block of bodies per frame, then the pair
   distributions, then the order of all samples. */
#include "apps/output/figure.h"
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
static void draw_bodies(struct figure *figure, const struct simulate_run *run,
                        const struct frames *frames)
{
    const struct phys_motion_solution *s = &run->motion;
    struct range x = {INFINITY, -INFINITY}, y = x;
    for (size_t f = 0; f < frames->n; f++)
        for (size_t k = 0; k < s->system->dof; k += 2) {
            range_widen(&x, s->x[2 * frames->sample[f] * s->system->dof + k]);
            range_widen(&y, s->x[2 * frames->sample[f] * s->system->dof + k + 1]);
        }
    figure_panel(figure, &(struct panel){.place = {0.07, 0.4, 0.13, 0.86},
                                         .across = {"x", NULL, range_with_margins(x, .03, .03), 0},
                                         .up = {"y", NULL, range_with_margins(y, .03, .03), 0},
                                         .equal = true});
    figure_element(figure,
                   "data index f using 1:2:(%.6g):3 with circles fs solid noborder lc palette "
                   "notitle",
                   0.5 * phys_system_get(&run->system, "sigma"));
}

static void draw_distributions(struct figure *figure, size_t block)
{
    figure_panel(figure, &(struct panel){.place = {0.6, 0.93, 0.55, 0.86},
                                         .x = "r / {/Symbol s}",
                                         .y = "g(r)",
                                         .x_range = "[0:5]",
                                         .y_range = "[0:*]",
                                         .key = KEY_ABOVE});
    figure_element(figure, "1 lc rgb '#b0b0b0' dt 2 notitle");
    figure_draw(figure, STYLE("#e69f00", 0, 1.5, 0), "start", "data index %zu using 1:2", block);
    figure_draw(figure, STYLE("#0072b2", 0, 1.8, 0), "end", "data index %zu using 3:4", block);
}

/* The grey line is the time of the frame. */
static void draw_orders(struct figure *figure, const struct phys_motion_solution *s, size_t block)
{
    figure_panel(figure, &(struct panel){.place = {0.6, 0.93, 0.1, 0.41},
                                         .across = {"t", NULL, {0, s->t[s->n - 1]}, 0},
                                         .y = "neighbours",
                                         .y_range = "[0:6.3]",
                                         .y_tics = "0,1,6",
                                         .key = KEY_ABOVE,
                                         .more = "set y2range [0:1.05]\nset y2tics 0,0.2,1\n"
                                                 "set y2label 'hexatic order'\n"});
    figure_draw(figure, STYLE("#0072b2", 0, 1.8, 0), "neighbours", "data index %zu using 1:2",
                block);
    figure_draw(figure, &(struct style){.colour = "#d55e00", .width = 1.8, .axes = "x1y2"},
                "hexatic order", "data index %zu using 1:3", block);
    figure_element(figure, "'+' using (time[f + 1]):(0):(0):(6.3) every ::0::0 with vectors nohead "
                           "lc rgb '#b0b0b0' notitle");
}

static void draw(const struct simulate_run *run, const struct frames *frames, struct plot *plot)
{
    const struct phys_motion_solution *s = &run->motion;
    char title[128];
    struct line line = {0};
    struct layout layout = {
        .height = 540, .expression = title, .found = line.text, .frames = frames->n};
    struct figure figure;
    FILE *out = plot->script;
    snprintf(title, sizeof title,
             "sprintf('gas: %zu bodies by %s, friction %g, t = %%g', time[f + 1])",
             run->system.bodies, s->integrator->name, phys_system_get(&run->system, "friction"));
    line_add(&line, "at the end: %.3g neighbours, hexatic order %.2g, peak of g %.3g",
             run->order_end.mean.neighbours, run->order_end.mean.hexatic, run->order_end.peak);
    if (s->keeps_energy)
        line_add(&line, "largest relative drift of the energy %.2g", s->info.energy_drift);
    fputs("set palette defined (0 '#d9d9d9', 1 '#f2c879', 2 '#f2b134', 3 '#e8743b', 4 '#8fc7e8', "
          "5 '#3c8dc5', 6 '#0b4f8a', 7 '#3f0a50') maxcolors 8\nset cbrange [-0.5:7.5]\n"
          "set cblabel 'neighbours' offset 0.5\nset cbtics 0,1,7\n",
          out);
    fprintf(out, "array time[%zu] = [", frames->n);
    for (size_t f = 0; f < frames->n; f++)
        fprintf(out, "%s%.6g", f ? "," : "", s->t[frames->sample[f]]);
    fputs("]\n", out);
    figure_begin(&figure, plot, &layout);
    draw_bodies(&figure, run, frames);
    draw_distributions(&figure, frames->n);
    draw_orders(&figure, s, frames->n + 1);
    figure_end(&figure);
}

enum ad_status simulate_gas_picture(const struct simulate_run *run, struct plot *plot,
                                    struct ad_error *error)
{
    const struct phys_motion_solution *s = &run->motion;
    struct frames frames;
    if (!choose_frames(s, plot->animated, &frames))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t f = 0; f < frames.n && error->status == AD_OK; f++)
        write_bodies(&run->system, s->x + 2 * frames.sample[f] * s->system->dof, plot->data, error);
    write_distributions(run, plot->data);
    if (error->status == AD_OK && write_orders(s, plot->data, error) == AD_OK)
        draw(run, &frames, plot);
    free(frames.sample);
    return error->status;
}
