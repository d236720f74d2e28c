/* Chooses columns by name, or by number from 1. */
#include "data_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status no_column(const struct hnn_source *s, const char *role, const char *name,
                                struct ad_error *error)
{
    const char **names = malloc((s->columns + 1) * sizeof *names);
    size_t n = 0;
    char all[160] = "";
    for (size_t k = 0; names && s->name && k < s->columns; k++)
        if (s->name[k])
            names[n++] = s->name[k];
    const char *nearest = names ? phys_nearest(name, n, names) : NULL;
    size_t used = 0;
    for (size_t k = 0; k < n && used < sizeof all - 48; k++)
        used += (size_t)snprintf(all + used, sizeof all - used, " %.40s", names[k]);
    if (nearest)
        ad_fail(error, AD_E_INPUT, "%s: %s: no column '%.60s'; did you mean '%s'?", s->file, role,
                name, nearest);
    else if (n)
        ad_fail(error, AD_E_INPUT, "%s: %s: no column '%.60s'; expected one of%s", s->file, role,
                name, all);
    else
        ad_fail(error, AD_E_INPUT,
                "%s: %s: no column '%.60s'; columns have no names, expected 1 to %zu", s->file,
                role, name, s->columns);
    free(names);
    return error->status;
}

/* Of all columns, by name first: a name may be a number. */
static enum ad_status find_column(const struct hnn_source *s, const char *role, const char *name,
                                  size_t *column, struct ad_error *error)
{
    size_t found = 0;
    for (size_t k = 0; s->name && k < s->columns; k++)
        if (s->name[k] && strcmp(s->name[k], name) == 0) {
            *column = k;
            found++;
        }
    if (found > 1)
        return ad_fail(error, AD_E_INPUT,
                       "%s: %s: %zu columns are named '%.60s'; expected a number from 1 to %zu",
                       s->file, role, found, name, s->columns);
    if (found)
        return AD_OK;
    char *end;
    unsigned long number = strtoul(name, &end, 10);
    if (*name < '0' || *name > '9' || *end || number < 1 || number > s->columns)
        return no_column(s, role, name, error);
    *column = number - 1;
    return AD_OK;
}

enum ad_status hnn_choose(const struct hnn_source *source, const char *role, const char *list,
                          size_t **column, size_t *n, struct ad_error *error)
{
    const struct phys_separator comma = {.text = ','};
    char **names = NULL;
    size_t found = 0;
    *n = 0;
    *column = NULL;
    if (!phys_fields_split(list, list + strlen(list), comma, &names, &found) ||
        !(*column = malloc(found * sizeof **column)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (; *column && *n < found; ++*n)
        if (find_column(source, role, names[*n] ? names[*n] : "", *column + *n, error) != AD_OK)
            break;
    phys_fields_free(names, found);
    return error->status;
}
