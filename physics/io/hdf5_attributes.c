/* Attributes of an HDF5 file: numbers and texts of its groups and datasets (hdf5_file.h). */
#include "hdf5_handles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Variable length and UTF-8: what h5py reads as str. */
static hid_t text_type(void)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
}

/* ---- writing ---- */

static void put(phys_hdf5 *file, const char *object, const char *name, hid_t file_type, hid_t type,
                const void *value)
{
    if (file->error.status != AD_OK)
        return;
    hid_t space = H5Screate(H5S_SCALAR), utf8 = H5Pcreate(H5P_ATTRIBUTE_CREATE);
    H5Pset_char_encoding(utf8, H5T_CSET_UTF8);
    hid_t id =
        H5Acreate_by_name(file->id, object, name, file_type, space, utf8, H5P_DEFAULT, H5P_DEFAULT);
    bool written = id >= 0 && H5Awrite(id, type, value) >= 0;
    if (!(id >= 0 && H5Aclose(id) >= 0 && written))
        phys_h5_fail_write(file, "write attribute", name);
    H5Pclose(utf8);
    H5Sclose(space);
}

void phys_hdf5_text(phys_hdf5 *file, const char *object, const char *name, const char *text)
{
    PHYS_H5_ALONE;
    hid_t type = text_type();
    put(file, object, name, type, type, &text);
    H5Tclose(type);
}

static void put_unit(phys_hdf5 *file, const char *object, const char *name, const char *unit)
{
    char beside[128];
    if (!unit || !*unit)
        return;
    snprintf(beside, sizeof beside, "%s.unit", name);
    phys_hdf5_text(file, object, beside, unit);
}

void phys_hdf5_number(phys_hdf5 *file, const char *object, const char *name, double value,
                      const char *unit)
{
    PHYS_H5_ALONE;
    put(file, object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
    put_unit(file, object, name, unit);
}

void phys_hdf5_integer(phys_hdf5 *file, const char *object, const char *name, int64_t value,
                       const char *unit)
{
    PHYS_H5_ALONE;
    put(file, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
    put_unit(file, object, name, unit);
}

/* ---- reading ---- */

/* The text of an attribute, to be freed; NULL if it cannot be read. False: out of memory. */
static bool read_text(hid_t id, char **text)
{
    hid_t stored = H5Aget_type(id), memory = text_type();
    bool room = true;
    *text = NULL;
    if (H5Tis_variable_str(stored) > 0) {
        char *owned = NULL;
        H5Tset_cset(memory, H5Tget_cset(stored));
        if (H5Aread(id, memory, &owned) >= 0 && owned) {
            room = (*text = strdup(owned)) != NULL;
            H5free_memory(owned);
        }
    } else if (!(*text = calloc(H5Tget_size(stored) + 1, 1))) {
        room = false;
    } else if (H5Aread(id, stored, *text) < 0) {
        free(*text);
        *text = NULL;
    }
    H5Tclose(memory);
    H5Tclose(stored);
    return room;
}

bool phys_h5_attribute(hid_t id, struct phys_hdf5_item *item, char **text)
{
    hid_t type = H5Aget_type(id), space = H5Aget_space(id);
    bool room = true;
    *text = NULL;
    item->kind = H5Sget_simple_extent_npoints(space) == 1 ? phys_h5_kind(type) : PHYS_HDF5_OTHER;
    if (item->kind == PHYS_HDF5_TEXT)
        room = read_text(id, text);
    item->text = *text;
    if ((phys_h5_is_number(item->kind) && H5Aread(id, H5T_NATIVE_DOUBLE, &item->number) < 0) ||
        (item->kind == PHYS_HDF5_TEXT && !*text))
        item->kind = PHYS_HDF5_OTHER;
    H5Sclose(space);
    H5Tclose(type);
    return room;
}

static enum ad_status get(phys_hdf5 *file, const char *object, const char *name,
                          struct phys_hdf5_item *item, char **text, struct ad_error *error)
{
    *item = (struct phys_hdf5_item){.object = object, .attribute = name};
    hid_t id = H5Aopen_by_name(file->id, object, name, H5P_DEFAULT, H5P_DEFAULT);
    if (id < 0)
        return phys_h5_fail(error, AD_E_INPUT, file->name, "find attribute", name);
    bool room = phys_h5_attribute(id, item, text);
    H5Aclose(id);
    return room ? AD_OK : ad_fail(error, AD_E_MEMORY, "%s: out of memory", file->name);
}

enum ad_status phys_hdf5_get(phys_hdf5 *file, const char *object, const char *name, double *value,
                             struct ad_error *error)
{
    PHYS_H5_ALONE;
    struct phys_hdf5_item item;
    char *text = NULL;
    enum ad_status status = get(file, object, name, &item, &text, error);
    free(text);
    if (status == AD_OK && !phys_h5_is_number(item.kind))
        return ad_fail(error, AD_E_INPUT, "%s: attribute '%s' is not a number", file->name, name);
    *value = item.number;
    return status;
}

enum ad_status phys_hdf5_get_text(phys_hdf5 *file, const char *object, const char *name,
                                  char **text, struct ad_error *error)
{
    PHYS_H5_ALONE;
    struct phys_hdf5_item item;
    *text = NULL;
    enum ad_status status = get(file, object, name, &item, text, error);
    if (status == AD_OK && !*text)
        return ad_fail(error, AD_E_INPUT, "%s: attribute '%s' is not a text", file->name, name);
    return status;
}
