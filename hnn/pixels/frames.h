/* Shared by the files that make and read frames. */
#ifndef HNN_PIXELS_FRAMES_H
#define HNN_PIXELS_FRAMES_H

#include "hnn/model/internal.h"
#include "pixels.h"

/* Sizes and room for the pixels; and for angles and speeds. AD_E_MEMORY. */
enum ad_status hnn_frames_new(struct hnn_frames *f, size_t trajectories, size_t frames,
                              size_t height, size_t width, struct ad_error *error);
enum ad_status hnn_frames_new_motion(struct hnn_frames *f, struct ad_error *error);

/* What hnn_frames_save writes, to a file that has been begun. */
void hnn_frames_write(const struct hnn_frames *frames, phys_hdf5 *file);

/* A division of frames that ranks share: what they want of it is known once its sizes are. */
struct hnn_frames_share {
    double fraction;
    uint64_t seed;
    struct ad_ranks *ranks;
    struct hnn_split_pairs *pairs;
    bool *wanted; /* [trajectories]; NULL: all */
};
/* hnn_frames_new, and which trajectories are wanted; `share` NULL: all. */
enum ad_status hnn_frames_begin(struct hnn_frames *f, const size_t size[4],
                                struct hnn_frames_share *share, struct ad_error *error);
static inline bool hnn_frames_wanted(const struct hnn_frames_share *share, size_t trajectory)
{
    return !share || !share->wanted || share->wanted[trajectory];
}
/* First pair of the video k that hnn_video_motion follows; SIZE_MAX: there are no more. */
size_t hnn_video_followed(const struct hnn_frames *f, const struct hnn_split_pairs *pairs,
                          size_t k);

/* The two kinds of source. */
enum ad_status hnn_frames_read_hdf5(const char *file, struct hnn_frames_share *share,
                                    struct hnn_frames *frames, struct ad_error *error);
enum ad_status hnn_frames_read_folder(const char *folder, struct hnn_frames_share *share,
                                      struct hnn_frames *frames, struct ad_error *error);

/* One picture of a file, PGM or PNG, grey, 8 bits: a byte a pixel. */
struct hnn_image {
    size_t height, width;
    unsigned char *pixels; /* [height x width], freed by the caller */
};
enum ad_status hnn_image_read(const char *file, struct hnn_image *image, struct ad_error *error);

#endif
