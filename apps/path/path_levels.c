/* What --tol tried, and why it took what it took (path.h). */
#include "path.h"
#include "apps/output/json.h"
#include "apps/output/unit.h"

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

void path_print_levels(const struct path_run *run)
{
    const char *unit = unit_shown(run->system.scene->unit);
    char text[128];
    if (!chosen(run))
        return;
    puts("  tried, coarse to fine   elements   seconds   estimate of the error");
    for (size_t k = 0; k < run->n_levels; k++) {
        const struct path_level *level = &run->level[k];
        printf("  %-22s %9zu %9.3g   ", level->rule->name, level->elements, level->seconds);
        if (isnan(level->estimate))
            puts(level->found ? "nothing to compare with" : "no stationary path found");
        else
            printf("%.3g%s%s\n", level->estimate, *unit ? " " : "", unit);
    }
    describe(run, text, sizeof text);
    printf("  chosen: %s\n\n", text);
}

void path_json_levels(struct json *json, const struct path_run *run)
{
    char text[128];
    if (!chosen(run))
        return;
    describe(run, text, sizeof text);
    json_number(json, "error_estimate", chosen(run)->estimate);
    json_text(json, "chosen", text);
    json_array(json, "tried");
    for (size_t k = 0; k < run->n_levels; k++) {
        const struct path_level *level = &run->level[k];
        json_object(json, NULL);
        json_text(json, "rule", level->rule->name);
        json_count(json, "elements", level->elements);
        json_number(json, "seconds", level->seconds);
        json_number(json, "estimate", level->estimate);
        json_end_object(json);
    }
    json_end_array(json);
}
