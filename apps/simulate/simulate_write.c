/* Results of a simulation (simulate.h): table, JSON, CSV and run file. */
#include "simulate.h"
#include "apps/command.h"
#include "apps/output/json.h"
#include "apps/output/unit.h"

#include <math.h>
#include <stdlib.h>

static const char *stop_name(enum phys_simulation_stop stop)
{
    static const char *const names[] = {
        [PHYS_SIMULATION_END] = "end reached",
        [PHYS_SIMULATION_EVENT] = "event",
        [PHYS_SIMULATION_INTERRUPTED] = "interrupted",
    };
    return names[stop];
}

/* Change of a vector over the run. */
static double change(const double before[3], const double after[3])
{
    double sum = 0;
    for (size_t k = 0; k < 3; k++)
        sum += (after[k] - before[k]) * (after[k] - before[k]);
    return sqrt(sum);
}

static const struct simulate_trial *chosen(const struct simulate_run *run)
{
    for (size_t k = 0; k < run->n_trials; k++)
        if (run->trial[k].chosen)
            return &run->trial[k];
    return NULL;
}

/* ---- table ---- */

static void print_trials(const struct simulate_run *run)
{
    const struct simulate_trial *best = chosen(run);
    if (!best)
        return;
    puts("  tried                        setting   evaluations   estimate of the error");
    for (size_t k = 0; k < run->n_trials; k++) {
        const struct simulate_trial *t = &run->trial[k];
        if (isnan(t->estimate)) {
            printf("  %-18s   %s\n", t->integrator->name,
                   t == best ? "chosen, and tightened by the measured error"
                             : "did not get through");
            continue;
        }
        printf("  %-18s %6s %10.3g %13zu   %.3g%s\n", t->integrator->name,
               t->integrator->adaptive ? "tol" : "dt", t->setting, t->evaluations, t->estimate,
               t == best ? "   chosen" : "   does not come nearer");
    }
    putchar('\n');
}

static void row(const char *name, double value, const char *unit)
{
    if (!isnan(value))
        printf("  %-24s %13.6g  %s\n", name, value, unit_shown(unit));
}

static void print_interpreted(const struct simulate_run *run)
{
    const struct phys_ode *ode = &run->ode;
    const char *why = ode->interpreted ? ode->interpreted(ode->context) : "";
    if (run->options->common.verbose && *why)
        printf("  interpreted: %s\n\n", why);
}

void simulate_print(const struct simulate_run *run, const struct simulate_result *result)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &result->info;
    simulate_ephemeris_print(run);
    print_trials(run);
    printf("%s: %s to t = %g %s, %zu steps (%zu rejected), %zu evaluations in %.3g s, %s\n\n",
           scene->name, run->integrator->name, info->t, unit_shown(scene->time_unit), info->steps,
           info->rejected, info->evaluations, info->seconds, stop_name(info->stop));
    print_interpreted(run);
    row("energy", info->energy_start, scene->energy_unit);
    row("energy drift, largest", info->energy_drift, "of the start");
    row("error, largest", result->error, scene->unit);
    row("error at the end", result->error_end, scene->unit);
    if (!isnan(result->known_until)) {
        row("reference known to", result->reference_uncertainty, scene->unit);
        if (isfinite(result->known_until))
            row("  and until t =", result->known_until, scene->time_unit);
    }
    simulate_ephemeris_rows(run, result);
    row("reversal error", result->reversal, scene->unit);
    row("shortest step", info->min_step, scene->time_unit);
    row("longest step", info->max_step, scene->time_unit);
    if (isfinite(result->closest.distance)) {
        row("closest approach", result->closest.distance, scene->unit);
        row("  at t =", result->closest.t, scene->time_unit);
    }
    event_answers_print(&result->events, &run->questions, &run->system);
    simulate_gas_print(run, &result->gas);
    simulate_outlook_print(run, &result->outlook);
    if (result->has_totals) {
        row("change of momentum", change(result->start.momentum, result->end.momentum), "1");
        row("change of ang. momentum", change(result->start.angular, result->end.angular), "1");
    }
}

/* ---- JSON ---- */

static void json_closest(struct json *json, const struct phys_closest *closest)
{
    bool known = isfinite(closest->distance);
    json_number(json, "closest_approach", known ? closest->distance : (double)NAN);
    json_number(json, "closest_time", known ? closest->t : (double)NAN);
    json_array(json, "closest_bodies");
    if (known) {
        json_count(json, NULL, closest->first + 1);
        json_count(json, NULL, closest->second + 1);
    }
    json_end_array(json);
}

static void json_trials(struct json *json, const struct simulate_run *run)
{
    json_array(json, "tried");
    for (size_t k = 0; k < run->n_trials; k++) {
        const struct simulate_trial *t = &run->trial[k];
        json_object(json, NULL);
        json_text(json, "integrator", t->integrator->name);
        json_number(json, t->integrator->adaptive ? "tol" : "dt", t->setting);
        json_count(json, "evaluations", t->evaluations);
        json_count(json, "searched", t->searched);
        json_number(json, "estimate", t->estimate);
        json_end_object(json);
    }
    json_end_array(json);
}

