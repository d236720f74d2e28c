/* leastaction path --all: several stationary paths between the same ends (path.h). */
#include "path.h"
#include "apps/output/report.h"

#include <math.h>
#include <string.h>

enum { STARTS = 200 }; /* random velocities at most, where there are several coordinates */

bool path_wants_all(const struct path_options *options)
{
    return options->all ||
           (!isnan(options->energy) && !path_time_is_free(options) && !path_is_periodic(options));
}

/* Tolerance of the energy asked for; where that is 0, of the largest found. */
static const double same_energy = 2e-3;

static double energy_tolerance(const struct phys_solutions *all, double energy)
{
    double size = fabs(energy);
    for (size_t k = 0; energy == 0 && k < all->n; k++)
        size = fmax(size, fabs(all->solution[k].energy));
    return same_energy * size;
}

static size_t nearest(const struct phys_solutions *all, double energy)
{
    size_t best = 0;
    for (size_t k = 1; k < all->n; k++)
        if (fabs(all->solution[k].energy - energy) < fabs(all->solution[best].energy - energy))
            best = k;
    return best;
}

/* The solution of the energy asked for, which all of free end time have, else the first. */
static enum ad_status choose(struct path_run *run, struct ad_error *error)
{
    const struct phys_solutions *all = &run->solutions;
    double energy = run->options->energy, tolerance = energy_tolerance(all, energy);
    char list[160] = "";
    if (isnan(energy) || run->ends.free_time)
        return AD_OK;
    run->chosen = nearest(all, energy);
    double found = all->solution[run->chosen].energy;
    if (fabs(found - energy) <= tolerance)
        return AD_OK;
    size_t n = 0, k = 0;
    while (k < all->n && n + 20 < sizeof list)
        n += (size_t)snprintf(list + n, sizeof list - n, " %.6g", all->solution[k++].energy);
    return ad_fail(error, AD_E_ACCURACY,
                   "no stationary path of energy %g +- %.2g between these ends; the nearest has "
                   "%.9g, those found have%s%s%s",
                   energy, tolerance, found, list, k < all->n ? " ... (see --all)" : "",
                   all->interrupted ? "; interrupted: there may be more" : "");
}

enum ad_status path_find_all(struct path_run *run, struct ad_error *error)
{
    size_t rows = run->settings.rule->degree * run->system.dof;
    struct phys_solutions *solutions = &run->solutions;
    const double *first =
        run->options->init || !run->reference ? run->start : run->reference; /* the motion is one */
    struct phys_path_settings settings = run->settings;
    settings.ranks = run->options->common.ranks;
    run->longest = settings.dt * (double)(settings.slices - 1);
    if (phys_path_all(&run->system, &settings, first, STARTS, run->options->common.seed, solutions,
                      error) != AD_OK)
        return error->status;
    if (solutions->n == 0 && solutions->interrupted)
        return ad_fail(error, AD_E_ACCURACY, "interrupted before a stationary path was found");
    if (solutions->n == 0 && run->ends.free_time)
        return ad_fail(error, AD_E_ACCURACY,
                       "no stationary path of energy %g found between these ends in times up to "
                       "%.6g%s",
                       run->ends.energy, run->longest,
                       solutions->unresolved ? " that the grid resolves; try more --slices"
                                             : "; try a higher --energy, or a larger --dt");
    if (solutions->n == 0)
        return ad_fail(error, AD_E_ACCURACY, "no stationary path found between these ends%s",
                       solutions->unresolved ? " that finer grids have, too; try --rule gauss4"
                                               " or a smaller --dt"
                                             : "; try --init ode, or --rule gauss4");
    if (choose(run, error) != AD_OK)
        return error->status;
    memcpy(run->path, solutions->solution[run->chosen].path,
           rows * run->settings.slices * sizeof *run->path);
    if (run->ends.free_time)
        run->settings.dt =
            solutions->solution[run->chosen].time / (double)(run->settings.slices - 1);
    return AD_OK;
}

