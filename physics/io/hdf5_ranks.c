/* Files written by all ranks (hdf5_file.h): the temporary file of rank 0, closed there, is opened
   on all by parallel HDF5, and later by rank 0 again, which gives it its checksum and its name. */
#include "autodiff/free.h"
#include "hdf5_handles.h"

#include <stdlib.h>
#include <string.h>

static const char *library = AD_LIBRARY_hdf5;
static void *set_parallel; /* H5Pset_fapl_mpio; NULL: HDF5 is not parallel */
static bool (*set_ranks)(void *set, int64_t access);

void *phys_hdf5_load(void **slot, const char *name) { return ad_lazy_load(slot, library, name); }

void phys_hdf5_parallel(const char *parallel, bool (*on_all_ranks)(void *set, int64_t access))
{
    set_parallel = ad_lazy_find(parallel, "H5Pset_fapl_mpio");
    set_ranks = on_all_ranks;
    if (set_parallel)
        library = parallel;
}

static void open_again(phys_hdf5 *file, const char *temporary, bool parallel)
{
    hid_t access = phys_h5_file_access();
    file->id = !parallel || set_ranks(set_parallel, access)
                   ? H5Fopen(temporary, H5F_ACC_RDWR, access)
                   : H5I_INVALID_HID;
    H5Pclose(access);
}

static void close_here(phys_hdf5 *file)
{
    if (file->id >= 0 && H5Fclose(file->id) < 0)
        phys_h5_fail_write(file, "close", file->name);
    file->id = H5I_INVALID_HID;
}

/* Of rank 0: on its own again. */
static void open_alone(phys_hdf5 *file)
{
    open_again(file, file->file.temporary, false);
    if (file->id < 0)
        phys_h5_fail_write(file, "open", file->name);
}

static bool on_all(struct ad_ranks *ranks, bool here, struct ad_error *error)
{
    double least = here;
    return ad_ranks_least(ranks, 1, &least, error) == AD_OK && least == 1;
}

enum ad_status phys_hdf5_share(struct ad_ranks *ranks, phys_hdf5 **file, bool *shared,
                               struct ad_error *error)
{
    PHYS_H5_ALONE;
    char *names = NULL; /* of the temporary file, and of the file */
    size_t bytes = 0;
    const bool writer = !ranks || ranks->rank == 0;
    *shared = false;
    if (!ranks || ranks->count == 1 || !on_all(ranks, set_parallel != NULL, error))
        return error->status;
    if (writer) {
        close_here(*file);
        const char *temporary = (*file)->file.temporary, *name = (*file)->name;
        bytes = strlen(temporary) + strlen(name) + 2;
        if ((names = malloc(bytes)))
            strcpy(stpcpy(names, temporary) + 1, name);
        else
            ad_fail(error, AD_E_MEMORY, "%s: out of memory", name);
    }
    if (ad_ranks_agree(ranks, error) == AD_OK)
        ad_ranks_spread(ranks, 0, (void **)&names, &bytes, error);
    if (error->status == AD_OK && !writer)
        *file = phys_h5_handle_new(names + strlen(names) + 1, error);
    if (ad_ranks_agree(ranks, error) == AD_OK)
        open_again(*file, names, true);
    *shared = on_all(ranks, *file && (*file)->id >= 0, error);
    if (!*shared && *file)
        close_here(*file);
    if (!*shared && writer)
        open_alone(*file);
    if (!*shared && !writer && *file) {
        phys_h5_handle_free(*file);
        *file = NULL;
    }
    free(names);
    return error->status;
}

enum ad_status phys_hdf5_unshare(struct ad_ranks *ranks, phys_hdf5 **file, struct ad_error *error)
{
    PHYS_H5_ALONE;
    close_here(*file);
    if (error->status == AD_OK && (*file)->error.status != AD_OK)
        ad_fail(error, (*file)->error.status, "%s", (*file)->error.message);
    if (ranks->rank == 0) {
        open_alone(*file);
    } else {
        phys_h5_handle_free(*file);
        *file = NULL;
    }
    return ad_ranks_agree(ranks, error);
}
