/* Parts of the page of a run (page.h): the view and its main panel (page_views.c), panels of lines
   beside it (page_lines.c), images (page_images.c), scans (page_scans.c). */
#ifndef APPS_OUTPUT_PAGE_PARTS_H
#define APPS_OUTPUT_PAGE_PARTS_H

#include "page.h"

struct line {
    const char *dataset, *name;
    size_t column; /* of a dataset [n x columns] */
    bool change;   /* its change since the start, relative where that is not 0 */
};

struct series {
    const char *over; /* dataset; NULL: the number of the row */
    bool log;
    struct line line[3];
};

/* Whether a file has numbers of this name and rank, none of its dimensions 0. */
bool page_has(phys_hdf5 *file, const char *name, size_t rank, struct phys_hdf5_item *item);
/* n numbers of a dataset or, where it has not these, `first` and on; owned by the caller. */
double *page_axis(phys_hdf5 *file, const char *name, size_t n, double first,
                  struct ad_error *error);
/* What is written of an axis: the first `kept`, or the samples picked. */
void page_write_axis(phys_hdf5 *file, struct json *json, const char *key, const char *name,
                     size_t n, double first, size_t kept, const size_t *pick,
                     struct ad_error *error);
/* A panel of lines. */
void page_write_series(phys_hdf5 *file, const struct series *series, struct json *json,
                       struct ad_error *error);
/* A panel for each number that changes with the parameter of a scan, of the first PANELS (24); a
   map for each that changes with two, as many as the page has room for (page_scans.c). */
void page_write_scan(phys_hdf5 *file, struct json *json, struct ad_error *error);
void page_write_maps(phys_hdf5 *file, struct json *json, struct ad_error *error);
/* Densities in the plane, and frames of videos. */
void page_write_images(phys_hdf5 *file, struct json *json, struct ad_error *error);

#endif
