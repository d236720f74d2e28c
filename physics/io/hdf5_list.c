/* Lists the contents of an HDF5 file, in order (hdf5_file.h). */
#include "hdf5_handles.h"

#include <stdlib.h>

struct listing {
    void (*visit)(void *context, const struct phys_hdf5_item *item);
    void *context;
    const char *object;
    phys_hdf5 *file;
    struct ad_error *error;
};

static herr_t list_attribute(hid_t object, const char *name, const H5A_info_t *info, void *context)
{
    struct listing *listing = context;
    char *text;
    (void)info;
    struct phys_hdf5_item item = {.object = listing->object, .attribute = name};
    hid_t id = H5Aopen(object, name, H5P_DEFAULT);
    if (id < 0)
        return -1;
    bool room = phys_h5_attribute(id, &item, &text);
    if (room)
        listing->visit(listing->context, &item);
    else
        ad_fail(listing->error, AD_E_MEMORY, "%s: out of memory", listing->file->name);
    free(text);
    H5Aclose(id);
    return room ? 0 : -1;
}

static int list_object(void *context, hid_t object, H5O_type_t type, const char *path)
{
    struct listing *listing = context;
    struct phys_hdf5_item item = {.object = path};
    if (type == H5O_TYPE_DATASET)
        phys_h5_describe(object, &item);
    else if (type != H5O_TYPE_GROUP)
        item.kind = PHYS_HDF5_OTHER;
    listing->object = path;
    listing->visit(listing->context, &item);
    return H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, NULL, list_attribute, listing) < 0 ? -1
                                                                                              : 0;
}

enum ad_status phys_hdf5_list(phys_hdf5 *file,
                              void (*visit)(void *context, const struct phys_hdf5_item *item),
                              void *context, struct ad_error *error)
{
    PHYS_H5_ALONE;
    struct listing listing = {visit, context, "", file, error};
    if (file->error.status != AD_OK) /* of writing */
        return ad_fail(error, file->error.status, "%s", file->error.message);
    return phys_h5_walk(file, list_object, &listing, error);
}
