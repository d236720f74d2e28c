/* What the page of a run shows: a table of views, of which a file has the first whose dataset it
   has. The main panel has curves along an axis, in frames (steps of a solver, times) or one; panels
   beside it have lines over steps or time. page.html draws both.

   A page has about NUMBERS numbers of curves. Where a file has more, some frames and some samples
   along the curves are left out; those that are there are those of the file. */
#include "autodiff/free.h"
#include "page_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 49152, FRAMES = 16, SAMPLES = 2000, CURVES = 1000 };

/* Curves of one dataset. Axes: F frames, C curves, N samples along them. */
struct group {
    const char *dataset, *axes, *name, *style; /* "line", "dash", "dots" */
};

struct view {
    size_t rank;             /* of the first dataset */
    const char *mark;        /* another dataset that the file has; NULL: any file */
    const char *over, *name; /* dataset of the frames (NULL: one frame), and what it is */
    const char *along;       /* dataset of the axis; where there is none, numbers from 0 */
    struct group group[3];
    struct series series[3];
};

static const struct view views[] = {
    {3, "columns", "row", "row", "time", {{"path", "FCN", "path", "line"}}, {{0}}},
    {3,
     "step",
     "step",
     "step",
     "time",
     {{"path", "FCN", "path", "line"}, {"reference", "CN", "reference", "dash"}},
     {{NULL,
       false,
       {{"history/action_mean", "S", 0, false},
        {"history/kinetic_mean", "T", 0, false},
        {"history/potential_mean", "V", 0, false}}},
      {NULL, true, {{"history/grad_norm", "|gradient|", 0, false}}}}},
    {2,
     NULL,
     NULL,
     NULL,
     "time",
     {{"path", "CN", "motion", "line"}},
     {{"time", false, {{"energy", "energy", 0, false}}},
      {"time", true, {{"energy", "energy drift", 0, true}, {"error", "error", 0, false}}}}},
    {2,
     NULL,
     "time",
     "t",
     "x",
     {{"density", "FN", "density", "line"}},
     {{"time", false, {{"moments", "mean x", 1, false}, {"moments", "width", 2, false}}},
      {"time", false, {{"moments", "norm", 0, false}}}}},
    {2,
     NULL,
     NULL,
     NULL,
     "time",
     {{"state", "NC", "model", "line"},
      {"against_state", "NC", "against", "line"},
      {"truth_state", "NC", "truth", "dash"}},
     {{"time",
       false,
       {{"energy", "energy of the model", 0, false},
        {"against_energy", "of the other", 0, false},
        {"truth_energy", "of the truth", 0, false}}}}},
    {2,
     NULL,
     NULL,
     NULL,
     "t",
     {{"model", "NC", "model", "line"}, {"data", "NC", "data", "dots"}},
     {{0}}},
    {1,
     NULL,
     NULL,
     NULL,
     "y",
     {{"screen", "N", "on the screen", "line"}, {"thin_slits", "N", "thin slits", "dash"}},
     {{0}}},
};

/* ---- the main panel ---- */

static size_t length(const struct group *group, const struct phys_hdf5_item *item, char letter)
{
    const char *at = strchr(group->axes, letter);
    return at ? item->dims[at - group->axes] : 1;
}

/* A frame as [curves x n]. */
static void read_frame(phys_hdf5 *file, const struct group *group,
                       const struct phys_hdf5_item *item, size_t frame, double *value,
                       struct ad_error *error)
{
    const size_t C = length(group, item, 'C'), n = length(group, item, 'N');
    const bool framed = group->axes[0] == 'F', turned = strcmp(group->axes, "NC") == 0;
    double *read = turned ? malloc(C * n * sizeof *read) : value;
    if (!read) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return;
    }
    phys_hdf5_read(file, group->dataset, framed ? frame : 0, framed ? 1 : item->dims[0], read,
                   error);
    if (!turned)
        return;
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < n; i++)
            value[c * n + i] = read[i * C + c];
    free(read);
}

