/* What --tol tried, and why it took what it took (path.h). */
#include "path.h"

#include <math.h>

static const struct path_level *chosen(const struct path_run *run)
{
    for (size_t k = 0; k < run->n_levels; k++)
        if (run->level[k].chosen)
            return &run->level[k];
    return NULL;
}

static void describe(const struct path_run *run, char *text, size_t size)
{
    const struct path_level *level = chosen(run);
    snprintf(text, size, "%zu elements of %s: the first setting with an estimate under %g",
             level->elements, level->rule->name, run->options->tolerance);
}

double path_estimate(const struct path_run *run)
{
    return chosen(run) ? chosen(run)->estimate : (double)NAN;
}

void path_report_levels(const struct path_run *run, struct report *report)
{
    char text[128];
    if (!chosen(run))
        return;
    report_line(report, "  tried, coarse to fine");
    for (size_t k = 0; k < run->n_levels; k++) {
        const struct path_level *level = &run->level[k];
        report_item(report, "tried");
        report_text(report, "rule", "rule", level->rule->name);
        report_count(report, "elements", "elements", level->elements);
        report_flag(report, "found", "path found", level->found);
        report->passing = true;
        report_number(report, "seconds", NULL, "s", level->seconds);
        report->passing = false;
        report_number(report, "estimate", "estimated error", run->system.scene->unit,
                      level->estimate);
    }
    report_item(report, NULL);
    describe(run, text, sizeof text);
    report_line(report, "  chosen: %s\n", text);
    report_text(report, "chosen", NULL, text);
    report_number(report, "error_estimate", NULL, run->system.scene->unit, chosen(run)->estimate);
}
