/* leastaction fit: parameters and starts of a scene from measured motions. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Splits NAME,NAME; or, with values, NAME=VALUE,NAME=VALUE. */
static enum ad_status split(const char *option, const char *text, bool values,
                            struct fit_list *list, struct ad_error *error)
{
    const size_t room = text ? strlen(text) / 2 + 1 : 0;
    char *rest;
    if (!text)
        return AD_OK;
    list->text = strdup(text);
    list->name = calloc(2 * room, sizeof *list->name);
    if (!list->text || !list->name)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    list->value = list->name + room;
    for (char *name = strtok_r(list->text, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        char *equals = strchr(name, '=');
        if (values && (!equals || equals == name || !equals[1]))
            return ad_fail(error, AD_E_ARGUMENT, "--%s: expected NAME=VALUE,NAME=VALUE, got '%s'",
                           option, name);
        if (values)
            *equals = '\0';
        list->value[list->n] = values ? equals + 1 : NULL;
        list->name[list->n++] = name;
    }
    return list->n ? AD_OK
                   : ad_fail(error, AD_E_ARGUMENT, "--%s: expected names, got '%s'", option, text);
}

/* --noise: one number for all, or by quantity. */
static enum ad_status read_noise(struct fit_run *run, struct ad_error *error)
{
    const size_t d = 2 * run->system.dof;
    char *end = NULL, name[64];
    if (!run->options->noise)
        return AD_OK;
    if (!(run->noise = calloc(d, sizeof *run->noise)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    run->settings.noise = run->noise;
    const double all = strtod(run->options->noise, &end);
    if (end != run->options->noise && *end == '\0') {
        for (size_t i = 0; i < d; i++)
            run->noise[i] = all;
        return all > 0 && isfinite(all)
                   ? AD_OK
                   : ad_fail(error, AD_E_ARGUMENT, "--noise: expected more than 0, got %g", all);
    }
    if (split("noise", run->options->noise, true, &run->noises, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < run->noises.n; k++) {
        size_t i = 0;
        for (; i < d; i++) {
            fit_quantity(&run->system, i, name, sizeof name);
            if (strcmp(name, run->noises.name[k]) == 0)
                break;
        }
        const double value = strtod(run->noises.value[k], &end);
        if (i == d || *end != '\0' || !(value > 0) || !isfinite(value))
            return ad_fail(error, AD_E_ARGUMENT,
                           "--noise: %s=%s: expected a coordinate, or v_ and a coordinate, and a "
                           "number more than 0",
                           run->noises.name[k], run->noises.value[k]);
        run->noise[i] = value;
    }
    return AD_OK;
}

static enum ad_status setup(const struct fit_options *o, struct fit_run *run,
                            struct ad_error *error)
{
    *run = (struct fit_run){.options = o};
    if (o->hold_out >= 1)
        return ad_fail(error, AD_E_ARGUMENT, "--hold-out: expected less than 1, got %g",
                       o->hold_out);
    if (hnn_system_open(o->common.argument[0], &run->system, error) != AD_OK ||
        phys_system_set_all(&run->system, o->common.set.n, o->common.set.setting, error) != AD_OK ||
        split("free", o->free, false, &run->free, error) != AD_OK ||
        split("columns", o->columns, true, &run->columns, error) != AD_OK)
        return error->status;
    run->settings = (struct phys_fit_settings){.size = sizeof(struct phys_fit_settings),
                                               .n_free = run->free.n,
                                               .free = run->free.name,
                                               .fixed_start = o->fixed_start,
                                               .seed = o->common.seed,
                                               .stretch = option_count_or(o->stretch, 0),
                                               .tries = option_count_or(o->tries, 0),
                                               .held_out = option_number_or(o->hold_out, 0),
                                               .proceed = interrupt_proceed};
    return read_noise(run, error) == AD_OK ? fit_read(run, o->common.argument[1], error)
                                           : error->status;
}

static void free_list(struct fit_list *list)
{
    free(list->text);
    free(list->name);
}

static void release(struct fit_run *run)
{
    phys_fit_free(&run->fit);
    free_list(&run->free);
    free_list(&run->columns);
    free_list(&run->noises);
    free(run->values);
    free(run->trials);
    free(run->noise);
    phys_system_close(&run->system);
}

/* Results that miss what was asked are shown: run->missed has the reason. */
struct whole {
    struct fit_run run;
    struct ad_error missed;
};

static enum ad_status solve(void *context, struct ad_error *error)
{
    struct whole *w = context;
    interrupt_catch();
    phys_fit_solve(&w->run.system, &w->run.data, &w->run.settings, &w->run.fit, &w->missed);
    if (w->missed.status != AD_OK && (w->missed.status != AD_E_ACCURACY ||
                                      !(w->run.fit.n_unknown && w->run.fit.singular[0] > 0)))
        *error = w->missed;
    return error->status;
}

static const struct output_kind outputs = {fit_report, fit_file, fit_write_csv, fit_picture, NULL};

static int run(const void *options, struct ad_error *error)
{
    struct whole w = {.missed = {0}};
    if (setup(options, &w.run, error) == AD_OK &&
        outputs_run(&outputs, &w.run.options->common, &w, solve, error) == AD_OK &&
        w.missed.status != AD_OK)
        *error = w.missed;
    release(&w.run);
    return command_status(error);
}

#define AT(member) offsetof(struct fit_options, member)

static const struct option table[] = {
    {"free", "NAME,NAME", OPTION_TEXT, NULL, "parameters to find [none: the starts alone]",
     AT(free)},
    {"fixed-start", NULL, OPTION_FLAG, NULL,
     "trials start at t = 0 as the scene does [starts are found, too]", AT(fixed_start)},
    {"columns", "QUANTITY=NAME,...", OPTION_TEXT, NULL,
     "columns of the file, by name or number [see below]", AT(columns)},
    {"noise", "S|QUANTITY=S,...", OPTION_TEXT, NULL,
     "standard deviations of the data [from the residuals]", AT(noise)},
    {"hold-out", "SHARE", OPTION_SIZE, NULL, "of each trial's end, predicted and not fitted [0]",
     AT(hold_out)},
    {"stretch", "ROWS", OPTION_SOME, NULL, "rows followed from one beginning [20]", AT(stretch)},
    {"tries", "N", OPTION_SOME, NULL, "beginnings from other values of the parameters [3]",
     AT(tries)},
    {"skip-rows", "N", OPTION_COUNT, NULL, "lines of the file to skip [0]", AT(skip)},
};

const struct command command_fit = {
    .line =
        {.name = "fit",
         .what = "parameters and starts from measured motions",
         .arguments = {"SCENE", "DATA"},
         .scene = true,
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "DATA has columns t (or time), coordinates, v_ and a coordinate for velocities, and\n"
             "trial, whose change begins another motion. Quantities and numbers may be missing.\n"
             "Parameters begin at their values of --set. The sum of squares of (motion - data) /\n"
             "noise is minimised by the method of Levenberg and Marquardt on motions in stretches\n"
             "that begin at the data and join (multiple shooting): short ones for chaotic "
             "motions.\n"
             "Deviations are standard deviations. What the data cannot tell apart is named, and\n"
             "the exit status is 1."},
    .bytes = sizeof(struct fit_options),
    .run = run,
};
