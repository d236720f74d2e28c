/* Run files (runfile.h): the one file that calls HDF5. Handles of HDF5 are released where they were
   opened; H5Xclose of an invalid handle is avoided, since it would hide the first reason. */
#define H5_USE_110_API /* one spelling of H5Ovisit in every version since 1.10 */
#include "runfile.h"
#include "seal.h"
#include "whole.h"

#include <assert.h>
#include <errno.h>
#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct phys_runfile {
    hid_t id;
    char *name;             /* as the user wrote it, for messages */
    struct phys_whole file; /* when writing */
    struct ad_error error;  /* first failure of writing */
};

/* ---- errors ---- */

/* HDF5's innermost reason for its last failure. */
struct reason {
    char text[160];
};

static herr_t innermost(unsigned depth, const H5E_error2_t *entry, void *reason)
{
    if (depth == 0 && entry->desc)
        snprintf(((struct reason *)reason)->text, sizeof(struct reason), "%s", entry->desc);
    return 0;
}

static struct reason last_reason(void)
{
    struct reason reason = {"HDF5 gives no reason"};
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, &reason);
    H5Eclear2(H5E_DEFAULT);
    reason.text[strcspn(reason.text, "\n")] = '\0';
    return reason;
}

static enum ad_status fail(struct ad_error *error, enum ad_status status, const char *file,
                           const char *what, const char *item)
{
    return ad_fail(error, status, "%s: cannot %s '%s': %s", file, what, item, last_reason().text);
}

static void fail_write(phys_runfile *file, const char *what, const char *item)
{
    fail(&file->error, AD_E_IO, file->name, what, item);
}

static phys_runfile *handle_new(const char *name, struct ad_error *error)
{
    phys_runfile *file = calloc(1, sizeof *file);
    if (file && !(file->name = strdup(name))) {
        free(file);
        file = NULL;
    }
    if (!file)
        ad_fail(error, AD_E_MEMORY, "%s: out of memory", name);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return file;
}

static void handle_free(phys_runfile *file)
{
    free(file->name);
    free(file);
}

/* ---- writing ---- */

enum ad_status phys_runfile_create(const char *target, phys_runfile **out, struct ad_error *error)
{
    *out = NULL;
    phys_runfile *file = handle_new(target, error);
    if (!file)
        return AD_E_MEMORY;
    enum ad_status status = phys_whole_begin(&file->file, target, error);
    if (status == AD_OK) {
        hid_t sealed = H5Pcreate(H5P_FILE_CREATE);
        H5Pset_userblock(sealed, PHYS_SEAL_BYTES);
        file->id = H5Fcreate(file->file.temporary, H5F_ACC_TRUNC, sealed, H5P_DEFAULT);
        H5Pclose(sealed);
        if (file->id < 0) {
            status = fail(error, AD_E_IO, target, "create", target);
            phys_whole_abandon(&file->file);
        }
    }
    if (status == AD_OK)
        *out = file;
    else
        handle_free(file);
    return status;
}

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

/* Makes a dataset without a timestamp, chunked unless `chunk` is NULL. */
static hid_t dataset_new(phys_runfile *file, const char *name, enum ad_type type, size_t rank,
                         const hsize_t size[], const hsize_t most[], const hsize_t *chunk)
{
    hid_t space = H5Screate_simple((int)rank, size, most);
    hid_t link = link_properties(), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(create, 0);
    if (chunk)
        H5Pset_chunk(create, (int)rank, chunk);
    hid_t id = H5Dcreate2(file->id, name, type == AD_F32 ? H5T_IEEE_F32LE : H5T_IEEE_F64LE, space,
                          link, create, H5P_DEFAULT);
    if (id < 0)
        fail_write(file, "create", name);
    H5Pclose(create);
    H5Pclose(link);
    H5Sclose(space);
    return id;
}

