/* leastaction path --all: several stationary paths between the same ends (path.h). */
#include "path.h"
#include "apps/output/json.h"

#include <math.h>
#include <string.h>

enum { STARTS = 200 }; /* random velocities at most, where there are several coordinates */

bool path_wants_all(const struct path_options *options)
{
    return options->all || !isnan(options->energy);
}

static const double same_energy = 1e-2; /* of the energy, or of the range of those found */

static size_t nearest(const struct phys_answers *all, double energy)
{
    size_t best = 0;
    for (size_t k = 1; k < all->n; k++)
        if (fabs(all->answer[k].energy - energy) < fabs(all->answer[best].energy - energy))
            best = k;
    return best;
}

/* Says which energies there are, as many as fit. */
static enum ad_status refuse_energy(const struct phys_answers *all, double energy,
                                    struct ad_error *error)
{
    char list[160] = "";
    size_t n = 0, k = 0;
    while (k < all->n && n + 20 < sizeof list)
        n += (size_t)snprintf(list + n, sizeof list - n, " %.6g", all->answer[k++].energy);
    return ad_fail(error, AD_E_ACCURACY,
                   "no stationary path of energy %g between these ends; those found have%s%s",
                   energy, list, k < all->n ? " ... (see --all)" : "");
}

/* The answer of the energy asked for, else the first. */
static enum ad_status choose(const struct path_run *run, struct path_result *result,
                             struct ad_error *error)
{
    const struct phys_answers *all = &result->answers;
    double energy = run->options->energy;
    if (isnan(energy))
        return AD_OK;
    result->chosen = nearest(all, energy);
    double off = fabs(all->answer[result->chosen].energy - energy);
    double range = all->answer[all->n - 1].energy - all->answer[0].energy;
    return off <= same_energy * fmax(fabs(energy), range) ? AD_OK
                                                          : refuse_energy(all, energy, error);
}

enum ad_status path_find_all(struct path_run *run, struct path_result *result,
                             struct ad_error *error)
{
    size_t rows = run->settings.rule->degree * run->system.dof;
    struct phys_answers *answers = &result->answers;
    const double *first = run->options->init ? run->start : run->reference; /* the motion is one */
    if (phys_path_all(&run->system, &run->settings, first, STARTS, run->options->common.seed,
                      answers, error) != AD_OK)
        return error->status;
    if (answers->n == 0)
        return ad_fail(error, AD_E_ACCURACY, "no stationary path found between these ends%s",
                       answers->unresolved ? " that finer grids have, too; try --rule gauss4"
                                             " or a smaller --dt"
                                           : "; try --init ode, or --rule gauss4");
    if (choose(run, result, error) != AD_OK)
        return error->status;
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
        char index[24] = "-";
        if (a->spectrum.legendre == PHYS_POSITIVE)
            snprintf(index, sizeof index, "%zu", a->spectrum.index);
        printf("%c %14.9g %14.9g %6s %14.9g %7zu\n", k == result->chosen ? '>' : ' ', a->energy,
               a->action, index, a->largest, a->copies);
    }
    if (run->system.dof > 1)
        printf("\n  another random start would find one not listed with a chance of about %.0f%%\n",
               100 * all->unseen);
    if (all->unresolved)
        printf("\n  %zu more are of this grid alone (finer ones move them or have none) "
               "and left out;\n  --rule gauss4 or a smaller --dt may tell more\n",
               all->unresolved);
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
        if (a->spectrum.legendre == PHYS_POSITIVE)
            json_count(json, "morse_index", a->spectrum.index);
        else
            json_null(json, "morse_index");
        json_number(json, "largest", a->largest);
        json_count(json, "copies", a->copies);
        json_end_object(json);
    }
    json_end_array(json);
    json_count(json, "chosen", result->chosen);
    json_count(json, "unresolved", all->unresolved);
    json_number(json, "unseen", all->unseen);
}
