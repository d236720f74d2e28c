/* Frames in memory, and the division of their pairs into training and test. */
#include "frames.h"
#include "autodiff/free.h"
#include "hnn/data/data_table.h"

#include <math.h>
#include <stdlib.h>

enum ad_status hnn_frames_new(struct hnn_frames *f, size_t trajectories, size_t frames,
                              size_t height, size_t width, struct ad_error *error)
{
    *f = (struct hnn_frames){
        .trajectories = trajectories, .frames = frames, .height = height, .width = width};
    size_t room = SIZE_MAX / sizeof *f->pixels, each[] = {trajectories, frames, height, width};
    for (size_t k = 0; k < LENGTH(each); k++)
        room /= each[k] ? each[k] : 1;
    size_t n = trajectories * frames;
    f->pixels = room ? calloc(n * height * width, sizeof *f->pixels) : NULL;
    return f->pixels
               ? AD_OK
               : ad_fail(error, AD_E_MEMORY, "out of memory for %zu x %zu frames of %zu x %zu",
                         trajectories, frames, height, width);
}

enum ad_status hnn_frames_new_motion(struct hnn_frames *f, struct ad_error *error)
{
    size_t n = f->trajectories * f->frames;
    f->angle = malloc(n * sizeof *f->angle);
    f->speed = malloc(n * sizeof *f->speed);
    return f->angle && f->speed ? AD_OK : ad_fail(error, AD_E_MEMORY, "out of memory");
}

void hnn_frames_free(struct hnn_frames *f)
{
    if (!f)
        return;
    AD_FREE(f->pixels, f->angle, f->speed);
    *f = (struct hnn_frames){0};
}

enum ad_status hnn_frames_split(const struct hnn_frames *f, double fraction, uint64_t seed,
                                struct hnn_split_pairs *pairs, struct ad_error *error)
{
    if (AD_LACKS(error, f, pairs))
        return error->status;
    *pairs = (struct hnn_split_pairs){0};
    if (!(fraction >= 0 && fraction < 1))
        return ad_fail(error, AD_E_ARGUMENT,
                       "test fraction: expected at least 0 and less than 1, got %g", fraction);
    size_t wanted = (size_t)llround(fraction * (double)f->trajectories), left = f->trajectories;
    if (wanted == left || (wanted == 0 && fraction > 0))
        return ad_fail(error, AD_E_ARGUMENT,
                       "a test fraction of %g of %zu trajectories leaves none %s", fraction, left,
                       wanted ? "to train on; expected a smaller one"
                              : "for the test; expected a larger one");
    size_t each = f->frames - 2, train = 0, test = (left - wanted) * each;
    pairs->n_train = test;
    pairs->n_test = wanted * each;
    pairs->train = malloc(left * each * sizeof *pairs->train);
    if (!pairs->train)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    pairs->test = pairs->train + test;
    struct phys_random random;
    phys_random_seed(&random, seed);
    for (size_t i = 0; i < f->trajectories; i++) {
        size_t *to = hnn_select(&random, &wanted, &left) ? &test : &train;
        for (size_t k = 0; k < each; k++)
            pairs->train[(*to)++] = i * f->frames + k;
    }
    return AD_OK;
}

/* ---- shares of ranks ---- */

/* The trajectories of this rank's share of some pairs. */
static void want(const struct hnn_frames *f, struct hnn_frames_share *share, size_t n,
                 const size_t *pairs)
{
    size_t begin, end;
    hnn_samples_share(share->ranks, n, &begin, &end);
    for (size_t k = begin; k < (end ? end : n); k++)
        share->wanted[pairs[k] / f->frames] = true;
}

enum ad_status hnn_frames_begin(struct hnn_frames *f, const size_t size[4],
                                struct hnn_frames_share *share, struct ad_error *error)
{
    if (hnn_frames_new(f, size[0], size[1], size[2], size[3], error) != AD_OK || !share ||
        hnn_frames_split(f, share->fraction, share->seed, share->pairs, error) != AD_OK)
        return error->status;
    const struct hnn_split_pairs *pairs = share->pairs;
    if (!(share->wanted = calloc(f->trajectories, sizeof *share->wanted)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    want(f, share, pairs->n_train, pairs->train);
    want(f, share, pairs->n_test, pairs->test);
    for (size_t k = 0, pair; (pair = hnn_video_followed(f, pairs, k)) != SIZE_MAX; k++)
        share->wanted[pair / f->frames] = true;
    return AD_OK;
}

void hnn_split_pairs_free(struct hnn_split_pairs *pairs)
{
    if (!pairs)
        return;
    free(pairs->train);
    *pairs = (struct hnn_split_pairs){0};
}
