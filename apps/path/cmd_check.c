/* leastaction check: checks a scene's Lagrangian for finite values, correct derivatives, and
   locality in time. */
#include "apps/command.h"
#include "apps/output/report.h"
#include "physics/motion/checks.h"

#include <stdio.h>

struct options {
    struct common common;
    size_t slices, entries;
    double dt, tolerance;
};

/* "q theta" for row k of q over v over t. */
static void row_name(const struct phys_system *system, size_t row, char *name, size_t size)
{
    char coordinate[32];
    size_t dof = system->dof;
    if (row == SIZE_MAX) {
        snprintf(name, size, "several coordinates");
    } else if (row == 2 * dof) {
        snprintf(name, size, "t");
    } else {
        phys_coordinate_name(system, row % dof, coordinate, sizeof coordinate);
        snprintf(name, size, "%s %s", row < dof ? "q" : "v", coordinate);
    }
}

static void report_failure(struct report *report, const char *key, const char *what,
                           const struct ad_error *error)
{
    bool passed = error->status == AD_OK;
    report_line(report, "  %-15s %s%s", what, passed ? "ok" : "FAILED  ", error->message);
    report->object = key;
    report_flag(report, "passed", NULL, passed);
    report_text(report, "message", NULL, passed ? NULL : error->message);
    report->object = NULL;
}

static void report_check(struct report *report, const struct phys_system *system, const char *key,
                         const char *what, double tolerance, const struct ad_check *check)
{
    char name[48], failed[128] = "";
    row_name(system, check->input * system->dof + check->row, name, sizeof name);
    if (!check->passed)
        snprintf(failed, sizeof failed, " (tape %.9g, difference %.9g%s)", check->tape,
                 check->difference, check->kink ? "; L has a kink near there" : "");
    else if (check->worst == tolerance)
        snprintf(failed, sizeof failed, " (terms of L cancel: tape %.9g, differences know %.3g)",
                 check->tape, check->difference);
    report_line(report, "  %-15s %-7s worst of %zu entries: %.2g at %s, slice %zu%s", what,
                check->passed ? "ok" : "FAILED", check->entries, check->worst, name, check->col,
                failed);
    report->object = key;
    report_flag(report, "passed", NULL, check->passed);
    report_count(report, "entries", NULL, check->entries);
    report_number(report, "worst", NULL, NULL, check->worst);
    report_text(report, "coordinate", NULL, name);
    report_count(report, "slice", NULL, check->col);
    report_number(report, "tape", NULL, NULL, check->tape);
    report_number(report, "difference", NULL, NULL, check->difference);
    report->object = NULL;
}

static void report_locality(struct report *report, const struct phys_system *system,
                            const struct phys_locality *locality)
{
    char name[48];
    report->object = "locality";
    report_flag(report, "passed", NULL, locality->passed);
    if (locality->passed) {
        report_line(report, "  %-15s ok", "slice locality");
    } else {
        row_name(system, locality->row, name, sizeof name);
        report_line(report, "  %-15s FAILED  L of slice %zu reacts to %s of slice %zu",
                    "slice locality", locality->slice, name, locality->moved);
        report_count(report, "slice", NULL, locality->slice);
        report_count(report, "reacts_to", NULL, locality->moved);
        report_text(report, "coordinate", NULL, name);
    }
    report->object = NULL;
}

static void report_checks(struct report *report, const struct phys_system *system, double tolerance,
                          const struct phys_checks *c)
{
    report_line(report, "%s", system->scene->name);
    report_text(report, "scene", NULL, system->scene->name);
    report_flag(report, "passed", NULL, c->passed);
    report_failure(report, "reference_path", "reference path", &c->no_path);
    report_failure(report, "finite", "finite there", &c->not_finite);
    if (c->not_finite.status != AD_OK) {
        report_line(report, "  the other checks need finite values");
        return;
    }
    report_check(report, system, "gradient", "gradient", tolerance, &c->gradient);
    report_check(report, system, "second", "second order", tolerance, &c->second);
    report_locality(report, system, &c->locality);
    report_failure(report, "energies", "energies", &c->energies);
    report_text(report, "kink", NULL, c->kink);
    if (c->kink)
        report_line(report, "  %-15s by %s: gradients and methods are right away from them only",
                    "kinks", c->kink);
    report_number(report, "mass_condition", NULL, NULL, c->mass_condition);
    if (c->locality.passed)
        report_line(
            report, "  %-15s condition number %.2g or more%s", "mass matrix", c->mass_condition,
            c->mass_condition > 1e8 ? ": nearly singular, accelerations lose as many digits" : "");
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    struct phys_system system;
    struct phys_checks checks = {0};
    if (phys_system_open(options->common.argument[0], &system, error) == AD_OK &&
        phys_system_set_all(&system, options->common.set.n, options->common.set.setting, error) ==
            AD_OK &&
        phys_check_scene(&system, options->common.seed,
                         option_count_or(options->slices, system.scene->slices),
                         option_number_or(options->dt, system.scene->dt), options->tolerance,
                         options->entries, &checks, error) == AD_OK) {
        struct report report = {0};
        report_checks(&report, &system, options->tolerance, &checks);
        (options->common.json ? report_json : report_print)(&report, stdout, error);
        report_free(&report);
    }
    phys_system_close(&system);
    if (error->status != AD_OK)
        return command_status(error);
    return checks.passed ? DONE : NOT_REACHED;
}

#define AT(member) offsetof(struct options, member)

static const struct option table[] = {
    {"slices", "N", OPTION_SLICES, NULL, "points of the reference path [the scene's]", AT(slices)},
    {"dt", "DT", OPTION_POSITIVE, NULL, "time from slice to slice [the scene's]", AT(dt)},
    {"tol", "E", OPTION_POSITIVE, "1e-6", "error of a derivative, relative to the largest",
     AT(tolerance)},
    {"entries", "N", OPTION_COUNT, "200", "compared with differences; 0: all", AT(entries)},
};

const struct command command_check = {
    .line = {.name = "check",
             .what = "gradient, second order, slice locality and energies of a Lagrangian",
             .arguments = {"SCENE|SCENE.so"},
             .scene = true,
             .options = table,
             .n_options = sizeof table / sizeof *table},
    .bytes = sizeof(struct options),
    .run = run,
};
