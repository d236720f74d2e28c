/* Walks all objects of an HDF5 file (hdf5_handles.h), depth first with an explicit stack, so that
   deep groups and circular links are harmless. */
#include "hdf5_handles.h"
#include "autodiff/free.h"
#include "grow.h"

#include <search.h>
#include <stdlib.h>
#include <string.h>

struct link {
    char *name;
    haddr_t address;
};

/* A group whose links are being followed. */
struct level {
    struct link *link;
    size_t n, next;
    size_t path; /* length of the group's own path */
};

struct walk {
    phys_hdf5 *file;
    int (*visit)(void *context, hid_t object, H5O_type_t type, const char *path);
    void *context;
    struct level *level;
    size_t n;
    char *path;
    size_t path_room;
    void *met; /* tree of the addresses of objects with several names */
    struct ad_error *error;
};

static bool out_of_memory(struct walk *w)
{
    ad_fail(w->error, AD_E_MEMORY, "%s: out of memory", w->file->name);
    return false;
}

static bool leads_out(struct walk *w, const char *name, const char *what)
{
    size_t group = w->n > 0 ? w->level[w->n - 1].path : 0;
    ad_fail(w->error, AD_E_INPUT, "%s: '%.*s/%.80s' %s; expected all data in the file itself",
            w->file->name, group < 80 ? (int)group : 80, w->path, name, what);
    return false;
}

/* ---- refused links and storage ---- */

static bool is_built_in(H5Z_filter_t filter)
{
    return filter == H5Z_FILTER_DEFLATE || filter == H5Z_FILTER_SHUFFLE ||
           filter == H5Z_FILTER_FLETCHER32 || filter == H5Z_FILTER_SZIP ||
           filter == H5Z_FILTER_NBIT || filter == H5Z_FILTER_SCALEOFFSET;
}

/* Why the storage of a dataset is refused; NULL: it is not. */
static const char *flaw_of(hid_t dataset)
{
    hid_t storage = H5Dget_create_plist(dataset);
    if (storage < 0)
        return "cannot be looked at";
    const char *flaw = H5Pget_layout(storage) == H5D_VIRTUAL ? "is a virtual dataset"
                       : H5Pget_external_count(storage) != 0 ? "has external storage"
                                                             : NULL;
    int filters = H5Pget_nfilters(storage);
    for (int k = 0; k < filters && !flaw; k++) {
        unsigned flags, config;
        size_t none = 0;
        if (!is_built_in(
                H5Pget_filter2(storage, (unsigned)k, &flags, &none, NULL, 0, NULL, &config)))
            flaw = "has a filter that is not built in";
    }
    H5Pclose(storage);
    return flaw;
}

/* ---- groups ---- */

static herr_t add_link(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
    struct walk *w = context;
    struct level *level = &w->level[w->n - 1];
    (void)group;
    if (info->type == H5L_TYPE_SOFT) /* a link to an object that has another name here */
        return 0;
    if (info->type != H5L_TYPE_HARD)
        return leads_out(w, name, "is an external link") - 1;
    if (!phys_grow(&level->link, level->n, sizeof *level->link))
        return out_of_memory(w) - 1;
    struct link *link = &level->link[level->n];
    *link = (struct link){strdup(name), info->u.address};
    if (!link->name)
        return out_of_memory(w) - 1;
    level->n++;
    return 0;
}

static void leave(struct walk *w)
{
    struct level *level = &w->level[--w->n];
    for (size_t k = 0; k < level->n; k++)
        free(level->link[k].name);
    free(level->link);
}

static bool enter(struct walk *w, hid_t group)
{
    if (!phys_grow(&w->level, w->n, sizeof *w->level))
        return out_of_memory(w);
    w->level[w->n++] = (struct level){.path = strlen(w->path)};
    if (H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, add_link, w) >= 0)
        return true;
    if (w->error->status == AD_OK)
        phys_h5_fail(w->error, AD_E_INPUT, w->file->name, "list", w->path);
    return false;
}

/* ---- objects ---- */

static int by_address(const void *a, const void *b)
{
    const haddr_t *p = a, *q = b;
    return (*p > *q) - (*p < *q);
}

/* Whether an object with several names was met before; keeps it. */
static bool is_met(struct walk *w, const H5O_info_t *info)
{
    if (info->rc < 2)
        return false;
    haddr_t *address = malloc(sizeof *address), **found;
    if (!address)
        return !out_of_memory(w);
    *address = info->addr;
    found = tsearch(address, &w->met, by_address);
    if (found && *found == address)
        return false;
    free(address);
    return found ? true : !out_of_memory(w);
}

static bool look_at(struct walk *w, hid_t object)
{
    H5O_info_t info;
    if (H5Oget_info(object, &info) < 0) {
        phys_h5_fail(w->error, AD_E_INPUT, w->file->name, "look at", w->path);
        return false;
    }
    if (is_met(w, &info))
        return true;
    if (w->error->status != AD_OK)
        return false;
    const char *flaw = info.type == H5O_TYPE_DATASET ? flaw_of(object) : NULL;
    if (flaw) {
        ad_fail(w->error, AD_E_INPUT, "%s: '%.160s' %s; expected all data in the file itself",
                w->file->name, w->path, flaw);
        return false;
    }
    if (w->visit && w->visit(w->context, object, info.type, w->path) < 0) {
        if (w->error->status == AD_OK)
            phys_h5_fail(w->error, AD_E_INPUT, w->file->name, "list", w->path);
        return false;
    }
    return info.type != H5O_TYPE_GROUP || enter(w, object);
}

/* The object of a link, by its address. */
static bool follow(struct walk *w, const struct level *level, const struct link *link)
{
    size_t length = level->path + strlen(link->name) + 2;
    if (length > w->path_room) {
        char *grown = realloc(w->path, 2 * length);
        if (!grown)
            return out_of_memory(w);
        w->path = grown;
        w->path_room = 2 * length;
    }
    char *end = w->path + level->path;
    if (level->path > 0)
        *end++ = '/';
    strcpy(end, link->name);
    hid_t object = H5Oopen_by_addr(w->file->id, link->address);
    if (object < 0) {
        phys_h5_fail(w->error, AD_E_INPUT, w->file->name, "open", w->path);
        return false;
    }
    bool done = look_at(w, object);
    H5Oclose(object);
    return done;
}

static void forget_met(struct walk *w)
{
    while (w->met) {
        haddr_t *address = *(haddr_t **)w->met;
        tdelete(address, &w->met, by_address);
        free(address);
    }
}

enum ad_status phys_h5_walk(phys_hdf5 *file,
                            int (*visit)(void *context, hid_t object, H5O_type_t type,
                                         const char *path),
                            void *context, struct ad_error *error)
{
    struct walk w = {.file = file, .visit = visit, .context = context, .error = error};
    hid_t root = H5Oopen(file->id, "/", H5P_DEFAULT);
    w.path = calloc(1, 1);
    w.path_room = 1;
    bool right = w.path ? root >= 0 && look_at(&w, root) : out_of_memory(&w);
    while (right && w.n > 0) {
        struct level *level = &w.level[w.n - 1];
        if (level->next < level->n)
            right = follow(&w, level, &level->link[level->next++]);
        else
            leave(&w);
    }
    if (root < 0)
        phys_h5_fail(error, AD_E_INPUT, file->name, "open", "/");
    else
        H5Oclose(root);
    while (w.n > 0)
        leave(&w);
    forget_met(&w);
    AD_FREE(w.level, w.path);
    return error->status;
}
