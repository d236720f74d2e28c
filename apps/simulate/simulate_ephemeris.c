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
    bool choosing = !isnan(o->tolerance);
    const struct {
        const char *name;
        bool given;
        const char *instead;
    } rows[] = {
        {"time", !isnan(o->time), "give --days"},
        {"samples", o->samples != OPTION_NO_COUNT, "there is one a day"},
        {"every", o->every != OPTION_NO_COUNT, "there is one sample a day"},
        {"integrator", choosing && o->integrator,
         "--tol chooses the model, and with it the method"},
        {"set", choosing && o->set.n > 0, "--tol chooses the model, and with it the parameters"},
        {"rough", choosing && o->rough, "--tol chooses the model, and with it the bodies"},
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

static bool same_content(const struct ephemeris_model *a, const struct ephemeris_model *b)
{
    bool same_bodies =
        a->rough && b->rough ? strcmp(a->rough, b->rough) == 0 : a->rough == b->rough;
    return same_bodies && a->relativity == b->relativity;
}

static bool meets(const struct simulate_run *run, size_t k)
{
    return run->tried[k].worst <= run->options->tolerance;
}

static enum ad_status out_of_reach(const struct simulate_run *run, struct ad_error *error)
{
    size_t best = 0;
    for (size_t k = 1; k < run->n_tried; k++)
        if (run->tried[k].worst < run->tried[best].worst)
            best = k;
    return ad_fail(error, AD_E_ACCURACY,
                   "--tol %g km: none of the models comes so near; the best (%s) is %.3g km off, "
                   "at %s; fewer --days bring it nearer",
                   run->options->tolerance, ephemeris_models[best].name, run->tried[best].worst,
                   ephemeris_planet(run->tried[best].worst_planet));
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
    if (!isnan(options->tolerance))
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

void simulate_ephemeris_compare(const struct simulate_run *run, struct simulate_result *result)
{
    const struct simulate_samples *s = &result->samples;
    result->error = result->error_end = 0;
    for (size_t i = 0; i < s->n && i <= run->tables.days; i++) {
        result->error_end = 0;
        for (size_t k = 0; k < EPHEMERIS_PLANETS; k++) {
            double km =
                ephemeris_distance(&run->tables, run->system.dims, s->x + 2 * i * s->dof, k, i);
            result->planet_km[k] = fmax(result->planet_km[k], km);
            result->error_end = fmax(result->error_end, 1e3 * km);
        }
        result->distance[i] = result->error_end;
        result->error = fmax(result->error, result->error_end);
    }
}

/* ---- in words ---- */

static const char *verdict(const struct simulate_run *run, size_t k)
{
    return k == run->chosen ? "chosen" : meets(run, k) ? "more work" : "too far";
}

static void print_models(const struct simulate_run *run)
{
    printf("  %-44s %9s %-8s %11s\n", "coarse to fine", "km off", "at", "evaluations");
    for (size_t k = 0; k < run->n_tried; k++)
        printf("  %-44s %9.3g %-8s %11zu  %s\n", ephemeris_models[k].name, run->tried[k].worst,
               ephemeris_planet(run->tried[k].worst_planet), run->tried[k].evaluations,
               verdict(run, k));
    printf("\n%s: the least that stays within %g km for %zu days; it adds %s\n\n", run->model->name,
           run->options->tolerance, run->tables.days, run->model->adds);
}

void simulate_ephemeris_print(const struct simulate_run *run)
{
    if (run->model)
        print_models(run);
}

void simulate_ephemeris_rows(const struct simulate_run *run, const struct simulate_result *result)
{
    for (size_t k = 0; run->tables.n && k < EPHEMERIS_PLANETS; k++)
        printf("  from the table of %-7s %12.6g  km\n", ephemeris_planet(k), result->planet_km[k]);
}

void simulate_ephemeris_json(struct json *json, const struct simulate_run *run,
                             const struct simulate_result *result)
{
    if (!run->tables.n)
        return;
    if (run->model)
        json_text(json, "model", run->model->name);
    json_array(json, "models_tried");
    for (size_t k = 0; k < run->n_tried; k++) {
        json_object(json, NULL);
        json_text(json, "model", ephemeris_models[k].name);
        json_number(json, "km", run->tried[k].worst);
        json_text(json, "planet", ephemeris_planet(run->tried[k].worst_planet));
        json_count(json, "evaluations", run->tried[k].evaluations);
        json_text(json, "verdict", verdict(run, k));
        json_end_object(json);
    }
    json_end_array(json);
    json_object(json, "km_from_tables");
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        json_number(json, ephemeris_planet(k), result->planet_km[k]);
    json_end_object(json);
}
