/* Reads frames from either kind of source. */
#include "frames.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

enum ad_status hnn_frames_read(const char *path, struct hnn_frames *frames, struct ad_error *error)
{
    struct stat status;
    if (AD_LACKS(error, path, frames))
        return error->status;
    *frames = (struct hnn_frames){0};
    if (stat(path, &status) != 0)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected frames, HDF5 or a folder",
                       path, strerror(errno));
    return (S_ISDIR(status.st_mode) ? hnn_frames_read_folder : hnn_frames_read_hdf5)(path, frames,
                                                                                     error);
}
