/* Walk over all objects of an HDF5 file: each once, by name, a group before its contents. */
#ifndef PHYSICS_IO_HDF5_WALK_H
#define PHYSICS_IO_HDF5_WALK_H

#include "hdf5_handles.h"

/* Calls `visit`, where there is one, with the open object and its path, which ends with the call;
   below 0 ends the walk. The file is refused (AD_E_INPUT) where it leads out of itself: by external
   or user-defined links, external or virtual storage, or filters that are not built in. Time and
   memory are linear in objects and their names: nothing is opened by a path from the root. */
enum ad_status phys_h5_walk(phys_hdf5 *file,
                            int (*visit)(void *context, hid_t object, H5O_type_t type,
                                         const char *path),
                            void *context, struct ad_error *error);

#endif
