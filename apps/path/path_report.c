/* The results of a path run, as one table (path.h). */
#include "path.h"
#include "apps/output/report.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

const char *path_stop_name(enum phys_stop stop)
{
    static const char *const names[] = {
        [PHYS_STOP_STEPS] = "all steps taken",   [PHYS_STOP_TOLERANCE] = "tolerance reached",
        [PHYS_STOP_INTERRUPTED] = "interrupted", [PHYS_STOP_ROUNDING] = "zero to rounding",
        [PHYS_STOP_STALLED] = "stalled",         [PHYS_STOP_REFERENCE] = "nearest to the reference",
    };
    return names[stop];
}

/* The bodies and epochs found by --data. */
static void report_tables(const struct path_run *run, struct report *report)
{
    for (size_t k = 0; k < run->n_tables; k++) {
        const struct phys_horizons *t = &run->tables[k];
        report_item(report, "tables");
        report_text(report, "target", "target", t->target);
        if (t->id != PHYS_HORIZONS_NO_ID)
            report_number(report, "id", NULL, NULL, t->id);
        report_text(report, "center", "about", t->center);
        report_text(report, "frame", NULL, t->frame);
        report_text(report, "units", "units", t->units);
        report_count(report, "epochs", "epochs", t->n);
        report_text(report, "start", "from", t->start_date);
        report_count(report, "first_index", "first slice", run->first_epoch);
        report_number(report, "first_epoch", NULL, "JD TDB", t->jd[run->first_epoch]);
    }
    report_item(report, NULL);
}

/* The shortest time between slices, where they are uneven. */
static double shortest(const struct path_run *run)
{
    const struct phys_grid grid = phys_grid_of(&run->settings);
    double least = (double)INFINITY;
    for (size_t i = 0; i + 1 < grid.slices; i++)
        least = fmin(least, phys_grid_time(&grid, i + 1) - phys_grid_time(&grid, i));
    return grid.mesh ? least : (double)NAN;
}

static void report_run(const struct path_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_path_settings *settings = &run->settings;
    const struct phys_path_info *info = &run->found.info;
    const char *time = unit_shown(scene->time_unit);
    report_line(report, "%s: %zu slices of %g%s%s, rule %s, %s, %zu step%s in %.3g s%s, %s\n",
                scene->name, settings->slices, settings->dt, unit_blank(time), time,
                settings->rule->name, run->solver->name, info->steps, info->steps == 1 ? "" : "s",
                info->seconds, info->native ? " as machine code" : "", path_stop_name(info->stop));
    report_number(report, "shortest_dt", "shortest", scene->time_unit, shortest(run));
    if (run->options->common.verbose && *info->interpreted)
        report_line(report, "  interpreted: %s\n", info->interpreted);
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "dof", NULL, run->system.dof);
    report_count(report, "slices", NULL, settings->slices);
    report_number(report, "dt", NULL, scene->time_unit, settings->dt);
    report_text(report, "solver", NULL, run->solver->name);
    report_text(report, "rule", NULL, settings->rule->name);
    report_count(report, "steps", NULL, info->steps);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", info->seconds);
    report_flag(report, "native", NULL, info->native);
    report->passing = false;
    report_text(report, "stop", NULL, path_stop_name(info->stop));
}

