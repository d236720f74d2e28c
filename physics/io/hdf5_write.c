/* Writes datasets and groups of an HDF5 file (hdf5_file.h). */
#include "hdf5_handles.h"

#include <assert.h>

static hid_t memory_type(enum ad_type type)
{
    return type == AD_F32 ? H5T_NATIVE_FLOAT : H5T_NATIVE_DOUBLE;
}

/* Property list of a link: folders on the way are made, names are UTF-8. */
static hid_t link_properties(void)
{
    hid_t list = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(list, 1);
    H5Pset_char_encoding(list, H5T_CSET_UTF8);
    return list;
}

/* Makes a dataset without a timestamp, chunked unless `chunk` is NULL; `blank`: with its place in
   the file, and nothing there. */
static hid_t dataset_new(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                         const hsize_t size[], const hsize_t most[], const hsize_t *chunk,
                         bool blank)
{
    hid_t space = H5Screate_simple((int)rank, size, most);
    hid_t link = link_properties(), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(create, 0);
    if (chunk)
        H5Pset_chunk(create, (int)rank, chunk);
    if (blank) {
        H5Pset_alloc_time(create, H5D_ALLOC_TIME_EARLY);
        H5Pset_fill_time(create, H5D_FILL_TIME_NEVER);
    }
    hid_t id = H5Dcreate2(file->id, name, type == AD_F32 ? H5T_IEEE_F32LE : H5T_IEEE_F64LE, space,
                          link, create, H5P_DEFAULT);
    if (id < 0)
        phys_h5_fail_write(file, "create", name);
    H5Pclose(create);
    H5Pclose(link);
    H5Sclose(space);
    return id;
}

void phys_hdf5_write(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                     const size_t dims[], const void *values)
{
    PHYS_H5_ALONE;
    assert(rank >= 1 && rank <= PHYS_HDF5_RANK);
    if (file->error.status != AD_OK)
        return;
    hsize_t size[PHYS_HDF5_RANK];
    for (size_t k = 0; k < rank; k++)
        size[k] = dims[k];
    hid_t id = dataset_new(file, name, type, rank, size, NULL, NULL, false);
    if (id < 0)
        return;
    bool written = H5Dwrite(id, memory_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
    if (!(H5Dclose(id) >= 0 && written)) /* small values reach the disk when it is closed */
        phys_h5_fail_write(file, "write", name);
}

void phys_hdf5_blank(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                     const size_t dims[])
{
    PHYS_H5_ALONE;
    hsize_t size[PHYS_HDF5_RANK];
    if (file->error.status != AD_OK)
        return;
    for (size_t k = 0; k < rank; k++)
        size[k] = dims[k];
    hid_t id = dataset_new(file, name, type, rank, size, NULL, NULL, true);
    if (id >= 0 && H5Dclose(id) < 0)
        phys_h5_fail_write(file, "create", name);
}

/* Records a chunk: about 64 KiB, so that a history of scalars does not become a chunk each. */
static hsize_t chunk_records(enum ad_type type, size_t rank, const size_t dims[])
{
    double bytes = type == AD_F32 ? 4 : 8;
    for (size_t k = 1; k < rank; k++)
        bytes *= (double)dims[k];
    return bytes < 65536 ? (hsize_t)(65536 / bytes) : 1;
}

void phys_hdf5_extendable(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                          const size_t dims[])
{
    PHYS_H5_ALONE;
    assert(rank >= 1 && rank <= PHYS_HDF5_RANK);
    if (file->error.status != AD_OK)
        return;
    hsize_t size[PHYS_HDF5_RANK] = {0}, most[PHYS_HDF5_RANK] = {H5S_UNLIMITED};
    hsize_t chunk[PHYS_HDF5_RANK] = {chunk_records(type, rank, dims)};
    for (size_t k = 1; k < rank; k++)
        size[k] = most[k] = chunk[k] = dims[k];
    hid_t id = dataset_new(file, name, type, rank, size, most, chunk, false);
    if (id >= 0 && H5Dclose(id) < 0)
        phys_h5_fail_write(file, "create", name);
}

/* Selects records first .. first+count-1 of a file's space; false if there are fewer. */
static bool select_records(hid_t space, size_t rank, const hsize_t size[], hsize_t first,
                           hsize_t count)
{
    hsize_t start[PHYS_HDF5_RANK] = {first}, block[PHYS_HDF5_RANK] = {count};
    for (size_t k = 1; k < rank; k++)
        block[k] = size[k];
    return first <= size[0] && count <= size[0] - first &&
           H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, block, NULL) >= 0;
}

/* Records from `first` on, or, at AFTER_ALL, behind those there are. */
static const size_t AFTER_ALL = SIZE_MAX;

static bool put(hid_t id, size_t first, size_t n, const void *records)
{
    hid_t space = H5Dget_space(id), type = H5Dget_type(id);
    hsize_t size[PHYS_HDF5_RANK];
    int rank = H5Sget_simple_extent_dims(space, size, NULL);
    H5Sclose(space);
    bool done = rank > 0;
    if (done && first == AFTER_ALL) {
        first = size[0];
        size[0] += n;
        done = H5Dset_extent(id, size) >= 0;
    }
    if (done) {
        hsize_t part[PHYS_HDF5_RANK] = {n};
        for (int k = 1; k < rank; k++)
            part[k] = size[k];
        space = H5Dget_space(id);
        hid_t memory = H5Screate_simple(rank, part, NULL);
        hid_t native = H5Tget_native_type(type, H5T_DIR_ASCEND);
        done = select_records(space, (size_t)rank, size, first, n) &&
               H5Dwrite(id, native, memory, space, H5P_DEFAULT, records) >= 0;
        H5Tclose(native);
        H5Sclose(memory);
        H5Sclose(space);
    }
    H5Tclose(type);
    return done;
}

void phys_hdf5_append(phys_hdf5 *file, const char *name, const void *record)
{
    phys_hdf5_append_all(file, name, 1, record);
}

void phys_hdf5_append_all(phys_hdf5 *file, const char *name, size_t n, const void *records)
{
    phys_hdf5_put(file, name, AFTER_ALL, n, records);
}

void phys_hdf5_put(phys_hdf5 *file, const char *name, size_t first, size_t n, const void *records)
{
    PHYS_H5_ALONE;
    if (file->error.status != AD_OK)
        return;
    hid_t id = H5Dopen2(file->id, name, H5P_DEFAULT);
    bool done = id >= 0 && put(id, first, n, records);
    if (!(id >= 0 && H5Dclose(id) >= 0 && done))
        phys_h5_fail_write(file, "write", name);
}

void phys_hdf5_folder(phys_hdf5 *file, const char *name)
{
    PHYS_H5_ALONE;
    if (file->error.status != AD_OK)
        return;
    hid_t link = link_properties();
    hid_t id = H5Gcreate2(file->id, name, link, H5P_DEFAULT, H5P_DEFAULT);
    if (id < 0 || H5Gclose(id) < 0)
        phys_h5_fail_write(file, "create", name);
    H5Pclose(link);
}
