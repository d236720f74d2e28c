/* Horizons tables: opening, reading, closing (horizons.h). */
#include "autodiff/free.h"
#include "horizons_reader.h"

#include <errno.h>
#include <string.h>

bool phys_horizons_open(struct horizons_reader *r, const char *file, struct phys_horizons *table,
                        struct ad_error *error)
{
    *r = (struct horizons_reader){.file = file, .table = table, .error = error};
    *table = (struct phys_horizons){.id = PHYS_HORIZONS_NO_ID};
    r->stream = fopen(file, "r");
    if (!r->stream)
        return HORIZONS_FAIL(r, AD_E_IO, "%s: cannot be read: %s", file, strerror(errno));
    return phys_horizons_header(r);
}

enum ad_status phys_horizons_close(struct horizons_reader *r)
{
    if (r->stream)
        fclose(r->stream);
    if (r->status != AD_OK)
        phys_horizons_free(r->table);
    return r->status;
}

enum ad_status phys_horizons_read(const char *file, struct phys_horizons *table,
                                  struct ad_error *error)
{
    struct horizons_reader r;
    if (AD_LACKS(error, table))
        return error->status;
    *table = (struct phys_horizons){.id = PHYS_HORIZONS_NO_ID};
    if (AD_LACKS(error, file))
        return error->status;
    if (phys_horizons_open(&r, file, table, error))
        phys_horizons_rows(&r);
    return phys_horizons_close(&r);
}

void phys_horizons_free(struct phys_horizons *table)
{
    if (!table)
        return;
    AD_FREE(table->jd, table->position, table->velocity);
    *table = (struct phys_horizons){.id = PHYS_HORIZONS_NO_ID};
}
