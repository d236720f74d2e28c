/* Sets up a path run (path.h) from the options, else the preset, else the scene. */
#include "autodiff/free.h"
#include "path.h"
#include "apps/set_fault.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STORED = 200 }; /* paths in a run file, about */

/* ---- scene and parameters ---- */

static enum ad_status choose_preset(const struct path_options *options, struct path_run *run,
                                    struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    if (!options->preset)
        return AD_OK;
    if (options_choose("preset", options->preset, 1, (const char *const[]){"paper"}, error) != 0)
        return error->status;
    if (!scene->paper)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--preset paper: scene %s is not in the paper; leave it out", scene->name);
    run->preset = scene->paper;
    return AD_OK;
}

static enum ad_status set_parameters(const struct path_options *options, struct path_run *run,
                                     struct ad_error *error)
{
    if (run->preset &&
        phys_system_set_all(&run->system, run->preset->n_set, run->preset->set, error) != AD_OK)
        return error->status;
    if (phys_system_set_all(&run->system, options->common.set.n, options->common.set.setting,
                            error) != AD_OK)
        return error->status;
    return set_check(&options->common, &run->system, error);
}

/* ---- settings ---- */

static const char *default_solver(const struct path_options *options, const struct path_run *run)
{
    bool descent = run->preset || isfinite(options->learning_rate) ||
                   isfinite(options->energy_weight) || options->energy_loss ||
                   options->stop_at_reference;
    return descent ? "adam" : "newton";
}

static void choose_settings(const struct path_options *options, struct path_run *run)
{
    const struct phys_preset *preset = run->preset;
    const struct phys_path_settings usual = phys_path_defaults(&run->system);
    struct phys_path_settings *settings = &run->settings;
    settings->size = sizeof *settings;
    settings->slices = option_count_or(options->slices, preset ? preset->slices : usual.slices);
    settings->dt = option_number_or(options->dt, preset ? preset->dt : usual.dt);
    settings->steps = option_count_or(options->steps, usual.steps);
    settings->learning_rate = option_number_or(options->learning_rate, usual.learning_rate);
    settings->tolerance = option_number_or(options->grad_tolerance, 0);
    settings->momentum = options->momentum;
    settings->hold = options->hold;
    /* from a straight line Newton's steps may stall; from near the path descent would leave it */
    bool line = path_from_line(options) && !run->preset;
    settings->adam_steps = option_count_or(options->adam_steps, line ? 200 : 0);
    settings->threads = options->common.threads;
    settings->native = true;
    run->every = option_count_or(options->every, (settings->steps + STORED - 1) / STORED);
    if (run->every == 0 && options->every == OPTION_NO_COUNT)
        run->every = 1; /* no steps at all: the start is stored */
}

static enum ad_status choose_solver(const struct path_options *options, struct path_run *run,
                                    struct ad_error *error)
{
    bool free_time = run->system.scene->free_time || path_time_is_free(options);
    bool newton = path_wants_all(options) || free_time;
    const char *name = options->solver ? options->solver : default_solver(options, run);
    static const char *const ends[] = {"both", "start", "periodic"};
    run->solver = phys_solver_find(newton ? "newton" : name, error);
    if (!run->solver || path_periodic_check(run, error) != AD_OK)
        return error->status;
    bool start = options_choose("ends", options->ends, 3, ends, error) == 1;
    if (path_wants_all(options) && free_time && !options->all)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "--energy: the end time of %s is free, of the path of energy 0; leave it out",
            run->system.scene->name);
    if (path_wants_all(options) && start)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--all: with --ends start there is one solution; leave out one of them");
    if (start && options->init && strcmp(options->init, "line") == 0)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "--init line: with --ends start the scene's start, or the first two rows of a "
            "FILE.csv, are what is given; leave it out");
    if (start)
        run->solver = &phys_solver_march;
    return error->status;
}

/* Whether the solver is one that finds stationary paths of the action itself. */
static bool is_exact(const struct path_run *run)
{
    return run->solver == &phys_solver_march ||
           (run->solver && strcmp(run->solver->name, "newton") == 0);
}

