/* The results of a simulation, as one table (simulate.h). */
#include "simulate.h"
#include "apps/output/periodic.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdio.h>

static const char *stop_name(enum phys_simulation_stop stop)
{
    static const char *const names[] = {
        [PHYS_SIMULATION_END] = "end reached",
        [PHYS_SIMULATION_EVENT] = "event",
        [PHYS_SIMULATION_INTERRUPTED] = "interrupted",
    };
    return names[stop];
}

/* The settings that --tol tried; returns the estimate of the one chosen. */
static double report_trials(const struct simulate_run *run, struct report *report)
{
    double estimate = (double)NAN;
    for (size_t k = 0; k < run->motion.n_trials; k++) {
        const struct phys_motion_trial *t = &run->motion.trial[k];
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

static void report_run(const struct simulate_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &run->motion.info;
    const char *why =
        run->motion.ode.interpreted ? run->motion.ode.interpreted(run->motion.ode.context) : "";
    bool adaptive = run->motion.integrator->adaptive;
    report_line(report,
                "%s: %s to t = %g%s%s, %zu step%s (%zu rejected), %zu evaluations in %.3g s, %s\n",
                scene->name, run->motion.integrator->name, info->t, unit_blank(scene->time_unit),
                unit_shown(scene->time_unit), info->steps, info->steps == 1 ? "" : "s",
                info->rejected, info->evaluations, info->seconds, stop_name(info->stop));
    if (run->options->common.verbose && *why)
        report_line(report, "  interpreted: %s\n", why);
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "dof", NULL, run->system.dof);
    report_text(report, "integrator", NULL, run->motion.integrator->name);
    report_number(report, "time", NULL, scene->time_unit, info->t);
    report_number(report, "dt", NULL, scene->time_unit, adaptive ? (double)NAN : info->max_step);
    report_number(report, "tol", NULL, NULL, adaptive ? run->motion.setting : (double)NAN);
    report_count(report, "steps", NULL, info->steps);
    report_count(report, "rejected", NULL, info->rejected);
    report_count(report, "evaluations", NULL, info->evaluations);
    report_count(report, "interpolations", NULL, info->interpolations);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", info->seconds);
    report->passing = false;
    report_text(report, "stop", NULL, stop_name(info->stop));
}

static void report_energy(const struct simulate_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_simulation_info *info = &run->motion.info;
    bool kept = run->motion.keeps_energy;
    double change = info->energy_drift * (info->energy_start != 0 ? fabs(info->energy_start) : 1);
    report_number(report, "energy", "energy at the start", scene->energy_unit, info->energy_start);
    report_flag(report, "energy_conserved", NULL, kept);
    report_number(report, "energy_drift", "energy drift, largest",
                  info->energy_start != 0 ? "of the start" : scene->energy_unit,
                  kept ? info->energy_drift : (double)NAN);
    report_number(report, "energy_change", kept ? NULL : "largest change of energy",
                  scene->energy_unit, change);
    report_number(report, "work", "  work of the forces", scene->energy_unit, run->work);
    report_number(report, "energy_balance", "  energy less work, changes by", scene->energy_unit,
                  run->balance);
    report_number(report, "work_uncertainty", "  work known to", scene->energy_unit,
                  run->work_unknown);
    if (!kept && !isnan(info->energy_drift) && !phys_system_has_forces(&run->system))
        report_line(report,
                    run->system.scene->constraint
                        ? "    not conserved: L or a constraint depends on time explicitly"
                        : "    not conserved: L depends on time explicitly (a drive, or friction)");
}

static void report_constraints(const struct simulate_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    char unit[UNIT_FORCE], speed[64];
    if (!run->reactions)
        return;
    const char *time = unit_shown(scene->time_unit);
    unit_of_force(scene->energy_unit, scene->unit, unit);
    snprintf(speed, sizeof speed, "%s%s%s", unit_shown(scene->unit), *time ? "/" : "", time);
    report_texts(report, "constraints", scene->n_constraints, scene->constraints);
    report_number(report, "constraint_residual", "off the constraints by", scene->unit,
                  run->residual[0]);
    report_number(report, "constraint_residual_velocity", "  and in velocity by", speed,
                  run->residual[1]);
    report_list(report, "reaction_most", "constraint force at samples", unit, run->system.dof,
                run->reaction_most);
}

static void report_error(const struct simulate_run *run, double estimate, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_motion_solution *m = &run->motion;
    const double tighter = 100; /* else the reference is no measure, but a bound */
    bool bound = m->error < tighter * m->reference_uncertainty;
    report_number(report, "error", bound ? "error, at most" : "error, largest", scene->unit,
                  m->error);
    if (!isnan(m->error))
        report_flag(report, "error_is_bound", NULL, bound);
    report_number(report, "error_end", "error at the end", scene->unit, m->error_end);
    report_number(report, "reference_uncertainty", "reference known to", scene->unit,
                  m->reference_uncertainty);
    report_number(report, "reference_reversal",
                  isnan(m->reference_forward) ? "  run back, from the start" : NULL, scene->unit,
                  m->reference_reversal);
    report_number(report, "reference_forward", "  from one by dop853", scene->unit,
                  m->reference_forward);
    report_number(report, "reference_horizon", "  and until t =", scene->time_unit, m->known_until);
    report_number(report, "reference_resolution", "  sees no force shorter than", scene->time_unit,
                  m->seen);
    report_number(report, "time_resolution", "  and none in time shorter than", scene->time_unit,
                  m->time_resolution > 0 ? m->time_resolution : (double)NAN);
    report_number(report, "error_estimate", NULL, scene->unit, estimate);
    simulate_ephemeris_report(run, report);
    report_number(report, "reversal_error", "reversal error", scene->unit, m->reversal);
    report_number(report, "min_step", "shortest step", scene->time_unit, m->info.min_step);
    report_number(report, "max_step", "longest step", scene->time_unit, m->info.max_step);
}

static void report_closest(const struct simulate_run *run,
                           const struct phys_closest_approach *closest, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    bool known = isfinite(closest->distance);
    double bodies[] = {(double)closest->first + 1, (double)closest->second + 1};
    report_number(report, "closest_approach", "closest approach", scene->unit, closest->distance);
    report_number(report, "closest_time", "  at t =", scene->time_unit,
                  known ? closest->t : (double)NAN);
    report_list(report, "closest_bodies", "  of bodies", NULL, known ? 2 : 0, bodies);
}

/* The change of total momentum, or angular momentum, and whether L conserves it. */
static void report_total(struct report *report, const struct simulate_run *run, bool angular)
{
    const struct phys_conserved *c = &run->motion.conserved;
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
                    angular ? "L changes under rotation about the origin"
                            : "L changes under translation of all bodies (an external force)");
}

