/* The report of all checks of a Lagrangian as lines of text. */
#include "checks.h"
#include "autodiff/text.h"

#include <stdio.h>

void phys_check_row_name(const struct phys_system *system, size_t k, char *name, size_t size)
{
    char coordinate[32];
    size_t dof = system ? system->dof : 0;
    if (!name || !size)
        return;
    if (!dof) {
        *name = 0;
    } else if (k == SIZE_MAX) {
        snprintf(name, size, "several coordinates");
    } else if (k == 2 * dof) {
        snprintf(name, size, "t");
    } else {
        phys_coordinate_name(system, k % dof, coordinate, sizeof coordinate);
        snprintf(name, size, "%s %s", k < dof ? "q" : "v", coordinate);
    }
}

static void add_failure(struct ad_text *text, const char *what, const struct ad_error *error)
{
    ad_text_add(text, "  %-15s %s%s\n", what, error->status == AD_OK ? "ok" : "FAILED  ",
                error->message);
}

static void add_check(struct ad_text *text, const struct phys_system *system, const char *what,
                      const struct ad_check *check)
{
    char name[48];
    phys_check_row_name(system, check->input * system->dof + check->row, name, sizeof name);
    ad_text_add(text, "  %-15s %-7s worst of %zu entries: %.2g at %s, slice %zu", what,
                check->passed ? "ok" : "FAILED", check->entries, check->worst, name, check->col);
    if (!check->passed || check->cancels)
        ad_text_add(text, " (tape %.9g, difference %.9g%s)", check->tape, check->difference,
                    check->kink      ? "; L has a kink near there"
                    : check->cancels ? ": terms of L cancel, no more is known"
                                     : "");
    ad_text_add(text, "\n");
}

static void add_locality(struct ad_text *text, const struct phys_system *system,
                         const struct phys_locality *locality)
{
    char name[48];
    phys_check_row_name(system, locality->row, name, sizeof name);
    ad_text_add(text, "  %-15s ", "slice locality");
    if (locality->passed)
        ad_text_add(text, "ok\n");
    else
        ad_text_add(text, "FAILED  L of slice %zu reacts to %s of slice %zu\n", locality->slice,
                    name, locality->moved);
}

static const char *definiteness(const struct phys_system *system, const struct phys_checks *c)
{
    if (c->negative_most == SIZE_MAX)
        return "singular";
    if (c->negative_most == 0)
        return "positive definite";
    return c->negative_least == system->dof
               ? "negative definite"
               : "indefinite: no Morse index, no minimum of the action";
}

size_t phys_checks_text(const struct phys_system *system, const struct phys_checks *checks,
                        char *text, size_t size)
{
    struct ad_text all = {text, text ? size : 0, 0};
    if (!system || !system->scene || !checks)
        return 0;
    ad_text_add(&all, "%s\n", system->scene->name);
    add_failure(&all, "reference path", &checks->no_path);
    add_failure(&all, "finite there", &checks->not_finite);
    if (checks->not_finite.status != AD_OK) {
        ad_text_add(&all, "  the other checks need finite values\n");
        return all.length;
    }
    add_check(&all, system, "gradient", &checks->gradient);
    add_check(&all, system, "second order", &checks->second);
    add_locality(&all, system, &checks->locality);
    add_failure(&all, "energies", &checks->energies);
    if (checks->kink)
        ad_text_add(&all, "  %-15s by %s: gradients and methods are right away from them only\n",
                    "kinks", checks->kink);
    if (checks->locality.passed)
        ad_text_add(&all, "  %-15s %s, condition number %.2g or more%s\n", "mass matrix",
                    definiteness(system, checks), checks->mass_condition,
                    checks->mass_condition > 1e8
                        ? ": nearly singular, accelerations lose as many digits"
                        : "");
    return all.length;
}