/* Two and three coordinates: what two independent searches say of paths that both missed. */
static void report_coverings(const struct path_run *run, const struct phys_solutions *all,
                             struct report *report)
{
    const double energy = 0.5 * all->fastest * all->fastest;
    const bool timed = run->ends.free_time;
    char above[80], starts[160];
    if (timed)
        snprintf(starts, sizeof starts, "all directions at the start and times up to %.6g",
                 run->longest);
    else if (all->farthest > 0)
        snprintf(starts, sizeof starts,
                 "places up to %.4g from the start of the line, with momenta of a kinetic energy "
                 "up to %.4g\n  there",
                 all->farthest, energy);
    else
        snprintf(starts, sizeof starts,
                 "all velocities at the start with a kinetic energy up to %.4g", energy);
    snprintf(above, sizeof above, " after %.3g million steps of motions, the limit",
             1e-6 * PHYS_ALL_STEPS);
    report_flag(report, "saturated", NULL, all->saturated);
    report_flag(report, "exhausted", NULL, all->exhausted);
    report_flag(report, "interrupted", NULL, all->interrupted);
    report_number(report, "unseen_paths", NULL, NULL,
                  all->interrupted ? (double)NAN : all->unseen_paths);
    report_number(report, "unseen_paths_limit", NULL, NULL,
                  all->saturated ? all->unseen_paths_limit : (double)NAN);
    report_number(report, "start_energy_limit", NULL, NULL, timed ? (double)NAN : energy);
    if (all->farthest > 0)
        report_number(report, "start_place_limit", NULL, NULL, all->farthest);
    report_number(report, "undecided", NULL, NULL, all->undecided);
    report_count(report, "found_once", NULL, all->found_once);
    report_line(report, "  from %s, %s", starts,
                all->interrupted ? "of which\n  only a part was searched: there may be many more"
                                 : "searched twice, independently;");
    if (all->interrupted)
        return;
    if (all->saturated)
        report_line(report,
                    "  both searches found the same motions. Unseen in this range: at most %.0f "
                    "with 95%% confidence,\n  if each is as easy to find as those listed and the "
                    "searches miss independently",
                    all->unseen_paths_limit);
    else if (all->found_once == 0)
        report_line(report,
                    "  both searches found the same motions, but %.3g%% of these are "
                    "undecided%s:\n  there may be more",
                    100 * fmin(1, all->undecided), all->exhausted ? above : "");
    else
        report_line(report,
                    "  not saturated: %.3g%% of these are undecided%s, and %zu motions "
                    "were\n  found by one search alone. At least about %.0f more are unseen; "
                    "there may be many",
                    100 * fmin(1, all->undecided), all->exhausted ? above : "", all->found_once,
                    ceil(all->unseen_paths));
}

/* Estimates of paths that are not listed. */
static void report_completeness(const struct path_run *run, const struct phys_solutions *all,
                                struct report *report)
{
    const size_t left = run->system.dof - run->system.scene->n_constraints;
    report_flag(report, "exhaustive", NULL, all->exhaustive);
    if (run->ends.free_time)
        report_number(report, "time_limit", NULL, run->system.scene->time_unit, run->longest);
    if (left > 1 && !isnan(all->unseen_paths)) {
        report_coverings(run, all, report);
    } else if (left > 1 || all->starts > 0) {
        report_number(report, "unseen", NULL, NULL, all->unseen);
        report_number(report, "unseen_limit", NULL, NULL, all->unseen_limit);
        report_count(report, "starts", NULL, all->starts);
        report_count(report, "starts_led", NULL, all->led);
        report_line(
            report,
            "  %zu of %zu random starts led to a path; another that does would find one not "
            "listed with a chance\n  under %.0f%% (95%% confidence). Paths that such starts "
            "seldom lead to are not counted: there may be many",
            all->led, all->starts, ceil(100 * all->unseen_limit));
    } else if (all->exhaustive) {
        report_count(report, "most_turns", NULL, all->most_turns);
        if (!run->ends.free_time)
            report_number(report, "fastest_start", NULL, NULL, all->fastest);
        report_flag(report, "more_turns", NULL, all->limited);
        report_line(report, "  all there are, of up to %zu turns and %s up to %.3g%s",
                    all->most_turns, run->ends.free_time ? "times" : "start velocities",
                    run->ends.free_time ? run->longest : all->fastest,
                    all->limited ? "; there are others that turn more often" : "");
    } else if (run->ends.free_time) {
        report_line(report,
                    "  in times up to %.3g; a closer look at the potential found others, "
                    "or a motion slows down on\n  top of it: there may be more",
                    run->longest);
    } else {
        report_number(report, "fastest_start", NULL, NULL, all->fastest);
        report_line(report,
                    "  the velocity at the start was swept up to %.3g: two paths near each other "
                    "may be missing",
                    all->fastest);
    }
    if (all->unresolved)
        report_line(report,
                    "  %zu more are rejected: the motion and the grid disagree; "
                    "--rule gauss4\n  or a smaller --dt may help",
                    all->unresolved);
}