/* More of them where the path still moves far from step to step. */
static size_t pick_frames(size_t frames, size_t keep, size_t index[])
{
    keep = keep < frames ? keep : frames;
    for (size_t k = 0; k < keep; k++) {
        const double share = keep > 1 ? (double)k / (double)(keep - 1) : 1;
        const size_t at = (size_t)lround(share * share * (double)(frames - 1));
        const size_t next = k ? index[k - 1] + 1 : 0, last = frames - keep + k;
        index[k] = at < next ? next : at > last ? last : at;
    }
    return keep;
}

struct panel {
    phys_hdf5 *file;
    const struct view *view;
    struct phys_hdf5_item item[3]; /* rank 0: not there */
    size_t F, C, n;                /* in the file */
    size_t frames, curves, kept;   /* on the page */
    size_t *frame, *pick;
    double *two; /* two frames */
};

/* Curves of the first and last frame, and of the other groups, say which samples are kept. */
static enum ad_status pick_samples(struct panel *p, struct ad_error *error)
{
    const struct group *group = p->view->group;
    const size_t size = p->C * p->n;
    size_t rows = p->C, most = NUMBERS / ((p->curves + 1) * (p->F < FRAMES ? p->F : FRAMES));
    most = most < 16 ? 16 : most > SAMPLES ? SAMPLES : most;
    read_frame(p->file, group, &p->item[0], p->F - 1, p->two, error);
    if (p->F > 1) {
        read_frame(p->file, group, &p->item[0], 0, p->two + size, error);
        rows += p->C;
    } else if (p->item[1].rank && length(&group[1], &p->item[1], 'C') == p->C) {
        read_frame(p->file, &group[1], &p->item[1], 0, p->two + size, error);
        rows += p->C;
    }
    if (error->status == AD_OK)
        p->kept = page_pick(p->n, rows, p->two, most, p->pick);
    return error->status;
}

static void write_group(const struct panel *p, size_t g, struct json *json, struct ad_error *error)
{
    const struct group *group = &p->view->group[g];
    const size_t curves =
        length(group, &p->item[g], 'C') < p->curves ? length(group, &p->item[g], 'C') : p->curves;
    const size_t frames = g == 0 ? p->frames : 1, kept = p->kept;
    double *all = malloc(length(group, &p->item[g], 'C') * p->n * sizeof *all);
    double *value = malloc(curves * frames * kept * sizeof *value);
    if (!all || !value)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t f = 0; f < frames && error->status == AD_OK; f++) {
        read_frame(p->file, group, &p->item[g], p->frame[f], all, error);
        for (size_t c = 0; c < curves; c++)
            for (size_t i = 0; i < kept; i++)
                value[(c * frames + f) * kept + i] = all[c * p->n + p->pick[i]];
    }
    json_object(json, NULL);
    json_text(json, "name", group->name);
    json_text(json, "dataset", group->dataset);
    json_text(json, "style", group->style);
    json_array(json, "curves");
    for (size_t c = 0; c < curves && error->status == AD_OK; c++)
        page_floats(json, NULL, frames * kept, value + c * frames * kept, error);
    json_end_array(json);
    json_end_object(json);
    AD_FREE(all, value);
}

/* [frames x kept]: the largest distance of a coordinate from the reference, as double precision
   has it: of a path that is found it is far below what is left in single precision. */
static void write_distance(const struct panel *p, struct json *json, struct ad_error *error)
{
    const struct group *group = p->view->group;
    const size_t size = p->C * p->n;
    double *far = calloc(p->frames * p->kept, sizeof *far);
    if (!far)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (error->status == AD_OK)
        read_frame(p->file, &group[1], &p->item[1], 0, p->two + size, error);
    for (size_t f = 0; f < p->frames && error->status == AD_OK; f++) {
        read_frame(p->file, group, &p->item[0], p->frame[f], p->two, error);
        for (size_t i = 0; i < p->kept; i++)
            for (size_t c = 0; c < p->C; c++) {
                const size_t at = c * p->n + p->pick[i];
                far[f * p->kept + i] =
                    fmax(far[f * p->kept + i], fabs(p->two[at] - p->two[size + at]));
            }
    }
    if (error->status == AD_OK)
        page_floats(json, "distance", p->frames * p->kept, far, error);
    free(far);
}

