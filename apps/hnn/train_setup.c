/* Sets up a training from the options: samples, model, method, and the checkpoint to resume. */
#include "train.h"
#include "apps/option_values.h"
#include "physics/io/fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Index of a name in a NULL-terminated table. */
static enum ad_status choose(const char *option, const char *name, const char *const names[],
                             size_t *index, struct ad_error *error)
{
    size_t n = 0;
    while (names[n])
        n++;
    *index = options_choose(option, name, n, names, error);
    return error->status;
}

/* "200", the width of every hidden layer, or "200,100", one number each. */
static enum ad_status read_widths(const char *text, struct hnn_settings *s, struct ad_error *error)
{
    double widths[HNN_LAYERS_MOST];
    size_t n, most = HNN_LAYERS_MOST - 1;
    const char *wrong = numbers_list(text, most, widths, &n);
    for (size_t k = 0; k < n && k < most && !wrong; k++)
        if (!(widths[k] >= 0 && widths[k] < 1e15 && widths[k] == floor(widths[k])))
            wrong = text;
    if (wrong)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "--hidden %s: expected a number such as 200, or one for each hidden layer: 200,100",
            text);
    if (n != 1 && n + 1 != s->layers)
        return ad_fail(error, AD_E_ARGUMENT, "--hidden %s: expected %zu numbers for %zu layers",
                       text, s->layers - 1, s->layers);
    for (size_t k = 0; k < most; k++)
        s->hidden[k] = (size_t)widths[k < n ? k : 0];
    return AD_OK;
}

/* "all", or names among the coordinates. */
static enum ad_status read_angles(const char *text, const struct hnn_dataset *data,
                                  struct hnn_settings *s, struct ad_error *error)
{
    const struct phys_separator comma = {.text = ','};
    const char *all = data->coordinates;
    char **name = NULL, **wanted = NULL;
    size_t n = 0, n_wanted = 0;
    if (strcmp(text, "all") == 0)
        text = all;
    if (!phys_fields_split(all, all + strlen(all), comma, &name, &n) ||
        !phys_fields_split(text, text + strlen(text), comma, &wanted, &n_wanted))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n_wanted && error->status == AD_OK; k++) {
        size_t at = options_choose("angles", wanted[k] ? wanted[k] : "", n,
                                   (const char *const *)name, error);
        s->angles |= error->status == AD_OK && at < 64 ? (uint64_t)1 << at : 0;
    }
    phys_fields_free(name, n);
    phys_fields_free(wanted, n_wanted);
    return error->status;
}

/* Models of states, then those of pixels, each in the order of hnn_kinds. */
static const char *const models[] = {"baseline",       "hnn",       "lnn", "sympnet",
                                     "pixel-baseline", "pixel-hnn", NULL};
enum { MODELS_OF_STATES = 4 };

static enum ad_status model_settings(const struct train_run *run, struct hnn_settings *s,
                                     struct ad_error *error)
{
    const struct train_options *o = run->options;
    size_t model = 0, field = 0, start = 0, precision = 0, lattice = 0;
    if (choose("model", o->model, models, &model, error) != AD_OK ||
        choose("field", o->field, hnn_field_types, &field, error) != AD_OK ||
        choose("start", o->start, hnn_starts, &start, error) != AD_OK ||
        choose("precision", o->precision, hnn_precisions, &precision, error) != AD_OK ||
        choose("lattice", o->lattice, hnn_lattices, &lattice, error) != AD_OK)
        return error->status;
    *s = run->pixels ? hnn_pixel_defaults((enum hnn_kind)(model - MODELS_OF_STATES),
                                          2 * run->frames.height * run->frames.width)
                     : hnn_defaults((enum hnn_kind)model, run->data.dof);
    s->dof = run->pixels ? option_count_or(o->coordinates, s->dof) : s->dof;
    s->layers = o->layers;
    s->activation = o->activation;
    s->field = (enum hnn_field_type)field;
    s->start = (enum hnn_start)start;
    s->precision = (enum ad_type)precision;
    s->separable = o->separable;
    s->dissipation = o->dissipation;
    s->quadratic = o->quadratic;
    s->lattice = (enum hnn_lattice)lattice;
    s->seed = o->common.seed;
    s->inputs = run->data.inputs;
    s->controls = run->data.controls;
    s->control_network = o->control_network;
    s->time = run->data.timed;
    if (s->layers < 1 || s->layers > HNN_LAYERS_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "--layers: expected 1 to %d, got %zu", HNN_LAYERS_MOST,
                       s->layers);
    if (read_widths(o->hidden, s, error) == AD_OK && run->pixels)
        s->autoencoder = s->hidden[0];
    return o->angles ? read_angles(o->angles, &run->data, s, error) : error->status;
}

