/* What --tol E goes with (path.h). */
#include "path.h"

#include <math.h>
#include <string.h>

bool path_wants_tolerance(const struct path_options *options) { return !isnan(options->tolerance); }

enum ad_status path_check_tolerance(const struct path_run *run, struct ad_error *error)
{
    const struct path_options *options = run->options;
    const struct {
        bool given;
        const char *why;
    } conflicts[] = {
        {options->preset != NULL, "--preset: its slices are fixed"},
        {path_wants_all(options), "--all, --energy: it refines one path"},
        {strcmp(options->ends, "both") != 0, "--ends start: it needs both ends"},
        {run->system.scene->free_time, "a free end time"},
        {options->data != NULL,
         "--data: observations have slices of their own; simulate ephemeris --data DIR --tol KM "
         "finds the least model"},
        {options->reference != NULL,
         "--reference: the rows of the file are slices of their own; compare the --csv of the run"},
        {options->hold != 1, "--hold: it chooses the slices"},
        {!isnan(options->grad_tolerance), "--grad-tol: every level is solved to rounding"},
    };
    if (!(options->tolerance > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--tol: expected more than 0, such as 1e-6, got %g",
                       options->tolerance);
    for (size_t k = 0; k < sizeof conflicts / sizeof *conflicts; k++)
        if (conflicts[k].given)
            return ad_fail(error, AD_E_ARGUMENT, "--tol does not go with %s", conflicts[k].why);
    if (strcmp(run->solver->name, "newton") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--tol needs --solver newton, got %s; leave out --solver",
                       run->solver->name);
    return AD_OK;
}
