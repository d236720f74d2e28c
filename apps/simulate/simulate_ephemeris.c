/* The ephemeris from and against Horizons tables (simulate.h): --tol KM takes the least model that
   stays that near to them. A model is less than another if it takes fewer bodies and effects into
   account, and among equals if it asks for fewer forces. */
#include "simulate.h"

#include <stdlib.h>
#include <string.h>

enum { DAY = 86400 };

static enum ad_status check(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    const struct {
        const char *name;
        bool given;
        const char *instead;
    } rows[] = {
        {"time", !isnan(o->time), "give --days"},
        {"samples", o->samples != OPTION_NO_COUNT, "there is one a day"},
        {"every", o->every != OPTION_NO_COUNT, "there is one sample a day"},
    };
    if (strcmp(run->system.scene->name, "ephemeris") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--data is for the scene ephemeris alone; leave it out");
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        if (rows[k].given)
            return ad_fail(error, AD_E_ARGUMENT, "--%s with --data: %s", rows[k].name,
                           rows[k].instead);
    if (!isnan(o->dt) && fabs(remainder(DAY, o->dt)) > 1e-9 * DAY)
        return ad_fail(error, AD_E_ARGUMENT, "--dt %g: expected a whole part of a day, %d s", o->dt,
                       DAY);
    return AD_OK;
}

/* ---- the least model ---- */

static bool model_given(const struct simulate_options *options)
{
    return options->integrator || options->rough || options->set.n > 0;
}

static bool same_content(const struct ephemeris_model *a, const struct ephemeris_model *b)
{
    bool same_bodies =
        a->rough && b->rough ? strcmp(a->rough, b->rough) == 0 : a->rough == b->rough;
    return same_bodies && a->relativity == b->relativity;
}

static bool meets(const struct simulate_run *run, size_t k)
{
    return run->tried[k].most.worst <= run->options->tolerance;
}

static enum ad_status out_of_reach(const struct simulate_run *run, struct ad_error *error)
{
    size_t best = 0;
    for (size_t k = 1; k < run->n_tried; k++)
        if (run->tried[k].most.worst < run->tried[best].most.worst)
            best = k;
    return ad_fail(error, AD_E_ACCURACY,
                   "--tol %g km: none of the models comes so near; the best (%s) is %.3g km off, "
                   "at %s; fewer --days bring it nearer",
                   run->options->tolerance, ephemeris_models[best].name,
                   run->tried[best].most.worst,
                   ephemeris_planet(run->tried[best].most.worst_planet));
}

static enum ad_status try_models(struct simulate_run *run, struct ad_error *error)
{
    const struct ephemeris_model *models = ephemeris_models, *found = NULL;
    for (size_t k = 0; k < EPHEMERIS_MODELS && error->status == AD_OK; k++) {
        if (found && !same_content(found, &models[k]))
            break;
        run->n_tried++;
        if (ephemeris_measure(&models[k], &run->tables, &run->tried[k], error) != AD_OK)
            break;
        if (meets(run, k) &&
            (!found || run->tried[k].evaluations < run->tried[run->chosen].evaluations)) {
            run->chosen = k;
            found = &models[k];
        }
    }
    run->model = found;
    return error->status != AD_OK || found ? error->status : out_of_reach(run, error);
}

static enum ad_status take_over(struct simulate_run *run, struct ad_error *error)
{
    struct ephemeris_motion motion;
    enum ad_status status = ephemeris_motion_open(run->model, &run->tables, &motion, error);
    phys_system_close(&run->system);
    free(run->q);
    run->system = motion.system;
    run->q = motion.q;
    run->v = motion.v;
    run->integrator = motion.integrator;
    run->dt = run->tolerance = motion.setting;
    return status;
}

enum ad_status simulate_ephemeris(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    struct ephemeris_tables *tables = &run->tables;
    if (check(run, error) != AD_OK ||
        ephemeris_tables_open(options->data, options->from, options->days, tables, error) != AD_OK)
        return error->status;
    run->time = (double)tables->days * DAY;
    if (!isnan(options->tolerance) && !model_given(options))
        return try_models(run, error) == AD_OK ? take_over(run, error) : error->status;
    if (phys_ephemeris_use(&run->system, tables->n, tables->table, tables->first, tables->days + 1,
                           run->system.dims, NULL, error) == AD_OK &&
        options->rough)
        phys_ephemeris_add(&run->system, options->rough, tables->table->jd[tables->first], error);
    return error->status;
}

void simulate_ephemeris_free(struct simulate_run *run)
{
    for (size_t k = 0; k < run->n_tried; k++)
        ephemeris_errors_free(&run->tried[k]);
    ephemeris_tables_close(&run->tables);
}

/* ---- against the tables ---- */

/* Of the model's error; a smaller error of integration is not seen in the distance from tables. */
static const double unseen_share = 0.01;

static struct ephemeris_motion motion_of(const struct simulate_run *run)
{
    return (struct ephemeris_motion){.system = run->system,
                                     .integrator = run->integrator,
                                     .setting =
                                         run->integrator->adaptive ? run->tolerance : run->dt,
                                     .q = run->q,
                                     .v = run->v};
}

enum ad_status simulate_ephemeris_steps(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    struct ephemeris_track seen = {0}, tight = {0};
    size_t days = run->tables.days;
    if (!run->integrator)
        run->integrator = phys_integrator_find("dop853", error);
    struct ephemeris_motion motion = motion_of(run);
    if (run->integrator->adaptive) {
        bool of_a_step = options->integrator && !isnan(options->tolerance);
        run->tolerance = of_a_step ? options->tolerance : EPHEMERIS_TIGHT;
        return AD_OK;
    }
    if (!isnan(options->dt))
        return AD_OK;
    if (ephemeris_track_tables(&run->tables, run->system.dims, &seen, error) == AD_OK &&
        ephemeris_follow_tightly(&motion, days, &tight, error) == AD_OK) {
        struct ephemeris_distances model = ephemeris_compare(&tight, &seen);
        for (size_t p = 0; p < EPHEMERIS_PLANETS; p++)
            model.km[p] = option_number_or(options->tolerance, unseen_share * model.km[p]);
        if (ephemeris_choose_step(&motion, days, &tight, model.km, error) == AD_OK)
            run->dt = motion.setting;
    }
    ephemeris_track_free(&seen);
    ephemeris_track_free(&tight);
    return error->status;
}

enum ad_status simulate_ephemeris_compare(const struct simulate_run *run,
                                          struct simulate_result *result, struct ad_error *error)
{
    const struct simulate_samples *s = &result->samples;
    struct ephemeris_motion motion = motion_of(run);
    struct ephemeris_track seen = {0}, tight = {0}, track = {0};
    size_t dims = run->system.dims, days = run->tables.days;
    if (ephemeris_track_samples(dims, days, s->n, s->t, s->x, 2 * s->dof, &track, error) == AD_OK &&
        ephemeris_track_tables(&run->tables, dims, &seen, error) == AD_OK &&
        ephemeris_follow_tightly(&motion, days, &tight, error) == AD_OK) {
        tight.n = track.n;
        result->tables.known = true;
        result->tables.in_all = ephemeris_compare(&track, &seen);
        result->tables.model = ephemeris_compare(&tight, &seen);
        result->tables.integration = ephemeris_compare(&track, &tight);
        result->error = 1e3 * result->tables.in_all.worst;
        for (size_t i = 0; i < s->n; i++)
            result->distance[i] = i < track.n ? 0 : (double)NAN;
        for (size_t i = 0; i < track.n; i++) {
            for (size_t p = 0; p < EPHEMERIS_PLANETS; p++)
                result->distance[i] =
                    fmax(result->distance[i], 1e3 * ephemeris_apart(&track, &seen, i, p));
            result->error_end = result->distance[i];
        }
    }
    ephemeris_track_free(&seen);
    ephemeris_track_free(&tight);
    ephemeris_track_free(&track);
    return error->status;
}

enum ad_status simulate_ephemeris_judge(const struct simulate_run *run,
                                        const struct simulate_result *result,
                                        struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    bool of_a_step = options->integrator && run->integrator->adaptive;
    const struct ephemeris_distances *off =
        options->integrator ? &result->tables.integration : &result->tables.in_all;
    if (!result->tables.known || isnan(options->tolerance) || of_a_step ||
        off->worst <= options->tolerance)
        return AD_OK;
    return ad_fail(error, AD_E_ACCURACY, "--tol %g km: %s is %.3g km off, at %s; expected less",
                   options->tolerance, options->integrator ? "the integration" : "the model",
                   off->worst, ephemeris_planet(off->worst_planet));
}

/* ---- in words ---- */

static const char *verdict(const struct simulate_run *run, size_t k)
{
    return k == run->chosen ? "chosen" : meets(run, k) ? "more work" : "too far";
}

void simulate_ephemeris_report_models(const struct simulate_run *run, struct report *report)
{
    if (!run->tables.n)
        return;
    if (run->model)
        report_text(report, "model", NULL, run->model->name);
    if (run->n_tried == 0)
        report_texts(report, "models_tried", 0, NULL);
    for (size_t k = 0; k < run->n_tried; k++) {
        report_item(report, "models_tried");
        report_text(report, "model", "coarse to fine", ephemeris_models[k].name);
        report_number(report, "km", "km off", NULL, run->tried[k].most.worst);
        report_text(report, "planet", "at", ephemeris_planet(run->tried[k].most.worst_planet));
        report_count(report, "evaluations", "evaluations", run->tried[k].evaluations);
        report_text(report, "verdict", "verdict", verdict(run, k));
    }
    report_item(report, NULL);
    if (run->model)
        report_line(report, "%s: the least that stays within %g km for %zu days; it adds %s\n",
                    run->model->name, run->options->tolerance, run->tables.days, run->model->adds);
}

static void report_distances(const char *name, const char *label, bool known,
                             const struct ephemeris_distances *distances, struct report *report)
{
    report->object = name;
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        report_number(report, ephemeris_planet(k), label, NULL,
                      known ? distances->km[k] : (double)NAN);
    report->object = NULL;
}

void simulate_ephemeris_report(const struct simulate_run *run, const struct simulate_result *result,
                               struct report *report)
{
    bool known = result->tables.known;
    double share = 0;
    if (!run->tables.n)
        return;
    if (known)
        report_line(report, "  %-24s %14s %14s %14s %14s", "from the tables, km",
                    ephemeris_planet(0), ephemeris_planet(1), ephemeris_planet(2),
                    ephemeris_planet(3));
    report_distances("km_from_tables", "  in all", known, &result->tables.in_all, report);
    report_distances("km_of_model", "  model", known, &result->tables.model, report);
    report_distances("km_of_integration", "  integration", known, &result->tables.integration,
                     report);
    for (size_t k = 0; k < EPHEMERIS_PLANETS && known; k++)
        share = fmax(share, result->tables.integration.km[k] / result->tables.model.km[k]);
    report_number(report, "integration_share", "  integration / model", NULL,
                  known ? share : (double)NAN);
    if (share > unseen_share)
        report_line(report, "  a shorter --dt, a smaller --tol, or --integrator dop853 would show "
                            "the model alone");
}
