/* leastaction check: is a scene's Lagrangian finite, differentiated rightly, and local in time? */
#include "apps/command.h"
#include "apps/output/json.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct options {
    struct common common;
    size_t slices, entries;
    double dt, tolerance;
    struct settings set;
};

struct points {
    struct phys_points at;
    double *values; /* [2 dof + 1 x n], owned */
};

struct report {
    struct ad_error no_path; /* why there is no reference path; the points are then on a line */
    struct ad_error not_finite;
    struct ad_error energies; /* how T and V are not those of L */
    struct ad_check gradient, second;
    struct phys_locality locality;
    double mass_condition; /* the largest lower bound at the points */
};

/* ---- where to look ---- */

static enum ad_status reference_path(const struct phys_system *system,
                                     const struct options *options, size_t slices, double dt,
                                     double *path, struct ad_error *error)
{
    size_t dof = system->dof;
    phys_motion *motion = NULL;
    double *q = malloc(2 * dof * sizeof *q), *v = q ? q + dof : NULL;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (system->scene->start(system->params, options->common.seed, q, v, error) == AD_OK &&
        phys_motion_new(system, &motion, error) == AD_OK) {
        for (size_t k = 0; k < dof; k++) {
            path[k * slices] = q[k];
            path[k * slices + 1] = q[k] + v[k] * dt;
        }
        struct ad_error lost = {0};
        const struct phys_simulation closely = {.rtol = 1e-10, .max_steps = 50000};
        if (phys_motion_path(system, &closely, q, v, slices, dt, path, &lost) != AD_OK) {
            for (size_t k = 0; k < dof; k++) {
                path[k * slices] = q[k];
                path[k * slices + 1] = q[k] + v[k] * dt;
            }
            phys_ode_path(motion, slices, dt, 1, path, error);
        }
    }
    phys_motion_free(motion);
    free(q);
    return error->status;
}

/* Uniform motion from the start, where the equations of motion cannot be solved. */
static void straight_path(size_t dof, size_t slices, double *path)
{
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 2; i < slices; i++)
            path[k * slices + i] =
                path[k * slices] + (double)i * (path[k * slices + 1] - path[k * slices]);
}

