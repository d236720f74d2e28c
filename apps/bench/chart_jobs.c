/* leastaction chart jobs: time and remaining error of complete jobs, with the published settings
   and with ours. */
#include "chart.h"
#include "chart_jobs.h"
#include "quantum/published.h"
#include "apps/bench/measure/timing.h"

#include <math.h>
#include <stdlib.h>

static void published_side(double scale, double end, struct job_side *side, struct ad_error *error)
{
    struct qm_published p;
    double start = processor_seconds();
    if (qm_published_new(scale, &p, error) == AD_OK) {
        while (qm_published_advance(&p))
            ;
        *side =
            (struct job_side){processor_seconds() - start, fabs(p.mean[p.frames - 1] - end), false};
    }
    qm_published_free(&p);
}

/* *end: the position of the particle at the end. */
static void right_side(double scale, double *end, struct job_side *side, struct ad_error *error)
{
    struct phys_system system;
    struct qm_slice slice = {.size = sizeof slice};
    struct qm_gaussian packet;
    qm_propagator *propagator = NULL;
    qm_complex *psi = NULL;
    size_t steps;
    double start = processor_seconds();
    if (qm_published_right(scale, &system, &slice, &packet, &steps, error) == AD_OK) {
        psi = malloc(slice.grid.n * sizeof *psi);
        if (!psi)
            ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", slice.grid.n);
        else
            qm_packet(&slice.grid, slice.hbar, &packet, 1, 0, psi);
        if (psi && qm_propagator_new(&qm_method_kernel, &slice, &propagator, error) == AD_OK) {
            for (size_t k = 0; k < steps && error->status == AD_OK; k++)
                qm_propagate(propagator, 1, psi, error);
            double t = (double)steps * slice.dt, mean = qm_moments(&slice.grid, 1, psi).mean_x;
            side->seconds = processor_seconds() - start;
            qm_classical(&slice, &packet, 1, &t, end, error);
            side->error = fabs(mean - *end);
        }
    }
    qm_propagator_free(propagator);
    free(psi);
    phys_system_close(&system);
}

enum ad_status jobs_quantum(bool quick, struct job jobs[], size_t *n, struct ad_error *error)
{
    double scale = quick ? 0.3 : 1, end = NAN;
    struct job job = {.name = "packet in a box",
                      .group = "quantum",
                      .measure = "distance of the mean from the particle at the end"};
    right_side(scale, &end, &job.ours, error);
    if (error->status == AD_OK)
        published_side(scale, end, &job.published, error);
    job.level = job.ours.error <= job.published.error ? job.ours.seconds : INFINITY;
    if (error->status == AD_OK)
        jobs[(*n)++] = job;
    return error->status;
}

static const struct column columns[] = {
    {.key = "group", .title = "", .width = -8},
    {.key = "job", .title = "", .width = -16},
    {.key = "measure"},
    {.key = "published_seconds", .digits = 4, .title = "published (s)", .width = 13, .shown = 3},
    {.key = "published_error", .digits = 4, .title = "error", .width = 9, .shown = 2},
    {.key = "published_cut", .title = "cut", .width = -3},
    {.key = "our_seconds", .digits = 4, .title = "ours (s)", .width = 10, .shown = 3},
    {.key = "our_error", .digits = 4, .title = "error", .width = 9, .shown = 2},
    {.key = "our_cut", .title = "cut", .width = -3},
    {.key = "level_seconds", .digits = 4, .title = "as exact (s)", .width = 12, .shown = 3},
    {.key = NULL},
};

static void add_row(struct sheet *sheet, const struct job *j, struct ad_error *error)
{
    sheet_row(sheet,
              ROW(NAME(j->group), NAME(j->name), NAME(j->measure), NUMBER(j->published.seconds),
                  NUMBER(j->published.error), NAME(j->published.cut ? "yes" : "no"),
                  NUMBER(j->ours.seconds), NUMBER(j->ours.error), NAME(j->ours.cut ? "yes" : "no"),
                  NUMBER(j->level)),
              error);
}

/* ---- the picture: a line a job, published and ours joined; CPU time left, errors right ---- */

static const double least = 1e-17; /* errors below are drawn there */

/* Name and group, then CPU time and error of either side, and the time until ours is level. */
static void write_data(size_t n, const struct job jobs[], FILE *data)
{
    for (const struct job *j = jobs; j < jobs + n; j++)
        fprintf(data, "\"%s: %s\" %.4g %.4g %.4g %.4g %.4g\n", j->group, j->name,
                j->published.seconds, fmax(j->published.error, least), j->ours.seconds,
                fmax(j->ours.error, least), j->level);
}

/* Columns of the published and of our values; the names of jobs stand at the first panel. */
static void draw_panel(struct figure *figure, const struct panel *panel, int published, int ours,
                       const char *names)
{
    figure_panel(figure, panel);
    figure_element(figure,
                   "data using %d:0:($%d-$%d):(0) with vectors nohead lw 1.5 lc rgb '#c0c0c0' "
                   "notitle",
                   published, ours, published);
    figure_element(figure,
                   "data using %d:0%s with points pt 7 ps 1.1 lc rgb '#b8261b' title 'published "
                   "settings'",
                   published, names);
    figure_element(figure, "data using %d:0 with points pt 7 ps 1.1 lc rgb '#0b4f8a' title 'ours'",
                   ours);
}

static void draw(size_t n, const struct job jobs[], struct plot *plot)
{
    const struct layout layout = {.width = 1000,
                                  .height = 170 + 27 * (int)n,
                                  .columns = 2,
                                  .room = {0.19, 0.985, 0.14, 0.8},
                                  .gap = {0.04, 0}};
    char range[32];
    struct figure figure;
    struct panel panel = {.title = "CPU time of the whole job (s)",
                          .log = "x",
                          .y_range = range,
                          .key = "at screen 0.985,0.96 right top maxrows 1 samplen 0.5 width 1"};
    snprintf(range, sizeof range, "[%zu.6:-0.6]", n - 1);
    write_data(n, jobs, plot->data);
    figure_begin(&figure, plot, &layout);
    draw_panel(&figure, &panel, 2, 4, ":ytic(1)");
    figure_element(&figure, "data using 6:0 with points pt 6 ps 1.5 lw 1.5 lc rgb '#0b4f8a' title "
                            "'ours, until as exact as published'");
    panel.title = "relative error at the end";
    panel.key = NULL;
    panel.y_tics = "1 format ''";
    draw_panel(&figure, &panel, 3, 5, "");
    figure_end(&figure);
}

enum ad_status chart_jobs(struct chart *chart, struct ad_error *error)
{
    struct job jobs[JOBS_MOST];
    struct sheet *sheet = chart_sheet(chart, "jobs", columns, error);
    struct plot *plot = chart_picture(chart, "jobs", error);
    size_t n = 0;
    if (error->status != AD_OK || jobs_paths(chart->quick, jobs, &n, error) != AD_OK ||
        jobs_networks(chart->quick, jobs, &n, error) != AD_OK ||
        jobs_quantum(chart->quick, jobs, &n, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++)
        add_row(sheet, &jobs[k], error);
    if (!chart->quiet)
        puts("both by this library, one thread; cut: stopped by the limit of time; as exact: until "
             "the error is the published one");
    sheet_json(sheet, "jobs", &chart->json);
    draw(n, jobs, plot);
    return error->status;
}
