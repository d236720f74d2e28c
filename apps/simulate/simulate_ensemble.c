/* leastaction simulate --ensemble: many motions, a row of a table each (simulate.h). */
#include "simulate.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "apps/output/unit.h"
#include "physics/io/csv.h"
#include "physics/motion/ensemble.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NAME = 72, MOST_FAILURES = 12 };

struct ensemble_run {
    const struct simulate_run *run;
    struct phys_ensemble_settings settings;
    struct phys_ensemble ensemble;
    char **names; /* [settings.n_columns], NULL where a column has none */
    double *values;
};

static enum ad_status check(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    const struct phys_integrator *given = run->settings.integrator;
    const struct conflict conflicts[] = {
        {o->every != OPTION_NO_COUNT, "--ensemble and --every: members have steps of their own; "
                                      "give --samples N"},
        {!isnan(o->dt), "--ensemble and --dt: members have steps of their own; give --tol E"},
        {o->reverse || !isnan(o->horizon) || o->sensitivity || o->lyapunov != OPTION_NO_COUNT,
         "--ensemble: not with --reverse, --horizon, --sensitivity or --lyapunov, which are of one "
         "motion"},
        {o->data != NULL, "--ensemble and --data: expected one of them; leave the other out"},
        {o->common.plot != NULL, "--ensemble and --plot: there is no picture of many motions; "
                                 "give --csv or --out"},
    };
    if (options_conflicts(sizeof conflicts / sizeof *conflicts, conflicts, error) == AD_OK &&
        given && !given->adaptive)
        ad_fail(error, AD_E_ARGUMENT,
                "--ensemble and --integrator %s: members have steps of their own; give taylor, "
                "dop853 or dopri5",
                given->name);
    return error->status;
}

static enum ad_status read_table(struct ensemble_run *r, struct ad_error *error)
{
    const char *file = r->run->options->ensemble;
    struct phys_ensemble_settings *s = &r->settings;
    if (phys_table_read_named(file, &s->n, &s->n_columns, &r->values, &r->names, error) != AD_OK)
        return error->status;
    for (size_t c = 0; c < s->n_columns; c++)
        if (!r->names || !r->names[c])
            return ad_fail(error, AD_E_INPUT,
                           "%s:1: column %zu has no name; expected a coordinate, v_ and a "
                           "coordinate, or a parameter",
                           file, c + 1);
    s->names = (const char *const *)r->names;
    s->values = r->values;
    return AD_OK;
}

/* ---- report ---- */

static void quantity_name(const struct phys_ensemble *e, size_t k, char *name)
{
    char coordinate[64];
    if (k == 2 * e->dof) {
        memcpy(name, "energy", sizeof "energy");
        return;
    }
    phys_coordinate_name(e->system, k % e->dof, coordinate, sizeof coordinate);
    snprintf(name, NAME, "%s%s", k < e->dof ? "" : "v_", coordinate);
}

static void report_spread(const struct phys_ensemble *e, struct report *report)
{
    static const char *const keys[PHYS_ENSEMBLE_QUANTILES] = {"q05", "q25", "q50", "q75", "q95"};
    static const char *const labels[PHYS_ENSEMBLE_QUANTILES] = {"5 %", NULL, "median", NULL,
                                                                "95 %"};
    for (size_t k = 0; k <= 2 * e->dof; k++) {
        const struct phys_spread *s = &e->spread[(e->n_times - 1) * (2 * e->dof + 1) + k];
        char name[NAME];
        quantity_name(e, k, name);
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

static void ensemble_report(const void *context, struct report *report)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    const struct phys_scene *scene = e->system->scene;
    size_t steps = 0, events = 0, shown = 0;
    for (size_t i = 0; i < e->n; i++) {
        steps += e->member[i].info.steps;
        events += e->member[i].crossed.n;
    }
    report_line(report, "%s: %zu motions by %s to t = %g%s%s, %zu steps in %.3g s\n", scene->name,
                e->n, e->integrator->name, r->settings.motion.time, unit_blank(scene->time_unit),
                unit_shown(scene->time_unit), steps, e->seconds);
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "dof", NULL, e->dof);
    report_texts(report, "columns", r->settings.n_columns, r->settings.names);
    report_text(report, "integrator", NULL, e->integrator->name);
    report_count(report, "members", NULL, e->n);
    report_count(report, "failed", e->failed ? "members that failed" : NULL, e->failed);
    report_count(report, "missed", e->missed ? "members that miss the error" : NULL, e->missed);
    report_count(report, "unknown",
                 e->unknown && !r->settings.motion.no_reference ? "members of unknown error" : NULL,
                 e->unknown);
    report_number(report, "time", NULL, scene->time_unit, r->settings.motion.time);
    report_count(report, "steps", NULL, steps);
    report_count(report, "crossings", r->settings.motion.n_crossings ? "events" : NULL, events);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", e->seconds);
    report_flag(report, "vectors", NULL, e->vectors);
    report->passing = false;
    report_errors(r, report);
    report_spread(e, report);
    report_members(e, report);
    for (size_t i = 0; i < e->n && shown < MOST_FAILURES; i++)
        if (e->member[i].failure.status != AD_OK && ++shown)
            report_line(report, "  row %zu failed at t = %g: %.300s", i + 1, e->member[i].info.t,
                        e->member[i].failure.message);
    if (e->failed > shown)
        report_line(report, "  and %zu more: --json has their rows", e->failed - shown);
}