/* " (energy in J, action in J s)": units that are none are left out. */
static void units(const struct phys_scene *scene, char *text, size_t size)
{
    const char *energy = unit_shown(scene->energy_unit), *time = unit_shown(scene->time_unit);
    const char *length = unit_shown(scene->unit);
    snprintf(text, size, "%s%s%s%s%s%s%s%s", *energy ? "; energy in " : "", energy,
             *energy || *time ? "; action in " : "", energy, *energy && *time ? " " : "", time,
             *length ? "; coordinates in " : "", length);
}

void path_report_solutions(const struct path_run *run, struct report *report)
{
    const struct phys_solutions *all = &run->solutions;
    const struct phys_scene *scene = run->system.scene;
    bool many = run->system.dof > PHYS_SHOOTING_DOF;
    bool families = false;
    char text[160];
    if (all->n == 0)
        return;
    for (size_t k = 0; k < all->n; k++)
        families = families || all->solution[k].family > 0;
    units(scene, text, sizeof text);
    report_line(report, "\n  %zu stationary path%s between these ends%s", all->n,
                all->n == 1 ? "" : "s", text);
    for (size_t k = 0; k < all->n; k++) {
        const struct phys_solution *a = &all->solution[k];
        report_item(report, "paths");
        if (run->ends.free_time)
            report_number(report, "time", "time", scene->time_unit, a->time);
        report_number(report, "energy", "energy", scene->energy_unit, a->energy);
        report_number(report, "action", "action", NULL, a->action);
        report_number(report, "morse_index", "index", NULL,
                      a->spectrum.legendre == PHYS_POSITIVE ? (double)a->spectrum.index
                                                            : (double)NAN);
        report_number(report, "largest", "largest", scene->unit, a->largest);
        report_count(report, "copies", "copies", a->copies);
        report_count(report, "family", families ? "family" : NULL, a->family);
        report_flag(report, "confirmed", many ? "confirmed" : NULL, a->resolved);
        report_flag(report, "result", "the result", k == run->chosen);
    }
    report_item(report, NULL);
    if (!isnan(run->options->energy) && !run->ends.free_time) {
        double tolerance = energy_tolerance(all, run->options->energy);
        report_line(report, "  the result: the nearest to the energy %g, within %.2g",
                    run->options->energy, tolerance);
        report_number(report, "energy_tolerance", NULL, scene->energy_unit, tolerance);
    }
    if (all->n_motions > 0)
        report_list(report, "motion_energies", "motions without a path of this grid: energy",
                    scene->energy_unit, all->n_motions, all->motion_energy);
    if (families)
        report_line(report,
                    "  family: the dimension of a continuous family of paths, of which one is "
                    "listed; 0: the path is alone");
    report_count(report, "chosen", NULL, run->chosen);
    report_count(report, "unresolved", NULL, all->unresolved);
    report_completeness(run, all, report);
    if (many)
        report_line(report,
                    "  above %d coordinates a path is confirmed where the motion from each "
                    "slice meets the next;\n  one that is not may be of this grid alone",
                    PHYS_SHOOTING_DOF);
}