static void write_panel(struct panel *p, struct json *json, struct ad_error *error)
{
    const struct view *view = p->view;
    const struct group *group = view->group;
    if (pick_samples(p, error) != AD_OK)
        return;
    const size_t most = NUMBERS / ((p->curves + 1) * p->kept);
    p->frames = pick_frames(p->F, most < 2 ? 2 : most, p->frame);
    json_object(json, "main");
    json_text(json, "frame", view->name);
    json_count(json, "curves_of", p->C);
    if (view->over)
        page_write_axis(p->file, json, "frames", view->over, p->F, 1, p->frames, p->frame, error);
    page_write_axis(p->file, json, "along", view->along, p->n, 0, p->kept, p->pick, error);
    json_array(json, "groups");
    for (size_t g = 0; g < 3; g++)
        if (p->item[g].rank)
            write_group(p, g, json, error);
    json_end_array(json);
    if (p->F > 1 && p->item[1].rank && length(&group[1], &p->item[1], 'C') == p->C)
        write_distance(p, json, error);
    json_end_object(json);
}

static enum ad_status main_panel(phys_hdf5 *file, const struct view *view, struct json *json,
                                 struct ad_error *error)
{
    struct panel p = {.file = file, .view = view};
    page_has(file, view->group[0].dataset, view->rank, &p.item[0]);
    p.F = length(view->group, &p.item[0], 'F');
    p.C = length(view->group, &p.item[0], 'C');
    p.n = length(view->group, &p.item[0], 'N');
    p.curves = p.C < CURVES ? p.C : CURVES;
    for (size_t g = 1; g < 3 && view->group[g].dataset; g++)
        if (!page_has(file, view->group[g].dataset, strlen(view->group[g].axes), &p.item[g]) ||
            length(&view->group[g], &p.item[g], 'N') != p.n)
            p.item[g].rank = 0;
    p.frame = calloc(p.F, sizeof *p.frame);
    p.pick = calloc(p.n, sizeof *p.pick);
    p.two = calloc(2 * p.C * p.n, sizeof *p.two);
    if (p.frame && p.pick && p.two)
        write_panel(&p, json, error);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory");
    AD_FREE(p.frame, p.pick, p.two);
    return error->status;
}

/* ---- the page ---- */

static bool fits(phys_hdf5 *file, const struct view *view)
{
    struct phys_hdf5_item item;
    struct ad_error none = {0};
    return page_has(file, view->group[0].dataset, view->rank, &item) &&
           (!view->mark || phys_hdf5_shape(file, view->mark, &item, &none) == AD_OK);
}

enum ad_status page_of_run(phys_hdf5 *file, const char *name, FILE *out, struct ad_error *error)
{
    struct page page;
    size_t v = 0;
    if (page_begin(&page, error) != AD_OK)
        return error->status;
    json_text(&page.json, "kind", "run");
    json_text(&page.json, "file", name);
    page_attributes(&page.json, file, error);
    while (v < sizeof views / sizeof *views && !fits(file, &views[v]))
        v++;
    const bool viewed = v < sizeof views / sizeof *views && error->status == AD_OK;
    if (viewed)
        main_panel(file, &views[v], &page.json, error);
    json_array(&page.json, "series");
    for (size_t k = 0; viewed && k < 3 && error->status == AD_OK; k++)
        page_write_series(file, &views[v].series[k], &page.json, error);
    if (error->status == AD_OK)
        page_write_scan(file, &page.json, error);
    json_end_array(&page.json);
    json_array(&page.json, "maps");
    page_write_maps(file, &page.json, error);
    json_end_array(&page.json);
    json_array(&page.json, "images");
    page_write_images(file, &page.json, error);
    json_end_array(&page.json);
    return page_end(&page, out, error);
}
