/* Reads and writes frames in HDF5: our files, and any array [trajectory, time, height, width]. */
#include "frames.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name, *unit;
    size_t offset;
} rod_number[] = {
    {"gravity", "m/s^2", offsetof(struct hnn_rod, gravity)},
    {"mass", "kg", offsetof(struct hnn_rod, mass)},
    {"length", "m", offsetof(struct hnn_rod, length)},
    {"dt", "s", offsetof(struct hnn_rod, dt)},
    {"radius", "m", offsetof(struct hnn_rod, radius)},
    {"axle", "m", offsetof(struct hnn_rod, axle)},
    {"shade", "1", offsetof(struct hnn_rod, shade)},
    {"left", "m", offsetof(struct hnn_rod, left)},
    {"right", "m", offsetof(struct hnn_rod, right)},
    {"bottom", "m", offsetof(struct hnn_rod, bottom)},
    {"top", "m", offsetof(struct hnn_rod, top)},
};

static double *number_of(struct hnn_rod *rod, size_t k)
{
    return (double *)(void *)((char *)rod + rod_number[k].offset);
}

/* ---- writing ---- */

void hnn_frames_write(const struct hnn_frames *f, phys_hdf5 *file)
{
    const size_t dims[] = {f->trajectories, f->frames, f->height, f->width};
    struct hnn_rod rod = f->rod;
    phys_hdf5_write(file, "frames", AD_F32, 4, dims, f->pixels);
    phys_hdf5_text(file, "frames", "axes", "trajectory, time, height, width");
    if (f->angle && f->speed) {
        phys_hdf5_write(file, "angle", AD_F64, 2, dims, f->angle);
        phys_hdf5_text(file, "angle", "unit", "rad");
        phys_hdf5_write(file, "speed", AD_F64, 2, dims, f->speed);
        phys_hdf5_text(file, "speed", "unit", "rad/s");
    }
    for (size_t k = 0; k < LENGTH(rod_number) && f->has_rod; k++)
        phys_hdf5_number(file, "/", rod_number[k].name, *number_of(&rod, k), rod_number[k].unit);
    if (f->has_rod)
        phys_hdf5_text(file, "/", "filter", hnn_filters[rod.filter]);
}

enum ad_status hnn_frames_save(const struct hnn_frames *frames, const char *file,
                               struct ad_error *error)
{
    phys_hdf5 *out;
    if (AD_LACKS(error, frames, file, frames->pixels))
        return error->status;
    if (phys_hdf5_create(file, &out, error) != AD_OK)
        return error->status;
    hnn_frames_write(frames, out);
    return phys_hdf5_commit(out, error);
}

/* ---- reading ---- */

/* Arrays that could be frames. */
struct search {
    struct phys_hdf5_item found; /* its object is `name` */
    char *name;
    size_t candidates;
    bool by_name, angle, speed;
};

static void visit(void *context, const struct phys_hdf5_item *item)
{
    struct search *s = context;
    bool numbers = item->kind == PHYS_HDF5_F64 || item->kind == PHYS_HDF5_F32 ||
                   item->kind == PHYS_HDF5_INTEGER;
    if (item->attribute || !numbers)
        return;
    bool named = strcmp(item->object, "frames") == 0;
    s->angle |= strcmp(item->object, "angle") == 0;
    s->speed |= strcmp(item->object, "speed") == 0;
    if (!(item->rank == 3 || item->rank == 4) || s->by_name)
        return;
    s->candidates = named ? 1 : s->candidates + 1;
    s->by_name = named;
    s->found = *item;
    free(s->name);
    s->name = strdup(item->object);
}

/* Sizes of [trajectory, time, height, width], 1 trajectory where that is left out. */
static enum ad_status choose(const char *path, phys_hdf5 *file, struct search *s, size_t size[4],
                             struct ad_error *error)
{
    if (phys_hdf5_list(file, visit, s, error) != AD_OK)
        return error->status;
    if (s->candidates != 1)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected frames as an array [trajectory, time, height, width] of "
                       "numbers, found %s%s",
                       path, s->candidates ? "several" : "none",
                       s->candidates ? ": name it 'frames'" : "");
    if (!s->name)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", path);
    bool one = s->found.rank == 3;
    size[0] = 1;
    memcpy(size + one, s->found.dims, s->found.rank * sizeof *size);
    if (!size[0] || size[1] < 3 || !size[2] || !size[3])
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected at least three frames of a trajectory in '%s', found an array "
                       "[%zu, %zu, %zu, %zu]",
                       path, s->name, size[0], size[1], size[2], size[3]);
    return AD_OK;
}