/* ---- files ---- */

/* A row for each member and time that it reached. */
static void ensemble_csv(const void *context, FILE *out)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    char name[NAME];
    fputs("row,t", out);
    for (size_t k = 0; k <= 2 * e->dof; k++) {
        quantity_name(e, k, name);
        fprintf(out, ",%s", name);
    }
    fputc('\n', out);
    for (size_t i = 0; i < e->n; i++)
        for (size_t j = 0; j < e->n_times; j++) {
            const size_t at = i * e->n_times + j;
            const double *x = e->x + 2 * e->dof * at;
            if (isnan(x[0]))
                break;
            fprintf(out, "%zu,%.17g", i + 1, e->t[j]);
            for (size_t k = 0; k < 2 * e->dof; k++)
                fprintf(out, ",%.17g", x[k]);
            fprintf(out, ",%.17g\n", e->energy[at]);
        }
}

/* Coordinates (half 0) or velocities, [members x dof x times]. */
static enum ad_status file_half(const struct phys_ensemble *e, size_t half, const char *name,
                                const char *unit, phys_hdf5 *file, struct ad_error *error)
{
    double *values = malloc(e->n * e->dof * e->n_times * sizeof *values), *to = values;
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < e->n; i++)
        for (size_t k = half * e->dof; k < (half + 1) * e->dof; k++)
            for (size_t j = 0; j < e->n_times; j++)
                *to++ = e->x[(i * e->n_times + j) * 2 * e->dof + k];
    phys_hdf5_write(file, name, AD_F64, 3, (size_t[]){e->n, e->dof, e->n_times}, values);
    phys_hdf5_text(file, name, "axes", "row, coordinate, time");
    phys_hdf5_text(file, name, "unit", unit);
    free(values);
    return error->status;
}

