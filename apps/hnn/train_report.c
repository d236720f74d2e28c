/* What a training came to. */
#include "train.h"
#include "apps/output/json.h"
#include "apps/output/quote.h"

#include <math.h>

static void cell(FILE *out, double value)
{
    if (isfinite(value))
        fprintf(out, ",%.9g", value);
    else
        fputc(',', out);
}

/* Seconds of steps before a resume are not known any more: their cells are empty. */
void train_write_log(const struct train_run *run, FILE *out)
{
    size_t n;
    const struct hnn_row *row = hnn_trainer_history(run->trainer, &n);
    fputs("step,train_loss,test_loss,seconds\n", out);
    for (size_t k = 0; k < n; k++) {
        fprintf(out, "%zu", row[k].step);
        cell(out, row[k].train_loss);
        cell(out, row[k].test_loss);
        cell(out, row[k].seconds);
        fputc('\n', out);
    }
}

static double ms_per_step(const struct train_run *run)
{
    size_t steps = hnn_trainer_steps_now(run->trainer);
    return steps ? 1e3 * hnn_trainer_seconds(run->trainer) / (double)steps : (double)NAN;
}

/* Which columns were taken for what, and what was left out. */
static void print_columns(const struct train_run *run)
{
    const struct hnn_dataset *d = &run->data;
    const char *part[][2] = {{"  q: ", d->coordinates},
                             {"; p: ", d->momenta},
                             {"; rates: ", *d->rate_names          ? d->rate_names
                                           : run->settings.rollout ? "none, rollouts"
                                                                   : "by differences over time"}};
    for (size_t k = 0; k < sizeof part / sizeof *part; k++) {
        fputs(part[k][0], stdout);
        quote_terminal(stdout, part[k][1]);
    }
    putchar('\n');
    if (d->trials_by_time)
        printf("  %zu trajectories: time goes back between them\n", d->trials);
    if (d->gaps)
        printf("  steps of time over %.6g, three times the median, left out: %zu\n", d->longest,
               d->gaps);
    if (d->missing)
        printf("  rows that lack a value, left out: %zu\n", d->missing);
    if (d->units_line)
        printf("  line %zu, of units, is left out\n", d->units_line);
}

static void print_motion(const struct train_motion *m)
{
    printf("  followed along %zu of its films it moves %.3g times as far as the data, its frames "
           "%.3g times\n",
           m->films, m->mean.latent / m->mean.latent_data, m->mean.frames / m->mean.frames_data);
    if (isfinite(m->energy))
        printf("  energy of the frames it draws %.4g, of the data's %.4g\n", m->energy,
               m->energy_data);
    if (m->kind == HNN_MOTION_AS_DATA)
        return;
    printf(
        "  it %s: what it foresees is no motion of the data; train longer, on more films, or with "
        "another --seed\n",
        hnn_motion_names[m->kind]);
}

void train_print(const struct train_run *run)
{
    double test = hnn_trainer_test_loss(run->trainer);
    printf("%s: %zu parameters, %zu steps, %.3g s", run->options->model, hnn_model_size(run->model),
           hnn_trainer_step(run->trainer), hnn_trainer_seconds(run->trainer));
    if (hnn_trainer_steps_now(run->trainer))
        printf(" (%.3g ms a step)", ms_per_step(run));
    putchar('\n');
    if (!run->pixels)
        print_columns(run);
    printf("  train loss %.6g on %zu samples\n", hnn_trainer_train_loss(run->trainer),
           run->train.n);
    if (run->test.n)
        printf("  test loss  %.6g on %zu samples\n", test, run->test.n);
    if (run->pixels)
        print_motion(&run->motion);
    quote_terminal_line(stdout, "  ", run->options->common.out);
}

static void json_columns(struct json *json, const struct train_run *run)
{
    const struct hnn_dataset *d = &run->data;
    json_text(json, "coordinates", d->coordinates);
    json_text(json, "momenta", d->momenta);
    json_text(json, "rates", *d->rate_names ? d->rate_names : NULL);
    json_count(json, "trajectories", d->trials);
    json_count(json, "gaps", d->gaps);
    json_count(json, "missing", d->missing);
}

static void json_motion(struct json *json, const struct train_motion *m)
{
    json_text(json, "motion", hnn_motion_names[m->kind]);
    json_number(json, "latent_spread", m->mean.latent);
    json_number(json, "latent_spread_data", m->mean.latent_data);
    json_number(json, "frame_spread", m->mean.frames);
    json_number(json, "frame_spread_data", m->mean.frames_data);
    json_number(json, "frame_energy", m->energy);
    json_number(json, "frame_energy_data", m->energy_data);
}

void train_print_json(const struct train_run *run)
{
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "model", run->options->model);
    if (!run->pixels)
        json_columns(&json, run);
    json_number(&json, "train_loss", hnn_trainer_train_loss(run->trainer));
    json_number(&json, "test_loss", hnn_trainer_test_loss(run->trainer));
    json_count(&json, "steps", hnn_trainer_step(run->trainer));
    json_number(&json, "seconds", hnn_trainer_seconds(run->trainer));
    json_number(&json, "ms_per_step", ms_per_step(run));
    json_count(&json, "parameters", hnn_model_size(run->model));
    json_count(&json, "train_samples", run->train.n);
    json_count(&json, "test_samples", run->test.n);
    if (run->pixels)
        json_motion(&json, &run->motion);
    json_text(&json, "out", run->options->common.out);
    json_close(&json);
}