/* Momenta of coordinates that L does not depend on. */
static void report_cyclic(const struct simulate_run *run, struct report *report)
{
    const size_t dof = run->system.dof;
    char name[64];
    for (size_t k = 0; run->cyclic && k < dof; k++) {
        if (!run->cyclic[k])
            continue;
        report_item(report, "cyclic");
        phys_coordinate_name(&run->system, k, name, sizeof name);
        report_text(report, "coordinate", "cyclic", name);
        report_number(report, "momentum", "its momentum", NULL, run->kept[k]);
        report_number(report, "change", "change of it", NULL,
                      phys_known_digits(run->kept[dof + k], 0.01 * run->kept[dof + k]));
    }
    report_item(report, NULL);
}

/* The scene's own functions of the motion. */
static void report_observables(const struct simulate_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const size_t n = run->motion.n;
    for (size_t k = 0; run->observed && k < scene->n_observables; k++) {
        const double *value = run->observed + k * n;
        double change = 0;
        for (size_t i = 0; i < n; i++)
            change = fmax(change, fabs(value[i] - value[0]));
        report_item(report, "observables");
        report_text(report, "name", "observable", scene->observables[k].name);
        report_number(report, "value", "at the start", scene->observables[k].unit, value[0]);
        report_number(report, "change", "largest change", scene->observables[k].unit, change);
    }
    report_item(report, NULL);
}

/* ---- events ---- */

static void report_crossing(const struct simulate_run *run, size_t i, struct report *report)
{
    enum { WIDE = 3 /* coordinates whose state fits into a line */ };
    char text[512];
    const struct phys_crossed *c = &run->motion.crossed;
    size_t dof = run->system.dof;
    int digits = isnan(c->uncertainty[i]) ? 6 : 15; /* the error of the motion is not known */
    size_t length = (size_t)snprintf(text, sizeof text, "  %-24s t = %.*g",
                                     run->crossings[(size_t)c->which[i] - 1].text, digits,
                                     phys_known_digits(c->t[i], 2 * c->uncertainty[i]));
    for (size_t k = 0; k < 2 * dof && dof <= WIDE && length < sizeof text; k++) {
        char name[SIMULATE_NAME];
        simulate_quantity(&run->system, k, name);
        length += (size_t)snprintf(text + length, sizeof text - length, ", %s = %.6g", name,
                                   c->x[2 * i * dof + k]);
    }
    report_line(report, "%s%s", text, c->touch[i] != 0 ? ", touched, not crossed" : "");
}

