/* Reads frames from either kind of source. */
#include "frames.h"
#include "autodiff/hash.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static enum ad_status read_frames(const char *path, struct hnn_frames_share *share,
                                  struct hnn_frames *frames, struct ad_error *error)
{
    struct stat status;
    *frames = (struct hnn_frames){0};
    if (stat(path, &status) != 0)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected frames, HDF5 or a folder",
                       path, strerror(errno));
    return (S_ISDIR(status.st_mode) ? hnn_frames_read_folder : hnn_frames_read_hdf5)(path, share,
                                                                                     frames, error);
}

enum ad_status hnn_frames_read(const char *path, struct hnn_frames *frames, struct ad_error *error)
{
    return AD_LACKS(error, path, frames) ? error->status : read_frames(path, NULL, frames, error);
}

/* Sizes, and the pixels of a trajectory that every rank reads. */
static enum ad_status agree(struct ad_ranks *ranks, const char *path, const struct hnn_frames *f,
                            const struct hnn_split_pairs *pairs, struct ad_error *error)
{
    char text[160];
    if (ad_ranks_agree(ranks, error) != AD_OK)
        return error->status;
    const size_t bytes = f->frames * f->height * f->width * sizeof *f->pixels;
    snprintf(text, sizeof text, "%zu x %zu frames of %zu x %zu, fingerprint %016" PRIx64,
             f->trajectories, f->frames, f->height, f->width,
             ad_hash(AD_HASH_BEGIN, hnn_frames_pair(f, pairs->train[0]), bytes));
    return ad_ranks_same(ranks, path, text, error);
}

enum ad_status hnn_frames_read_split(const char *path, double fraction, uint64_t seed,
                                     struct ad_ranks *ranks, struct hnn_frames *frames,
                                     struct hnn_split_pairs *pairs, struct ad_error *error)
{
    if (AD_LACKS(error, path, frames, pairs))
        return error->status;
    struct hnn_frames_share share = {fraction, seed, ranks, pairs, NULL};
    *pairs = (struct hnn_split_pairs){0};
    read_frames(path, &share, frames, error);
    free(share.wanted);
    return agree(ranks, path, frames, pairs, error);
}
