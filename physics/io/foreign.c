/* Recognises files of other formats by their first bytes, so that messages can name them. */
#include "lines.h"

#include <string.h>

#define BYTES(text) text, sizeof text - 1

static const struct {
    const char *bytes;
    size_t n;
    const char *what, *instead;
} kinds[] = {
    {BYTES("\xff\xfe"), "UTF-16 text", "UTF-8, as by iconv -f UTF-16 -t UTF-8"},
    {BYTES("\xfe\xff"), "UTF-16 text", "UTF-8, as by iconv -f UTF-16 -t UTF-8"},
    {BYTES("\x93NUMPY"), "a NumPy array (.npy)", "text, as by numpy.savetxt, or HDF5"},
    {BYTES("PK\3\4"), "a zip archive (.npz, .xlsx)", "one table in it as CSV, text or HDF5"},
    {BYTES("\x1f\x8b"), "compressed twice by gzip", "once"},
    {BYTES("BZh"), "compressed by bzip2", "gzip, or none"},
    {BYTES("\xfd"
           "7zXZ"),
     "compressed by xz", "gzip, or none"},
    {BYTES("\x28\xb5\x2f\xfd"), "compressed by zstd", "gzip, or none"},
    {BYTES("PAR1"), "a Parquet file", "CSV, text or HDF5"},
    {BYTES("ARROW1"), "an Arrow file", "CSV, text or HDF5"},
    {BYTES("\xd0\xcf\x11\xe0"), "an old Excel file", "one table in it as CSV"},
    {BYTES("MATLAB 5.0"), "a MATLAB file", "HDF5, as by save -v7.3, or CSV"},
    {BYTES("CDF\1"), "a netCDF file", "HDF5, CSV or text"},
    {BYTES("CDF\2"), "a netCDF file", "HDF5, CSV or text"},
    {BYTES("\x80\4\x95"), "a Python pickle", "CSV, text or HDF5"},
    {BYTES("SQLite format 3"), "an SQLite database", "one table in it as CSV"},
    {BYTES("\x89HDF"), "HDF5 in gzip or a pipe", "a file that can be read at any place"},
    {BYTES("{"), "JSON", "CSV, text or HDF5"},
    {BYTES("<"), "XML or HTML", "CSV, text or HDF5"},
};

/* Zeros at every other byte: UTF-16 without a byte order mark. */
static bool is_wide(const char *text, size_t n)
{
    size_t zeros[2] = {0, 0}, most = n < 64 ? n / 2 * 2 : 64;
    for (size_t k = 0; k < most; k++)
        zeros[k % 2] += text[k] == 0;
    return most >= 4 && (zeros[0] == most / 2) != (zeros[1] == most / 2);
}

enum ad_status phys_lines_identify(struct phys_lines *lines, struct ad_error *error)
{
    const char *text = lines->buffer;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (lines->n >= kinds[k].n && memcmp(text, kinds[k].bytes, kinds[k].n) == 0)
            return ad_fail(error, AD_E_INPUT, "%s: %s; expected %s", lines->file, kinds[k].what,
                           kinds[k].instead);
    if (is_wide(text, lines->n))
        return ad_fail(error, AD_E_INPUT, "%s: UTF-16 text; expected %s", lines->file,
                       kinds[0].instead);
    if (lines->n && !memchr(text, '\n', lines->n) && memchr(text, '\r', lines->n))
        lines->end = '\r'; /* as old Macintosh and some instruments write */
    return AD_OK;
}
