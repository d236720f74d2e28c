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

/* The two kinds of source. */
enum ad_status hnn_frames_read_hdf5(const char *file, struct hnn_frames *frames,
                                    struct ad_error *error);
enum ad_status hnn_frames_read_folder(const char *folder, struct hnn_frames *frames,
                                      struct ad_error *error);

/* One picture of a file, PGM or PNG, grey, 8 bits: a byte a pixel. */
struct hnn_image {
    size_t height, width;
    unsigned char *pixels; /* [height x width], freed by the caller */
};
enum ad_status hnn_image_read(const char *file, struct hnn_image *image, struct ad_error *error);

#endif
