/* A page: one HTML file without requests, made of a template (page.html) and one JSON object.

       struct page page;
       if (page_begin(&page, error) == AD_OK) {
           ... members to page.json ...
           page_end(&page, out, error);
       }

   All that comes from outside is in that object, with every < escaped, so that nothing in it ends
   the script element; the page shows it as text. */
#ifndef APPS_OUTPUT_PAGE_H
#define APPS_OUTPUT_PAGE_H

#include "json.h"
#include "physics/io/hdf5_file.h"

struct page {
    struct json json;
    char *text; /* behind json.out */
    size_t length;
};

enum ad_status page_begin(struct page *page, struct ad_error *error);
/* Writes the page, where `out` is not NULL and `error` empty, and frees it. */
enum ad_status page_end(struct page *page, FILE *out, struct ad_error *error);

/* The page of a run file, which may still be open for writing: the table of its views is in
   page_views.c. `name` is its title where the file has no command. */
enum ad_status page_of_run(phys_hdf5 *file, const char *name, FILE *out, struct ad_error *error);
/* The attributes of all objects of a file as an object of objects. */
enum ad_status page_attributes(struct json *json, phys_hdf5 *file, struct ad_error *error);

/* Whether a name ends in .html. */
bool page_wanted(const char *name);
/* AD_E_ARGUMENT where a file of this name exists and is no page of ours: of a name that the user
   has not given. */
enum ad_status page_may_replace(const char *name, struct ad_error *error);

/* ---- numbers of a page (page_numbers.c) ---- */

/* Of the finite ones of n numbers: the largest less the least, 1 where that is 0; and their
 * indices.
 */
double page_span(size_t n, const double *value, size_t *least, size_t *most);
/* At most `keep` (at least 2) of n samples, in order, into index[n]: the ends, and those that the
   polygon through the others misses most, in shares of the span of each of some rows [rows x n].
   With few rows their extremes are among them. Returns how many. */
size_t page_pick(size_t n, size_t rows, const double *value, size_t keep, size_t index[]);
/* n numbers as they are, in base64. */
void page_doubles(struct json *json, const char *key, size_t n, const double value[],
                  struct ad_error *error);
/* {"offset", "scale", "values"}: value = offset + scale float32, with a relative error of 6e-8;
   those not finite are NaN. */
void page_floats(struct json *json, const char *key, size_t n, const double value[],
                 struct ad_error *error);

#endif
