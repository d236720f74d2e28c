/* Measured motions from columns of a file: t, trial, coordinates and velocities by name. */
#include "fit.h"
#include "physics/io/csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void fit_quantity(const struct phys_system *system, size_t i, char *name, size_t size)
{
    char of[48];
    phys_coordinate_name(system, i % system->dof, of, sizeof of);
    snprintf(name, size, "%s%s", i < system->dof ? "" : "v_", of);
}

/* The column of a quantity: by --columns, or by its own name; SIZE_MAX: none. */
static size_t column_of(const struct fit_run *run, const struct phys_csv *csv, const char *known,
                        const char *quantity, const char *other, struct ad_error *error)
{
    const char *name = NULL;
    for (size_t k = 0; k < run->columns.n; k++)
        if (strcmp(run->columns.name[k], quantity) == 0)
            name = run->columns.value[k];
    for (size_t c = 0; csv->name && c < csv->columns; c++)
        if (csv->name[c] && (strcmp(csv->name[c], name ? name : quantity) == 0 ||
                             (!name && other && strcmp(csv->name[c], other) == 0)))
            return c;
    char *end;
    const unsigned long number = name ? strtoul(name, &end, 10) : 0;
    if (name && *name && *end == '\0' && number >= 1 && number <= csv->columns)
        return number - 1;
    if (name)
        ad_fail(error, AD_E_ARGUMENT, "--columns: %s has no column %s, got: %s", csv->file, name,
                known);
    return SIZE_MAX;
}

/* Columns of t, trial and the components, of `to`. */
static enum ad_status choose(const struct fit_run *run, const struct phys_csv *csv, size_t *to,
                             struct ad_error *error)
{
    const size_t d = 2 * run->system.dof;
    char name[64], known[300] = "";
    size_t measured = 0;
    for (size_t c = 0, used = 0; csv->name && c < csv->columns && used + 40 < sizeof known; c++)
        used += (size_t)snprintf(known + used, sizeof known - used, "%s%.32s", used ? " " : "",
                                 csv->name[c] ? csv->name[c] : "?");
    if (!*known)
        snprintf(known, sizeof known, "no names");
    to[d] = column_of(run, csv, known, phys_time_name(&run->system), "time", error);
    to[d + 1] = column_of(run, csv, known, "trial", NULL, error);
    for (size_t i = 0; i < d && error->status == AD_OK; i++) {
        fit_quantity(&run->system, i, name, sizeof name);
        to[i] = column_of(run, csv, known, name, NULL, error);
        measured += to[i] != SIZE_MAX;
    }
    for (size_t k = 0; k < run->columns.n && error->status == AD_OK; k++) {
        bool any = strcmp(run->columns.name[k], phys_time_name(&run->system)) == 0 ||
                   strcmp(run->columns.name[k], "trial") == 0;
        for (size_t i = 0; i < d && !any; i++) {
            fit_quantity(&run->system, i, name, sizeof name);
            any = strcmp(name, run->columns.name[k]) == 0;
        }
        if (!any)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--columns: no quantity '%s'; expected t, trial, a coordinate or v_ "
                           "and a coordinate",
                           run->columns.name[k]);
    }
    if (error->status != AD_OK)
        return error->status;
    fit_quantity(&run->system, 0, name, sizeof name);
    if (to[d] == SIZE_MAX || !measured)
        return ad_fail(error, AD_E_INPUT,
                       "%s: no column of %s, got: %s; expected --columns t=NAME,%s=NAME, of names "
                       "or numbers",
                       csv->file,
                       to[d] == SIZE_MAX ? phys_time_name(&run->system)
                                         : "a coordinate or velocity",
                       known, name);
    return AD_OK;
}

/* Rows of t, trial number, components. */
static enum ad_status read_rows(struct fit_run *run, struct phys_csv *csv, const size_t *column,
                                struct ad_error *error)
{
    const size_t d = 2 * run->system.dof, width = d + 2;
    double **to = calloc(csv->columns + 1, sizeof *to);
    size_t n = 0, room = 0, rows = 1;
    while (to && rows && error->status == AD_OK) {
        if (n + PHYS_CSV_ROWS > room) {
            room = 2 * room + PHYS_CSV_ROWS;
            double *more = realloc(run->values, room * width * sizeof *more);
            if (!more) {
                ad_fail(error, AD_E_MEMORY, "out of memory");
                break;
            }
            run->values = more;
        }
        double *at = run->values + n * width;
        for (size_t k = 0; k < PHYS_CSV_ROWS * width; k++)
            at[k] = NAN;
        for (size_t i = 0; i < width; i++)
            if (column[i] != SIZE_MAX)
                to[column[i]] = at + i;
        phys_csv_read(csv, PHYS_CSV_ROWS, to, width, &rows, error);
        n += error->status == AD_OK ? rows : 0;
    }
    free(to);
    run->data.n = n;
    return !to ? ad_fail(error, AD_E_MEMORY, "out of memory") : error->status;
}

/* Into arrays of their own, trials by their order. */
static enum ad_status arrange(struct fit_run *run, struct ad_error *error)
{
    const size_t d = 2 * run->system.dof, width = d + 2, n = run->data.n;
    double *t = malloc((n * (d + 1) + 1) * sizeof *t), last = NAN;
    run->trials = calloc(n + 1, sizeof *run->trials);
    if (!t || !run->trials) {
        free(t);
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    for (size_t k = 0; k < n; k++) {
        const double *row = run->values + k * width;
        t[k] = row[d];
        memcpy(t + n + k * d, row, d * sizeof *row);
        run->trials[k] = k == 0 ? 0 : run->trials[k - 1] + (isfinite(last) && row[d + 1] != last);
        last = row[d + 1];
    }
    free(run->values);
    run->values = t;
    run->data =
        (struct phys_fit_data){.size = sizeof(struct phys_fit_data), n, t, run->trials, t + n};
    return AD_OK;
}

enum ad_status fit_read(struct fit_run *run, const char *file, struct ad_error *error)
{
    struct phys_csv csv = {.skip_missing = true};
    size_t *column = calloc(2 * run->system.dof + 2, sizeof *column);
    if (!column)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_csv_open(&csv, file, option_count_or(run->options->skip, 0), error) == AD_OK &&
        choose(run, &csv, column, error) == AD_OK && read_rows(run, &csv, column, error) == AD_OK)
        arrange(run, error);
    phys_csv_close(&csv);
    free(column);
    return error->status;
}
