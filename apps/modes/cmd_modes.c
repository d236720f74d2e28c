/* leastaction modes: equilibria of a scene and small oscillations about them. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "modes.h"

#include <stdlib.h>
#include <string.h>

/* --within NAME=LOW:HIGH */
static enum ad_status read_box(struct modes_run *run, const char *text, struct ad_error *error)
{
    char name[64], given[64];
    double from, to;
    if (!options_range(text, given, sizeof given, &from, &to) || !(from < to))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--within: expected NAME=LOW:HIGH, LOW less than HIGH, got '%s'", text);
    for (size_t k = 0; k < run->system.dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        if (strcmp(name, given) == 0) {
            run->low[k] = from;
            run->high[k] = to;
            return AD_OK;
        }
    }
    return ad_fail(error, AD_E_ARGUMENT, "--within: expected a coordinate of %s, got '%s'",
                   run->system.scene->name, given);
}

static enum ad_status setup(const struct modes_options *o, struct modes_run *run,
                            struct ad_error *error)
{
    *run = (struct modes_run){.options = o};
    if (hnn_system_open(o->common.argument[0], &run->system, error) != AD_OK ||
        phys_system_set_all(&run->system, o->common.set.n, o->common.set.setting, error) != AD_OK)
        return error->status;
    const size_t dof = run->system.dof;
    if (o->within.n > 0 && !(run->low = malloc(2 * dof * sizeof *run->low)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    run->high = run->low ? run->low + dof : NULL;
    for (size_t k = 0; run->low && k < 2 * dof; k++)
        run->low[k] = NAN;
    for (size_t k = 0; k < o->within.n && error->status == AD_OK; k++)
        read_box(run, o->within.text[k], error);
    return error->status;
}

static enum ad_status solve(void *context, struct ad_error *error)
{
    struct modes_run *run = context;
    const struct phys_equilibria_settings how = {
        .size = sizeof how,
        .starts = option_count_or(run->options->starts, 0),
        .seed = run->options->common.seed,
        .low = run->low,
        .high = run->high,
        .proceed = interrupt_proceed,
    };
    interrupt_catch();
    if (phys_equilibria_find(&run->system, &how, &run->found, error) != AD_OK)
        return error->status;
    run->drawn = option_count_or(run->options->equilibrium, 1) - 1;
    run->drawn_mode = option_count_or(run->options->mode, 1) - 1;
    if (run->found.n == 0)
        return ad_fail(error, AD_E_ACCURACY,
                       "%s: no equilibrium: none of %zu starts led to one; try --within "
                       "NAME=LOW:HIGH, --starts",
                       run->system.scene->name, run->found.starts);
    if (run->drawn >= run->found.n)
        return ad_fail(error, AD_E_ARGUMENT, "--equilibrium: expected at most %zu, got %zu",
                       run->found.n, run->drawn + 1);
    if (run->options->mode != OPTION_NO_COUNT &&
        run->drawn_mode >= run->found.one[run->drawn].n_modes)
        return ad_fail(error, AD_E_ARGUMENT, "--mode: expected at most %zu, got %zu",
                       run->found.one[run->drawn].n_modes, run->drawn_mode + 1);
    return AD_OK;
}

static const struct output_kind outputs = {modes_report, modes_file, modes_write_csv, modes_picture,
                                           NULL};

static int run(const void *options, struct ad_error *error)
{
    struct modes_run run;
    if (setup(options, &run, error) == AD_OK)
        outputs_run(&outputs, &run.options->common, &run, solve, error);
    phys_equilibria_free(&run.found);
    free(run.low);
    phys_system_close(&run.system);
    return command_status(error);
}

#define AT(member) offsetof(struct modes_options, member)

static const struct option table[] = {
    {"starts", "N", OPTION_SOME, NULL, "starts of Newton's method [200]", AT(starts)},
    {"within", "NAME=LOW:HIGH", OPTION_TEXTS, NULL,
     "where starts are drawn, repeatable [about the scene's start; a turn for angles]", AT(within)},
    {"equilibrium", "N", OPTION_SOME, NULL, "which one the picture is of [1]", AT(equilibrium)},
    {"mode", "N", OPTION_SOME, NULL, "and which of its modes [1]", AT(mode)},
};

const struct command command_modes = {
    .line =
        {.name = "modes",
         .what = "equilibria and small oscillations about them",
         .arguments = {"SCENE"},
         .scene = true,
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "Equilibria are points at rest without a force, L_q = 0, found by Newton's method "
             "from\n"
             "many starts; what no start leads to is not found. About each, small motions are "
             "those\n"
             "of M x'' + G x' + K x = 0, M = L_vv, G = L_vq - L_qv (turning frames, magnetic "
             "fields),\n"
             "K = -L_qq: shape exp((growth + i frequency) t). An equilibrium is stable where the\n"
             "energy is least, and unstable where a mode grows; else the linear equations do not\n"
             "decide. Pictures: one mode in time (a GIF moves), and all frequencies."},
    .bytes = sizeof(struct modes_options),
    .run = run,
};
