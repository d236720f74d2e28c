/* What a simulation found, as one table (simulate.h). */
#include "simulate.h"
#include "apps/output/unit.h"

#include <math.h>

static const char *stop_name(enum phys_simulation_stop stop)
{
    static const char *const names[] = {
        [PHYS_SIMULATION_END] = "end reached",
        [PHYS_SIMULATION_EVENT] = "event",
        [PHYS_SIMULATION_INTERRUPTED] = "interrupted",
    };
    return names[stop];
}

/* What --tol tried; returns the estimate of the setting it chose. */
static double report_trials(const struct simulate_run *run, struct report *report)
{
    double estimate = (double)NAN;
    for (size_t k = 0; k < run->n_trials; k++) {
        const struct simulate_trial *t = &run->trial[k];
        report_item(report, "tried");
        report_text(report, "integrator", "tried", t->integrator->name);
        report_number(report, t->integrator->adaptive ? "tol" : "dt", "tol or dt", NULL,
                      t->setting);
        report_count(report, "evaluations", "evaluations", t->evaluations);
        report_count(report, "searched", NULL, t->searched);
        report_number(report, "estimate", "error estimate", NULL, t->estimate);
        report_flag(report, "chosen", "chosen", t->chosen);
        if (t->chosen)
            estimate = t->estimate;
    }
    report_item(report, NULL);
    return estimate;
}

static void report_run(const struct simulate_run *run, const struct simulate_result *result,
                       struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &result->info;
    const char *why = run->ode.interpreted ? run->ode.interpreted(run->ode.context) : "";
    bool adaptive = run->integrator->adaptive;
    report_line(
        report, "%s: %s to t = %g %s, %zu steps (%zu rejected), %zu evaluations in %.3g s, %s\n",
        scene->name, run->integrator->name, info->t, unit_shown(scene->time_unit), info->steps,
        info->rejected, info->evaluations, info->seconds, stop_name(info->stop));
    if (run->options->common.verbose && *why)
        report_line(report, "  interpreted: %s\n", why);
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "dof", NULL, run->system.dof);
    report_text(report, "integrator", NULL, run->integrator->name);
    report_number(report, "time", NULL, scene->time_unit, info->t);
    report_number(report, "dt", NULL, scene->time_unit, adaptive ? (double)NAN : info->max_step);
    report_number(report, "tol", NULL, NULL, adaptive ? run->tolerance : (double)NAN);
    report_count(report, "steps", NULL, info->steps);
    report_count(report, "rejected", NULL, info->rejected);
    report_count(report, "evaluations", NULL, info->evaluations);
    report_count(report, "interpolations", NULL, info->interpolations);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", info->seconds);
    report->passing = false;
    report_text(report, "stop", NULL, stop_name(info->stop));
}

static void report_energy(const struct simulate_run *run, const struct simulate_result *result,
                          struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &result->info;
    bool kept = result->keeps_energy;
    double change = info->energy_drift * (info->energy_start != 0 ? fabs(info->energy_start) : 1);
    report_number(report, "energy", "energy at the start", scene->energy_unit, info->energy_start);
    report_flag(report, "energy_conserved", NULL, kept);
    report_number(report, "energy_drift", "energy drift, largest", "of the start",
                  kept ? info->energy_drift : (double)NAN);
    report_number(report, "energy_change", kept ? NULL : "change of energy", scene->energy_unit,
                  change);
    if (!kept && !isnan(info->energy_drift))
        report_line(report, "    not conserved: the time enters L (a drive, or friction)");
}

static void report_error(const struct simulate_run *run, const struct simulate_result *result,
                         double estimate, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const double tighter = 100; /* else the reference is no measure, but a bound */
    bool bound = result->error < tighter * result->reference_uncertainty;
    report_number(report, "error", bound ? "error, at most" : "error, largest", scene->unit,
                  result->error);
    if (!isnan(result->error))
        report_flag(report, "error_is_bound", NULL, bound);
    report_number(report, "error_end", "error at the end", scene->unit, result->error_end);
    report_number(report, "reference_uncertainty", "reference known to", scene->unit,
                  result->reference_uncertainty);
    report_number(report, "reference_reversal", "  run back, from the start", scene->unit,
                  result->reference_reversal);
    report_number(report, "reference_horizon", "  and until t =", scene->time_unit,
                  result->known_until);
    report_number(report, "reference_resolution", NULL, scene->time_unit, result->seen);
    report_number(report, "error_estimate", NULL, scene->unit, estimate);
    simulate_ephemeris_report(run, result, report);
    report_number(report, "reversal_error", "reversal error", scene->unit, result->reversal);
    report_number(report, "min_step", "shortest step", scene->time_unit, result->info.min_step);
    report_number(report, "max_step", "longest step", scene->time_unit, result->info.max_step);
}

static void report_closest(const struct simulate_run *run, const struct phys_closest *closest,
                           struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    bool known = isfinite(closest->distance);
    double bodies[] = {(double)closest->first + 1, (double)closest->second + 1};
    report_number(report, "closest_approach", "closest approach", scene->unit, closest->distance);
    report_number(report, "closest_time", "  at t =", scene->time_unit,
                  known ? closest->t : (double)NAN);
    report_list(report, "closest_bodies", "  of bodies", NULL, known ? 2 : 0, bodies);
}

/* A total of the bodies, and whether L keeps it. */
static void report_total(struct report *report, const struct simulate_result *result, bool angular)
{
    const struct phys_conserved *c = &result->conserved;
    bool kept = angular ? c->angular : c->momentum;
    double change = angular ? c->angular_change : c->momentum_change;
    report_number(report, angular ? "angular_momentum_change" : "momentum_change",
                  angular ? "change of ang. momentum" : "change of momentum", NULL,
                  c->bodies ? change : (double)NAN);
    if (!c->bodies)
        return;
    report_flag(report, angular ? "angular_momentum_conserved" : "momentum_conserved", NULL, kept);
    if (!kept)
        report_line(report, "    not conserved: %s",
                    angular ? "L changes when all bodies are turned about the origin"
                            : "L changes when all bodies are moved (a force from outside)");
}

void simulate_report(const struct simulate_run *run, const struct simulate_result *result,
                     struct report *report)
{
    simulate_ephemeris_report_models(run, report);
    double estimate = report_trials(run, report);
    report_run(run, result, report);
    report_energy(run, result, report);
    report_error(run, result, estimate, report);
    report_closest(run, &result->closest, report);
    event_answers_report(&result->events, &run->questions, &run->system, report);
    simulate_gas_report(&result->gas, report);
    simulate_outlook_report(run, &result->outlook, report);
    report_total(report, result, false);
    report_total(report, result, true);
}
