/* Part of leastaction chart integrators: members of an ensemble one after the other, several at
   once, and so on two threads. CPU time, in turn; the bits must be the same. */
#include "chart.h"
#include "apps/bench/measure/timing.h"
#include "physics/physics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMBERS = 1000, MEMBERS_QUICK = 64, ROUNDS = 7, COLUMNS = 2, WAYS = 3 };

static const struct way {
    size_t threads, at_once;
} ways[WAYS] = {{1, 1}, {1, 2}, {2, 2}};

static const struct job {
    const char *scene, *names[COLUMNS];
    double start[COLUMNS], time, tolerance;
} jobs[] = {
    {"dblpend", {"a", "b"}, {2, 2.5}, 30, 1e-6},
    {"dblpend", {"a", "b"}, {2, 2.5}, 30, 1e-9},
    {"dblpend", {"a", "b"}, {2, 2.5}, 30, 1e-12},
    {"kepler", {"x", "v_y"}, {0.4, 2}, 60, 1e-9},
    {"figure8", {"x1", "y1"}, {0.97, -0.243}, 30, 1e-9},
};

/* CPU seconds of a way, and its states, freed by the caller. */
static enum ad_status run_ensemble(const struct job *job, const struct way *way, size_t n,
                                   const double *values, double *seconds, double **states,
                                   size_t *n_states, struct ad_error *error)
{
    struct phys_system system = {0};
    struct phys_ensemble ensemble = {0};
    const struct phys_motion_settings motion = {.size = sizeof motion,
                                                .time = job->time,
                                                .tolerance = job->tolerance,
                                                .n_samples = 1,
                                                .no_reference = true};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = n,
                                                    .n_columns = COLUMNS,
                                                    .names = job->names,
                                                    .values = values,
                                                    .motion = &motion,
                                                    .threads = way->threads,
                                                    .at_once = way->at_once};
    if (phys_system_open(job->scene, &system, error) == AD_OK) {
        const double before = processor_seconds();
        phys_ensemble_solve(&system, &settings, &ensemble, error);
        *seconds = processor_seconds() - before;
        *states = ensemble.x;
        *n_states = ensemble.n * ensemble.n_times * 2 * ensemble.dof;
        ensemble.x = NULL;
    }
    phys_ensemble_free(&ensemble);
    phys_system_close(&system);
    return error->status;
}

static const struct column columns[] = {
    {.key = "scene", .title = "CPU us per member", .width = -17},
    {.key = "tolerance", .title = "tol", .width = 7, .shown = 1},
    {.key = "alone_us", .title = "alone", .width = 8, .shown = 1, .fixed = true},
    {.key = "together_us", .title = "at once", .width = 8, .shown = 1, .fixed = true},
    {.key = "together_ratio", .title = "ratio", .width = 6, .shown = 2, .fixed = true},
    {.key = "threads_us", .title = "2 threads", .width = 10, .shown = 1, .fixed = true},
    {.key = "threads_ratio", .title = "ratio", .width = 6, .shown = 2, .fixed = true},
    {.key = "same", .title = "same bits", .width = 10},
    {.key = NULL},
};

static enum ad_status add_job(struct chart *chart, struct sheet *sheet, const struct job *job,
                              double *values, struct ad_error *error)
{
    const size_t n = chart->quick ? MEMBERS_QUICK : MEMBERS, rounds = chart->quick ? 1 : ROUNDS;
    double seconds[WAYS][ROUNDS], ratio[2][ROUNDS], *states[WAYS] = {NULL};
    size_t n_states = 0;
    bool same = true;
    for (size_t k = 0; k < n * COLUMNS; k++) /* within 1e-3 of each other */
        values[k] = job->start[k % COLUMNS] + 1e-3 * fmod(0.6180339887498949 * (double)k, 1);
    for (size_t r = 0; r < rounds && error->status == AD_OK; r++) {
        for (size_t w = 0; w < WAYS && error->status == AD_OK; w++)
            run_ensemble(job, &ways[w], n, values, &seconds[w][r], &states[w], &n_states, error);
        for (size_t w = 0; w < WAYS; w++) {
            same =
                same && states[w] && memcmp(states[0], states[w], n_states * sizeof(double)) == 0;
            if (w > 0)
                free(states[w]);
        }
        free(states[0]);
        memset(states, 0, sizeof states);
        ratio[0][r] = seconds[0][r] / seconds[1][r];
        ratio[1][r] = 2 * seconds[0][r] / seconds[2][r];
    }
    if (error->status != AD_OK)
        return error->status;
    if (!same)
        chart->missed = "members at once and one after the other differ";
    const double us = 1e6 / (double)n;
    return sheet_row(
        sheet,
        ROW(NAME(job->scene), NUMBER(job->tolerance), NUMBER(us * time_median(rounds, seconds[0])),
            NUMBER(us * time_median(rounds, seconds[1])), NUMBER(time_median(rounds, ratio[0])),
            NUMBER(us * time_median(rounds, seconds[2])), NUMBER(time_median(rounds, ratio[1])),
            NAME(same ? "yes" : "no")),
        error);
}

enum ad_status chart_ensembles(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "ensembles", columns, error);
    double *values = malloc(MEMBERS * COLUMNS * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for an ensemble");
    for (size_t k = 0; k < sizeof jobs / sizeof *jobs && error->status == AD_OK; k++)
        add_job(chart, sheet, &jobs[k], values, error);
    free(values);
    sheet_json(sheet, "ensembles", &chart->json);
    return error->status;
}
