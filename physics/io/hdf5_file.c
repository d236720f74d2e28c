/* HDF5 files (hdf5_file.h): opening, closing, and HDF5's reasons for failures. Only the files
   hdf5_*.c call HDF5. Each function closes the handles that it opened; H5Xclose of an invalid
   handle is avoided, because it would replace the first reason. */
#include "autodiff/free.h"
#include "hdf5_handles.h"
#include "checksum.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char *_Atomic reading;

const char *phys_hdf5_reading(void) { return atomic_load(&reading); }

/* ---- one call at a time ---- */

static pthread_mutex_t one_call;
static pthread_once_t once = PTHREAD_ONCE_INIT;

static void make_alone(void)
{
    pthread_mutexattr_t recursive;
    pthread_mutexattr_init(&recursive);
    pthread_mutexattr_settype(&recursive, PTHREAD_MUTEX_RECURSIVE);
    pthread_mutex_init(&one_call, &recursive);
    pthread_mutexattr_destroy(&recursive);
}

int phys_h5_enter(void)
{
    pthread_once(&once, make_alone);
    return pthread_mutex_lock(&one_call);
}

void phys_h5_leave(int *entered)
{
    if (*entered == 0)
        pthread_mutex_unlock(&one_call);
}

/* ---- errors ---- */

/* HDF5's innermost reason for its last failure. */
struct reason {
    char text[160];
};

/* After a failed system call HDF5 prints the time, the file and more around "error message =
   '...'". */
static herr_t innermost(unsigned depth, const H5E_error2_t *entry, void *reason)
{
    static const char before[] = "error message = '";
    const char *system = entry->desc ? strstr(entry->desc, before) : NULL;
    const char *text = system ? system + sizeof before - 1 : entry->desc;
    if (depth == 0 && text)
        snprintf(((struct reason *)reason)->text, sizeof(struct reason), "%.*s",
                 (int)strcspn(text, system ? "'" : "\n"), text);
    return 0;
}

static struct reason last_reason(void)
{
    struct reason reason = {"HDF5 gives no reason"};
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, &reason);
    H5Eclear2(H5E_DEFAULT);
    return reason;
}

enum ad_status phys_h5_fail(struct ad_error *error, enum ad_status status, const char *file,
                            const char *what, const char *item)
{
    return ad_fail(error, status, "%s: cannot %s '%s': %s", file, what, item, last_reason().text);
}

void phys_h5_fail_write(phys_hdf5 *file, const char *what, const char *item)
{
    phys_h5_fail(&file->error, AD_E_IO, file->name, what, item);
}

/* Called before everything else. At exit HDF5 would write again to a file that could not be closed,
   and crash. Filters named in a file are never loaded as plugins. */
