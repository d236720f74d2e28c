/* What the files runfile*.c share. They alone call HDF5, and they alone include this. */
#ifndef PHYSICS_RUNFILE_H5_H
#define PHYSICS_RUNFILE_H5_H

#define H5_USE_110_API /* one spelling of H5Ovisit in every version since 1.10 */
#include "hdf5_file.h"
#include "atomic_file.h"

#include <hdf5.h>

struct phys_hdf5 {
    hid_t id;
    char *name;                   /* as the user wrote it, for messages */
    struct phys_atomic_file file; /* when writing */
    struct ad_error error;        /* first failure of writing */
};

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

#endif