void phys_runfile_write(phys_runfile *file, const char *name, enum ad_type type, size_t rank,
                        const size_t dims[], const void *values)
{
    assert(rank >= 1 && rank <= PHYS_RUNFILE_RANK);
    if (file->error.status != AD_OK)
        return;
    hsize_t size[PHYS_RUNFILE_RANK];
    for (size_t k = 0; k < rank; k++)
        size[k] = dims[k];
    hid_t id = dataset_new(file, name, type, rank, size, NULL, NULL);
    if (id < 0)
        return;
    if (H5Dwrite(id, memory_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        fail_write(file, "write", name);
    H5Dclose(id);
}

/* Records a chunk: about 64 KiB, so that a history of scalars does not become a chunk each. */
static hsize_t chunk_records(enum ad_type type, size_t rank, const size_t dims[])
{
    double bytes = type == AD_F32 ? 4 : 8;
    for (size_t k = 1; k < rank; k++)
        bytes *= (double)dims[k];
    return bytes < 65536 ? (hsize_t)(65536 / bytes) : 1;
}

void phys_runfile_extendable(phys_runfile *file, const char *name, enum ad_type type, size_t rank,
                             const size_t dims[])
{
    assert(rank >= 1 && rank <= PHYS_RUNFILE_RANK);
    if (file->error.status != AD_OK)
        return;
    hsize_t size[PHYS_RUNFILE_RANK] = {0}, most[PHYS_RUNFILE_RANK] = {H5S_UNLIMITED};
    hsize_t chunk[PHYS_RUNFILE_RANK] = {chunk_records(type, rank, dims)};
    for (size_t k = 1; k < rank; k++)
        size[k] = most[k] = chunk[k] = dims[k];
    hid_t id = dataset_new(file, name, type, rank, size, most, chunk);
    if (id >= 0)
        H5Dclose(id);
}

/* Selects records first .. first+count-1 of a file's space; false where there are not so many. */
static bool select_records(hid_t space, size_t rank, const hsize_t size[], hsize_t first,
                           hsize_t count)
{
    hsize_t start[PHYS_RUNFILE_RANK] = {first}, block[PHYS_RUNFILE_RANK] = {count};
    for (size_t k = 1; k < rank; k++)
        block[k] = size[k];
    return first <= size[0] && count <= size[0] - first &&
           H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, block, NULL) >= 0;
}

static bool append(hid_t id, const void *record)
{
    hid_t space = H5Dget_space(id), type = H5Dget_type(id);
    hsize_t size[PHYS_RUNFILE_RANK];
    int rank = H5Sget_simple_extent_dims(space, size, NULL);
    H5Sclose(space);
    size[0]++;
    bool done = rank > 0 && H5Dset_extent(id, size) >= 0;
    if (done) {
        hsize_t one[PHYS_RUNFILE_RANK] = {1};
        for (int k = 1; k < rank; k++)
            one[k] = size[k];
        space = H5Dget_space(id);
        hid_t memory = H5Screate_simple(rank, one, NULL);
        hid_t native = H5Tget_native_type(type, H5T_DIR_ASCEND);
        done = select_records(space, (size_t)rank, size, size[0] - 1, 1) &&
               H5Dwrite(id, native, memory, space, H5P_DEFAULT, record) >= 0;
        H5Tclose(native);
        H5Sclose(memory);
        H5Sclose(space);
    }
    H5Tclose(type);
    return done;
}

void phys_runfile_append(phys_runfile *file, const char *name, const void *record)
{
    if (file->error.status != AD_OK)
        return;
    hid_t id = H5Dopen2(file->id, name, H5P_DEFAULT);
    if (id < 0 || !append(id, record))
        fail_write(file, "append to", name);
    if (id >= 0)
        H5Dclose(id);
}

void phys_runfile_folder(phys_runfile *file, const char *name)
{
    if (file->error.status != AD_OK)
        return;
    hid_t link = link_properties();
    hid_t id = H5Gcreate2(file->id, name, link, H5P_DEFAULT, H5P_DEFAULT);
    if (id < 0)
        fail_write(file, "create", name);
    else
        H5Gclose(id);
    H5Pclose(link);
}

static void put(phys_runfile *file, const char *object, const char *name, hid_t file_type,
                hid_t type, const void *value)
{
    if (file->error.status != AD_OK)
        return;
    hid_t space = H5Screate(H5S_SCALAR), utf8 = H5Pcreate(H5P_ATTRIBUTE_CREATE);
    H5Pset_char_encoding(utf8, H5T_CSET_UTF8);
    hid_t id =
        H5Acreate_by_name(file->id, object, name, file_type, space, utf8, H5P_DEFAULT, H5P_DEFAULT);
    if (id < 0 || H5Awrite(id, type, value) < 0)
        fail_write(file, "write attribute", name);
    if (id >= 0)
        H5Aclose(id);
    H5Pclose(utf8);
    H5Sclose(space);
}

/* Variable length and UTF-8: what h5py reads as str. */
static hid_t text_type(void)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
}