/* One trajectory's values to pixels from -1 to 1. */
static enum ad_status convert(const char *path, const struct search *s, const struct hnn_frames *f,
                              size_t trajectory, const double *values, struct ad_error *error)
{
    bool bytes = s->found.kind == PHYS_HDF5_INTEGER;
    double least = bytes ? 0 : -1, most = bytes ? 255 : 1;
    size_t area = f->height * f->width, n = f->frames * area;
    float *pixels = f->pixels + trajectory * n;
    for (size_t i = 0; i < n; i++) {
        if (!(values[i] >= least && values[i] <= most))
            return ad_fail(error, AD_E_INPUT,
                           "%s: expected %s from %g to %g, found %g in '%s': trajectory %zu, frame "
                           "%zu, row %zu, column %zu",
                           path, bytes ? "integers" : "numbers", least, most, values[i], s->name,
                           trajectory + 1, i / area + 1, i % area / f->width + 1, i % f->width + 1);
        pixels[i] = (float)(values[i] / most);
    }
    return AD_OK;
}

static enum ad_status read_pixels(const char *path, phys_hdf5 *file, const struct search *s,
                                  const struct hnn_frames_share *share, struct hnn_frames *f,
                                  struct ad_error *error)
{
    bool one = s->found.rank == 3;
    double *values = malloc(f->frames * f->height * f->width * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", path);
    for (size_t i = 0; i < f->trajectories && error->status == AD_OK; i++)
        if (hnn_frames_wanted(share, i) &&
            phys_hdf5_read(file, s->name, one ? 0 : i, one ? f->frames : 1, values, error) == AD_OK)
            convert(path, s, f, i, values, error);
    free(values);
    return error->status;
}

static enum ad_status read_motion(const char *path, phys_hdf5 *file, const char *name,
                                  const struct hnn_frames *f, double *values,
                                  struct ad_error *error)
{
    struct phys_hdf5_item item;
    size_t n = f->trajectories * f->frames;
    if (phys_hdf5_shape(file, name, &item, error) != AD_OK)
        return error->status;
    if (item.rank != 2 || item.dims[0] != f->trajectories || item.dims[1] != f->frames)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected '%s' to be an array [%zu, %zu], one per frame", path, name,
                       f->trajectories, f->frames);
    if (phys_hdf5_read(file, name, 0, f->trajectories, values, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++)
        if (!isfinite(values[k]))
            return ad_fail(error, AD_E_INPUT,
                           "%s: expected a finite number in '%s', trajectory %zu, frame %zu, "
                           "found %g",
                           path, name, k / f->frames + 1, k % f->frames + 1, values[k]);
    return AD_OK;
}

/* The filter; area if the file names none. */
static enum ad_status read_filter(const char *path, phys_hdf5 *file, struct hnn_rod *rod,
                                  struct ad_error *error)
{
    char *text = NULL;
    struct ad_error none = {0}, why = {0};
    if (phys_hdf5_get_text(file, "/", "filter", &text, &none) == AD_OK &&
        hnn_filter_find(text, &rod->filter, &why) != AD_OK)
        ad_fail(error, AD_E_INPUT, "%s: %s", path, why.message);
    if (none.status == AD_E_MEMORY)
        ad_fail(error, none.status, "%s", none.message);
    free(text);
    return error->status;
}

/* Reads the rod, if the file has the attribute that only files with a rod have. */
static enum ad_status read_rod(const char *path, phys_hdf5 *file, struct hnn_frames *f,
                               struct ad_error *error)
{
    struct ad_error none = {0};
    if (phys_hdf5_get(file, "/", "shade", &f->rod.shade, &none) != AD_OK)
        return AD_OK;
    if (read_filter(path, file, &f->rod, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < LENGTH(rod_number); k++)
        if (phys_hdf5_get(file, "/", rod_number[k].name, number_of(&f->rod, k), error) != AD_OK)
            return error->status;
    f->has_rod = hnn_rod_check(&f->rod, &none) == AD_OK;
    return f->has_rod ? AD_OK : ad_fail(error, AD_E_INPUT, "%s: %s", path, none.message);
}

static enum ad_status read_all(const char *path, phys_hdf5 *file, struct search *s,
                               struct hnn_frames_share *share, struct hnn_frames *f,
                               struct ad_error *error)
{
    size_t size[4] = {0};
    if (choose(path, file, s, size, error) != AD_OK ||
        hnn_frames_begin(f, size, share, error) != AD_OK ||
        read_pixels(path, file, s, share, f, error) != AD_OK ||
        read_rod(path, file, f, error) != AD_OK)
        return error->status;
    if (!s->angle || !s->speed)
        return AD_OK;
    if (hnn_frames_new_motion(f, error) == AD_OK &&
        read_motion(path, file, "angle", f, f->angle, error) == AD_OK)
        read_motion(path, file, "speed", f, f->speed, error);
    return error->status;
}

enum ad_status hnn_frames_read_hdf5(const char *path, struct hnn_frames_share *share,
                                    struct hnn_frames *f, struct ad_error *error)
{
    phys_hdf5 *file;
    struct search search = {0};
    if (phys_hdf5_open(path, &file, error) == AD_OK)
        read_all(path, file, &search, share, f, error);
    free(search.name);
    phys_hdf5_close(file);
    return error->status;
}
