/* leastaction check: checks a scene's Lagrangian for finite values, correct derivatives, and
   locality in time. */
#include "apps/command.h"
#include "apps/output/report.h"
#include "physics/motion/checks.h"

#include <stdio.h>
#include <string.h>

struct options {
    struct common common;
    size_t slices, entries;
    double dt, tolerance;
};

static void add_failure(struct report *report, const char *key, const struct ad_error *error)
{
    bool passed = error->status == AD_OK;
    report->object = key;
    report_flag(report, "passed", NULL, passed);
    report_text(report, "message", NULL, passed ? NULL : error->message);
    report->object = NULL;
}

static void add_check(struct report *report, const struct phys_system *system, const char *key,
                      const struct ad_check *check)
{
    char name[48];
    phys_check_row_name(system, check->input * system->dof + check->row, name, sizeof name);
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

static void add_locality(struct report *report, const struct phys_system *system,
                         const struct phys_locality *locality)
{
    char name[48];
    report->object = "locality";
    report_flag(report, "passed", NULL, locality->passed);
    if (!locality->passed) {
        phys_check_row_name(system, locality->row, name, sizeof name);
        report_count(report, "slice", NULL, locality->slice);
        report_count(report, "reacts_to", NULL, locality->moved);
        report_text(report, "coordinate", NULL, name);
    }
    report->object = NULL;
}

static void add_text(struct report *report, const struct phys_system *system,
                     const struct phys_checks *c)
{
    char text[4096], *next = NULL;
    phys_checks_text(system, c, text, sizeof text);
    for (char *line = strtok_r(text, "\n", &next); line; line = strtok_r(NULL, "\n", &next))
        report_line(report, "%s", line);
}

static void report_checks(struct report *report, const struct phys_system *system,
                          const struct phys_checks *c)
{
    add_text(report, system, c);
    report_text(report, "scene", NULL, system->scene->name);
    report_flag(report, "passed", NULL, c->passed);
    add_failure(report, "reference_path", &c->no_path);
    add_failure(report, "finite", &c->not_finite);
    if (c->not_finite.status != AD_OK)
        return;
    add_check(report, system, "gradient", &c->gradient);
    add_check(report, system, "second", &c->second);
    add_locality(report, system, &c->locality);
    add_failure(report, "energies", &c->energies);
    report_text(report, "kink", NULL, c->kink);
    report_number(report, "mass_condition", NULL, NULL, c->mass_condition);
    report_learnt(system, 0, NULL, NULL, report);
    if (c->negative_most != SIZE_MAX)
        report_count(report, "mass_negative", NULL, c->negative_most);
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    struct phys_system system;
    struct phys_checks checks = {0};
    if (hnn_system_open(options->common.argument[0], &system, error) == AD_OK &&
        phys_system_set_all(&system, options->common.set.n, options->common.set.setting, error) ==
            AD_OK &&
        phys_check_scene(&system, options->common.seed,
                         option_count_or(options->slices, system.scene->slices),
                         option_number_or(options->dt, system.scene->dt), options->tolerance,
                         options->entries, &checks, error) == AD_OK) {
        struct report report = {0};
        report_checks(&report, &system, &checks);
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
