/* Opens a file by its kind: text or HDF5. */
#include "data_source.h"

#include <string.h>
#include <sys/stat.h>

/* Recognised by its first bytes; a damaged file by its name. A pipe is text. */
static bool is_hdf5(const char *file)
{
    struct stat status;
    const char *dot = strrchr(file, '.');
    if (stat(file, &status) != 0 || !S_ISREG(status.st_mode))
        return false;
    return (dot && (strcmp(dot, ".h5") == 0 || strcmp(dot, ".hdf5") == 0)) || phys_hdf5_is(file);
}

enum ad_status hnn_source_open(const char *file, size_t skip, struct hnn_source **source,
                               struct ad_error *error)
{
    *source = NULL;
    if (is_hdf5(file) && skip)
        return ad_fail(error, AD_E_ARGUMENT, "%s: rows are skipped in text alone, this is HDF5",
                       file);
    if (is_hdf5(file))
        return hnn_hdf5_open(file, source, error);
    return hnn_text_open(file, skip, source, error);
}

void hnn_source_close(struct hnn_source *source)
{
    if (source)
        source->kind->close(source);
}
