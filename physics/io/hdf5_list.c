/* Everything in a run file, in order (runfile.h). */
#include "hdf5_handles.h"

#include <stdlib.h>
#include <string.h>

struct listing {
    void (*visit)(void *context, const struct phys_runfile_item *item);
    void *context;
    const char *object;
    bool out_of_memory;
};

static herr_t list_attribute(hid_t object, const char *name, const H5A_info_t *info, void *context)
{
    struct listing *listing = context;
    char *text;
    (void)info;
    struct phys_runfile_item item = {.object = listing->object, .attribute = name};
    hid_t id = H5Aopen(object, name, H5P_DEFAULT);
    if (id < 0)
        return -1;
    listing->out_of_memory = !phys_h5_attribute(id, &item, &text);
    if (!listing->out_of_memory)
        listing->visit(listing->context, &item);
    free(text);
    H5Aclose(id);
    return listing->out_of_memory ? -1 : 0;
}

static herr_t list_object(hid_t root, const char *name, const H5O_info_t *info, void *context)
{
    struct listing *listing = context;
    struct phys_runfile_item item = {.object = strcmp(name, ".") == 0 ? "" : name};
    hid_t id = H5Oopen(root, name, H5P_DEFAULT);
    if (id < 0)
        return -1;
    if (info->type == H5O_TYPE_DATASET)
        phys_h5_describe(id, &item);
    else if (info->type != H5O_TYPE_GROUP)
        item.kind = PHYS_RUNFILE_OTHER;
    listing->object = item.object;
    listing->visit(listing->context, &item);
    herr_t failed = H5Aiterate2(id, H5_INDEX_NAME, H5_ITER_INC, NULL, list_attribute, listing);
    H5Oclose(id);
    return failed < 0 ? -1 : 0;
}

enum ad_status phys_runfile_list(phys_runfile *file,
                                 void (*visit)(void *context, const struct phys_runfile_item *item),
                                 void *context, struct ad_error *error)
{
    struct listing listing = {visit, context, "", false};
    if (H5Ovisit(file->id, H5_INDEX_NAME, H5_ITER_INC, list_object, &listing) < 0)
        return listing.out_of_memory ? ad_fail(error, AD_E_MEMORY, "%s: out of memory", file->name)
                                     : phys_h5_fail(error, AD_E_INPUT, file->name, "list", "/");
    return AD_OK;
}