/* The published penalty belongs to descents; newton finds the stationary path of the action. */
static enum ad_status choose_energy_loss(const struct path_options *options, struct path_run *run,
                                         struct ad_error *error)
{
    bool published = run->preset && !is_exact(run) && !options->energy_loss;
    double otherwise = published ? run->preset->energy_weight : options->energy_loss ? 1 : 0;
    run->settings.energy_weight = option_number_or(options->energy_weight, otherwise);
    static const char *const kinds[] = {"global", "local"};
    if (options->energy_loss)
        run->settings.energy_local =
            options_choose("energy-loss", options->energy_loss, 2, kinds, error) == 1;
    if (is_exact(run) && run->settings.energy_weight != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--energy-%s: %s finds a stationary path of the action itself; take adam, "
                       "sgd or lbfgs for a penalty",
                       options->energy_loss ? "loss" : "weight", run->solver->name);
    return error->status;
}

/* The published noise belongs to the preset's own start; a sigma given replaces its size. */
static void choose_noise(const struct path_options *options, struct path_run *run)
{
    bool published = run->preset && (!options->init || strcmp(options->init, "ode") == 0);
    run->noise = published ? run->preset->noise : (struct phys_noise){.scale = 1};
    run->noise.sigma = option_number_or(options->noise, run->noise.sigma);
}

static enum ad_status check_settings(const struct path_run *run, struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    if (!(settings->momentum >= 0 && settings->momentum < 1))
        return ad_fail(error, AD_E_ARGUMENT, "--momentum: expected 0 or more, less than 1, got %g",
                       settings->momentum);
    if (settings->hold > (settings->slices - 1) / 2)
        return ad_fail(error, AD_E_ARGUMENT, "--hold: expected 1 to %zu, got %zu",
                       (settings->slices - 1) / 2, settings->hold);
    return AD_OK;
}

enum ad_status path_setup(const struct path_options *options, struct path_run *run,
                          struct ad_error *error)
{
    double *observed = NULL;
    *run = (struct path_run){.options = options};
    if (path_by_blocks(options) && path_blocks_check(options, error) != AD_OK)
        return error->status;
    if (hnn_system_open(options->common.argument[0], &run->system, error) != AD_OK ||
        choose_preset(options, run, error) != AD_OK ||
        set_parameters(options, run, error) != AD_OK ||
        scene_inputs_read(&options->common, options->inputs, &run->system, &run->inputs, error) !=
            AD_OK ||
        path_continuation(run, error) != AD_OK)
        return error->status;
    choose_solver(options, run, error);
    const bool smooth =
        run->system.scene->free_time || path_time_is_free(options) || path_is_periodic(options);
    const char *rule = run->preset && !is_exact(run) ? "left+repeat" : smooth ? "gauss4" : "left";
    run->settings.rule = phys_rule_find(options->rule ? options->rule : rule, error);
    choose_settings(options, run);
    choose_noise(options, run);
    if (error->status != AD_OK || choose_energy_loss(options, run, error) != AD_OK ||
        path_ephemeris(options, run, &observed, error) != AD_OK ||
        check_settings(run, error) != AD_OK || path_ends(run, error) != AD_OK ||
        (path_wants_tolerance(options) && !path_is_periodic(options) &&
         path_check_tolerance(run, error) != AD_OK)) {
        free(observed);
        return error->status;
    }
    return path_by_blocks(options) ? path_blocks_start(run, error)
                                   : path_start(run, observed, error);
}

void path_run_free(struct path_run *run)
{
    for (size_t k = 0; k < run->n_tables; k++)
        phys_horizons_free(&run->tables[k]);
    free(run->tables);
    phys_ode_free(&run->ode);
    phys_refined_free(&run->refined);
    phys_continued_free(&run->continued);
    path_record_free(&run->record);
    phys_periodic_free(&run->periodic);
    phys_solutions_free(&run->solutions);
    phys_path_found_free(&run->found);
    AD_FREE(run->given, run->moves, run->relation, run->reference, run->start, run->path,
            run->settings.start_momentum);
    phys_system_close(&run->system);
    scene_inputs_free(&run->inputs);
}
