/* Scans on a page (page_parts.h): a panel of lines for each number over one parameter, a map over
   two. */
#include "page_parts.h"

#include <stdlib.h>
#include <string.h>

enum { AXES = 2, PANELS = 24, NAME = 120, MAP_NUMBERS = 200000 };

/* Names of the datasets of a scan. */
struct scanned {
    phys_hdf5 *file;
    size_t axes, n[AXES + 1];
    char over[AXES][NAME], result[AXES + 1][PANELS][NAME]; /* results by rank */
};

/* Parameters stand in the order of the attribute `axis`; a file without it has one. */
static void find_scanned(void *context, const struct phys_hdf5_item *item)
{
    struct scanned *s = context;
    struct ad_error ignored = {0};
    double axis = 0;
    if (item->attribute || item->rank < 1 || item->rank > AXES || strlen(item->object) >= NAME)
        return;
    if (strncmp(item->object, "scanned/", 8) == 0) {
        phys_hdf5_get(s->file, item->object, "axis", &axis, &ignored);
        if (axis == 0 || axis == 1)
            strcpy(s->over[(size_t)axis], item->object);
        s->axes++;
    } else if (strncmp(item->object, "results/", 8) == 0 && s->n[item->rank] < PANELS) {
        strcpy(s->result[item->rank][s->n[item->rank]++], item->object);
    }
}

/* Numbers of a dataset if it changes, owned by the caller; else NULL. */
static double *read_changing(phys_hdf5 *file, const char *name, size_t n, struct ad_error *error)
{
    struct phys_hdf5_item item;
    double *value = malloc(n * sizeof *value);
    size_t least, most;
    if (!value)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_hdf5_shape(file, name, &item, error) == AD_OK &&
             phys_hdf5_read(file, name, 0, item.dims[0], value, error) == AD_OK &&
             page_span(n, value, &least, &most) > 0 && value[least] < value[most])
        return value;
    free(value);
    return NULL;
}

static void write_line(const struct scanned *s, const char *name, struct json *json,
                       struct ad_error *error)
{
    const struct series series = {s->over[0], false, {{name, name + 8, 0, false}}};
    struct phys_hdf5_item item;
    double *value = page_has(s->file, name, 1, &item)
                        ? read_changing(s->file, name, item.dims[0], error)
                        : NULL;
    if (value)
        page_write_series(s->file, &series, json, error);
    free(value);
}

static bool is_map(const struct scanned *s, const char *name, struct phys_hdf5_item *map)
{
    struct phys_hdf5_item axis[AXES];
    return s->axes == AXES && page_has(s->file, name, 2, map) &&
           page_has(s->file, s->over[0], 1, &axis[0]) &&
           page_has(s->file, s->over[1], 1, &axis[1]) && axis[0].dims[0] == map->dims[0] &&
           axis[1].dims[0] == map->dims[1];
}

static void write_map(const struct scanned *s, const char *name, const struct phys_hdf5_item *item,
                      struct json *json, struct ad_error *error)
{
    static const char *const keys[] = {"across", "up"};
    double *value = read_changing(s->file, name, item->dims[0] * item->dims[1], error);
    if (!value)
        return;
    json_object(json, NULL);
    json_text(json, "name", name + 8);
    json_text(json, "dataset", name);
    for (size_t a = 0; a < AXES; a++)
        page_write_axis(s->file, json, keys[a], s->over[a], item->dims[a], 0, item->dims[a], NULL,
                        error);
    page_floats(json, "data", item->dims[0] * item->dims[1], value, error);
    json_end_object(json);
    free(value);
}

static struct scanned find(phys_hdf5 *file, struct ad_error *error)
{
    struct scanned s = {.file = file};
    phys_hdf5_list(file, find_scanned, &s, error);
    return s;
}

void page_write_scan(phys_hdf5 *file, struct json *json, struct ad_error *error)
{
    const struct scanned s = find(file, error);
    for (size_t k = 0; s.axes == 1 && k < s.n[1] && error->status == AD_OK; k++)
        write_line(&s, s.result[1][k], json, error);
}

void page_write_maps(phys_hdf5 *file, struct json *json, struct ad_error *error)
{
    const struct scanned s = find(file, error);
    size_t room = MAP_NUMBERS;
    struct phys_hdf5_item item;
    for (size_t k = 0; k < s.n[2] && error->status == AD_OK; k++) {
        if (!is_map(&s, s.result[2][k], &item) || item.dims[0] * item.dims[1] > room)
            continue;
        room -= item.dims[0] * item.dims[1];
        write_map(&s, s.result[2][k], &item, json, error);
    }
}
