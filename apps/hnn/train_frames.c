/* Training from frames: a sample is a pair of them, its target the pair one frame later. */
#include "train.h"

#include <math.h>

/* Options that speak of columns, or of rates that are known. */
static enum ad_status check_options(const struct train_options *o, struct ad_error *error)
{
    char what[96];
    snprintf(what, sizeof what, "is for models of states, not for --model %s; leave it out",
             o->model);
    return options_refuse(&o->common,
                          "state rate inputs controls hold stepping time trial differences test "
                          "split unit normalise dt rollout "
                          "skip-missing skip-rows",
                          what, error);
}

enum ad_status train_read_frames(struct train_run *run, struct ad_error *error)
{
    const struct train_options *o = run->options;
    double fraction = isnan(o->test_fraction) ? 0.2 : o->test_fraction;
    if (check_options(o, error) != AD_OK ||
        hnn_frames_read_split(o->common.argument[0], fraction, o->common.seed, o->common.ranks,
                              &run->frames, &run->pairs, error) != AD_OK)
        return error->status;
    struct hnn_samples all = {.frames = run->frames.pixels,
                              .frame = run->frames.height * run->frames.width};
    run->train = run->test = all;
    run->train.n = run->pairs.n_train;
    run->train.first = run->pairs.train;
    run->test.n = run->pairs.n_test;
    run->test.first = run->pairs.test;
    for (struct hnn_samples *s = &run->train; s; s = s == &run->train ? &run->test : NULL)
        hnn_samples_share(o->common.ranks, s->n, &s->begin, &s->end);
    return AD_OK;
}

enum ad_status train_note_frames(struct train_run *run, struct ad_error *error)
{
    char text[64];
    snprintf(text, sizeof text, "%zu x %zu", run->frames.height, run->frames.width);
    hnn_model_note(run->model, "frame", text, error);
    if (run->frames.has_rod) {
        snprintf(text, sizeof text, "%.17g", run->frames.rod.dt);
        hnn_model_note(run->model, "dt", text, error);
        hnn_model_note(run->model, "filter", hnn_filters[run->frames.rod.filter], error);
    }
    return error->status;
}
