/* Reads paths from text files, --init and --reference (path.h), with columns of coordinates and
   time by name. */
#include "autodiff/free.h"
#include "path.h"
#include "physics/io/csv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double same_time = 1e-6; /* of the whole span */

struct path_file {
    const char *file;
    size_t rows, columns;
    double *table;  /* [rows][columns] */
    char **name;    /* [columns], or NULL */
    size_t time;    /* its column; `columns`: there is none */
    size_t *column; /* [dof] of the coordinates */
};

/* The column named so; `columns` if there is none. */
static size_t column_of(const struct path_file *f, const char *name)
{
    for (size_t c = 0; f->name && c < f->columns; c++)
        if (f->name[c] && strcmp(f->name[c], name) == 0)
            return c;
    return f->columns;
}

/* A column of velocities, as simulate names them: no coordinates, whatever their order. */
static const char *velocities(const struct path_run *run, const struct path_file *f)
{
    char name[32];
    for (size_t k = 0; k < run->system.dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        for (size_t c = 0; f->name && c < f->columns; c++)
            if (f->name[c] && strncmp(f->name[c], "v_", 2) == 0 &&
                strcmp(f->name[c] + 2, name) == 0)
                return f->name[c];
    }
    return NULL;
}

/* Coordinates by their names, whatever else there is; where none has its name, the columns beside
   the time in their order, and no others. */
static enum ad_status find_columns(const struct path_run *run, struct path_file *f,
                                   struct ad_error *error)
{
    size_t dof = run->system.dof, found = 0, missing = dof;
    char name[32], lacking[32] = "";
    f->time = column_of(f, phys_time_name(&run->system));
    for (size_t k = 0; k < dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        f->column[k] = column_of(f, name);
        found += f->column[k] < f->columns;
        if (f->column[k] == f->columns && missing == dof) {
            missing = k;
            memcpy(lacking, name, sizeof lacking);
        }
    }
    if (found == dof)
        return AD_OK;
    if (found > 0)
        return ad_fail(error, AD_E_INPUT, "%s: no column '%s'; expected all coordinates of %s",
                       f->file, lacking, run->system.scene->name);
    const char *velocity = velocities(run, f);
    if (velocity)
        return ad_fail(error, AD_E_INPUT,
                       "%s: no column '%s', got a column of velocities, '%s'; expected coordinates",
                       f->file, lacking, velocity);
    size_t others = f->columns - (f->time < f->columns);
    if (others != dof)
        return ad_fail(
            error, AD_E_INPUT,
            "%s: %zu columns%s, expected one for each coordinate of %s: %zu, or these by "
            "name; a column of time is named t",
            f->file, others, f->time < f->columns ? " beside t" : "", run->system.scene->name, dof);
    for (size_t c = 0, k = 0; c < f->columns; c++)
        if (c != f->time)
            f->column[k++] = c;
    return AD_OK;
}

/* Checks that its column is the time of the slices; it may begin at any time. */
static enum ad_status check_times(const struct path_run *run, const struct path_file *f,
                                  struct ad_error *error)
{
    size_t slices = run->settings.slices;
    const double *t = f->table + f->time;
    double dt = run->settings.dt, step = t[(slices - 1) * f->columns] - t[0];
    if (f->time == f->columns)
        return AD_OK;
    step /= (double)(slices - 1);
    if (run->ends.free_time && step > 0) /* the time found may be another one */
        dt = step;
    for (size_t i = 0; i < slices; i++) {
        double expected = t[0] + (double)i * dt;
        if (!(fabs(t[i * f->columns] - expected) <= same_time * (double)slices * dt))
            return ad_fail(error, AD_E_INPUT,
                           "%s: t is %.9g in row %zu, expected %.9g with --dt %g", f->file,
                           t[i * f->columns], i + 1, expected, dt);
    }
    return AD_OK;
}

static enum ad_status read_table(const struct path_run *run, const char *file, struct path_file *f,
                                 struct ad_error *error)
{
    *f = (struct path_file){.file = file};
    if (phys_table_read_named(file, &f->rows, &f->columns, &f->table, &f->name, error) != AD_OK)
        return error->status;
    f->column = malloc(run->system.dof * sizeof *f->column);
    return f->column ? find_columns(run, f, error)
                     : ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
}

static void free_table(struct path_file *f)
{
    phys_fields_free(f->name, f->columns);
    AD_FREE(f->column, f->table);
}

double *path_read(const struct path_run *run, const char *file, struct ad_error *error)
{
    size_t dof = run->system.dof, slices = run->settings.slices;
    struct path_file f;
    double *path = NULL;
    if (read_table(run, file, &f, error) == AD_OK && f.rows != slices)
        ad_fail(error, AD_E_INPUT,
                "%s: %zu rows, expected one for each slice: %zu; or give --slices %zu", file,
                f.rows, slices, f.rows);
    else if (error->status == AD_OK && check_times(run, &f, error) == AD_OK)
        path = path_new(run, error);
    for (size_t k = 0; path && k < dof; k++)
        for (size_t i = 0; i < slices; i++)
            path[k * slices + i] = f.table[i * f.columns + f.column[k]];
    free_table(&f);
    return path;
}

enum ad_status path_read_end(const struct path_run *run, const char *file, bool last, double *x,
                             struct ad_error *error)
{
    struct path_file f;
    if (read_table(run, file, &f, error) == AD_OK)
        for (size_t k = 0; k < run->system.dof; k++)
            x[k] = f.table[(last ? f.rows - 1 : 0) * f.columns + f.column[k]];
    free_table(&f);
    return error->status;
}