static enum ad_status note_all(const struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    char step[32];
    const bool steps = hnn_model_settings(run->model)->kind == HNN_SYMPNET;
    snprintf(step, sizeof step, "%.17g", run->data.dt);
    const struct {
        const char *name, *text;
    } note[] = {{"state", run->data.state_names},
                {"rate", run->data.rate_names},
                {"inputs", run->data.input_names},
                {"step", steps ? step : NULL},
                {"interpolation", o->hold ? "hold" : NULL},
                {"unit", o->unit},
                {"data", o->common.argument[0]},
                {"test", o->test}};
    for (size_t k = 0; k < sizeof note / sizeof *note; k++)
        if (note[k].text && *note[k].text)
            hnn_model_note(run->model, note[k].name, note[k].text, error);
    return error->status;
}

/* Names of the model's components at other places in the data: their columns are exchanged. */
static enum ad_status check_order(const struct train_run *run, struct ad_error *error)
{
    const struct phys_separator comma = {.text = ','};
    const char *old = hnn_model_noted(run->model, "state"), *now = run->data.state_names;
    char **a = NULL, **b = NULL;
    size_t n_a = 0, n_b = 0;
    if (!old)
        return AD_OK;
    if (!phys_fields_split(old, old + strlen(old), comma, &a, &n_a) ||
        !phys_fields_split(now, now + strlen(now), comma, &b, &n_b))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n_a && error->status == AD_OK; i++)
        for (size_t k = 0; k < n_b; k++)
            if (i != k && a[i] && b[k] && strcmp(a[i], b[k]) == 0 &&
                (i >= n_b || !b[i] || strcmp(a[i], b[i]) != 0))
                ad_fail(error, AD_E_ARGUMENT, "--from %s: learnt from %s, got %s; try --state %s",
                        run->options->from, old, now, old);
    phys_fields_free(a, n_a);
    phys_fields_free(b, n_b);
    return error->status;
}

static enum ad_status load_model(struct train_run *run, struct ad_error *error)
{
    const char *file = run->options->from;
    if (hnn_model_load(file, &run->model, error) != AD_OK)
        return error->status;
    const struct hnn_settings *s = hnn_model_settings(run->model);
    if (s->pixels)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--from %s: learnt from pixels; expected a model of states", file);
    if (s->dof != run->data.dof)
        return ad_fail(error, AD_E_ARGUMENT, "--from %s: expected data of %zu coordinates, got %zu",
                       file, s->dof, run->data.dof);
    const char *inputs = hnn_model_noted(run->model, "inputs"), *now = run->data.input_names;
    if (strcmp(inputs ? inputs : "", now) != 0 || s->controls != run->data.controls ||
        s->time != run->data.timed)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--from %s: its inputs are '%s', %zu of them controls, those of the data "
                       "'%s', %zu",
                       file, inputs ? inputs : "", s->controls, now, run->data.controls);
    return check_order(run, error);
}

const char *train_model_name(const struct train_run *run)
{
    return run->options->from ? hnn_kinds[hnn_model_settings(run->model)->kind]
                              : run->options->model;
}

static enum ad_status make_model(struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    struct hnn_settings settings;
    if (o->from)
        load_model(run, error);
    else if (model_settings(run, &settings, error) == AD_OK)
        hnn_model_new(&settings, &run->model, error);
    if (error->status != AD_OK)
        return error->status;
    if (run->data.varied && hnn_model_settings(run->model)->kind == HNN_LAGRANGIAN)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--inputs %s: of lnn they are parameters, constant in a trajectory, or the "
                       "--time; forces are --controls",
                       run->data.input_names);
    if (o->normalise && hnn_dataset_normalise(&run->data, run->model, error) != AD_OK)
        return error->status;
    if (run->pixels && train_note_frames(run, error) != AD_OK)
        return error->status;
    return note_all(run, error);
}

static enum ad_status read_data(struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    size_t differences = 0, split = 0;
    if (choose("differences", o->differences, hnn_differences_names, &differences, error) !=
            AD_OK ||
        choose("split", o->split, hnn_split_names, &split, error) != AD_OK)
        return error->status;
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = o->common.argument[0],
                                     .state = o->state,
                                     .rate = o->rate,
                                     .time = o->time,
                                     .differences = (enum hnn_differences)differences,
                                     .trial = o->trial,
                                     .rollout = o->rollout,
                                     .dt = isnan(o->dt) ? 0 : o->dt,
                                     .skip_missing = o->skip_missing,
                                     .skip_rows = o->skip_rows,
                                     .test_file = o->test,
                                     .test_fraction =
                                         isnan(o->test_fraction) ? 0 : o->test_fraction,
                                     .split = (enum hnn_split)split,
                                     .seed = o->common.seed,
                                     .inputs = o->inputs,
                                     .controls = o->controls,
                                     .ranks = o->common.ranks};
    if (hnn_dataset_read(&s, &run->data, error) == AD_OK) {
        run->train = run->data.train;
        run->test = run->data.test;
    }
    return error->status;
}

