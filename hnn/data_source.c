/* Which kind of file it is. */
#include "data_source.h"

#include <errno.h>
#include <string.h>

enum { HDF5_FIRST_BYTE = 0x89 }; /* no text begins so: it continues a character of UTF-8 */

enum ad_status hnn_source_open(const char *file, struct hnn_source **source, struct ad_error *error)
{
    *source = NULL;
    FILE *stream = fopen(file, "rb");
    if (stream)
        setvbuf(stream, NULL, _IONBF, 0); /* the readers have buffers of their own */
    int first = stream ? getc(stream) : EOF;
    if (!stream || ferror(stream)) {
        ad_fail(error, AD_E_IO, "%s: cannot be read: %s", file, strerror(errno));
        if (stream)
            fclose(stream);
        return error->status;
    }
    if (first == HDF5_FIRST_BYTE) {
        fclose(stream);
        return hnn_hdf5_open(file, source, error);
    }
    ungetc(first, stream);
    return hnn_text_open(file, stream, source, error);
}

void hnn_source_close(struct hnn_source *source)
{
    if (source)
        source->kind->close(source);
}
