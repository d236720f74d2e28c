/* Removes pixels that are dark in every training frame: half of them, for a swinging rod. Their
   weights in the encoder's first map have gradient 0, and the published training only lets them
   decay to 0. The trained model therefore lacks these columns, and takes as many products less; in
   the final model they are 0. Other frames' values there are ignored, as they are after the weights
   have decayed. */
#include "autodiff/free.h"
#include "train.h"
#include "hnn/data/data.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct looking {
    const struct hnn_samples *samples;
    size_t pixels;
};

/* Counts, for each pixel of a frame, the frames of sample i in which it is lit. */
static void add_lit(void *context, size_t i, double *sum)
{
    const struct looking *l = context;
    const struct hnn_samples *s = l->samples;
    const float *window = s->frames + s->first[s->begin + i] * s->frame;
    for (size_t at = 0; at <= l->pixels; at += s->frame)
        for (size_t k = 0; k < s->frame; k++)
            sum[k] += window[at + k] != 0;
}

/* Pixels of a frame that are lit in one of those which the samples need, of all ranks. */
static enum ad_status find_lit(struct ad_ranks *ranks, const struct hnn_samples *s, size_t pixels,
                               struct hnn_lit *lit, struct ad_error *error)
{
    struct looking looking = {s, pixels};
    double *times = malloc(s->frame * sizeof *times);
    lit->pixel = malloc(s->frame * sizeof *lit->pixel);
    if (!times || !lit->pixel)
        ad_fail(error, AD_E_MEMORY, "out of memory for frames of %zu pixels", s->frame);
    if (ad_ranks_agree(ranks, error) == AD_OK &&
        hnn_samples_sum(ranks, s, s->frame, add_lit, &looking, times, error) == AD_OK)
        for (size_t k = 0; k < s->frame; k++)
            if (times[k] > 0)
                lit->pixel[lit->n++] = k;
    free(times);
    return error->status;
}

/* All of them: where none or all are dark, or where an observation is not whole frames. */
static void see_all(struct hnn_lit *lit, size_t frame)
{
    free(lit->pixel);
    *lit = (struct hnn_lit){.n = frame};
}

enum ad_status hnn_learner_new(hnn_trainer *t, const struct hnn_samples *samples,
                               struct ad_error *error)
{
    const size_t pixels = t->model->settings.pixels, frame = samples->frame;
    t->learner = t->model;
    if (!pixels)
        return AD_OK;
    bool whole = pixels % frame == 0;
    if (whole && find_lit(t->settings.ranks, samples, pixels, &t->lit, error) != AD_OK)
        return error->status;
    if (t->lit.n == 0 || t->lit.n == frame)
        see_all(&t->lit, frame);
    if (hnn_model_blank(&t->model->settings, &t->learner, error) != AD_OK)
        return error->status;
    t->learner->seen = whole ? pixels / frame * t->lit.n : pixels;
    t->learner->shift = t->lit.n;
    hnn_layout(t->learner);
    t->selected = malloc(t->learner->size * hnn_type_bytes(t->model->settings.precision));
    return t->selected ? AD_OK : ad_fail(error, AD_E_MEMORY, "out of memory");
}

void hnn_learner_free(hnn_trainer *t)
{
    if (t->learner != t->model)
        hnn_model_free(t->learner);
    AD_FREE(t->lit.pixel, t->selected);
}

/* ---- the same parameters, with and without those columns ---- */

/* Where the learner's input k is among the model's pixels. */
static size_t pixel_of(const hnn_trainer *t, size_t k)
{
    const struct hnn_lit *lit = &t->lit;
    if (!lit->pixel)
        return k;
    size_t frame = t->model->settings.pixels / (t->learner->seen / lit->n);
    return k / lit->n * frame + lit->pixel[k % lit->n];
}

/* From the model's parameters to the learner's or back. The first map comes first in both. */
static void convert(const hnn_trainer *t, char *wide, char *narrow, bool widen)
{
    const struct hnn_block *b = &t->learner->block[t->learner->encoder];
    const size_t bytes = hnn_type_bytes(t->model->settings.precision), cols = t->model->seen;
    const size_t rest = (t->learner->size - b->rows * b->cols) * bytes;
    assert(b->offset == 0);
    if (widen)
        memset(wide, 0, b->rows * cols * bytes);
    for (size_t k = 0; k < b->cols; k++)
        for (size_t r = 0, pixel = pixel_of(t, k); r < b->rows; r++) {
            char *to = wide + (r * cols + pixel) * bytes,
                 *from = narrow + (r * b->cols + k) * bytes;
            memcpy(widen ? to : from, widen ? from : to, bytes);
        }
    wide += b->rows * cols * bytes;
    narrow += b->rows * b->cols * bytes;
    memcpy(widen ? wide : narrow, widen ? narrow : wide, rest);
}

const void *hnn_learner_point(hnn_trainer *t)
{
    if (t->learner == t->model)
        return t->model->parameters;
    convert(t, t->model->parameters, t->selected, false);
    return t->selected;
}

void hnn_learner_deliver(hnn_trainer *t, const void *point)
{
    if (t->learner == t->model) {
        hnn_model_set_parameters(t->model, point);
        return;
    }
    memcpy(t->selected, point, t->size_bytes);
    convert(t, t->model->parameters, t->selected, true);
    t->model->version++;
}