/* The folder "spread": [2 dof + 1 x times], coordinates, velocities and energy. */
static enum ad_status file_spread(const struct phys_ensemble *e, phys_hdf5 *file,
                                  struct ad_error *error)
{
    static const char *const names[] = {"spread/members", "spread/mean", "spread/deviation",
                                        "spread/q05",     "spread/q25",  "spread/q50",
                                        "spread/q75",     "spread/q95"};
    const size_t n = 2 * e->dof + 1;
    double *values = malloc(n * e->n_times * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_folder(file, "spread");
    for (size_t what = 0; what < sizeof names / sizeof *names; what++) {
        for (size_t k = 0; k < n; k++)
            for (size_t j = 0; j < e->n_times; j++) {
                const struct phys_spread *s = &e->spread[j * n + k];
                values[k * e->n_times + j] = what == 0   ? (double)s->n
                                             : what == 1 ? s->mean
                                             : what == 2 ? s->deviation
                                                         : s->quantile[what - 3];
            }
        phys_hdf5_write(file, names[what], AD_F64, 2, (size_t[]){n, e->n_times}, values);
        phys_hdf5_text(file, names[what], "axes", "coordinates, velocities and energy; time");
    }
    free(values);
    return error->status;
}

/* The folder "events": of all members in turn. */
static enum ad_status file_events(const struct ensemble_run *r, phys_hdf5 *file,
                                  struct ad_error *error)
{
    static const char *const names[] = {"events/row", "events/number", "events/time",
                                        "events/uncertainty", "events/touch"};
    const struct phys_ensemble *e = &r->ensemble;
    size_t n = 0, states = 2 * e->dof;
    for (size_t i = 0; i < e->n; i++)
        n += e->member[i].crossed.n;
    if (r->settings.motion.n_crossings == 0)
        return AD_OK;
    double *values = malloc((n + 1) * states * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_folder(file, "events");
    for (size_t what = 0; n > 0 && what <= sizeof names / sizeof *names; what++) {
        double *to = values;
        for (size_t i = 0; i < e->n; i++) {
            const struct phys_crossed *c = &e->member[i].crossed;
            for (size_t k = 0; k < c->n; k++) {
                const double of[] = {(double)i + 1, c->which[k], c->t[k], c->uncertainty[k],
                                     c->touch[k]};
                for (size_t s = 0; what == sizeof names / sizeof *names && s < states; s++)
                    *to++ = c->x[k * states + s];
                if (what < sizeof names / sizeof *names)
                    *to++ = of[what];
            }
        }
        if (what < sizeof names / sizeof *names)
            phys_hdf5_write(file, names[what], AD_F64, 1, &n, values);
        else
            phys_hdf5_write(file, "events/state", AD_F64, 2, (size_t[]){n, states}, values);
    }
    free(values);
    return error->status;
}

static enum ad_status ensemble_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    const struct phys_scene *scene = e->system->scene;
    char speed[64];
    const char *time = unit_shown(scene->time_unit);
    snprintf(speed, sizeof speed, "%s%s%s", scene->unit, *time ? "/" : "", time);
    phys_hdf5_integer(file, "/", "seed", (int64_t)r->run->options->common.seed, NULL);
    report_parameters(e->system, file);
    phys_hdf5_write(file, "columns", AD_F64, 2, (size_t[]){r->settings.n, r->settings.n_columns},
                    r->settings.values);
    phys_hdf5_text(file, "columns", "axes", "row, column");
    phys_hdf5_write(file, "time", AD_F64, 1, &e->n_times, e->t);
    phys_hdf5_text(file, "time", "unit", scene->time_unit);
    phys_hdf5_write(file, "energy", AD_F64, 2, (size_t[]){e->n, e->n_times}, e->energy);
    phys_hdf5_text(file, "energy", "unit", scene->energy_unit);
    phys_hdf5_text(file, "energy", "axes", "row, time");
    if (file_half(e, 0, "path", scene->unit, file, error) == AD_OK &&
        file_half(e, 1, "velocity", speed, file, error) == AD_OK &&
        file_spread(e, file, error) == AD_OK)
        file_events(r, file, error);
    return error->status;
}

/* ---- the run ---- */

static enum ad_status follow(void *context, struct ad_error *error)
{
    struct ensemble_run *r = context;
    struct ad_error cause = {0};
    interrupt_catch();
    phys_ensemble_solve(&r->run->system, &r->settings, &r->ensemble, &cause);
    return cause.status == AD_OK ? AD_OK
                                 : ad_fail(error, cause.status, "%s: %.400s",
                                           r->run->options->ensemble, cause.message);
}

static enum ad_status judge(const struct ensemble_run *r, struct ad_error *error)
{
    const struct phys_ensemble *e = &r->ensemble;
    if (e->interrupted)
        return ad_fail(error, AD_E_ACCURACY, "interrupted; results are partial");
    struct ad_error missed = {0};
    if (phys_ensemble_met(&r->settings, e, &missed) != AD_OK)
        return simulate_refuse(e->missed && !e->failed ? "--tol: " : "", &missed, error);
    for (size_t i = 0; r->run->options->until && i < e->n; i++)
        if (e->member[i].info.stop == PHYS_SIMULATION_END)
            return ad_fail(error, AD_E_ACCURACY,
                           "--until %s: row %zu: not before t = %g; try a longer --time",
                           r->run->options->until, i + 1, e->member[i].info.t);
    return AD_OK;
}

enum ad_status simulate_ensemble(const struct simulate_run *run, struct ad_error *error)
{
    static const struct output_kind outputs = {ensemble_report, ensemble_file, ensemble_csv, NULL,
                                               NULL};
    struct ensemble_run r = {
        .run = run, .settings = {.motion = run->settings, .threads = run->options->common.threads}};
    if (check(run, error) == AD_OK && read_table(&r, error) == AD_OK &&
        outputs_run(&outputs, &run->options->common, &r, follow, error) == AD_OK)
        judge(&r, error);
    phys_ensemble_free(&r.ensemble);
    phys_fields_free(r.names, r.settings.n_columns);
    free(r.values);
    return error->status;
}
