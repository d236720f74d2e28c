/* leastaction train: trains a Hamiltonian or Lagrangian neural network, or a baseline, on measured
   motion. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "train.h"

static int train(struct train_run *run, struct ad_error *error)
{
    const struct common *common = &run->options->common;
    struct report report = {0};
    enum hnn_stop stop = HNN_STOP_STEPS;
    train_check_outputs(run->options, error);
    if (ad_ranks_agree(common->ranks, error) != AD_OK)
        return command_status(error);
    progress_start(&run->progress, common->quiet, NULL);
    run->progress.from = (double)hnn_trainer_step(run->trainer);
    interrupt_catch();
    hnn_trainer_run(run->trainer, &stop, error);
    interrupt_finish();
    progress_end(&run->progress);
    if (run->failed.status != AD_OK)
        ad_fail(error, run->failed.status, "%s", run->failed.message);
    if (error->status == AD_OK && train_save(run, error) == AD_OK &&
        (!run->pixels ||
         hnn_video_motion(run->model, &run->frames, &run->pairs, &run->motion, error) == AD_OK) &&
        train_mass(run, error) == AD_OK)
        train_publish(run, true, error);
    if (ad_ranks_agree(common->ranks, error) != AD_OK)
        return command_status(error);
    train_report(run, &report);
    report_show(&report, common, error);
    if (stop == HNN_STOP_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted after step %zu of %zu; --resume goes on",
                hnn_trainer_step(run->trainer), run->settings.steps);
    return command_status(error);
}

static int run(const void *options, struct ad_error *error)
{
    struct train_run training;
    int status;
    if (train_setup(options, &training, error) == AD_OK)
        status = train(&training, error);
    else
        status = command_status(error);
    train_free(&training);
    return status;
}

#define AT(member) offsetof(struct train_options, member)

static const struct option table[] = {
    {"model", "KIND", OPTION_TEXT, "hnn",
     "hnn: H(q, p); lnn: L(q, v); baseline: the rates; sympnet: a symplectic map, with --rollout; "
     "from frames: pixel-hnn, pixel-baseline",
     AT(model)},
    {"state", "COLUMNS", OPTION_TEXT, NULL,
     "coordinates, then momenta (lnn: velocities): names, or numbers from 1 [all with a rate]",
     AT(state)},
    {"rate", "COLUMNS", OPTION_TEXT, NULL,
     "their rates of change, in that order if not named dXdt [dXdt for every X]", AT(rate)},
    {"time", "COLUMN", OPTION_TEXT, NULL, "without --rate: rates by differences over this time",
     AT(time)},
    {"inputs", "COLUMNS", OPTION_TEXT, NULL,
     "what H, L or rates depend on beside the state: parameters, or the --time: H(q, p, t)",
     AT(inputs)},
    {"controls", "COLUMNS", OPTION_TEXT, NULL,
     "forces u: dp/dt has + G u besides, with a matrix G that is learnt", AT(controls)},
    {"control-network", NULL, OPTION_FLAG, NULL,
     "of --controls: G(q), by a network [a constant matrix]", AT(control_network)},
    {"differences", "KIND", OPTION_TEXT, "forward", "forward, as published, or central",
     AT(differences)},
    {"trial", "COLUMN", OPTION_TEXT, NULL,
     "number of the trajectory [trial, if there is one; else a time that decreases]", AT(trial)},
    {"skip-missing", NULL, OPTION_FLAG, NULL, "skip rows that lack a value, and count them",
     AT(skip_missing)},
    {"skip-rows", "N", OPTION_COUNT, "0", "lines of text before the names, or the first row",
     AT(skip_rows)},
    {"unit", "UNITS", OPTION_TEXT, NULL, "of the states, kept in the model", AT(unit)},
    {"test", "FILE", OPTION_INPUT, NULL, "test samples, of the same columns", AT(test)},
    {"test-fraction", "F", OPTION_NUMBER, NULL,
     "of DATA, reserved for the test [none; frames: 0.2]", AT(test_fraction)},
    {"split", "HOW", OPTION_TEXT, "tail", "which: tail, random or trial", AT(split)},
    {"normalise", NULL, OPTION_FLAG, NULL, "the network sees states of mean 0 and deviation 1",
     AT(normalise)},
    {"hidden", "WIDTH", OPTION_TEXT, "200", "of the hidden layers; or one number each: 200,100",
     AT(hidden)},
    {"layers", "N", OPTION_COUNT, "3", "linear maps", AT(layers)},
    {"coordinates", "N", OPTION_COUNT, NULL, "coordinates of the latent state of frames [1]",
     AT(coordinates)},
    {"activation", "NAME", OPTION_TEXT, "tanh",
     "tanh, relu, sigmoid, softplus, sine, swish (or silu), gelu, elu", AT(activation)},
    {"angles", "COLUMNS", OPTION_TEXT, NULL,
     "coordinates that are angles, or all: the network sees sine and cosine", AT(angles)},
    {"field", "KIND", OPTION_TEXT, "symplectic", "symplectic, conservative, or both", AT(field)},
    {"separable", NULL, OPTION_FLAG, NULL, "H = T(p) + V(q), a network each", AT(separable)},
    {"quadratic", NULL, OPTION_FLAG, NULL, "lnn: L = v M(q) v/2 - V(q), M and V by the network",
     AT(quadratic)},
    {"lattice", "ENDS", OPTION_TEXT, "none",
     "coordinates are sites of a chain, a ring or fixed at its ends, with one network for all",
     AT(lattice)},
    {"dissipation", NULL, OPTION_FLAG, NULL, "a second network whose gradient damps",
     AT(dissipation)},
    {"start", "HOW", OPTION_TEXT, "orthogonal", "of the weights: orthogonal, xavier, he",
     AT(start)},
    {"precision", "TYPE", OPTION_TEXT, "f32", "f32 or f64", AT(precision)},
    {"optimiser", "NAME", OPTION_TEXT, "adam", "adam, adamw, sgd, lbfgs", AT(optimiser)},
    {"steps", "K", OPTION_COUNT, NULL,
     "in all, those before --resume included [2000; frames: 10000]", AT(steps)},
    {"batch", "N", OPTION_TEXT, NULL, "samples per step [full; frames: 200, or all there are]",
     AT(batch)},
    {"lr", "X", OPTION_NUMBER, "1e-3", "learning rate", AT(learning_rate)},
    {"schedule", "HOW", OPTION_TEXT, "constant",
     "of the rate: constant, cosine, step, onecycle, warmup", AT(schedule)},
    {"clip", "NORM", OPTION_POSITIVE, NULL, "gradients of a larger norm are scaled to it [never]",
     AT(clip)},
    {"weight-decay", "X", OPTION_NUMBER, NULL, "of all parameters [1e-4; frames: 1e-5]",
     AT(weight_decay)},
    {"average", "F", OPTION_NUMBER, NULL,
     "the weights are the mean over this last fraction of the steps [0.1; frames, lbfgs: 0]",
     AT(average)},
    {"momentum", "M", OPTION_NUMBER, "0", "sgd: share of the last step in the next", AT(momentum)},
    {"rollout", "K", OPTION_COUNT, "0", "loss on K steps in time along trajectories", AT(rollout)},
    {"stepping", "HOW", OPTION_TEXT, "runge-kutta",
     "they are runge-kutta, leapfrog (with --separable) or midpoint", AT(stepping)},
    {"free-starts", NULL, OPTION_FLAG, NULL,
     "states that steps begin from have noise, too: loss of the motion nearest to all of them",
     AT(free_starts)},
    {"hold", NULL, OPTION_FLAG, NULL,
     "inputs hold from row to row [they are linear between]; the time does not", AT(hold)},
    {"dt", "DT", OPTION_POSITIVE, NULL, "their length [that of the data]", AT(dt)},
    {"every", "K", OPTION_COUNT, NULL, "steps from one test loss to the next [10; frames: 200]",
     AT(every)},
    {"patience", "K", OPTION_COUNT, NULL, "stop after K steps without a lower test loss [never]",
     AT(patience)},
    {"out", "FILE.h5", OPTION_OUTPUT, "model.h5", "the model, and all that --resume needs",
     AT(common.out)},
    {"log", "FILE", OPTION_OUTPUT, NULL, "losses as CSV; - is standard output", AT(log)},
    {"plot", "FILE", OPTION_PICTURE, NULL, "losses as .svg or .png", AT(common.plot)},
    {"checkpoint", "SECONDS", OPTION_SIZE, "10",
     "between checkpoints to --out, and new --log and --plot", AT(checkpoint)},
    {"from", "MODEL.h5", OPTION_INPUT, NULL,
     "begin with this network and its weights, also on other data", AT(from)},
    {"resume", NULL, OPTION_FLAG, NULL, "resume from --out, if it exists", AT(resume)},
};

const struct command command_train = {
    .line =
        {.name = "train",
         .what = "a Hamiltonian or Lagrangian neural network from data",
         .ranks = true,
         .arguments = {"DATA"},
         .members = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "DATA is CSV, whitespace text or HDF5, one sample per row. The loss is the mean "
             "square\n"
             "of field less rate, over components and samples. For pixel-hnn and pixel-baseline "
             "it\n"
             "is frames: HDF5 [trajectory, time, height, width], or a folder of PGM or PNG files;\n"
             "an autoencoder and the field on its latent state are trained together, and whole\n"
             "trajectories are the test. Pixels that are dark in every frame to train on are not\n"
             "looked at, later either. The states of lnn have velocities for momenta. A run that "
             "was stopped, by Ctrl-C or worse, is the same "
             "to\n"
             "the last bit after --resume with the same options.\n"
             "Weights are readable with h5py: h5py.File(\"model.h5\")[\"linear1.weight\"][:]"},
    .bytes = sizeof(struct train_options),
    .run = run,
};
