/* leastaction simulate --ensemble: many motions, a row of a table each (simulate.h). */
#include "simulate_ensemble.h"
#include "apps/interrupt.h"
#include "physics/io/csv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
        {o->common.plot && !o->section,
         "--ensemble and --plot: there is no picture of many motions; "
         "give --section, --csv or --out"},
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
    const struct settings *set = &r->run->options->common.set;
    struct phys_ensemble_settings *s = &r->settings;
    if (phys_table_read_named(file, &s->n, &s->n_columns, &r->values, &r->names, error) != AD_OK)
        return error->status;
    for (size_t c = 0; c < s->n_columns; c++) {
        if (!r->names || !r->names[c])
            return ad_fail(error, AD_E_INPUT,
                           "%s:1: column %zu has no name; expected a coordinate, v_ and a "
                           "coordinate, or a parameter",
                           file, c + 1);
        for (size_t k = 0; k < set->n; k++)
            if (strcmp(set->setting[k].name, r->names[c]) == 0)
                return ad_fail(error, AD_E_ARGUMENT,
                               "--set, --scan: %s is a column of %s, which gives it to each "
                               "member; leave one out",
                               r->names[c], file);
    }
    s->names = (const char *const *)r->names;
    s->values = r->values;
    return AD_OK;
}

static enum ad_status follow(void *context, struct ad_error *error)
{
    struct ensemble_run *r = context;
    struct ad_error cause = {0};
    interrupt_catch();
    phys_ensemble_solve(&r->run->system, &r->settings, &r->ensemble, &cause);
    if (cause.status == AD_OK && simulate_section(r->run, &r->ensemble, error) == AD_OK &&
        r->run->diagnosis.n_warnings && !r->run->options->common.quiet)
        fprintf(stderr, "leastaction simulate: warning: %s\n", r->run->diagnosis.warning[0]);
    return cause.status == AD_OK ? error->status
                                 : ad_fail(error, cause.status, "%s: %.400s",
                                           r->run->options->ensemble, cause.message);
}

/* Every member has come to its last crossing. */
static enum ad_status judge_until(const struct ensemble_run *r, struct ad_error *error)
{
    const struct phys_ensemble *e = &r->ensemble;
    const struct phys_motion_settings *s = r->settings.motion;
    char rows[96] = "";
    size_t n = 0, length = 0;
    for (size_t i = 0; i < e->n; i++) {
        const struct phys_crossed *c = &e->member[i].crossed;
        if (c->n > 0 && s->crossings[(size_t)c->which[c->n - 1] - 1].last)
            continue;
        n++;
        if (length + 32 < sizeof rows)
            length += (size_t)snprintf(rows + length, sizeof rows - length, "%s%zu",
                                       length ? ", " : "", i + 1);
        else if (rows[length - 1] != '.')
            length += (size_t)snprintf(rows + length, sizeof rows - length, ", ...");
    }
    return n ? ad_fail(error, AD_E_ACCURACY,
                       "--until %s: %zu of %zu members not before t = %g; row%s %s; try a longer "
                       "--time",
                       r->run->options->until, n, e->n, s->time, n > 1 ? "s" : "", rows)
             : AD_OK;
}

static enum ad_status judge(const struct ensemble_run *r, struct ad_error *error)
{
    const struct phys_ensemble *e = &r->ensemble;
    if (e->interrupted)
        return ad_fail(error, AD_E_ACCURACY,
                       "interrupted: %zu of %zu members are complete; results are partial",
                       e->complete, e->n);
    struct ad_error missed = {0};
    if (phys_ensemble_met(&r->settings, e, &missed) != AD_OK)
        return simulate_refuse(e->missed && !e->failed ? "--tol: " : "", &missed, error);
    if (r->run->options->until && judge_until(r, error) != AD_OK)
        return error->status;
    return simulate_section_judge(r->run, error);
}

static enum ad_status picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct ensemble_run *r = context;
    return simulate_section_picture(r->run, plot, error);
}

enum ad_status simulate_ensemble(struct simulate_run *run, struct ad_error *error)
{
    static const struct output_kind outputs = {simulate_ensemble_report, simulate_ensemble_file,
                                               simulate_ensemble_csv, picture, NULL};
    struct ensemble_run r = {.run = run,
                             .settings = {.size = sizeof(struct phys_ensemble_settings),
                                          .motion = &run->settings,
                                          .threads = run->options->common.threads,
                                          .ranks = run->options->common.ranks}};
    if (check(run, error) == AD_OK && read_table(&r, error) == AD_OK &&
        outputs_run(&outputs, &run->options->common, &r, follow, error) == AD_OK)
        judge(&r, error);
    phys_ensemble_free(&r.ensemble);
    phys_fields_free(r.names, r.settings.n_columns);
    free(r.values);
    return error->status;
}