static void start_hdf5(void)
{
    H5dont_atexit();
    H5PLset_loading_state(0);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

phys_hdf5 *phys_h5_handle_new(const char *name, struct ad_error *error)
{
    start_hdf5();
    phys_hdf5 *file = calloc(1, sizeof *file);
    if (file && !(file->name = strdup(name))) {
        free(file);
        file = NULL;
    }
    if (!file)
        ad_fail(error, AD_E_MEMORY, "%s: out of memory", name);
    return file;
}

void phys_h5_handle_free(phys_hdf5 *file)
{
    char *mine = file->name;
    atomic_compare_exchange_strong(&reading, &mine, NULL);
    AD_FREE(file->name, file);
}

/* ---- writing ---- */

hid_t phys_h5_file_access(void)
{
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
#if H5_VERSION_GE(1, 12, 1) || (H5_VERS_MINOR == 10 && H5_VERS_RELEASE >= 7)
    H5Pset_file_locking(access, false, true);
#else
    setenv("HDF5_USE_FILE_LOCKING", "FALSE", 1);
#endif
    return access;
}

enum ad_status phys_hdf5_create(const char *target, phys_hdf5 **out, struct ad_error *error)
{
    PHYS_H5_ALONE;
    *out = NULL;
    phys_hdf5 *file = phys_h5_handle_new(target, error);
    if (!file)
        return AD_E_MEMORY;
    enum ad_status status = phys_atomic_file_begin(&file->file, target, error);
    if (status == AD_OK) {
        hid_t sealed = H5Pcreate(H5P_FILE_CREATE);
        H5Pset_userblock(sealed, PHYS_CHECKSUM_BYTES);
        hid_t access = phys_h5_file_access();
        file->id = H5Fcreate(file->file.temporary, H5F_ACC_TRUNC, sealed, access);
        H5Pclose(access);
        if (file->id < 0) {
            status = phys_h5_fail(error, AD_E_IO, target, "create", target);
            phys_atomic_file_abandon(&file->file);
        }
        H5Pclose(sealed);
    }
    if (status == AD_OK)
        *out = file;
    else
        phys_h5_handle_free(file);
    return status;
}

enum ad_status phys_hdf5_commit(phys_hdf5 *file, struct ad_error *error)
{
    PHYS_H5_ALONE;
    if (!file)
        return AD_OK;
    if (H5Fclose(file->id) < 0)
        phys_h5_fail_write(file, "close", file->name);
    if (file->error.status == AD_OK)
        phys_checksum_write(file->file.temporary, file->name, &file->error);
    enum ad_status status = file->error.status;
    if (status == AD_OK) {
        status = phys_atomic_file_commit(&file->file, error);
    } else {
        ad_fail(error, status, "%s", file->error.message);
        phys_atomic_file_abandon(&file->file);
    }
    phys_h5_handle_free(file);
    return status;
}

void phys_hdf5_abandon(phys_hdf5 *file)
{
    PHYS_H5_ALONE;
    if (!file)
        return;
    H5Fclose(file->id);
    phys_atomic_file_abandon(&file->file);
    phys_h5_handle_free(file);
}

/* ---- reading ---- */

bool phys_hdf5_is(const char *name)
{
    PHYS_H5_ALONE;
    start_hdf5();
    return H5Fis_hdf5(name) > 0;
}

enum ad_status phys_hdf5_open(const char *name, phys_hdf5 **out, struct ad_error *error)
{
    PHYS_H5_ALONE;
    *out = NULL;
    if (phys_checksum_check(name, name, error) != AD_OK)
        return AD_E_INPUT;
    phys_hdf5 *file = phys_h5_handle_new(name, error);
    if (!file)
        return AD_E_MEMORY;
    atomic_store(&reading, file->name);
    file->id = H5Fopen(name, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file->id < 0) {
        phys_h5_handle_free(file);
        return access(name, R_OK) != 0
                   ? ad_fail(error, AD_E_INPUT, "%s: cannot be read: %s; expected an HDF5 file",
                             name, strerror(errno))
                   : ad_fail(error, AD_E_INPUT, "%s: not an HDF5 file, or damaged: %s", name,
                             last_reason().text);
    }
    if (phys_h5_walk(file, NULL, NULL, error) != AD_OK) {
        phys_hdf5_close(file);
        return error->status;
    }
    *out = file;
    return AD_OK;
}

void phys_hdf5_close(phys_hdf5 *file)
{
    PHYS_H5_ALONE;
    if (!file)
        return;
    H5Fclose(file->id);
    phys_h5_handle_free(file);
}

/* ---- kinds ---- */

static const char *const kind_names[] = {"folder", "f64", "f32", "integer", "text", "other"};

const char *phys_hdf5_kind_name(enum phys_hdf5_kind kind) { return kind_names[kind]; }

enum phys_hdf5_kind phys_h5_kind(hid_t type)
{
    switch (H5Tget_class(type)) {
    case H5T_FLOAT:
        return H5Tget_size(type) == 4 ? PHYS_HDF5_F32 : PHYS_HDF5_F64;
    case H5T_INTEGER:
        return PHYS_HDF5_INTEGER;
    case H5T_STRING:
        return PHYS_HDF5_TEXT;
    default:
        return PHYS_HDF5_OTHER;
    }
}

bool phys_h5_is_number(enum phys_hdf5_kind kind)
{
    return kind == PHYS_HDF5_F64 || kind == PHYS_HDF5_F32 || kind == PHYS_HDF5_INTEGER;
}
