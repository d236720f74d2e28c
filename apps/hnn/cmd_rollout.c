/* leastaction rollout: the motion by a trained model. */
#include "apps/command.h"
#include "pixel_rollout.h"
#include "apps/output/outputs.h"
#include "rollout.h"

static enum ad_status rollout_states(const struct rollout_options *options, hnn_model *model,
                                     struct ad_error *error)
{
    struct rollout_run rollout;
    if (rollout_setup(options, model, &rollout, error) == AD_OK)
        outputs_run(&rollout_outputs, &options->common, &rollout, rollout_run, error);
    rollout_free(&rollout);
    return error->status;
}

static enum ad_status rollout_pixels(const struct rollout_options *options, hnn_model *model,
                                     struct ad_error *error)
{
    struct pixel_rollout rollout;
    if (pixel_rollout_setup(options, model, &rollout, error) == AD_OK)
        outputs_run(&pixel_rollout_outputs, &options->common, &rollout, pixel_rollout_run, error);
    pixel_rollout_free(&rollout);
    return error->status;
}

static int run(const void *values, struct ad_error *error)
{
    const struct rollout_options *options = values;
    hnn_model *model;
    if (rollout_is_ensemble(options->common.argument[0]))
        rollout_ensemble(options, error);
    else if (hnn_model_load(options->common.argument[0], &model, error) == AD_OK)
        (hnn_model_settings(model)->pixels ? rollout_pixels : rollout_states)(options, model,
                                                                              error);
    return command_status(error);
}

#define AT(member) offsetof(struct rollout_options, member)

static const struct option table[] = {
    {"x0", "Q,...,P,...", OPTION_TEXT, NULL,
     "start: coordinates, then momenta (lnn: velocities) [that of the truth]", AT(x0)},
    {"time", "T", OPTION_POSITIVE, NULL, "how long [20; of a file: to the trajectory's end]",
     AT(time)},
    {"points", "N", OPTION_TWO, NULL, "outputs, both ends included [401; with --starts 100]",
     AT(points)},
    {"integrator", "NAME", OPTION_TEXT, NULL,
     "as of `simulate`, those of a Lagrangian left out "
     "[dop853]",
     AT(integrator)},
    {"rtol", "E", OPTION_POSITIVE, NULL, "error of a step, relative [1e-9]", AT(rtol)},
    {"dt", "DT", OPTION_POSITIVE, NULL, "length of fixed steps", AT(dt)},
    {"truth", "TASK|FILE|SCENE", OPTION_INPUT, NULL,
     "a task of `dataset`, a measured trajectory, or a scene of `scenes`", AT(truth)},
    {"inputs", "TABLE", OPTION_INPUT, NULL,
     "of models with inputs: their columns over time [those of the truth's file]", AT(inputs)},
    {"fix", "NAME=VALUE", OPTION_SETTINGS, NULL, "an input that is a number; repeatable", AT(fix)},
    {"interpolation", "HOW", OPTION_TEXT, NULL,
     "of inputs: linear, or hold from row to row [as trained]", AT(interpolation)},
    {"strength", "K", OPTION_POSITIVE, NULL, "of the task's potential [published]", AT(strength)},
    {"state", "COLUMNS", OPTION_TEXT, NULL, "of the file [those the model was trained on]",
     AT(state)},
    {"time-column", "COLUMN", OPTION_TEXT, NULL, "of the file; of --inputs [t]", AT(time_column)},
    {"trial", "COLUMN", OPTION_TEXT, NULL,
     "of the file [trial, if there is one; else a time that decreases]; of frames: which "
     "trajectory [1]",
     AT(trial)},
    {"skip-missing", NULL, OPTION_FLAG, NULL, "of the file: skip rows that lack a value",
     AT(skip_missing)},
    {"skip-rows", "N", OPTION_COUNT, "0", "of the file: lines before the names, or the first row",
     AT(skip_rows)},
    {"from", "T", OPTION_NUMBER, NULL, "of the file: when the motion starts [its first row]",
     AT(from)},
    {"energy", "TASK", OPTION_TEXT, NULL, "of the file: the true energy is that of this task",
     AT(energy)},
    {"against", "MODEL", OPTION_INPUT, NULL, "another model from the same start, a baseline say",
     AT(against)},
    {"starts", "N", OPTION_SOME, NULL, "random starts of the task instead: means over them",
     AT(starts)},
    {"reverse", NULL, OPTION_FLAG, NULL, "also run back: how far from the start does it end?",
     AT(reverse)},
    {"add-energy", "DE", OPTION_NUMBER, NULL, "raise H by DE, along its gradient ...",
     AT(add_energy)},
    {"at", "T", OPTION_NUMBER, NULL, "... at this time", AT(at)},
};

const struct command command_rollout = {
    .line =
        {.name = "rollout",
         .what = "motion by a trained model, against the truth",
         .arguments = {"MODEL"},
         .scene = true,
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "Errors are means over outputs of squares of differences from the true motion: of\n"
             "the true energy, of the model's H, and of the components of the state. H is known\n"
             "up to a constant, so its change is not divided by it. The energy's error is also\n"
             "computed as it was published (arXiv 1906.01563): of a pendulum from q^2 + p^2, of a\n"
             "spring over a time longer by 1.09. Fixed steps are shortened so\n"
             "that whole ones lead from output to output. Where a motion leaves the states or\n"
             "the values of H that the model was trained on, the report says so. Energy is added\n"
             "to models with an H alone: in a baseline's field no direction is that of more\n"
             "energy, so --add-energy --against a baseline is refused.\n\n"
             "Of the table of `train --seeds` or `--sweep` all models are followed: their mean,\n"
             "standard deviation, least and largest value at each output, and of each error.\n\n"
             "Of a model of pixels --truth is `pixels`, or frames as `train` takes them. It is\n"
             "shown the first two, and foresees N more (--time N [300]; time and DT are counted\n"
             "in frames). The energy that frames show is measured by fitting drawn rods to them,\n"
             "where they are of a rod, and its error is that against the true one. A picture\n"
             "has frames, the latent motion on contours of H, and energies; a GIF plays them."},
    .bytes = sizeof(struct rollout_options),
    .run = run,
};