/* The run file has them as datasets (simulate_file). */
static void report_crossings(const struct simulate_run *run, struct report *report)
{
    enum { MOST = 12 };
    const struct phys_crossed *c = &run->motion.crossed;
    size_t dof = run->system.dof, shown = 0;
    if (run->settings.n_crossings == 0)
        return;
    report->passing = true;
    if (c->n == 0)
        report_texts(report, "events", 0, NULL);
    for (size_t i = 0; i < c->n; i++) {
        const double *x = c->x + 2 * i * dof;
        report_item(report, "events");
        report_text(report, "event", NULL, run->crossings[(size_t)c->which[i] - 1].text);
        report_number(report, "t", NULL, NULL, c->t[i]);
        report_number(report, "t_uncertainty", NULL, NULL, c->uncertainty[i]);
        report_flag(report, "touch", NULL, c->touch[i] != 0);
        report_list(report, "q", NULL, NULL, dof, x);
        report_list(report, "v", NULL, NULL, dof, x + dof);
    }
    report_item(report, NULL);
    report->passing = false;
    for (size_t i = 0; i < c->n; i++)
        if ((size_t)c->which[i] != run->section.number && shown++ < MOST)
            report_crossing(run, i, report);
    if (shown > MOST)
        report_line(report, "  and %zu more: --json and --out have all", shown - MOST);
    for (size_t k = 0; k < run->settings.n_crossings; k++) {
        bool found = false;
        for (size_t i = 0; i < c->n; i++)
            found |= (size_t)c->which[i] == k + 1;
        if (!found)
            report_line(report, "  %-24s %s", run->crossings[k].text,
                        c->constant[k] ? "never: it is constant but for rounding"
                                       : "not in this time");
    }
}

/* ---- order, diagnoses ---- */

static void report_order(const struct phys_gas_order *order, const char *label,
                         struct report *report)
{
    report_number(report, "neighbours", label, NULL, order->mean.neighbours);
    report_number(report, "hexatic", label, NULL, order->mean.hexatic);
    report_number(report, "peak", label, NULL, order->peak);
    report_number(report, "peak_at", label, NULL, order->peak_at);
    report_text(report, "state", label, phys_state_text(order->mean.state));
}

static void report_gas(const struct simulate_run *run, struct report *report)
{
    if (!run->has_order)
        return;
    report_line(report, "  %-24s %14s %14s %14s %14s", "order", "neighbours", "hexatic",
                "peak of g", "at distance");
    report->object = "order_start";
    report_order(&run->order_start, "  at the start", report);
    report->object = "order_end";
    report_order(&run->order_end, "  at the end", report);
    report->object = NULL;
}

static void report_diagnosis(const struct simulate_run *run, struct report *report)
{
    const struct phys_diagnosis *d = &run->diagnosis;
    const struct phys_scene *scene = run->system.scene;
    const struct phys_lyapunov *chaos = &d->chaos;
    const char *warnings[PHYS_DIAGNOSIS_WARNINGS];
    char rate[48];
    snprintf(rate, sizeof rate, "%s%s", *unit_blank(scene->time_unit) ? "1/" : "",
             unit_shown(scene->time_unit));
    if (d->has_horizon) {
        report_number(report, "lyapunov_exponent", "Lyapunov exponent", rate,
                      phys_known_digits(chaos->exponent, chaos->most - chaos->least));
        report_number(report, "lyapunov_least", NULL, rate, chaos->least);
        report_number(report, "lyapunov_most", NULL, rate, chaos->most);
        report_number(report, "lyapunov_time", "Lyapunov time", scene->time_unit,
                      chaos->least > 0
                          ? phys_known_digits(chaos->time, 1 / chaos->least - 1 / chaos->most)
                          : (double)NAN);
        report_number(report, "megno", "MEGNO", NULL, chaos->megno);
        report_flag(report, "chaotic", "chaotic in this time", chaos->chaotic);
        report_number(report, "horizon", "horizon", scene->time_unit,
                      phys_known_digits(chaos->horizon, chaos->latest - chaos->horizon));
        report_number(report, "error_before_horizon", "error before the horizon", scene->unit,
                      d->error_before);
    }
    if (run->exponents) {
        report_list(report, "lyapunov_spectrum", "Lyapunov exponents", rate, run->options->lyapunov,
                    run->exponents);
        report_list(report, "lyapunov_change", "  change in the second half", rate,
                    run->options->lyapunov, run->change);
    }
    simulate_family_report(run, report);
    report_periodic(&run->system, &run->periodic, report);
    simulate_report_sensitivity(run, report);
    report_number(report, "mass_condition", NULL, NULL,
                  d->mass_condition > 0 ? d->mass_condition : (double)NAN);
    report_number(report, "stiff_rate", NULL, rate, d->stiff.rate > 0 ? d->stiff.rate : NAN);
    report_number(report, "stiff_dt", NULL, scene->time_unit,
                  d->stiff.rate > 0 ? d->stiff.dt : NAN);
    report_count(report, "stiff_evaluations", NULL, d->stiff.evaluations);
    for (size_t k = 0; k < d->n_warnings; k++)
        warnings[k] = d->warning[k];
    report_texts(report, "warnings", d->n_warnings, warnings);
}

void simulate_report(const void *context, struct report *report)
{
    const struct simulate_run *run = context;
    simulate_ephemeris_report_models(run, report);
    double estimate = report_trials(run, report);
    report_run(run, report);
    report_energy(run, report);
    report_constraints(run, report);
    report_error(run, estimate, report);
    report_learnt(&run->system, run->motion.n, run->motion.t, run->motion.x, report);
    report_closest(run, &run->motion.closest, report);
    report_crossings(run, report);
    simulate_section_report(run, report);
    report_gas(run, report);
    report_diagnosis(run, report);
    report_total(report, run, false);
    report_total(report, run, true);
    report_cyclic(run, report);
    report_observables(run, report);
}