void simulate_print_json(const struct simulate_run *run, const struct simulate_result *result)
{
    const struct phys_simulation_info *info = &result->info;
    const struct simulate_trial *best = chosen(run);
    bool adaptive = run->integrator->adaptive;
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "scene", run->system.scene->name);
    json_count(&json, "dof", run->system.dof);
    json_text(&json, "integrator", run->integrator->name);
    json_number(&json, "time", info->t);
    json_number(&json, "dt", adaptive ? (double)NAN : info->max_step);
    json_number(&json, "tol", adaptive ? run->tolerance : (double)NAN);
    json_count(&json, "steps", info->steps);
    json_count(&json, "rejected", info->rejected);
    json_count(&json, "evaluations", info->evaluations);
    json_count(&json, "interpolations", info->interpolations);
    json_number(&json, "seconds", info->seconds);
    json_number(&json, "energy", info->energy_start);
    json_number(&json, "energy_drift", info->energy_drift);
    json_number(&json, "error", result->error);
    json_number(&json, "error_end", result->error_end);
    json_number(&json, "reference_uncertainty", result->reference_uncertainty);
    json_number(&json, "reference_horizon", result->known_until);
    json_number(&json, "reference_resolution", result->seen);
    json_number(&json, "error_estimate", best ? best->estimate : (double)NAN);
    json_number(&json, "reversal_error", result->reversal);
    json_number(&json, "min_step", info->min_step);
    json_number(&json, "max_step", info->max_step);
    json_closest(&json, &result->closest);
    json_number(&json, "momentum_change",
                result->has_totals ? change(result->start.momentum, result->end.momentum)
                                   : (double)NAN);
    json_number(&json, "angular_momentum_change",
                result->has_totals ? change(result->start.angular, result->end.angular)
                                   : (double)NAN);
    if (run->n_trials)
        json_trials(&json, run);
    if (run->questions.n)
        event_answers_json(&json, &result->events);
    simulate_ephemeris_json(&json, run, result);
    simulate_gas_json(&json, &result->gas);
    simulate_outlook_json(&json, &result->outlook);
    json_text(&json, "stop", stop_name(info->stop));
    json_close(&json);
}

/* ---- CSV ---- */

void simulate_write_csv(const struct simulate_run *run, const struct simulate_result *result,
                        FILE *out)
{
    const struct simulate_samples *s = &result->samples;
    char name[64];
    fputs("t", out);
    for (size_t k = 0; k < 2 * s->dof; k++) {
        phys_coordinate_name(&run->system, k % s->dof, name, sizeof name);
        fprintf(out, ",%s%s", k < s->dof ? "" : "v_", name);
    }
    fputc('\n', out);
    for (size_t i = 0; i < s->n; i++) {
        fprintf(out, "%.17g", s->t[i]);
        for (size_t k = 0; k < 2 * s->dof; k++)
            fprintf(out, ",%.17g", s->x[2 * i * s->dof + k]);
        fputc('\n', out);
    }
}

/* ---- run file ---- */

static void file_parameters(const struct simulate_run *run, phys_runfile *file)
{
    const struct phys_scene *scene = run->system.scene;
    phys_runfile_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_runfile_number(file, "parameters", scene->params[k].name,
                            phys_system_get(&run->system, scene->params[k].name),
                            scene->params[k].unit);
}

/* Half 0 (coordinates) or 1 (velocities) of the samples, as [dof x samples]. */
static enum ad_status file_half(const struct simulate_result *result, size_t half, const char *name,
                                phys_runfile *file, struct ad_error *error)
{
    const struct simulate_samples *s = &result->samples;
    double *values = malloc(s->dof * s->n * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i < s->n; i++)
            values[k * s->n + i] = s->x[(2 * i + half) * s->dof + k];
    phys_runfile_write(file, name, AD_F64, 2, (size_t[]){s->dof, s->n}, values);
    phys_runfile_text(file, name, "axes", "coordinate, sample");
    free(values);
    return AD_OK;
}

static void file_units(const struct phys_scene *scene, phys_runfile *file)
{
    const char *time = unit_shown(scene->time_unit);
    char speed[64];
    snprintf(speed, sizeof speed, "%s%s%s", scene->unit, *time ? "/" : "", time);
    phys_runfile_text(file, "path", "unit", scene->unit);
    phys_runfile_text(file, "velocity", "unit", speed);
}

enum ad_status simulate_file(const struct simulate_run *run, const struct simulate_result *result,
                             phys_runfile *file, struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &result->info;
    const struct simulate_samples *s = &result->samples;
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", run->options->common.command);
    phys_runfile_text(file, "/", "scene", scene->name);
    phys_runfile_text(file, "/", "integrator", run->integrator->name);
    if (run->integrator->adaptive)
        phys_runfile_number(file, "/", "tol", run->tolerance, NULL);
    else
        phys_runfile_number(file, "/", "dt", info->max_step, scene->time_unit);
    phys_runfile_integer(file, "/", "seed", (int64_t)run->options->common.seed, NULL);
    phys_runfile_integer(file, "/", "steps", (int64_t)info->steps, NULL);
    phys_runfile_integer(file, "/", "evaluations", (int64_t)info->evaluations, NULL);
    phys_runfile_number(file, "/", "energy_drift", info->energy_drift, NULL);
    phys_runfile_number(file, "/", "error", result->error, scene->unit);
    phys_runfile_text(file, "/", "stop", stop_name(info->stop));
    file_parameters(run, file);
    phys_runfile_write(file, "time", AD_F64, 1, &s->n, s->t);
    phys_runfile_text(file, "time", "unit", scene->time_unit);
    phys_runfile_write(file, "energy", AD_F64, 1, &s->n, s->energy);
    phys_runfile_text(file, "energy", "unit", scene->energy_unit);
    if (result->distance) {
        phys_runfile_write(file, "error", AD_F64, 1, &s->n, result->distance);
        phys_runfile_text(file, "error", "unit", scene->unit);
    }
    if (event_answers_file(&result->events, &run->questions, file, error) != AD_OK)
        return error->status;
    if (file_half(result, 0, "path", file, error) == AD_OK &&
        file_half(result, 1, "velocity", file, error) == AD_OK)
        file_units(scene, file);
    return error->status;
}
