/* Run files and checkpoints: HDF5, readable with h5py, written atomically, without timestamps
   (equal runs give equal bytes), and preceded by a checksum of the file (checksum.h), so that a
   damaged one is refused before HDF5 reads it.

   Errors of writing are sticky, as those of a tape: the first one is kept, later calls do nothing,
   and commit returns it. Names are paths inside the file ("parameters", "history/action"); missing
   groups are created. One handle is used by one thread at a time; calls on several wait for each
   other. HDF5's own error messages are switched off for the thread that opens a file. */
#ifndef PHYSICS_IO_HDF5_FILE_H
#define PHYSICS_IO_HDF5_FILE_H

#include "autodiff/autodiff.h"
#include "autodiff/ranks.h"

AD_HEADER_BEGIN

enum { PHYS_HDF5_RANK = 4 }; /* dimensions at most */

typedef struct phys_hdf5 phys_hdf5;

/* ---- writing ---- */

/* Starts a file for `target`, to be ended by phys_hdf5_commit or phys_hdf5_abandon. AD_E_IO for an
   unwritable target. */
enum ad_status phys_hdf5_create(const char *target, phys_hdf5 **file, struct ad_error *error);
/* An n-dimensional dataset at once: values [dims[0] x ... x dims[rank-1]] of the element type. */
void phys_hdf5_write(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                     const size_t dims[], const void *values);
/* A dataset of that shape, filled by phys_hdf5_put: records first ... first + n - 1 [n x dims[1] x
   ... x dims[rank-1]]. */
void phys_hdf5_blank(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                     const size_t dims[]);
void phys_hdf5_put(phys_hdf5 *file, const char *name, size_t first, size_t n, const void *records);
/* A dataset that grows along its first dimension: dims[0] is ignored, 0 records so far. */
void phys_hdf5_extendable(phys_hdf5 *file, const char *name, enum ad_type type, size_t rank,
                          const size_t dims[]);
/* Appends one record [dims[1] x ... x dims[rank-1]], or n of them, to an extendable dataset. */
void phys_hdf5_append(phys_hdf5 *file, const char *name, const void *record);
void phys_hdf5_append_all(phys_hdf5 *file, const char *name, size_t n, const void *records);
/* A folder; needed only where it carries attributes. */
void phys_hdf5_folder(phys_hdf5 *file, const char *name);
/* Attributes of a dataset or folder ("/": of the file). A unit (may be NULL) goes beside the number
   as the attribute NAME.unit. */
void phys_hdf5_text(phys_hdf5 *file, const char *object, const char *name, const char *text);
void phys_hdf5_number(phys_hdf5 *file, const char *object, const char *name, double value,
                      const char *unit);
void phys_hdf5_integer(phys_hdf5 *file, const char *object, const char *name, int64_t value,
                       const char *unit);
/* Closes, syncs and renames to the target, and frees the handle, whatever happens; after an earlier
   failure nothing is left behind. NULL: nothing to do. */
enum ad_status phys_hdf5_commit(phys_hdf5 *file, struct ad_error *error);
/* Drops what was written, and the handle. NULL: nothing to do. */
void phys_hdf5_abandon(phys_hdf5 *file);

/* ---- writing by all ranks (hdf5_ranks.c) ---- */

/* From now on HDF5 is this library, which must be a parallel one, else nothing changes; before any
   other call. on_all_ranks (H5Pset_fapl_mpio, access) gives a list for access to files (hid_t) the
   communicator of all ranks. */
void phys_hdf5_parallel(const char *library, bool (*on_all_ranks)(void *set, int64_t access));
/* Opens the file that rank 0 writes, *file, NULL on the others, on all of them, which then call
   phys_hdf5_put alone. Where that cannot be, as HDF5 is not parallel or the file system not one
   that all see: *shared is false, and the file open on rank 0 alone, as before. */
enum ad_status phys_hdf5_share(struct ad_ranks *ranks, phys_hdf5 **file, bool *shared,
                               struct ad_error *error);
/* Back to rank 0 alone; *file becomes NULL on the others. A failure of writing of any rank. */
enum ad_status phys_hdf5_unshare(struct ad_ranks *ranks, phys_hdf5 **file, struct ad_error *error);

/* ---- reading ---- */

enum phys_hdf5_kind {
    PHYS_HDF5_FOLDER,
    PHYS_HDF5_F64, /* dataset or attribute of numbers (f64, f32, or integers) ... */
    PHYS_HDF5_F32,
    PHYS_HDF5_INTEGER,
    PHYS_HDF5_TEXT,
    PHYS_HDF5_OTHER /* what this library does not write */
};
/* "folder", "f64", ... */
const char *phys_hdf5_kind_name(enum phys_hdf5_kind kind);

/* One thing in a file: a folder, a dataset, or an attribute of one of these. */
struct phys_hdf5_item {
    const char *object;    /* path of the folder or dataset, without a leading slash; "" the file */
    const char *attribute; /* NULL: the object itself */
    enum phys_hdf5_kind kind;
    size_t rank, dims[PHYS_HDF5_RANK]; /* of a dataset */
    double number;                     /* of an attribute that is one number */
    const char *text;                  /* of an attribute that is a text */
};

/* The file is HDF5, damaged or not, as far as its first bytes tell. Not for pipes. */
bool phys_hdf5_is(const char *name);
/* AD_E_INPUT too for a file that leads out of itself, by external links, external or virtual
   storage, or filters that are not built in. */
enum ad_status phys_hdf5_open(const char *name, phys_hdf5 **file, struct ad_error *error);
/* Calls `visit` for everything in the file in the order of names, each object before its
   attributes, the file's own first. Strings live for the call only. */
enum ad_status phys_hdf5_list(phys_hdf5 *file,
                              void (*visit)(void *context, const struct phys_hdf5_item *item),
                              void *context, struct ad_error *error);
/* Kind and shape of a dataset; AD_E_INPUT if there is none of that name. */
enum ad_status phys_hdf5_shape(phys_hdf5 *file, const char *name, struct phys_hdf5_item *item,
                               struct ad_error *error);
/* Records first .. first+count-1 along the first dimension of a dataset of numbers, as doubles. */
enum ad_status phys_hdf5_read(phys_hdf5 *file, const char *name, size_t first, size_t count,
                              double *values, struct ad_error *error);
/* The block first[k] ... first[k]+count[k]-1 along every dimension k of a dataset of numbers. */
enum ad_status phys_hdf5_read_block(phys_hdf5 *file, const char *name, const size_t first[],
                                    const size_t count[], double *values, struct ad_error *error);
/* One attribute that is a number; AD_E_INPUT if there is none. */
enum ad_status phys_hdf5_get(phys_hdf5 *file, const char *object, const char *name, double *value,
                             struct ad_error *error);
/* One attribute that is a text, which the caller frees; AD_E_INPUT if there is none. */
enum ad_status phys_hdf5_get_text(phys_hdf5 *file, const char *object, const char *name,
                                  char **text, struct ad_error *error);
void phys_hdf5_close(phys_hdf5 *file); /* takes NULL */
/* Name of the file that was opened last for reading, until it is closed; NULL: none. It is for
   handlers of signals: HDF5 crashes on some damaged files. */
const char *phys_hdf5_reading(void);

AD_HEADER_END
#endif