void phys_runfile_text(phys_runfile *file, const char *object, const char *name, const char *text)
{
    hid_t type = text_type();
    put(file, object, name, type, type, &text);
    H5Tclose(type);
}

static void put_unit(phys_runfile *file, const char *object, const char *name, const char *unit)
{
    char beside[128];
    if (!unit || !*unit)
        return;
    snprintf(beside, sizeof beside, "%s.unit", name);
    phys_runfile_text(file, object, beside, unit);
}

void phys_runfile_number(phys_runfile *file, const char *object, const char *name, double value,
                         const char *unit)
{
    put(file, object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
    put_unit(file, object, name, unit);
}

void phys_runfile_integer(phys_runfile *file, const char *object, const char *name, int64_t value,
                          const char *unit)
{
    put(file, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
    put_unit(file, object, name, unit);
}

const struct ad_error *phys_runfile_error(const phys_runfile *file) { return &file->error; }

enum ad_status phys_runfile_commit(phys_runfile *file, struct ad_error *error)
{
    if (!file)
        return AD_OK;
    if (H5Fclose(file->id) < 0)
        fail_write(file, "close", file->name);
    if (file->error.status == AD_OK)
        phys_seal_write(file->file.temporary, file->name, &file->error);
    enum ad_status status = file->error.status;
    if (status == AD_OK) {
        status = phys_whole_commit(&file->file, error);
    } else {
        ad_fail(error, status, "%s", file->error.message);
        phys_whole_abandon(&file->file);
    }
    handle_free(file);
    return status;
}

void phys_runfile_abandon(phys_runfile *file)
{
    if (!file)
        return;
    H5Fclose(file->id);
    phys_whole_abandon(&file->file);
    handle_free(file);
}

/* ---- reading ---- */

static const char *const kind_names[] = {"folder", "f64", "f32", "integer", "text", "other"};

const char *phys_runfile_kind_name(enum phys_runfile_kind kind) { return kind_names[kind]; }

bool phys_runfile_is(const char *name)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return H5Fis_hdf5(name) > 0;
}

enum ad_status phys_runfile_open(const char *name, phys_runfile **out, struct ad_error *error)
{
    *out = NULL;
    if (phys_seal_check(name, name, error) != AD_OK)
        return AD_E_INPUT;
    phys_runfile *file = handle_new(name, error);
    if (!file)
        return AD_E_MEMORY;
    file->id = H5Fopen(name, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file->id < 0) {
        handle_free(file);
        return access(name, R_OK) != 0
                   ? ad_fail(error, AD_E_INPUT, "%s: cannot be read: %s", name, strerror(errno))
                   : ad_fail(error, AD_E_INPUT, "%s: not an HDF5 file, or damaged: %s", name,
                             last_reason().text);
    }
    *out = file;
    return AD_OK;
}

void phys_runfile_close(phys_runfile *file)
{
    if (!file)
        return;
    H5Fclose(file->id);
    handle_free(file);
}

static enum phys_runfile_kind kind_of(hid_t type)
{
    switch (H5Tget_class(type)) {
    case H5T_FLOAT:
        return H5Tget_size(type) == 4 ? PHYS_RUNFILE_F32 : PHYS_RUNFILE_F64;
    case H5T_INTEGER:
        return PHYS_RUNFILE_INTEGER;
    case H5T_STRING:
        return PHYS_RUNFILE_TEXT;
    default:
        return PHYS_RUNFILE_OTHER;
    }
}

static bool is_number(enum phys_runfile_kind kind)
{
    return kind == PHYS_RUNFILE_F64 || kind == PHYS_RUNFILE_F32 || kind == PHYS_RUNFILE_INTEGER;
}

/* The text of an attribute, to be freed; NULL if it cannot be read. */
static char *read_text(hid_t id)
{
    hid_t stored = H5Aget_type(id), memory = text_type();
    char *text = NULL;
    if (H5Tis_variable_str(stored) > 0) {
        char *owned = NULL;
        H5Tset_cset(memory, H5Tget_cset(stored));
        if (H5Aread(id, memory, &owned) >= 0 && owned) {
            text = strdup(owned);
            H5free_memory(owned);
        }
    } else if ((text = calloc(H5Tget_size(stored) + 1, 1)) && H5Aread(id, stored, text) < 0) {
        free(text);
        text = NULL;
    }
    H5Tclose(memory);
    H5Tclose(stored);
    return text;
}

/* Fills kind and number of an attribute; returns its text, to be freed, where it is one. */
static char *read_attribute(hid_t id, struct phys_runfile_item *item)
{
    hid_t type = H5Aget_type(id), space = H5Aget_space(id);
    char *text = NULL;
    item->kind = H5Sget_simple_extent_npoints(space) == 1 ? kind_of(type) : PHYS_RUNFILE_OTHER;
    if (item->kind == PHYS_RUNFILE_TEXT)
        item->text = text = read_text(id);
    if ((is_number(item->kind) && H5Aread(id, H5T_NATIVE_DOUBLE, &item->number) < 0) ||
        (item->kind == PHYS_RUNFILE_TEXT && !text))
        item->kind = PHYS_RUNFILE_OTHER;
    H5Sclose(space);
    H5Tclose(type);
    return text;
}

/* Kind and shape of a dataset. */
static void describe(hid_t id, struct phys_runfile_item *item)
{
    hid_t type = H5Dget_type(id), space = H5Dget_space(id);
    int rank = H5Sget_simple_extent_ndims(space);
    item->kind = rank >= 0 && rank <= PHYS_RUNFILE_RANK ? kind_of(type) : PHYS_RUNFILE_OTHER;
    if (item->kind != PHYS_RUNFILE_OTHER) {
        hsize_t size[PHYS_RUNFILE_RANK];
        item->rank = (size_t)rank;
        H5Sget_simple_extent_dims(space, size, NULL);
        for (size_t k = 0; k < item->rank; k++)
            item->dims[k] = (size_t)size[k];
    }
    H5Sclose(space);
    H5Tclose(type);
}

struct listing {
    void (*visit)(void *context, const struct phys_runfile_item *item);
    void *context;
    const char *object;
};

static herr_t list_attribute(hid_t object, const char *name, const H5A_info_t *info, void *context)
{
    const struct listing *listing = context;
    (void)info;
    struct phys_runfile_item item = {.object = listing->object, .attribute = name};
    hid_t id = H5Aopen(object, name, H5P_DEFAULT);
    if (id < 0)
        return -1;
    char *text = read_attribute(id, &item);
    listing->visit(listing->context, &item);
    free(text);
    H5Aclose(id);
    return 0;
}

static herr_t list_object(hid_t root, const char *name, const H5O_info_t *info, void *context)
{
    struct listing *listing = context;
    struct phys_runfile_item item = {.object = strcmp(name, ".") == 0 ? "" : name};
    hid_t id = H5Oopen(root, name, H5P_DEFAULT);
    if (id < 0)
        return -1;
    if (info->type == H5O_TYPE_DATASET)
        describe(id, &item);
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
    struct listing listing = {visit, context, ""};
    if (H5Ovisit(file->id, H5_INDEX_NAME, H5_ITER_INC, list_object, &listing) < 0)
        return fail(error, AD_E_INPUT, file->name, "list", "/");
    return AD_OK;
}

static hid_t dataset_open(phys_runfile *file, const char *name, struct phys_runfile_item *item,
                          struct ad_error *error)
{
    *item = (struct phys_runfile_item){.object = name};
    hid_t id = H5Dopen2(file->id, name, H5P_DEFAULT);
    if (id >= 0)
        describe(id, item);
    else
        fail(error, AD_E_INPUT, file->name, "find dataset", name);
    return id;
}

enum ad_status phys_runfile_shape(phys_runfile *file, const char *name,
                                  struct phys_runfile_item *item, struct ad_error *error)
{
    hid_t id = dataset_open(file, name, item, error);
    if (id < 0)
        return AD_E_INPUT;
    H5Dclose(id);
    return AD_OK;
}

static bool select_block(hid_t space, const struct phys_runfile_item *item, const hsize_t first[],
                         const hsize_t count[])
{
    for (size_t k = 0; k < item->rank; k++)
        if (first[k] > item->dims[k] || count[k] > item->dims[k] - first[k])
            return false;
    return H5Sselect_hyperslab(space, H5S_SELECT_SET, first, NULL, count, NULL) >= 0;
}

/* The arrays have the rank of the dataset. */
static enum ad_status read_block(phys_runfile *file, hid_t id, const struct phys_runfile_item *item,
                                 const hsize_t first[], const hsize_t count[], double *values,
                                 struct ad_error *error)
{
    enum ad_status status = AD_OK;
    hid_t space = H5Dget_space(id), memory = H5Screate_simple((int)item->rank, count, NULL);
    if (!select_block(space, item, first, count) ||
        H5Dread(id, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, values) < 0)
        status = fail(error, AD_E_INPUT, file->name, "read", item->object);
    H5Sclose(memory);
    H5Sclose(space);
    return status;
}

static hid_t numbers_open(phys_runfile *file, const char *name, struct phys_runfile_item *item,
                          struct ad_error *error)
{
    hid_t id = dataset_open(file, name, item, error);
    if (id < 0 || (is_number(item->kind) && item->rank > 0))
        return id;
    H5Dclose(id);
    ad_fail(error, AD_E_INPUT, "%s: '%s' is not an array of numbers", file->name, name);
    return H5I_INVALID_HID;
}

enum ad_status phys_runfile_read(phys_runfile *file, const char *name, size_t first, size_t count,
                                 double *values, struct ad_error *error)
{
    struct phys_runfile_item item;
    hid_t id = numbers_open(file, name, &item, error);
    if (id < 0)
        return AD_E_INPUT;
    hsize_t from[PHYS_RUNFILE_RANK] = {first}, size[PHYS_RUNFILE_RANK] = {count};
    for (size_t k = 1; k < item.rank; k++)
        size[k] = item.dims[k];
    enum ad_status status = read_block(file, id, &item, from, size, values, error);
    H5Dclose(id);
    return status;
}

enum ad_status phys_runfile_read_block(phys_runfile *file, const char *name, const size_t first[],
                                       const size_t count[], double *values, struct ad_error *error)
{
    struct phys_runfile_item item;
    hid_t id = numbers_open(file, name, &item, error);
    if (id < 0)
        return AD_E_INPUT;
    hsize_t from[PHYS_RUNFILE_RANK], size[PHYS_RUNFILE_RANK];
    for (size_t k = 0; k < item.rank; k++) {
        from[k] = first[k];
        size[k] = count[k];
    }
    enum ad_status status = read_block(file, id, &item, from, size, values, error);
    H5Dclose(id);
    return status;
}

static enum ad_status get(phys_runfile *file, const char *object, const char *name,
                          struct phys_runfile_item *item, char **text, struct ad_error *error)
{
    *item = (struct phys_runfile_item){.object = object, .attribute = name};
    hid_t id = H5Aopen_by_name(file->id, object, name, H5P_DEFAULT, H5P_DEFAULT);
    if (id < 0)
        return fail(error, AD_E_INPUT, file->name, "find attribute", name);
    *text = read_attribute(id, item);
    H5Aclose(id);
    return AD_OK;
}

enum ad_status phys_runfile_get(phys_runfile *file, const char *object, const char *name,
                                double *value, struct ad_error *error)
{
    struct phys_runfile_item item;
    char *text = NULL;
    enum ad_status status = get(file, object, name, &item, &text, error);
    free(text);
    if (status == AD_OK && !is_number(item.kind))
        return ad_fail(error, AD_E_INPUT, "%s: attribute '%s' is not a number", file->name, name);
    *value = item.number;
    return status;
}

enum ad_status phys_runfile_get_text(phys_runfile *file, const char *object, const char *name,
                                     char **text, struct ad_error *error)
{
    struct phys_runfile_item item;
    *text = NULL;
    enum ad_status status = get(file, object, name, &item, text, error);
    if (status == AD_OK && !*text)
        return ad_fail(error, AD_E_INPUT, "%s: attribute '%s' is not a text", file->name, name);
    return status;
}
