/* A page around its JSON (page.h). */
#include "page.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* page.html; @DATA@ in it stands for the object. */
static const char template[] = {
#include "apps/output/page.html.inc"
};
static const char mark[] = "@DATA@";
/* By which a page of ours is known. */
static const char generator[] = "<meta name=\"generator\" content=\"leastaction\">";

enum ad_status page_begin(struct page *page, struct ad_error *error)
{
    *page = (struct page){0};
    FILE *out = open_memstream(&page->text, &page->length);
    if (!out)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    json_open(&page->json, out);
    return AD_OK;
}

/* < occurs in texts alone. */
static void write_data(const struct page *page, FILE *out)
{
    for (size_t i = 0; i < page->length; i++)
        if (page->text[i] == '<')
            fputs("\\u003c", out);
        else
            fputc(page->text[i], out);
}

enum ad_status page_end(struct page *page, FILE *out, struct ad_error *error)
{
    const char *at = strstr(template, mark);
    json_close(&page->json);
    const bool whole = !ferror(page->json.out);
    if ((fclose(page->json.out) != 0 || !whole) && error->status == AD_OK)
        ad_fail(error, AD_E_MEMORY, "out of memory for the page");
    if (out && error->status == AD_OK) {
        fwrite(template, 1, (size_t)(at - template), out);
        write_data(page, out);
        fputs(at + sizeof mark - 1, out);
    }
    free(page->text);
    return error->status;
}

bool page_wanted(const char *name)
{
    const char *dot = name ? strrchr(name, '.') : NULL;
    return dot && strcasecmp(dot, ".html") == 0;
}

enum ad_status page_may_replace(const char *name, struct ad_error *error)
{
    char head[256];
    FILE *in = fopen(name, "r");
    if (!in)
        return AD_OK;
    head[fread(head, 1, sizeof head - 1, in)] = '\0';
    fclose(in);
    return strstr(head, generator)
               ? AD_OK
               : ad_fail(error, AD_E_INPUT,
                         "%s: is no page of leastaction; expected --plot FILE.html, the page to "
                         "write",
                         name);
}

/* ---- attributes ---- */

struct listing {
    struct json *json;
    bool open;
};

static void list(void *context, const struct phys_hdf5_item *item)
{
    struct listing *listing = context;
    struct json *json = listing->json;
    if (!item->attribute) {
        if (listing->open)
            json_end_object(json);
        listing->open = true;
        json_object(json, item->object);
    } else if (item->kind == PHYS_HDF5_TEXT) {
        json_text(json, item->attribute, item->text);
    } else if (item->kind != PHYS_HDF5_OTHER) {
        json_number(json, item->attribute, item->number);
    }
}

enum ad_status page_attributes(struct json *json, phys_hdf5 *file, struct ad_error *error)
{
    struct listing listing = {json, false};
    json_object(json, "objects");
    phys_hdf5_list(file, list, &listing, error);
    if (listing.open)
        json_end_object(json);
    json_end_object(json);
    return error->status;
}
