/* Internals shared by the files hdf5_*.c, the only ones that call HDF5. */
#ifndef PHYSICS_IO_HDF5_HANDLES_H
#define PHYSICS_IO_HDF5_HANDLES_H

#define H5_USE_110_API /* one spelling of H5Ovisit in every version since 1.10 */
#include "hdf5_file.h"
#include "atomic_file.h"
#include "autodiff/lazy.h"

#include <hdf5.h>

/* All of HDF5 that is called; what is missing here is missing when the library is linked. */
void *phys_hdf5_load(void **slot, const char *name);
#define H5Aclose AD_LAZY(phys_hdf5_load, H5Aclose)
#define H5Acreate_by_name AD_LAZY(phys_hdf5_load, H5Acreate_by_name)
#define H5Aget_space AD_LAZY(phys_hdf5_load, H5Aget_space)
#define H5Aget_type AD_LAZY(phys_hdf5_load, H5Aget_type)
#define H5Aiterate2 AD_LAZY(phys_hdf5_load, H5Aiterate2)
#define H5Aopen AD_LAZY(phys_hdf5_load, H5Aopen)
#define H5Aopen_by_name AD_LAZY(phys_hdf5_load, H5Aopen_by_name)
#define H5Aread AD_LAZY(phys_hdf5_load, H5Aread)
#define H5Awrite AD_LAZY(phys_hdf5_load, H5Awrite)
#define H5Dclose AD_LAZY(phys_hdf5_load, H5Dclose)
#define H5Dcreate2 AD_LAZY(phys_hdf5_load, H5Dcreate2)
#define H5Dget_create_plist AD_LAZY(phys_hdf5_load, H5Dget_create_plist)
#define H5Dget_space AD_LAZY(phys_hdf5_load, H5Dget_space)
#define H5Dget_type AD_LAZY(phys_hdf5_load, H5Dget_type)
#define H5Dopen2 AD_LAZY(phys_hdf5_load, H5Dopen2)
#define H5Dread AD_LAZY(phys_hdf5_load, H5Dread)
#define H5Dset_extent AD_LAZY(phys_hdf5_load, H5Dset_extent)
#define H5Dwrite AD_LAZY(phys_hdf5_load, H5Dwrite)
#define H5Eclear2 AD_LAZY(phys_hdf5_load, H5Eclear2)
#define H5Eset_auto2 AD_LAZY(phys_hdf5_load, H5Eset_auto2)
#define H5Ewalk2 AD_LAZY(phys_hdf5_load, H5Ewalk2)
#define H5Fclose AD_LAZY(phys_hdf5_load, H5Fclose)
#define H5Fcreate AD_LAZY(phys_hdf5_load, H5Fcreate)
#define H5Fis_hdf5 AD_LAZY(phys_hdf5_load, H5Fis_hdf5)
#define H5Fopen AD_LAZY(phys_hdf5_load, H5Fopen)
#define H5Gclose AD_LAZY(phys_hdf5_load, H5Gclose)
#define H5Gcreate2 AD_LAZY(phys_hdf5_load, H5Gcreate2)
#define H5Literate AD_LAZY(phys_hdf5_load, H5Literate)
#define H5Oclose AD_LAZY(phys_hdf5_load, H5Oclose)
#define H5Oget_info AD_LAZY(phys_hdf5_load, H5Oget_info)
#define H5Oopen AD_LAZY(phys_hdf5_load, H5Oopen)
#define H5Oopen_by_addr AD_LAZY(phys_hdf5_load, H5Oopen_by_addr)
#define H5PLset_loading_state AD_LAZY(phys_hdf5_load, H5PLset_loading_state)
#define H5P_CLS_ATTRIBUTE_CREATE_ID_g (*AD_LAZY(phys_hdf5_load, H5P_CLS_ATTRIBUTE_CREATE_ID_g))
#define H5P_CLS_DATASET_CREATE_ID_g (*AD_LAZY(phys_hdf5_load, H5P_CLS_DATASET_CREATE_ID_g))
#define H5P_CLS_FILE_ACCESS_ID_g (*AD_LAZY(phys_hdf5_load, H5P_CLS_FILE_ACCESS_ID_g))
#define H5P_CLS_FILE_CREATE_ID_g (*AD_LAZY(phys_hdf5_load, H5P_CLS_FILE_CREATE_ID_g))
#define H5P_CLS_LINK_CREATE_ID_g (*AD_LAZY(phys_hdf5_load, H5P_CLS_LINK_CREATE_ID_g))
#define H5Pclose AD_LAZY(phys_hdf5_load, H5Pclose)
#define H5Pcreate AD_LAZY(phys_hdf5_load, H5Pcreate)
#define H5Pget_external_count AD_LAZY(phys_hdf5_load, H5Pget_external_count)
#define H5Pget_filter2 AD_LAZY(phys_hdf5_load, H5Pget_filter2)
#define H5Pget_layout AD_LAZY(phys_hdf5_load, H5Pget_layout)
#define H5Pget_nfilters AD_LAZY(phys_hdf5_load, H5Pget_nfilters)
#define H5Pset_alloc_time AD_LAZY(phys_hdf5_load, H5Pset_alloc_time)
#define H5Pset_char_encoding AD_LAZY(phys_hdf5_load, H5Pset_char_encoding)
#define H5Pset_chunk AD_LAZY(phys_hdf5_load, H5Pset_chunk)
#define H5Pset_create_intermediate_group AD_LAZY(phys_hdf5_load, H5Pset_create_intermediate_group)
#define H5Pset_file_locking AD_LAZY(phys_hdf5_load, H5Pset_file_locking)
#define H5Pset_fill_time AD_LAZY(phys_hdf5_load, H5Pset_fill_time)
#define H5Pset_obj_track_times AD_LAZY(phys_hdf5_load, H5Pset_obj_track_times)
#define H5Pset_userblock AD_LAZY(phys_hdf5_load, H5Pset_userblock)
#define H5Sclose AD_LAZY(phys_hdf5_load, H5Sclose)
#define H5Screate AD_LAZY(phys_hdf5_load, H5Screate)
#define H5Screate_simple AD_LAZY(phys_hdf5_load, H5Screate_simple)
#define H5Sget_simple_extent_dims AD_LAZY(phys_hdf5_load, H5Sget_simple_extent_dims)
#define H5Sget_simple_extent_ndims AD_LAZY(phys_hdf5_load, H5Sget_simple_extent_ndims)
#define H5Sget_simple_extent_npoints AD_LAZY(phys_hdf5_load, H5Sget_simple_extent_npoints)
#define H5Sselect_hyperslab AD_LAZY(phys_hdf5_load, H5Sselect_hyperslab)
#define H5T_C_S1_g (*AD_LAZY(phys_hdf5_load, H5T_C_S1_g))
#define H5T_IEEE_F32LE_g (*AD_LAZY(phys_hdf5_load, H5T_IEEE_F32LE_g))
#define H5T_IEEE_F64LE_g (*AD_LAZY(phys_hdf5_load, H5T_IEEE_F64LE_g))
#define H5T_NATIVE_DOUBLE_g (*AD_LAZY(phys_hdf5_load, H5T_NATIVE_DOUBLE_g))
#define H5T_NATIVE_FLOAT_g (*AD_LAZY(phys_hdf5_load, H5T_NATIVE_FLOAT_g))
#define H5T_NATIVE_INT64_g (*AD_LAZY(phys_hdf5_load, H5T_NATIVE_INT64_g))
#define H5T_STD_I64LE_g (*AD_LAZY(phys_hdf5_load, H5T_STD_I64LE_g))
#define H5Tclose AD_LAZY(phys_hdf5_load, H5Tclose)
#define H5Tcopy AD_LAZY(phys_hdf5_load, H5Tcopy)
#define H5Tget_class AD_LAZY(phys_hdf5_load, H5Tget_class)
#define H5Tget_cset AD_LAZY(phys_hdf5_load, H5Tget_cset)
#define H5Tget_native_type AD_LAZY(phys_hdf5_load, H5Tget_native_type)
#define H5Tget_size AD_LAZY(phys_hdf5_load, H5Tget_size)
#define H5Tis_variable_str AD_LAZY(phys_hdf5_load, H5Tis_variable_str)
#define H5Tset_cset AD_LAZY(phys_hdf5_load, H5Tset_cset)
#define H5Tset_size AD_LAZY(phys_hdf5_load, H5Tset_size)
#define H5check_version AD_LAZY(phys_hdf5_load, H5check_version)
#define H5dont_atexit AD_LAZY(phys_hdf5_load, H5dont_atexit)
#define H5free_memory AD_LAZY(phys_hdf5_load, H5free_memory)
#define H5open AD_LAZY(phys_hdf5_load, H5open)