static enum ad_status read_batch(const char *text, size_t *batch, struct ad_error *error)
{
    uint64_t n = 0;
    *batch = 0;
    if (strcmp(text, "full") == 0)
        return AD_OK;
    if (!options_integer(text, SIZE_MAX, &n) || n == 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--batch: expected 'full' or a number of samples, got '%s'", text);
    *batch = n;
    return AD_OK;
}

static enum ad_status training_settings(struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    struct hnn_training *s = &run->settings;
    size_t stepping = 0;
    if (choose("stepping", o->stepping, hnn_steppings, &stepping, error) != AD_OK)
        return error->status;
    *s = run->pixels ? hnn_pixel_training_defaults() : hnn_training_defaults();
    if (s->batch > run->train.n)
        s->batch = 0; /* all of them */
    s->optimiser = hnn_optimiser_find(o->optimiser, error);
    s->schedule = hnn_schedule_find(o->schedule, error);
    s->learning_rate = o->learning_rate;
    s->steps = option_count_or(o->steps, s->steps);
    s->every = option_count_or(o->every, s->every);
    s->weight_decay = option_number_or(o->weight_decay, s->weight_decay);
    s->average = option_number_or(o->average, s->average);
    s->momentum = o->momentum;
    s->clip = option_number_or(o->clip, 0);
    s->rollout = o->rollout;
    s->stepping = (enum hnn_stepping)stepping;
    s->hold = o->hold;
    s->free_starts = o->free_starts;
    s->dt = run->data.dt;
    s->patience = option_count_or(o->patience, 0);
    s->seed = o->common.seed;
    s->threads = o->common.threads;
    s->ranks = o->common.ranks;
    s->progress = train_after_step;
    s->context = run;
    if (error->status == AD_OK && o->batch)
        read_batch(o->batch, &s->batch, error);
    return error->status;
}

/* Options that such a training does not look at; its data are read. */
static enum ad_status refuse_unused(const struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    bool differences = run->data.rate_names && !*run->data.rate_names && !o->rollout;
    const struct unused rows[] = {
        {o->from,
         "model field activation angles start hidden layers precision separable dissipation "
         "quadratic lattice control-network normalise",
         "is of a new network; --from has its own"},
        {!o->from && !strstr(o->model, "hnn"), "field",
         "is of models with an H: hnn and pixel-hnn"},
        {!run->pixels, "coordinates", "is of the latent state of frames; --state has them here"},
        {isnan(o->test_fraction) && !run->pixels, "split", "needs --test-fraction"},
        {!o->rollout, "dt stepping hold free-starts", "needs --rollout"},
        {!run->data.inputs, "hold", "needs --inputs or --controls"},
        {!differences, "differences", "is for rates by differences; here are others"},
        {strcmp(o->optimiser, "sgd") != 0, "momentum", "needs --optimiser sgd"},
        {strcmp(o->optimiser, "lbfgs") == 0, "lr schedule average clip",
         "is not for lbfgs, which chooses its steps"},
    };
    return options_unused(&o->common, sizeof rows / sizeof *rows, rows, error);
}

static enum ad_status set_up(struct train_run *run, struct ad_error *error)
{
    if ((run->pixels ? train_read_frames : read_data)(run, error) != AD_OK ||
        refuse_unused(run, error) != AD_OK || make_model(run, error) != AD_OK ||
        training_settings(run, error) != AD_OK || train_find_loss_of_zero(run, error) != AD_OK)
        return error->status;
    return hnn_trainer_new(run->model, &run->settings, &run->train, &run->test, &run->trainer,
                           error);
}

enum ad_status train_setup(const struct train_options *options, struct train_run *run,
                           struct ad_error *error)
{
    const char *file = options->common.out;
    *run = (struct train_run){.options = options, .next_checkpoint = options->checkpoint};
    run->pixels = strncmp(options->model, "pixel-", 6) == 0;
    set_up(run, error);
    if (ad_ranks_agree(options->common.ranks, error) == AD_OK && options->resume &&
        access(file, F_OK) == 0)
        hnn_trainer_resume(run->trainer, file, error);
    return error->status;
}

void train_free(struct train_run *run)
{
    hnn_trainer_free(run->trainer);
    hnn_model_free(run->model);
    hnn_dataset_free(&run->data);
    hnn_split_pairs_free(&run->pairs);
    hnn_frames_free(&run->frames);
}
