/* Settings of a training: defaults, and whether they fit the model and the samples. */
#include "train.h"
#include "autodiff/sized.h"

#include <math.h>

void hnn_training_defaults_to(struct hnn_training *settings)
{
    const struct hnn_training defaults = {.size = sizeof defaults,
                                          .optimiser = hnn_optimisers[0],
                                          .schedule = hnn_schedules[0],
                                          .steps = 2000,
                                          .learning_rate = 1e-3,
                                          .weight_decay = 1e-4,
                                          .average = 0.1,
                                          .every = 10,
                                          .threads = 1};
    AD_GIVE(settings, &defaults);
}

static bool steps_are_positive(const struct hnn_training *s, const struct hnn_samples *samples)
{
    size_t n = hnn_samples_held(samples) * s->rollout;
    if (!samples->steps)
        return samples->n == 0 || (s->dt > 0 && isfinite(s->dt));
    for (size_t k = 0; k < n; k++)
        if (!(samples->steps[k] > 0 && isfinite(samples->steps[k])))
            return false;
    return true;
}

/* Samples of which this rank holds a part. */
static enum ad_status check_share(const struct hnn_training *s, const struct hnn_samples *samples,
                                  struct ad_error *error)
{
    size_t begin, end;
    if (!samples->end)
        return AD_OK;
    hnn_samples_share(s->ranks, samples->n, &begin, &end);
    end = end ? end : samples->n;
    if (samples->begin > begin || samples->end < end || samples->end > samples->n)
        return ad_fail(error, AD_E_ARGUMENT,
                       "samples of this rank: expected %zu to %zu of %zu, got %zu to %zu", begin,
                       end, samples->n, samples->begin, samples->end);
    return AD_OK;
}

static enum ad_status check_samples(bool pixels, const struct hnn_samples *train,
                                    const struct hnn_samples *test, struct ad_error *error)
{
    if (train->n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "there are no samples to train on");
    if (train->n > UINT32_MAX || test->n > UINT32_MAX) /* hnn_data.order */
        return ad_fail(error, AD_E_ARGUMENT, "samples: expected at most 4294967295, got %zu",
                       train->n > test->n ? train->n : test->n);
    if (pixels != (train->frames != NULL) || (test->n && pixels != (test->frames != NULL)))
        return ad_fail(error, AD_E_ARGUMENT, "models of %s learn from %s",
                       pixels ? "pixels" : "states", pixels ? "frames" : "states and targets");
    for (size_t k = 0; k < 2; k++) {
        const struct hnn_samples *set = k ? test : train;
        if (set->n > 0 && (pixels ? AD_LACKS(error, set->frames, set->first)
                                  : AD_LACKS(error, set->x, set->target)))
            return error->status;
    }
    if (pixels && !train->frame)
        return ad_fail(error, AD_E_ARGUMENT, "frames of 0 pixels; expected some");
    if (pixels && test->n && test->frame != train->frame)
        return ad_fail(error, AD_E_ARGUMENT,
                       "frames of %zu pixels to train on, and of %zu for the test", train->frame,
                       test->frame);
    return AD_OK;
}

/* Each number alone. */
static enum ad_status check_numbers(const struct hnn_training *s, size_t samples,
                                    struct ad_error *error)
{
    const struct {
        bool right;
        const char *what;
        double got;
    } rows[] = {
        {s->steps > 0, "steps: expected at least 1, such as 2000", (double)s->steps},
        {s->learning_rate > 0 && isfinite(s->learning_rate),
         "learning rate: expected more than 0, such as 1e-3", s->learning_rate},
        {s->weight_decay >= 0 && isfinite(s->weight_decay),
         "weight decay: expected at least 0, such as 1e-4", s->weight_decay},
        {s->clip >= 0 && isfinite(s->clip), "norm of gradients: expected 0 or more", s->clip},
        {s->momentum >= 0 && s->momentum < 1, "momentum: expected 0 or more, less than 1",
         s->momentum},
        {s->average >= 0 && s->average <= 1,
         "fraction of the steps to average over: expected 0 to 1", s->average},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        if (!rows[k].right)
            return ad_fail(error, AD_E_ARGUMENT, "%s, got %g", rows[k].what, rows[k].got);
    if (s->rollout > HNN_ROLLOUT_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "rollout: expected at most %d steps, got %zu",
                       HNN_ROLLOUT_MOST, s->rollout);
    return s->batch > samples
               ? ad_fail(error, AD_E_ARGUMENT,
                         "batch: expected at most the %zu samples there are, got %zu", samples,
                         s->batch)
               : AD_OK;
}

enum ad_status hnn_training_check(const hnn_model *model, const struct hnn_training *s,
                                  const struct hnn_samples *train, const struct hnn_samples *test,
                                  struct ad_error *error)
{
    const bool pixels = model->settings.pixels > 0;
    if (s->ranks && ad_ranks_check(s->ranks, error) != AD_OK)
        return error->status;
    if (!s->optimiser) /* not found: `error` may say so already */
        return ad_fail(error, AD_E_ARGUMENT, "training without an optimiser");
    if (check_samples(pixels, train, test, error) != AD_OK ||
        check_share(s, train, error) != AD_OK || check_share(s, test, error) != AD_OK ||
        check_numbers(s, train->n, error) != AD_OK)
        return error->status;
    const struct {
        bool wrong;
        const char *what;
    } rows[] = {
        {pixels && s->rollout, "a loss on rollouts needs a model of states"},
        {pixels && s->loss, "a loss of one's own needs a model of states"},
        {s->rollout && !(steps_are_positive(s, train) && steps_are_positive(s, test)),
         "a loss on rollouts needs positive time steps"},
        {s->free_starts && (!s->rollout || s->loss || model->settings.dof > HNN_STARTS_MOST),
         "free starts need a loss on rollouts, of at most 16 coordinates"},
        {s->clip > 0 && s->optimiser == &hnn_lbfgs,
         "lbfgs searches along its directions; expected gradients that are not clipped"},
        {s->patience && test->n == 0,
         "stopping by the test loss needs test samples; set some apart"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        if (rows[k].wrong)
            return ad_fail(error, AD_E_ARGUMENT, "%s", rows[k].what);
    if (s->optimiser->full_batch && s->batch && s->batch != train->n)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s needs all samples in every step; expected a full batch",
                       s->optimiser->name);
    if (hnn_stepping_check(model, s, error) != AD_OK)
        return error->status;
    return hnn_velocities_check(model, s, train, error);
}