struct phys_hdf5 {
    hid_t id;
    char *name;                   /* as the user wrote it, for messages */
    struct phys_atomic_file file; /* when writing */
    struct ad_error error;        /* first failure of writing */
};

/* In each function of hdf5_file.h: HDF5, as distributions build it, is not thread-safe, so that
   calls wait for each other. A function may call another one. */
#define PHYS_H5_ALONE int alone __attribute__((cleanup(phys_h5_leave), unused)) = phys_h5_enter()
int phys_h5_enter(void);
void phys_h5_leave(int *alone);

/* A handle without a file; AD_E_MEMORY. Frees it. */
phys_hdf5 *phys_h5_handle_new(const char *name, struct ad_error *error);
void phys_h5_handle_free(phys_hdf5 *file);
/* Property list of a file that is locked already, being a temporary one of ours. */
hid_t phys_h5_file_access(void);

/* "FILE: cannot WHAT 'ITEM': " and HDF5's innermost reason for its last failure; returns status. */
enum ad_status phys_h5_fail(struct ad_error *error, enum ad_status status, const char *file,
                            const char *what, const char *item);
/* The same as AD_E_IO, kept in the handle unless it already holds a failure. */
void phys_h5_fail_write(phys_hdf5 *file, const char *what, const char *item);

/* What a run file calls values of this type. */
enum phys_hdf5_kind phys_h5_kind(hid_t type);
bool phys_h5_is_number(enum phys_hdf5_kind kind);

/* Kind and shape of a dataset. */
void phys_h5_describe(hid_t dataset, struct phys_hdf5_item *item);
/* Fills kind and number of an attribute, and its text, to be freed, where it is one, NULL else.
   False: out of memory. */
bool phys_h5_attribute(hid_t attribute, struct phys_hdf5_item *item, char **text);

/* Walks over all objects of a file (hdf5_walk.c): each once, by name, a group before its contents.
   Calls `visit`, where there is one, with the open object and its path, which ends with the call;
   below 0 ends the walk. The file is refused (AD_E_INPUT) where it leads out of itself: by external
   or user-defined links, external or virtual storage, or filters that are not built in. Time and
   memory are linear in objects and their names: nothing is opened by a path from the root. */
enum ad_status phys_h5_walk(phys_hdf5 *file,
                            int (*visit)(void *context, hid_t object, H5O_type_t type,
                                         const char *path),
                            void *context, struct ad_error *error);

#endif
