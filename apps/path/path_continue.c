/* leastaction path --continue NAME=FROM:TO: a parameter followed to the value asked for (path.h).
 */
#include "path.h"

#include <stdlib.h>
#include <string.h>

enum ad_status path_continuation(struct path_run *run, struct ad_error *error)
{
    const char *text = run->options->follow;
    const struct settings *set = &run->options->common.set;
    if (!text)
        return AD_OK;
    if (!options_range(text, run->followed, sizeof run->followed, &run->follow.from,
                       &run->follow.to))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--continue: expected NAME=FROM:TO, as in m=1:0.01, got '%s'", text);
    run->follow.size = sizeof run->follow;
    run->follow.name = run->followed;
    if (!path_wants_tolerance(run->options))
        return ad_fail(error, AD_E_ARGUMENT, "--continue needs --tol, the error of the last path");
    for (size_t k = 0; k < set->n; k++)
        if (strcmp(set->setting[k].name, run->followed) == 0)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--continue does not go with --set %s: it sets that parameter",
                           run->followed);
    size_t dof = run->system.dof;
    if (phys_system_set(&run->system, run->followed, run->follow.from, error) == AD_OK)
        phys_system_set(&run->system, run->followed, run->follow.to, error);
    if (error->status == AD_OK && run->system.dof != dof)
        ad_fail(error, AD_E_ARGUMENT, "--continue %s: it changes the number of coordinates",
                run->followed);
    return error->status;
}

void path_report_continued(const struct path_run *run, struct report *report)
{
    const struct phys_continued *c = &run->continued;
    if (c->n == 0)
        return;
    report_line(report, "  %s followed from %g to %g, %zu steps", run->followed, run->follow.from,
                run->follow.to, c->n - 1);
    double *list = malloc(2 * c->n * sizeof *list);
    if (!list) {
        report->failed = true;
        return;
    }
    for (size_t k = 0; k < c->n; k++) {
        const struct phys_continued_step *step = &c->step[k];
        list[k] = step->value;
        list[c->n + k] = (double)step->index;
        if (k > 0 && step->index != step[-1].index)
            report_line(report,
                        "  Morse index %zu at %s = %.9g, %zu at %.9g: another branch begins or "
                        "ends between",
                        step[-1].index, run->followed, step[-1].value, step->index, step->value);
    }
    report_list(report, "continued_values", NULL, NULL, c->n, list);
    report_list(report, "continued_indices", NULL, NULL, c->n, list + c->n);
    free(list);
}
