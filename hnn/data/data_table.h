/* A data set being read: the plan, the chosen columns, and the use of each row. */
#ifndef HNN_DATA_DATA_TABLE_H
#define HNN_DATA_DATA_TABLE_H

#include "data.h"
#include "data_source.h"

#define HNN_NO_COLUMN SIZE_MAX

/* ---- which columns are what (data_plan.c) ---- */

struct hnn_plan {
    size_t components;    /* 2 dof */
    size_t *state, *rate; /* [components] columns of the file; rate NULL: differences, rollouts */
    size_t time, trial;   /* HNN_NO_COLUMN: none */
    size_t *input, inputs, controls; /* the time first, controls last */
    size_t *column, n;               /* those of the file that are needed, each once */
    size_t *slot;                    /* [columns of the file]: where in `column` */
};
/* Ends with hnn_plan_free, whatever it returned. */
enum ad_status hnn_plan_make(const struct hnn_dataset_settings *settings,
                             const struct hnn_source *source, struct hnn_plan *plan,
                             struct ad_error *error);
void hnn_plan_free(struct hnn_plan *plan);
/* Names of those columns, or numbers, commas between, to be freed. */
char *hnn_plan_names(const struct hnn_source *source, const size_t *column, size_t n);

/* ---- what names alone tell (data_guess.c) ---- */

/* The state into plan->state, which has room for all columns; its rates into plan->rate. */
enum ad_status hnn_guess_state(const struct hnn_source *source, struct hnn_plan *plan,
                               struct ad_error *error);
enum ad_status hnn_guess_rate(const struct hnn_source *source, struct hnn_plan *plan,
                              struct ad_error *error);
/* Where names choose columns, they have to be different. */
enum ad_status hnn_names_check(const struct hnn_dataset_settings *settings,
                               const struct hnn_source *source, struct ad_error *error);

/* ---- which names belong together (data_pairs.c) ---- */

size_t hnn_column_named(const struct hnn_source *source, const char *name); /* or HNN_NO_COLUMN */
/* The column dXdt of column X; HNN_NO_COLUMN. */
size_t hnn_rate_of(const struct hnn_source *source, size_t column);
/* "dXdt", whatever X is. */
bool hnn_named_as_rate(const struct hnn_source *source, size_t column);
/* Puts columns [n] in order, coordinates and then their momenta, where their names tell: q1, p1,
   q2, p2; x, px; theta, p_theta. Where they do not, `paired` is false and they are left alone. */
enum ad_status hnn_pairs_order(const struct hnn_source *source, size_t n, size_t *column,
                               bool *paired, struct ad_error *error);
/* Puts rates [n] into the order of their states, where all names tell. AD_E_INPUT where one rate is
   by name that of another state. */
enum ad_status hnn_rates_match(const struct hnn_source *source, size_t n, const size_t *state,
                               size_t *rate, struct ad_error *error);

/* ---- their numbers (data_table.c) ---- */

/* What a row is for. */
enum hnn_role { HNN_UNUSED, HNN_TRAIN, HNN_TEST };

struct hnn_table {
    struct hnn_plan plan;
    const char *file;
    char *state_names, *coordinates, *momenta, *rate_names, *input_names;
    size_t rows, capacity, trials, missing; /* missing: rows left out */
    bool by_time;         /* time that goes back begins a trajectory, there is no column for it */
    double step;          /* median of the steps of time within trajectories; 0: no time */
    double longest;       /* step that rates and rollouts still cross */
    size_t units_line;    /* of the file, left out; 0: none */
    bool varied;          /* inputs that are neither time nor controls change in a trajectory */
    size_t before, after; /* rows that a sample needs before and after its own */
    double **column;      /* [plan.n], each [rows]; NULL once it is used up */
    size_t *uses;         /* [plan.n] of a column that are still to come */
    unsigned char *role;  /* [rows], enum hnn_role */
    bool shared;          /* among ranks: columns but time and trial hold the rows of a read, and */
    size_t from;          /* those just before; the first of them */
    bool *reads;          /* [plan.n], of a read */
    uint64_t fingerprint; /* hash of what was read first, and of text all of it */
};
/* Reads all rows of a file, or of columns if it is NULL; their roles are HNN_UNUSED. Ends with
   hnn_table_free, whatever it returned. */
