/* Reads datasets of an HDF5 file (hdf5_file.h). */
#include "hdf5_handles.h"

void phys_h5_describe(hid_t id, struct phys_hdf5_item *item)
{
    hid_t type = H5Dget_type(id), space = H5Dget_space(id);
    int rank = H5Sget_simple_extent_ndims(space);
    item->kind = rank >= 0 && rank <= PHYS_HDF5_RANK ? phys_h5_kind(type) : PHYS_HDF5_OTHER;
    if (item->kind != PHYS_HDF5_OTHER) {
        hsize_t size[PHYS_HDF5_RANK];
        item->rank = (size_t)rank;
        H5Sget_simple_extent_dims(space, size, NULL);
        for (size_t k = 0; k < item->rank; k++)
            item->dims[k] = (size_t)size[k];
    }
    H5Sclose(space);
    H5Tclose(type);
}

static hid_t dataset_open(phys_hdf5 *file, const char *name, struct phys_hdf5_item *item,
                          struct ad_error *error)
{
    *item = (struct phys_hdf5_item){.object = name};
    hid_t id = H5Dopen2(file->id, name, H5P_DEFAULT);
    if (id >= 0)
        phys_h5_describe(id, item);
    else
        phys_h5_fail(error, AD_E_INPUT, file->name, "find dataset", name);
    return id;
}

enum ad_status phys_hdf5_shape(phys_hdf5 *file, const char *name, struct phys_hdf5_item *item,
                               struct ad_error *error)
{
    PHYS_H5_ALONE;
    hid_t id = dataset_open(file, name, item, error);
    if (id < 0)
        return AD_E_INPUT;
    H5Dclose(id);
    return AD_OK;
}

static bool select_block(hid_t space, const struct phys_hdf5_item *item, const hsize_t first[],
                         const hsize_t count[])
{
    for (size_t k = 0; k < item->rank; k++)
        if (first[k] > item->dims[k] || count[k] > item->dims[k] - first[k])
            return false;
    return H5Sselect_hyperslab(space, H5S_SELECT_SET, first, NULL, count, NULL) >= 0;
}

/* The arrays have the rank of the dataset. */
static enum ad_status read_block(phys_hdf5 *file, hid_t id, const struct phys_hdf5_item *item,
                                 const hsize_t first[], const hsize_t count[], double *values,
                                 struct ad_error *error)
{
    enum ad_status status = AD_OK;
    hid_t space = H5Dget_space(id), memory = H5Screate_simple((int)item->rank, count, NULL);
    if (!select_block(space, item, first, count) ||
        H5Dread(id, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, values) < 0)
        status = phys_h5_fail(error, AD_E_INPUT, file->name, "read", item->object);
    H5Sclose(memory);
    H5Sclose(space);
    return status;
}

static hid_t numbers_open(phys_hdf5 *file, const char *name, struct phys_hdf5_item *item,
                          struct ad_error *error)
{
    hid_t id = dataset_open(file, name, item, error);
    if (id < 0 || (phys_h5_is_number(item->kind) && item->rank > 0))
        return id;
    H5Dclose(id);
    ad_fail(error, AD_E_INPUT, "%s: '%s' is not an array of numbers", file->name, name);
    return H5I_INVALID_HID;
}

enum ad_status phys_hdf5_read(phys_hdf5 *file, const char *name, size_t first, size_t count,
                              double *values, struct ad_error *error)
{
    PHYS_H5_ALONE;
    struct phys_hdf5_item item;
    hid_t id = numbers_open(file, name, &item, error);
    if (id < 0)
        return AD_E_INPUT;
    hsize_t from[PHYS_HDF5_RANK] = {first}, size[PHYS_HDF5_RANK] = {count};
    for (size_t k = 1; k < item.rank; k++)
        size[k] = item.dims[k];
    enum ad_status status = read_block(file, id, &item, from, size, values, error);
    H5Dclose(id);
    return status;
}

enum ad_status phys_hdf5_read_block(phys_hdf5 *file, const char *name, const size_t first[],
                                    const size_t count[], double *values, struct ad_error *error)
{
    PHYS_H5_ALONE;
    struct phys_hdf5_item item;
    hid_t id = numbers_open(file, name, &item, error);
    if (id < 0)
        return AD_E_INPUT;
    hsize_t from[PHYS_HDF5_RANK], size[PHYS_HDF5_RANK];
    for (size_t k = 0; k < item.rank; k++) {
        from[k] = first[k];
        size[k] = count[k];
    }
    enum ad_status status = read_block(file, id, &item, from, size, values, error);
    H5Dclose(id);
    return status;
}
