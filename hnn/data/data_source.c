/* Which kind of file it is. */
#include "data_source.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

/* By its first bytes; by its name where damage has hidden them. A pipe is text. */
static bool is_hdf5(const char *file)
{
    struct stat status;
    const char *dot = strrchr(file, '.');
    if (stat(file, &status) != 0 || !S_ISREG(status.st_mode))
        return false;
    return (dot && (strcmp(dot, ".h5") == 0 || strcmp(dot, ".hdf5") == 0)) || phys_runfile_is(file);
}

enum ad_status hnn_source_open(const char *file, struct hnn_source **source, struct ad_error *error)
{
    *source = NULL;
    if (is_hdf5(file))
        return hnn_hdf5_open(file, source, error);
    FILE *stream = fopen(file, "rb");
    if (!stream)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected CSV, text or HDF5", file,
                       strerror(errno));
    return hnn_text_open(file, stream, source, error);
}

void hnn_source_close(struct hnn_source *source)
{
    if (source)
        source->kind->close(source);
}