enum ad_status hnn_table_read(const struct hnn_dataset_settings *settings, const char *file,
                              const struct hnn_columns *columns, struct hnn_table *table,
                              struct ad_error *error);
void hnn_table_free(struct hnn_table *table);
/* A trajectory begins with this row. */
bool hnn_table_begins(const struct hnn_table *table, size_t row);
/* It follows the row before in time: no trajectory begins, and no gap is between. */
bool hnn_table_follows(const struct hnn_table *table, size_t row);
const double *hnn_table_column(const struct hnn_table *table, size_t column);
/* From a row on that is held. */
const double *hnn_table_row(const struct hnn_table *table, size_t column, size_t row);
/* Of tables shared: a column that is held whole. */
bool hnn_table_whole(const struct hnn_table *table, size_t k);
/* The next rows, of columns k for which `reads` is true, become rows `at` and on: those `kept` that
   lack no value, where rows are left out for that. from (may be NULL): which of the rows they were.
 */
enum ad_status hnn_table_next(struct hnn_table *table, struct hnn_source *source, size_t at,
                              size_t *rows, size_t *kept, size_t *from, struct ad_error *error);
/* Of tables shared: of the rows before `at` the last `keep` stay. */
void hnn_table_slide(struct hnn_table *table, size_t at, size_t keep);
/* Counts a use down; after the last one the column is freed. */
void hnn_table_release(struct hnn_table *table, size_t column);

/* ---- roles (data_split.c) ---- */

/* Every row that has a target: HNN_TRAIN. Returns their number. */
size_t hnn_roles_usable(struct hnn_table *table);
/* Selection sampling: whether the next of `left` items is one of the `wanted`; exactly that many
   are selected in the end. */
bool hnn_select(struct phys_random *random, size_t *wanted, size_t *left);
/* Makes some of `usable` rows HNN_TEST. AD_E_ARGUMENT where that leaves nothing for one part. */
enum ad_status hnn_roles_split(const struct hnn_dataset_settings *settings, struct hnn_table *table,
                               size_t usable, struct ad_error *error);

/* ---- samples (data_samples.c) ---- */

/* One part of a data set while it is filled: n samples, of which begin to end - 1 are held. */
struct hnn_part {
    struct hnn_table *table;
    enum hnn_role role;
    size_t n, begin, end;
    size_t first, last;         /* rows of the samples held are first to last - 1 */
    size_t from, to, taken;     /* the next of them, and how many samples were before */
    bool shared;                /* among ranks */
    double *x, *target, *steps; /* steps: of rollouts, or forward differences */
};
/* Samples of rows from to to - 1, which are held, of parts of one table. */
void hnn_parts_take(const struct hnn_dataset_settings *settings, struct hnn_part *part,
                    size_t parts);

/* Training samples from HNN_TRAIN rows of `table`, test samples from HNN_TEST rows of `test`, which
   may be the same table; their columns are used up. dataset->dof is set. */
enum ad_status hnn_samples_make(const struct hnn_dataset_settings *settings,
                                struct hnn_table *table, struct hnn_table *test,
                                struct hnn_dataset *dataset, struct ad_error *error);

/* ---- shares of ranks (data_share.c) ---- */

/* Whether ranks can each read a share: it is in a file. */
bool hnn_share_possible(const struct hnn_dataset_settings *settings, const char *file);
/* All ranks have read a table; AD_E_INPUT: another one. */
enum ad_status hnn_share_agree(const struct hnn_dataset_settings *settings,
                               const struct hnn_table *table, struct ad_error *error);
/* Fills parts of one table from its file. */
enum ad_status hnn_share_read(const struct hnn_dataset_settings *settings, struct hnn_part *part,
                              size_t parts, struct ad_error *error);

#endif