/* Reference, start and path found side by side, all by the solver's own recording. */
static void report_figures(const struct path_run *run, const struct phys_path_info *info,
                           struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_path_figures found = {
        .action = info->action,
        .action_mean = info->action_mean,
        .kinetic_mean = info->kinetic_mean,
        .potential_mean = info->potential_mean,
        .grad_norm = info->grad_norm,
    };
    const struct phys_path_figures *const column[] = {&info->compared, &info->start, &found};
    char product[64];
    const char *energy = unit_shown(scene->energy_unit), *time = unit_shown(scene->time_unit);
    snprintf(product, sizeof product, "%s%s%s", energy, *energy && *time ? " " : "", time);
    const struct {
        const char *label, *key[3], *unit;
        size_t at;
    } rows[] = {
#define ROW(label, member, unit)                                                                   \
    {label,                                                                                        \
     {"reference_" #member, "start_" #member, #member},                                            \
     unit,                                                                                         \
     offsetof(struct phys_path_figures, member)}
        ROW("action", action, product),      ROW("S mean", action_mean, energy),
        ROW("T mean", kinetic_mean, energy), ROW("V mean", potential_mean, energy),
        ROW("|gradient|", grad_norm, ""),
#undef ROW
    };
    report_line(report, "  %-24s %14s %14s %14s", "", "reference", "start", "found");
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (size_t c = 0; c < 3; c++)
            report_number(report, rows[k].key[c], rows[k].label, rows[k].unit,
                          *(const double *)((const char *)column[c] + rows[k].at));
}

static void report_energy(const struct path_run *run, struct report *report)
{
    const struct phys_path_info *info = &run->found.info;
    report_number(report, "energy", "energy, mean", run->system.scene->energy_unit,
                  info->energy_mean);
    report_flag(report, "energy_conserved", NULL, run->found.keeps_energy);
    report_number(report, "energy_drift", "energy drift", "of the start",
                  run->found.keeps_energy ? info->energy_drift : (double)NAN);
    if (!run->found.keeps_energy)
        report_line(report,
                    "  L depends on time explicitly, so the energy is not conserved: no drift");
}

double path_mse(const struct path_run *run, const double *path)
{
    size_t n = run->system.dof * run->settings.slices;
    double sum = 0;
    for (size_t k = 0; run->reference && k < n; k++)
        sum += pow(path[k] - run->reference[k], 2);
    return run->reference ? sum / (double)n : (double)NAN;
}

static void report_distances(const struct path_run *run, struct report *report)
{
    const char *length = unit_shown(run->system.scene->unit), *blank = *length ? " " : "";
    char square[64];
    snprintf(square, sizeof square, "%s%s", length, *length ? "^2" : "");
    report_line(report, "\n  reference: %s", run->reference ? run->reference_is : "none");
    report_text(report, "reference", NULL, run->reference ? run->reference_is : NULL);
    report_number(report, "mse_initial", "MSE of the start", square, path_mse(run, run->start));
    report_number(report, "mse_final", "MSE", square, path_mse(run, run->path));
    report_number(report, "max_error", "from the reference", length,
                  run->found.another ? (double)NAN : run->found.reference_distance);
    report_number(report, "reference_distance", NULL, length, run->found.reference_distance);
    report_flag(report, "another_path", NULL, run->found.another);
    if (run->found.another)
        report_line(
            report,
            "  another stationary path between these ends than the reference, up to %.6g%s%s "
            "from it;\n  %s--all finds several",
            run->found.reference_distance, blank, length,
            path_from_line(run->options) ? "--init ode starts from the reference, " : "");
    report_number(report, "true_distance", "from the true motion", length,
                  run->found.true_distance);
    report_number(report, "true_known", "  which is known to", length, run->found.true_known);
    if (*run->found.no_motion)
        report_line(report, "  no distance from the true motion: %s", run->found.no_motion);
    report_number(report, "discretisation_error", "discretisation error", length,
                  run->found.discretisation);
    if (run->found.stationary && isnan(run->found.discretisation))
        report_line(report,
                    "  discretisation error unknown: no path of a finer rule was found near, or it "
                    "has too many coordinates to look for");
}

static void report_forces(const struct path_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const size_t dof = run->system.dof, n = run->settings.slices;
    double *most = run->found.force ? calloc(dof, sizeof *most) : NULL;
    char unit[UNIT_FORCE];
    if (!run->found.force)
        return;
    report->failed = report->failed || !most;
    for (size_t k = 0; most && k < dof * n; k++)
        most[k / n] = fmax(most[k / n], fabs(run->found.force[k]));
    unit_of_force(scene->energy_unit, scene->unit, unit);
    report_texts(report, "constraints", scene->n_constraints, scene->constraints);
    if (most)
        report_list(report, "reaction_most", "constraint force at slices", unit, dof, most);
    free(most);
}

/* By the middles of the slices. */
static void report_model(const struct path_run *run, struct report *report)
{
    const struct phys_grid grid = phys_grid_of(&run->settings);
    const size_t dof = run->system.dof, n = grid.slices - 1;
    double *t = malloc(n * (1 + 2 * dof) * sizeof *t);
    if (!t) {
        report->failed = true;
        return;
    }
    double *x = t + n;
    for (size_t i = 0; i < n; i++) {
        const double t0 = phys_grid_time(&grid, i), t1 = phys_grid_time(&grid, i + 1);
        t[i] = (t0 + t1) / 2;
        for (size_t k = 0; k < dof; k++) {
            const double *q = run->path + k * grid.slices + i;
            x[2 * i * dof + k] = (q[0] + q[1]) / 2;
            x[2 * i * dof + dof + k] = (q[1] - q[0]) / (t1 - t0);
        }
    }
    report_learnt(&run->system, n, t, x, report);
    free(t);
}

void path_report(const void *context, struct report *report)
{
    const struct path_run *run = context;
    report_tables(run, report);
    path_report_continued(run, report);
    path_report_levels(run, report);
    report_run(run, report);
    report_figures(run, &run->found.info, report);
    path_report_ends(run, report);
    path_report_kind(run, report);
    report_distances(run, report);
    if (hnn_system_model(&run->system))
        report_model(run, report);
    report_forces(run, report);
    report_energy(run, report);
    path_report_solutions(run, report);
}

void path_report_blocks(const void *context, struct report *report)
{
    const struct path_run *run = context;
    const struct ad_ranks *ranks = run->options->common.ranks;
    report_run(run, report);
    report_figures(run, &run->found.info, report);
    path_report_kind(run, report);
    report_energy(run, report);
    report_line(report, "\n  by blocks: no distances, conjugate points and estimates of errors");
    report->passing = true;
    report_count(report, "ranks", "ranks", ranks ? ranks->count : 1);
    report_count(report, "messages", "messages of rank 0", ranks ? ranks->messages : 0);
    report_count(report, "message_bytes", "bytes of them", ranks ? ranks->bytes : 0);
    report_number(report, "seconds_waiting", "waiting", "s", ranks ? ranks->seconds : 0);
    report->passing = false;
}
