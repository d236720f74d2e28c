/* The picture of the published variant beside the right one: above the published, below the same
   scene done right; left the real part of the kernel, right the density over time. */
#include "apps/output/figure.h"
#include "quantum.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

enum { ACROSS = 300 };

/* Re K averaged over blocks, so that oscillations faster than the picture's resolution are white
   instead of a moire pattern. */
static double block(size_t n, const qm_complex *K, size_t a, size_t b, size_t size)
{
    double sum = 0;
    for (size_t i = a; i < a + size; i++)
        for (size_t j = b; j < b + size; j++)
            sum += creal(K[i * n + j]);
    return sum / (double)(size * size);
}

/* x_b x_a Re K in units of its largest entry, a scan an x_b. */
static void write_kernel(size_t n, const qm_complex *K, double low, double dx, FILE *out)
{
    size_t skip = n / ACROSS + 1;
    double most = 0, shift = 0.5 * (double)(skip - 1);
    for (size_t k = 0; k < n * n; k += skip)
        most = fmax(most, cabs(K[k]));
    for (size_t b = 0; b + skip <= n; b += skip, fputc('\n', out))
        for (size_t a = 0; a + skip <= n; a += skip)
            fprintf(out, "%.5g %.5g %.3g\n", low + ((double)b + shift) * dx,
                    low + ((double)a + shift) * dx, block(n, K, a, b, skip) / most);
    fputc('\n', out);
}

/* Blocks 0, 1: the published kernel and density; 2, 3: the right ones; 4: published time and mean;
   5: time, mean, particle. */
static void write_data(const struct qm_published *p, const struct quantum_run *run,
                       const struct qm_run_result *result, const qm_complex *K, FILE *out)
{
    const struct qm_grid *grid = &run->slice.grid;
    write_kernel(p->grid.n, p->K, 0, qm_dx(&p->grid), out);
    quantum_density(p->frames, p->grid.n, p->time, p->density, 0, qm_dx(&p->grid), out);
    write_kernel(grid->n, K, qm_x(grid, 0), qm_dx(grid), out);
    quantum_density(result->n, grid->n, result->t, result->density, qm_x(grid, 0), qm_dx(grid),
                    out);
    for (size_t k = 0; k < p->frames; k++)
        fprintf(out, "%.6g %.6g\n", p->time[k], p->mean[k]);
    fputs("\n\n", out);
    for (size_t k = 0; k < result->n; k++)
        fprintf(out, "%.6g %.6g %.6g\n", result->t[k], result->moments[k].mean_x,
                result->classical[k]);
}

static void kernel_panel(struct figure *figure, const char *title, int block)
{
    figure_panel(figure, &(struct panel){.title = title,
                                         .across = {"from x", NULL, {0, 8}, 0},
                                         .up = {"to x", NULL, {0, 8}, 0},
                                         .equal = true,
                                         .more = "set cbrange [-1:1]\nset palette defined "
                                                 "(-1 '#b8261b', 0 '#ffffff', 1 '#0b4f8a')\n"});
    figure_element(figure, "data index %d using 1:2:3 with image", block);
}

static void density_panel(struct figure *figure, const char *title, int block, double end,
                          bool particle)
{
    figure_panel(figure, &(struct panel){.title = title,
                                         .across = {"t", NULL, {0, end}, 0},
                                         .y = "x",
                                         .y_range = "[0:8]",
                                         .key = "top right opaque",
                                         .more = "set cbrange [0:*]\n" DENSITY_PALETTE});
    quantum_carpet(figure, block, particle ? 5 : 4, particle);
}

enum ad_status paper_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct paper *paper = context;
    const struct qm_published *p = &paper->old;
    const struct quantum_run *run = &paper->run;
    const struct qm_run_result *result = &run->result;
    size_t n = run->slice.grid.n;
    qm_complex *K = malloc(n * n * sizeof *K);
    if (!K)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    double end = fmax(result->t[result->n - 1], p->time[p->frames - 1]);
    char hbar[64], title[160];
    struct layout layout = figure_pair;
    struct figure figure;
    if (qm_kernel(&run->slice, K, error) == AD_OK)
        write_data(p, run, result, K, plot->data);
    free(K);
    snprintf(hbar, sizeof hbar, "a wave packet between walls, hbar = %.3g", p->hbar);
    layout.height = 920;
    layout.title = hbar;
    layout.found = "left: the kernel, its real part; right: the density over time";
    layout.rows = 2;
    layout.gap.x = 0.1;
    layout.room.bottom = 0.06;
    layout.room.top = 0.9;
    layout.gap.y = 0.13;
    fputs("unset colorbox\n", plot->script);
    figure_begin(&figure, plot, &layout);
    kernel_panel(&figure, "as published: Re K", 0);
    snprintf(title, sizeof title, "as published: aliased (%.3g rad), no potential acts", p->phases);
    density_panel(&figure, title, 1, end, false);
    kernel_panel(&figure, "done right: Re K between walls", 2);
    snprintf(title, sizeof title, "done right: %.3g rad, norm 1 - %.1g", M_PI * run->aliasing.ratio,
             fabs(1 - result->moments[result->n - 1].norm / result->moments[0].norm));
    density_panel(&figure, title, 3, end, true);
    figure_end(&figure);
    return error->status;
}