/* q, v, t at the slices of a path but the last, as the rule `left` takes them. */
static enum ad_status take_points(const double *path, size_t dof, size_t slices, double dt,
                                  struct points *points, struct ad_error *error)
{
    size_t n = slices - 1;
    points->values = calloc(2 * dof + 1, n * sizeof *points->values);
    if (!points->values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *q = points->values, *v = q + dof * n, *t = v + dof * n;
    for (size_t i = 0; i < n; i++) {
        t[i] = (double)i * dt;
        for (size_t k = 0; k < dof; k++) {
            q[k * n + i] = path[k * slices + i];
            v[k * n + i] = (path[k * slices + i + 1] - path[k * slices + i]) / dt;
        }
    }
    points->at = (struct phys_points){n, q, v, t};
    return AD_OK;
}

static enum ad_status find_points(const struct phys_system *system, const struct options *options,
                                  struct points *points, struct ad_error *no_path,
                                  struct ad_error *error)
{
    const struct phys_scene *scene = system->scene;
    size_t slices = option_count_or(options->slices, scene->slices);
    double dt = option_number_or(options->dt, scene->dt);
    if (slices < 3)
        return ad_fail(error, AD_E_ARGUMENT, "--slices: expected at least 3, got %zu", slices);
    if (!(dt > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--dt: expected more than 0, such as 0.01, got %g",
                       dt);
    if (!(options->tolerance > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--tol: expected more than 0, such as 1e-6, got %g",
                       options->tolerance);
    double *path = calloc(system->dof, slices * sizeof *path);
    if (!path)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (reference_path(system, options, slices, dt, path, no_path) != AD_OK)
        straight_path(system->dof, slices, path);
    take_points(path, system->dof, slices, dt, points, error);
    free(path);
    return error->status;
}

/* ---- looking ---- */

static bool all_finite(const struct report *report) { return report->not_finite.status == AD_OK; }

static enum ad_status find_condition(const struct phys_system *system, const struct phys_points *at,
                                     double *condition, struct ad_error *error)
{
    size_t dof = system->dof;
    phys_legendre *legendre;
    double *x = malloc(2 * dof * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_legendre_new(system, &legendre, error) == AD_OK) {
        for (size_t i = 0; i < at->n; i++) {
            for (size_t k = 0; k < dof; k++) {
                x[k] = at->q[k * at->n + i];
                x[dof + k] = at->v[k * at->n + i];
            }
            *condition = fmax(*condition, phys_legendre_condition(legendre, x, x + dof, at->t[i]));
        }
        phys_legendre_free(legendre);
    }
    free(x);
    return error->status;
}

/* Only a finite Lagrangian can be compared with differences. */
static enum ad_status examine(const struct phys_system *system, const struct options *options,
                              struct report *report, struct ad_error *error)
{
    struct points points = {0};
    const struct phys_points *at = &points.at;
    struct ad_error *not_finite = &report->not_finite;
    if (find_points(system, options, &points, &report->no_path, error) == AD_OK &&
        phys_check_finite(system, at, not_finite) == AD_OK) {
        phys_check_gradient(system, at, 1, options->tolerance, options->entries, &report->gradient,
                            error);
        phys_check_gradient(system, at, 2, options->tolerance, options->entries, &report->second,
                            error);
        phys_check_locality(system, at, &report->locality, error);
        phys_check_energies(system, at, &report->energies);
        if (report->energies.status != AD_OK && report->energies.status != AD_E_ARGUMENT)
            ad_fail(error, report->energies.status, "%s", report->energies.message);
        report->mass_condition = NAN;
        if (report->locality.passed) /* it is recorded at one slice */
            find_condition(system, at, &report->mass_condition, error);
    } else if (!all_finite(report) && not_finite->status != AD_E_NONFINITE) {
        ad_fail(error, not_finite->status, "%s", not_finite->message);
    }
    free(points.values);
    return error->status;
}

static bool passed(const struct report *r)
{
    return r->no_path.status == AD_OK && all_finite(r) && r->gradient.passed && r->second.passed &&
           r->locality.passed && r->energies.status == AD_OK;
}

/* ---- reporting ---- */

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

static void entry_name(const struct phys_system *system, const struct ad_check *check, char *name,
                       size_t size)
{
    row_name(system, check->input * system->dof + check->row, name, size);
}

static void print_check(const struct phys_system *system, const char *what,
                        const struct ad_check *check)
{
    char name[48];
    entry_name(system, check, name, sizeof name);
    printf("  %-15s %-7s worst of %zu entries: %.2g at %s, slice %zu", what,
           check->passed ? "ok" : "FAILED", check->entries, check->worst, name, check->col);
    if (!check->passed)
        printf(" (tape %.9g, difference %.9g%s)", check->tape, check->difference,
               check->kink ? "; L has a kink near there" : "");
    putchar('\n');
}

static void print_locality(const struct phys_system *system, const struct phys_locality *locality)
{
    char name[48];
    if (locality->passed) {
        printf("  %-15s ok\n", "slice locality");
        return;
    }
    row_name(system, locality->row, name, sizeof name);
    printf("  %-15s FAILED  L of slice %zu reacts to %s of slice %zu\n", "slice locality",
           locality->slice, name, locality->moved);
}

static void print_failure(const char *what, const struct ad_error *error)
{
    if (error->status == AD_OK)
        printf("  %-15s ok\n", what);
    else
        printf("  %-15s FAILED  %s\n", what, error->message);
}

static void print_report(const struct phys_system *system, const struct report *report)
{
    printf("%s\n", system->scene->name);
    print_failure("reference path", &report->no_path);
    print_failure("finite there", &report->not_finite);
    if (!all_finite(report)) {
        puts("  the other checks need finite values");
        return;
    }
    print_check(system, "gradient", &report->gradient);
    print_check(system, "second order", &report->second);
    print_locality(system, &report->locality);
    print_failure("energies", &report->energies);
    if (report->locality.passed)
        printf("  %-15s condition number %.2g or more%s\n", "mass matrix", report->mass_condition,
               report->mass_condition > 1e8 ? ": nearly singular, accelerations lose as many digits"
                                            : "");
}

static void json_check(struct json *json, const struct phys_system *system, const char *key,
                       const struct ad_check *check)
{
    char name[48];
    entry_name(system, check, name, sizeof name);
    json_object(json, key);
    json_bool(json, "passed", check->passed);
    json_count(json, "entries", check->entries);
    json_number(json, "worst", check->worst);
    json_text(json, "coordinate", name);
    json_count(json, "slice", check->col);
    json_number(json, "tape", check->tape);
    json_number(json, "difference", check->difference);
    json_end_object(json);
}

static void json_locality(struct json *json, const struct phys_system *system,
                          const struct phys_locality *locality)
{
    char name[48];
    json_object(json, "locality");
    json_bool(json, "passed", locality->passed);
    if (!locality->passed) {
        row_name(system, locality->row, name, sizeof name);
        json_count(json, "slice", locality->slice);
        json_count(json, "reacts_to", locality->moved);
        json_text(json, "coordinate", name);
    }
    json_end_object(json);
}

static void json_failure(struct json *json, const char *key, const struct ad_error *error)
{
    json_object(json, key);
    json_bool(json, "passed", error->status == AD_OK);
    json_text(json, "message", error->status == AD_OK ? NULL : error->message);
    json_end_object(json);
}

static void json_report(const struct phys_system *system, const struct report *report)
{
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "scene", system->scene->name);
    json_bool(&json, "passed", passed(report));
    json_failure(&json, "reference_path", &report->no_path);
    json_failure(&json, "finite", &report->not_finite);
    if (all_finite(report)) {
        json_check(&json, system, "gradient", &report->gradient);
        json_check(&json, system, "second", &report->second);
        json_locality(&json, system, &report->locality);
        json_failure(&json, "energies", &report->energies);
        json_number(&json, "mass_condition", report->mass_condition);
    }
    json_close(&json);
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    struct phys_system system;
    struct report report = {0};
    if (phys_system_open(options->common.argument[0], &system, error) == AD_OK)
        phys_system_set_all(&system, options->set.n, options->set.setting, error);
    int status = command_status(error);
    if (status == DONE && examine(&system, options, &report, error) == AD_OK) {
        (options->common.json ? json_report : print_report)(&system, &report);
        status = passed(&report) ? DONE : NOT_REACHED;
    } else {
        status = command_status(error);
    }
    phys_system_close(&system);
    return status;
}

#define AT(member) offsetof(struct options, member)

static const struct option table[] = {
    {"slices", "N", OPTION_COUNT, NULL, "points of the reference path [the scene's]", AT(slices)},
    {"dt", "DT", OPTION_NUMBER, NULL, "time from slice to slice [the scene's]", AT(dt)},
    {"tol", "E", OPTION_NUMBER, "1e-6", "error of a derivative, relative to the largest",
     AT(tolerance)},
    {"entries", "N", OPTION_COUNT, "200", "compared with differences; 0: all", AT(entries)},
    {"set", "NAME=VALUE", OPTION_SETTINGS, NULL, "a parameter of the scene; repeatable", AT(set)},
};

const struct command command_check = {
    .line = {.name = "check",
             .what = "gradient, second order, slice locality and energies of a Lagrangian",
             .arguments = {"SCENE|SCENE.so"},
             .options = table,
             .n_options = sizeof table / sizeof *table},
    .bytes = sizeof(struct options),
    .run = run,
};
