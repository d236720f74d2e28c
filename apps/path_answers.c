/* leastaction path --all: several stationary paths between the same ends (path.h). */
#include "path.h"
#include "json.h"

#include <math.h>
#include <string.h>

enum { STARTS = 200 }; /* random velocities, where there are several coordinates */

bool path_wants_all(const struct path_options *options)
{
    return options->all || !isnan(options->energy);
}

/* The answer of the energy asked for, else the first. */
static size_t choose(const struct path_run *run, const struct phys_answers *answers)
{
    double energy = run->options->energy;
    size_t best = 0;
    for (size_t k = 1; k < answers->n && !isnan(energy); k++)
        if (fabs(answers->answer[k].energy - energy) < fabs(answers->answer[best].energy - energy))
            best = k;
    return best;
}

enum ad_status path_find_all(struct path_run *run, struct path_result *result,
                             struct ad_error *error)
{
    size_t rows = run->settings.rule->degree * run->system.dof;
    struct phys_answers *answers = &result->answers;
    if (phys_path_all(&run->system, &run->settings, run->start, STARTS, run->options->common.seed,
                      answers, error) != AD_OK)
        return error->status;
    if (answers->n == 0)
        return ad_fail(error, AD_E_ACCURACY, "no stationary path found between these ends");
    result->chosen = choose(run, answers);
    memcpy(run->path, answers->answer[result->chosen].path,
           rows * run->settings.slices * sizeof *run->path);
    return AD_OK;
}

void path_print_answers(const struct path_run *run, const struct path_result *result)
{
    const struct phys_answers *all = &result->answers;
    const struct phys_scene *scene = run->system.scene;
    if (all->n == 0)
        return;
    printf("\n  %zu stationary paths between these ends (energy in %s, action in %s %s, largest "
           "coordinate in %s)\n\n",
           all->n, scene->energy_unit, scene->energy_unit, scene->time_unit, scene->unit);
    printf("  %14s %14s %6s %14s %7s\n", "energy", "action", "index", "largest", "copies");
    for (size_t k = 0; k < all->n; k++) {
        const struct phys_answer *a = &all->answer[k];
        printf("%c %14.9g %14.9g %6zu %14.9g %7zu\n", k == result->chosen ? '>' : ' ', a->energy,
               a->action, a->spectrum.index, a->largest, a->copies);
    }
}

void path_json_answers(struct json *json, const struct path_result *result)
{
    const struct phys_answers *all = &result->answers;
    if (all->n == 0)
        return;
    json_array(json, "paths");
    for (size_t k = 0; k < all->n; k++) {
        const struct phys_answer *a = &all->answer[k];
        json_object(json, NULL);
        json_number(json, "energy", a->energy);
        json_number(json, "action", a->action);
        json_count(json, "morse_index", a->spectrum.index);
        json_number(json, "largest", a->largest);
        json_count(json, "copies", a->copies);
        json_end_object(json);
    }
    json_end_array(json);
    json_count(json, "chosen", result->chosen);
}
