/* A data set on its way from a file: the plan, the chosen columns, and what becomes of each row. */
#ifndef HNN_DATA_TABLE_H
#define HNN_DATA_TABLE_H

#include "data.h"
#include "data_source.h"

#define HNN_NO_COLUMN SIZE_MAX

/* ---- which columns are what (data_plan.c) ---- */

struct hnn_plan {
    size_t components;    /* 2 dof */
    size_t *state, *rate; /* [components] columns of the file; rate NULL: differences, rollouts */
    size_t time, trial;   /* HNN_NO_COLUMN: none */
    size_t *column, n;    /* those of the file that are needed, each once */
    size_t *slot;         /* [columns of the file]: where in `column` */
};
/* Ends with hnn_plan_free, whatever it returned. */
enum ad_status hnn_plan_make(const struct hnn_dataset_settings *settings,
                             const struct hnn_source *source, struct hnn_plan *plan,
                             struct ad_error *error);
void hnn_plan_free(struct hnn_plan *plan);
/* Names of those columns, or numbers, commas between, to be freed. */
char *hnn_plan_names(const struct hnn_source *source, const size_t *column, size_t n);

/* ---- their numbers (data_table.c) ---- */

/* What a row is for. */
enum hnn_role { HNN_UNUSED, HNN_TRAIN, HNN_TEST };

struct hnn_table {
    struct hnn_plan plan;
    const char *file;
    char *state_names, *rate_names;
    size_t rows, capacity, trials;
    double **column;     /* [plan.n], each [rows]; NULL once it is used up */
    size_t *uses;        /* [plan.n] of a column that are still to come */
    unsigned char *role; /* [rows], enum hnn_role */
};
/* Reads all rows; their roles are HNN_UNUSED. Ends with hnn_table_free, whatever it returned. */
enum ad_status hnn_table_read(const struct hnn_dataset_settings *settings, const char *file,
                              struct hnn_table *table, struct ad_error *error);
void hnn_table_free(struct hnn_table *table);
/* A trajectory begins with this row. */
bool hnn_table_begins(const struct hnn_table *table, size_t row);
const double *hnn_table_column(const struct hnn_table *table, size_t column);
/* Counts a use down; after the last one the column is freed. */
void hnn_table_release(struct hnn_table *table, size_t column);

/* ---- roles (data_split.c) ---- */

/* Every row that has a target: HNN_TRAIN. Returns their number. */
size_t hnn_roles_usable(const struct hnn_dataset_settings *settings, struct hnn_table *table);
/* Makes some of `usable` rows HNN_TEST. AD_E_ARGUMENT where that leaves nothing for one part. */
enum ad_status hnn_roles_split(const struct hnn_dataset_settings *settings, struct hnn_table *table,
                               size_t usable, struct ad_error *error);

#endif
