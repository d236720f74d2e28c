/* The tables that models of the ephemeris are held against (ephemeris_models.h). */
#include "ephemeris_models.h"
#include "apps/options.h"

#include <stdlib.h>

enum { DAY = 86400, PAPER_DAY = 148, PAPER_YEAR = 365 };

static const char bodies[] = "sun,mercury,venus,earth,mars";

static enum ad_status choose_span(const char *folder, const char *from, size_t days,
                                  struct ephemeris_tables *tables, struct ad_error *error)
{
    const struct phys_horizons *table = tables->table;
    tables->days = option_count_or(days, EPHEMERIS_DAYS);
    if (from && phys_horizons_epoch(table, from, &tables->first, error) != AD_OK)
        return error->status;
    if (!from && table->n >= PAPER_YEAR)
        tables->first = table->n - PAPER_YEAR + PAPER_DAY;
    if (tables->days < 1)
        return ad_fail(error, AD_E_ARGUMENT, "--days: expected at least 1, got 0");
    if (tables->first >= table->n || tables->days >= table->n - tables->first)
        return ad_fail(error, AD_E_INPUT,
                       "%s: --days %zu from index %zu needs %zu epochs, there are %zu", folder,
                       tables->days, tables->first, tables->first + tables->days + 1, table->n);
    double step = (table->jd[1] - table->jd[0]) * DAY;
    if (fabs(step - DAY) > 1e-3)
        return ad_fail(error, AD_E_INPUT, "%s: epochs are %.9g s apart, expected a day", folder,
                       step);
    return AD_OK;
}

enum ad_status ephemeris_tables_open(const char *folder, const char *from, size_t days,
                                     struct ephemeris_tables *tables, struct ad_error *error)
{
    *tables = (struct ephemeris_tables){0};
    if (phys_horizons_folder(folder, bodies, &tables->n, &tables->table, error) != AD_OK)
        return error->status;
    return choose_span(folder, from, days, tables, error);
}

void ephemeris_tables_close(struct ephemeris_tables *tables)
{
    for (size_t k = 0; k < tables->n; k++)
        phys_horizons_free(&tables->table[k]);
    free(tables->table);
    *tables = (struct ephemeris_tables){0};
}
