/* The ephemeris from Horizons tables, and its distance from them (simulate.h). */
#include "simulate.h"

#include <stdlib.h>
#include <string.h>

enum { DAY = 86400, DAYS = 65 };

static enum ad_status check(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    if (strcmp(run->system.scene->name, "ephemeris") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--data is for the scene ephemeris only; leave it out");
    if (options_refuse(&o->common, "time", "with --data: give --days", error) != AD_OK ||
        options_refuse(&o->common, "samples every", "with --data: there is one sample a day",
                       error) != AD_OK)
        return error->status;
    if (!isnan(o->dt) && fabs(remainder(DAY, o->dt)) > 1e-9 * DAY)
        return ad_fail(error, AD_E_ARGUMENT, "--dt %g: expected a whole part of a day, %d s", o->dt,
                       DAY);
    return AD_OK;
}

/* The model becomes the run's system, start and method. */
static enum ad_status use_model(struct simulate_run *run, struct ad_error *error)
{
    struct phys_ephemeris_motion motion;
    struct phys_motion_settings *s = &run->settings;
    phys_ephemeris_motion_open(run->model, &run->tables, &motion, error);
    phys_system_close(&run->system);
    run->system = motion.system;
    s->q = run->start = motion.q;
    s->v = motion.v;
    s->integrator = motion.integrator;
    s->dt = s->tolerance = motion.setting;
    return error->status;
}

/* Where --dt and --tol do not say, integration may err by a hundredth of the model. */
static enum ad_status choose_steps(struct simulate_run *run, struct ad_error *error)
{
    struct phys_motion_settings *s = &run->settings;
    if (!s->integrator)
        s->integrator = phys_integrator_find("dop853", error);
    if (s->integrator->adaptive) {
        s->tolerance = s->tolerance > 0 ? s->tolerance : PHYS_EPHEMERIS_TIGHT;
        return AD_OK;
    }
    size_t dof = run->system.dof;
    struct phys_ephemeris_motion motion = {.system = run->system, .integrator = s->integrator};
    if (s->dt > 0)
        return AD_OK;
    if (!(motion.q = malloc(2 * dof * sizeof *motion.q)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    motion.v = motion.q + dof;
    if (run->system.scene->start(run->system.params, s->seed, motion.q, motion.v, error) == AD_OK)
        phys_ephemeris_choose_step(&motion, &run->tables, run->options->tolerance, error);
    s->dt = motion.setting;
    free(motion.q);
    return error->status;
}

enum ad_status simulate_ephemeris(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    struct phys_motion_settings *s = &run->settings;
    struct phys_ephemeris_tables *tables = &run->tables;
    bool given = options->integrator || options->rough || options->common.set.n > 0;
    size_t days = option_count_or(options->days, DAYS);
    struct ad_error cause = {0};
    if (check(run, error) != AD_OK)
        return error->status;
    if (phys_ephemeris_tables_read(options->data, options->from, days, tables, &cause) != AD_OK)
        return simulate_refuse(tables->n ? "--from, --days: " : "", &cause, error);
    s->time = (double)days * DAY;
    s->n_samples = days;
    s->no_reference = true;
    s->error = 0; /* it bounds the distance from the tables */
    if (!isnan(options->tolerance) && !given) {
        if (phys_ephemeris_least(tables, options->tolerance, &run->choice, &cause) != AD_OK)
            return simulate_refuse("--tol: ", &cause, error);
        run->model = &phys_ephemeris_models[run->choice.chosen];
        return use_model(run, error);
    }
    if (phys_ephemeris_use(&run->system, tables->n, tables->table, tables->first, days + 1,
                           run->system.dims, NULL, error) != AD_OK)
        return error->status;
    if (options->rough && phys_ephemeris_add(&run->system, options->rough,
                                             tables->table->jd[tables->first], error) != AD_OK)
        return error->status;
    return choose_steps(run, error);
}

void simulate_ephemeris_free(struct simulate_run *run)
{
    free(run->start);
    phys_ephemeris_tables_free(&run->tables);
}

/* ---- against the tables ---- */

/* Of the model's error; a smaller error of integration is not seen in the distance from tables. */
static const double unseen_share = 0.01;

enum ad_status simulate_ephemeris_compare(struct simulate_run *run, struct ad_error *error)
{
    struct phys_motion_solution *m = &run->motion;
    size_t dims = run->system.dims, dof = run->system.dof, days = run->tables.days;
    const struct phys_ephemeris_motion motion = {run->system, m->integrator, m->setting, m->start,
                                                 m->start + dof};
    struct phys_ephemeris_track seen = {0}, tight = {0};
    struct phys_ephemeris_track track = {.dims = dims, .row = 1, .column = 2 * dof, .x = m->x};
    while (track.n < m->n && track.n <= days && fabs(m->t[track.n] - (double)track.n * DAY) < 1)
        track.n++;
    if (!(m->distance = malloc(m->n * sizeof *m->distance)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ephemeris_track_tables(&run->tables, dims, &seen, error) == AD_OK &&
        phys_ephemeris_follow_tightly(&motion, days, &tight, error) == AD_OK) {
        tight.n = track.n;
        run->off.known = true;
        run->off.in_all = phys_ephemeris_compare(&track, &seen);
        run->off.model = phys_ephemeris_compare(&tight, &seen);
        run->off.integration = phys_ephemeris_compare(&track, &tight);
        m->error = 1e3 * run->off.in_all.worst;
        for (size_t i = 0; i < m->n; i++)
            m->distance[i] = i < track.n ? 0 : (double)NAN;
        for (size_t i = 0; i < track.n; m->error_end = m->distance[i++])
            for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++)
                m->distance[i] =
                    fmax(m->distance[i], 1e3 * phys_ephemeris_apart(&track, &seen, i, p));
    }
    phys_ephemeris_track_free(&seen);
    phys_ephemeris_track_free(&tight);
    return error->status;
}

enum ad_status simulate_ephemeris_judge(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    bool of_a_step = options->integrator && run->motion.integrator->adaptive;
    const struct phys_ephemeris_distances *off =
        options->integrator ? &run->off.integration : &run->off.in_all;
    if (!run->off.known || isnan(options->tolerance) || of_a_step ||
        off->worst <= options->tolerance)
        return AD_OK;
    return ad_fail(error, AD_E_ACCURACY, "--tol %g km: %s is %.3g km off, at %s; expected less",
                   options->tolerance, options->integrator ? "the integration" : "the model",
                   off->worst, phys_ephemeris_planet(off->worst_planet));
}

/* ---- in words ---- */

static const char *verdict(const struct simulate_run *run, size_t k)
{
    bool meets = run->choice.off[k].worst <= run->options->tolerance;
    return k == run->choice.chosen ? "chosen" : meets ? "more work" : "too far";
}

void simulate_ephemeris_report_models(const struct simulate_run *run, struct report *report)
{
    if (!run->tables.n)
        return;
    if (run->model)
        report_text(report, "model", NULL, run->model->name);
    if (run->choice.n == 0)
        report_texts(report, "models_tried", 0, NULL);
    for (size_t k = 0; k < run->choice.n; k++) {
        report_item(report, "models_tried");
        report_text(report, "model", "coarse to fine", phys_ephemeris_models[k].name);
        report_number(report, "km", "km off", NULL, run->choice.off[k].worst);
        report_text(report, "planet", "at", phys_ephemeris_planet(run->choice.off[k].worst_planet));
        report_count(report, "evaluations", "evaluations", run->choice.evaluations[k]);
        report_text(report, "verdict", "verdict", verdict(run, k));
    }
    report_item(report, NULL);
    if (run->model)
        report_line(report, "%s: the least that stays within %g km for %zu days; it adds %s\n",
                    run->model->name, run->options->tolerance, run->tables.days, run->model->adds);
}

static void report_distances(const char *name, const char *label, bool known,
                             const struct phys_ephemeris_distances *distances,
                             struct report *report)
{
    report->object = name;
    for (size_t k = 0; k < PHYS_EPHEMERIS_PLANETS; k++)
        report_number(report, phys_ephemeris_planet(k), label, NULL,
                      known ? distances->km[k] : (double)NAN);
    report->object = NULL;
}

void simulate_ephemeris_report(const struct simulate_run *run, struct report *report)
{
    bool known = run->off.known;
    double share = 0;
    if (!run->tables.n)
        return;
    if (known)
        report_line(report, "  %-24s %14s %14s %14s %14s", "from the tables, km",
                    phys_ephemeris_planet(0), phys_ephemeris_planet(1), phys_ephemeris_planet(2),
                    phys_ephemeris_planet(3));
    report_distances("km_from_tables", "  in all", known, &run->off.in_all, report);
    report_distances("km_of_model", "  model", known, &run->off.model, report);
    report_distances("km_of_integration", "  integration", known, &run->off.integration, report);
    for (size_t k = 0; k < PHYS_EPHEMERIS_PLANETS && known; k++)
        share = fmax(share, run->off.integration.km[k] / run->off.model.km[k]);
    report_number(report, "integration_share", "  integration / model", NULL,
                  known ? share : (double)NAN);
    if (share > unseen_share)
        report_line(report, "  a shorter --dt, a smaller --tol, or --integrator dop853 would show "
                            "the model alone");
}
