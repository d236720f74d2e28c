/* What simulate --ensemble reports: sizes, errors, statistics at the end, members that failed. */
#include "simulate_ensemble.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_FAILURES = 12 };

static void report_final_spread(const struct phys_ensemble *e, struct report *report)
{
    static const char *const keys[PHYS_ENSEMBLE_QUANTILES] = {"q05", "q25", "q50", "q75", "q95"};
    static const char *const labels[PHYS_ENSEMBLE_QUANTILES] = {"5 %", NULL, "median", NULL,
                                                                "95 %"};
    for (size_t k = 0; k <= 2 * e->dof + 1; k++) {
        const struct phys_spread *s = &e->spread[e->n_times * (2 * e->dof + 1) + k];
        char name[SIMULATE_NAME];
        simulate_quantity(e->system, k, name);
        report_item(report, "end");
        report_text(report, "quantity", "at the end", name);
        report_count(report, "members", "members", s->n);
        report_number(report, "mean", "mean", NULL, s->mean);
        report_number(report, "deviation", "deviation", NULL, s->deviation);
        for (size_t q = 0; q < PHYS_ENSEMBLE_QUANTILES; q++)
            report_number(report, keys[q], labels[q], NULL, s->quantile[q]);
    }
    report_item(report, NULL);
}

/* How well the times of events are known. */
static void report_times(const struct ensemble_run *r, struct report *report)
{
    const struct phys_ensemble *e = &r->ensemble;
    double most = (double)NAN;
    size_t unknown = 0;
    for (size_t i = 0; i < e->n; i++)
        for (size_t k = 0; k < e->member[i].crossed.n; k++) {
            most = fmax(most, e->member[i].crossed.uncertainty[k]);
            unknown += isnan(e->member[i].crossed.uncertainty[k]) ? 1 : 0;
        }
    report_number(report, "crossings_uncertainty", "  their times, known to",
                  e->system->scene->time_unit, most);
    report_count(report, "crossings_unknown",
                 unknown && !r->settings.motion->no_reference ? "  of unknown error" : NULL,
                 unknown);
}

/* A list with a number of each member. */
static void report_members(const struct phys_ensemble *e, struct report *report)
{
    static const char *const keys[] = {"errors", "tolerances", "times", "member_steps",
                                       "failed_rows"};
    double *values = malloc(e->n * sizeof *values);
    report->failed |= !values;
    for (size_t k = 0; values && k < sizeof keys / sizeof *keys; k++) {
        size_t n = 0;
        for (size_t i = 0; i < e->n; i++) {
            const struct phys_member *m = &e->member[i];
            const double of[] = {m->error, m->tolerance, m->info.t, (double)m->info.steps,
                                 (double)i + 1};
            if (k < 4 || m->failure.status != AD_OK)
                values[n++] = of[k];
        }
        report_list(report, keys[k], NULL, NULL, n, values);
    }
    free(values);
}

static void report_errors(const struct ensemble_run *r, struct report *report)
{
    const struct phys_ensemble *e = &r->ensemble;
    const char *unit = e->system->scene->unit;
    double most = (double)NAN, row = (double)NAN;
    for (size_t i = 0; i < e->n; i++)
        if (!(e->member[i].error <= most) && !isnan(e->member[i].error)) {
            most = e->member[i].error;
            row = (double)i + 1;
        }
    report_number(report, "error", "error, largest estimate", unit, most);
    report_number(report, "error_row", "  of row", NULL, row);
    for (size_t k = 0; k < e->n_checked; k++) {
        report_item(report, "checked");
        report_count(report, "row", "by reference, row", e->checked[k] + 1);
        report_number(report, "estimate", "estimate", unit, e->member[e->checked[k]].error);
        report_number(report, "error", "error", unit, e->measured[k]);
        report_number(report, "reference_uncertainty", "known to", unit, e->uncertainty[k]);
    }
    report_item(report, NULL);
}

void simulate_ensemble_report(const void *context, struct report *report)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    const struct phys_scene *scene = e->system->scene;
    size_t steps = 0, events = 0, shown = 0;
    char part[32] = "";
    for (size_t i = 0; i < e->n; i++) {
        steps += e->member[i].info.steps;
        events += e->member[i].crossed.n;
    }
    if (e->interrupted)
        snprintf(part, sizeof part, "%zu of ", e->complete);
    report_line(report, "%s: %s%zu motions by %s to t = %g%s%s, %zu steps in %.3g s%s\n",
                scene->name, part, e->n, e->integrator->name, r->settings.motion->time,
                unit_blank(scene->time_unit), unit_shown(scene->time_unit), steps, e->seconds,
                e->interrupted ? ", interrupted" : "");
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "dof", NULL, e->dof);
    report_texts(report, "columns", r->settings.n_columns, r->settings.names);
    report_text(report, "integrator", NULL, e->integrator->name);
    report_count(report, "members", NULL, e->n);
    report_count(report, "complete", e->interrupted ? "complete members" : NULL, e->complete);
    report_count(report, "failed", e->failed ? "members that failed" : NULL, e->failed);
    report_count(report, "missed", e->missed ? "members that miss the error" : NULL, e->missed);
    report_count(report, "unknown",
                 e->unknown && !r->settings.motion->no_reference ? "members of unknown error"
                                                                 : NULL,
                 e->unknown);
    report_number(report, "time", NULL, scene->time_unit, r->settings.motion->time);
    report_count(report, "steps", NULL, steps);
    report_count(report, "crossings", r->settings.motion->n_crossings ? "events" : NULL, events);
    report_times(r, report);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", e->seconds);
    report_flag(report, "vectors", NULL, e->vectors);
    report->passing = false;
    report_errors(r, report);
    simulate_section_report(r->run, report);
    report_final_spread(e, report);
    report_members(e, report);
    for (size_t i = 0; i < e->n && shown < MOST_FAILURES; i++)
        if (e->member[i].failure.status != AD_OK && ++shown)
            report_line(report, "  row %zu failed at t = %g: %.300s", i + 1, e->member[i].info.t,
                        e->member[i].failure.message);
    if (e->failed > shown)
        report_line(report, "  and %zu more: --json has their rows", e->failed - shown);
}
