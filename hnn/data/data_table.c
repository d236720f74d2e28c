/* Stores the chosen columns of a file as rows arrive; times and trials are checked at the same
   time, while line numbers are known. */
#include "data_table.h"
#include "autodiff/ascending.h"
#include "autodiff/free.h"
#include "autodiff/hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const double *hnn_table_column(const struct hnn_table *table, size_t column)
{
    return table->column[table->plan.slot[column]];
}

bool hnn_table_whole(const struct hnn_table *table, size_t k)
{
    size_t column = table->plan.column[k];
    return !table->shared || column == table->plan.time || column == table->plan.trial;
}

const double *hnn_table_row(const struct hnn_table *table, size_t column, size_t row)
{
    bool whole = hnn_table_whole(table, table->plan.slot[column]);
    return hnn_table_column(table, column) + (whole ? row : row - table->from);
}

bool hnn_table_begins(const struct hnn_table *table, size_t row)
{
    if (row == 0)
        return true;
    size_t column = table->by_time ? table->plan.time : table->plan.trial;
    if (column == HNN_NO_COLUMN)
        return false;
    const double *value = hnn_table_column(table, column);
    return table->by_time ? value[row] < value[row - 1] : value[row] != value[row - 1];
}

bool hnn_table_follows(const struct hnn_table *table, size_t row)
{
    if (hnn_table_begins(table, row))
        return false;
    if (table->plan.time == HNN_NO_COLUMN)
        return true;
    const double *time = hnn_table_column(table, table->plan.time);
    return !(time[row] - time[row - 1] > table->longest);
}

static enum ad_status no_memory(const struct hnn_table *table, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory after %zu rows", table->file,
                   table->rows);
}

/* Room for the rows of another read: half as much again. Pages not written to take no memory. */
static enum ad_status make_room(struct hnn_table *table, struct ad_error *error)
{
    size_t capacity = table->capacity, few = PHYS_CSV_ROWS + table->before + table->after + 1;
    if (capacity - table->rows >= PHYS_CSV_ROWS)
        return AD_OK;
    capacity += capacity / 2 + PHYS_CSV_ROWS;
    if (capacity > SIZE_MAX / sizeof(double))
        return no_memory(table, error);
    for (size_t k = 0; k < table->plan.n; k++) {
        double *column = realloc(table->column[k],
                                 (hnn_table_whole(table, k) ? capacity : few) * sizeof *column);
        if (!column)
            return no_memory(table, error);
        table->column[k] = column;
    }
    table->capacity = capacity;
    return AD_OK;
}

/* Row `at` of column k, for which there is room. */
static double *place_of(const struct hnn_table *table, size_t k, size_t at)
{
    return table->column[k] + (hnn_table_whole(table, k) ? at : at - table->from);
}

/* Leaves out those of `rows` new rows from `at` on that lack a value, where the source has not;
   from[i], of `from` that is not NULL, is where row i was among them. */
static size_t leave_out_missing(const struct hnn_table *table, size_t at, size_t rows, size_t *from)
{
    size_t kept = 0;
    for (size_t i = 0; i < rows; i++) {
        bool missing = false;
        for (size_t k = 0; k < table->plan.n; k++) {
            double *column = place_of(table, k, at);
            column[kept] = column[i];
            missing |= isnan(column[i]) != 0;
        }
        if (from)
            from[kept] = i;
        kept += !missing;
    }
    return kept;
}

void hnn_table_slide(struct hnn_table *table, size_t at, size_t keep)
{
    size_t have = at - table->from, kept = have < keep ? have : keep;
    for (size_t k = 0; k < table->plan.n; k++)
        if (!hnn_table_whole(table, k))
            memmove(table->column[k], table->column[k] + have - kept,
                    kept * sizeof **table->column);
    table->from = at - kept;
}

/* Inputs that are neither time nor controls change with this row. Rows without time and trial may
   be states of any motions. */
static bool inputs_vary(const struct hnn_table *table, size_t row)
{
    const struct hnn_plan *plan = &table->plan;
    bool known = plan->time != HNN_NO_COLUMN || plan->trial != HNN_NO_COLUMN;
    for (size_t k = 0; k < plan->inputs - plan->controls && known; k++)
        if (plan->input[k] != plan->time && *hnn_table_row(table, plan->input[k], row) !=
                                                *hnn_table_row(table, plan->input[k], row - 1))
            return true;
    return false;
}

/* Counts trajectories among the last `rows`, in which time has to go on; they were rows `from` of
   the read. */
static enum ad_status look_at_times(struct hnn_table *table, const struct hnn_source *source,
                                    size_t rows, const size_t *from, struct ad_error *error)
{
    const struct hnn_plan *plan = &table->plan;
    const double *time = plan->time != HNN_NO_COLUMN ? hnn_table_column(table, plan->time) : NULL;
    size_t first = table->rows - rows;
    for (size_t i = first; i < table->rows; i++) {
        bool begins = hnn_table_begins(table, i);
        table->trials += begins;
        table->varied |= !begins && inputs_vary(table, i);
        if (!begins && time && !(time[i] > time[i - 1])) {
            char place[256];
            source->kind->place(source, from[i - first], place, sizeof place);
            return ad_fail(error, AD_E_INPUT, "%s: expected a time after %.9g, found %.9g%s", place,
                           time[i - 1], time[i],
                           plan->trial == HNN_NO_COLUMN && !table->by_time
                               ? " (several trajectories need a trial column)"
                               : "");
        }
    }
    return AD_OK;
}

enum ad_status hnn_table_next(struct hnn_table *table, struct hnn_source *source, size_t at,
                              size_t *rows, size_t *kept, size_t *from, struct ad_error *error)
{
    double **to = calloc(source->columns, sizeof *to);
    *rows = *kept = 0;
    if (!to)
        return no_memory(table, error);
    for (size_t k = 0; k < table->plan.n; k++)
        if (table->reads[k])
            to[table->plan.column[k]] = place_of(table, k, at);
    if (source->kind->read(source, PHYS_CSV_ROWS, to, rows, error) == AD_OK)
        *kept = source->skip_missing ? leave_out_missing(table, at, *rows, from) : *rows;
    free(to);
    return error->status;
}

/* After the first read, which tells how many rows HDF5 has, those of ranks' shares alone tell
   trajectories and inputs, and all which rows lack a value. */
static void end_first_read(struct hnn_table *table, bool all)
{
    const struct hnn_plan *plan = &table->plan;
    for (size_t k = 0; k < plan->n; k++)
        table->reads[k] = all || hnn_table_whole(table, k);
    for (size_t k = 0; k < plan->inputs; k++)
        table->reads[plan->slot[plan->input[k]]] = true;
}

static void add_fingerprint(struct hnn_table *table, size_t rows)
{
    for (size_t k = 0; k < table->plan.n; k++)
        if (table->reads[k])
            table->fingerprint = ad_hash(
                table->fingerprint, hnn_table_row(table, table->plan.column[k], table->rows - rows),
                rows * sizeof **table->column);
}

/* Numbers go from the file into the columns of the table. */
static enum ad_status read_rows(struct hnn_table *table, struct hnn_source *source,
                                struct ad_error *error)
{
    size_t *from = malloc(PHYS_CSV_ROWS * sizeof *from), rows = 1, kept;
    if (!from)
        no_memory(table, error);
    for (size_t i = 0; from && i < PHYS_CSV_ROWS; i++)
        from[i] = i;
    while (rows && error->status == AD_OK && make_room(table, error) == AD_OK &&
           hnn_table_next(table, source, table->rows, &rows, &kept, from, error) == AD_OK) {
        table->missing += rows - kept;
        table->rows += kept;
        look_at_times(table, source, kept, from, error);
        if (table->shared) {
            add_fingerprint(table, kept);
            end_first_read(table, source->skip_missing);
            hnn_table_slide(table, table->rows, 1);
        }
    }
    table->fingerprint = ad_hash(table->fingerprint, &source->crc, sizeof source->crc);
    free(from);
    return error->status;
}

/* Rows of one trajectory have to follow each other: no number begins twice. */
static enum ad_status look_at_trials(const struct hnn_table *table, struct ad_error *error)
{
    double *starts = malloc((table->trials + 1) * sizeof *starts);
    size_t n = 0;
    if (!starts)
        return no_memory(table, error);
    for (size_t i = 0; i < table->rows; i++)
        if (hnn_table_begins(table, i))
            starts[n++] = hnn_table_column(table, table->plan.trial)[i];
    qsort(starts, n, sizeof *starts, ad_ascending);
    for (size_t k = 1; k < n && error->status == AD_OK; k++)
        if (starts[k] == starts[k - 1])
            ad_fail(error, AD_E_INPUT, "%s: the rows of trial %.9g are not consecutive",
                    table->file, starts[k]);
    free(starts);
    return error->status;
}

/* Steps longer than this many medians are gaps, with allowance for the digits that times are
   printed with. */
static const double gap = 3 * (1 + 1e-4);

static enum ad_status look_at_steps(struct hnn_table *table, struct ad_error *error)
{
    const double *time = hnn_table_column(table, table->plan.time);
    double *step = malloc((table->rows + 1) * sizeof *step);
    size_t n = 0;
    if (!step)
        return no_memory(table, error);
    for (size_t i = 1; i < table->rows; i++)
        if (!hnn_table_begins(table, i))
            step[n++] = time[i] - time[i - 1];
    qsort(step, n, sizeof *step, ad_ascending);
    table->step = n ? step[n / 2] : 0;
    table->longest = gap * table->step;
    free(step);
    return AD_OK;
}

static void count_uses(struct hnn_table *table)
{
    const struct hnn_plan *plan = &table->plan;
    for (size_t c = 0; c < plan->components; c++) {
        table->uses[plan->slot[plan->state[c]]]++;
        if (plan->rate)
            table->uses[plan->slot[plan->rate[c]]]++;
    }
}

static enum ad_status prepare(const struct hnn_dataset_settings *settings, struct hnn_table *table,
                              const struct hnn_source *source, struct ad_error *error)
{
    const struct hnn_plan *plan = &table->plan;
    const bool differences = !plan->rate && settings->rollout == 0;
    table->before = differences && settings->differences == HNN_CENTRAL;
    table->after = settings->rollout ? settings->rollout : differences;
    table->fingerprint = AD_HASH_BEGIN;
    table->by_time =
        !settings->trial && plan->trial == HNN_NO_COLUMN && plan->time != HNN_NO_COLUMN;
    table->column = calloc(plan->n, sizeof *table->column);
    table->uses = calloc(plan->n, sizeof *table->uses);
    table->reads = malloc(plan->n * sizeof *table->reads);
    table->state_names = hnn_plan_names(source, plan->state, plan->components);
    table->coordinates = hnn_plan_names(source, plan->state, plan->components / 2);
    table->momenta =
        hnn_plan_names(source, plan->state + plan->components / 2, plan->components / 2);
    table->rate_names = hnn_plan_names(source, plan->rate, plan->components);
    table->input_names = hnn_plan_names(source, plan->input, plan->inputs);
    if (!table->column || !table->uses || !table->reads || !table->state_names ||
        !table->coordinates || !table->momenta || !table->rate_names || !table->input_names)
        return no_memory(table, error);
    memset(table->reads, true, plan->n * sizeof *table->reads);
    count_uses(table);
    return AD_OK;
}

static enum ad_status read_table(const struct hnn_dataset_settings *settings, const char *file,
                                 const struct hnn_columns *columns, struct hnn_table *table,
                                 struct ad_error *error)
{
    struct hnn_source *source;
    *table = (struct hnn_table){.file = file ? file : "columns in memory",
                                .shared = hnn_share_possible(settings, file)};
    if ((file ? hnn_source_open(file, settings->skip_rows, &source, error)
              : hnn_columns_open(columns, table->file, &source, error)) != AD_OK)
        return error->status;
    source->skip_missing = settings->skip_missing;
    table->units_line = source->units_line;
    if (hnn_plan_make(settings, source, &table->plan, error) == AD_OK &&
        prepare(settings, table, source, error) == AD_OK)
        read_rows(table, source, error);
    if (error->status == AD_OK && table->plan.trial != HNN_NO_COLUMN)
        look_at_trials(table, error);
    if (error->status == AD_OK && table->plan.time != HNN_NO_COLUMN)
        look_at_steps(table, error);
    table->missing += source->left_out;
    hnn_source_close(source);
    if (error->status == AD_OK && !(table->role = calloc(table->rows + 1, 1)))
        return no_memory(table, error);
    return error->status;
}

enum ad_status hnn_table_read(const struct hnn_dataset_settings *settings, const char *file,
                              const struct hnn_columns *columns, struct hnn_table *table,
                              struct ad_error *error)
{
    read_table(settings, file, columns, table, error);
    return hnn_share_agree(settings, table, error);
}

void hnn_table_release(struct hnn_table *table, size_t column)
{
    size_t k = table->plan.slot[column];
    if (table->shared || --table->uses[k] > 0 || column == table->plan.time ||
        column == table->plan.trial)
        return;
    free(table->column[k]);
    table->column[k] = NULL;
}

void hnn_table_free(struct hnn_table *table)
{
    for (size_t k = 0; table->column && k < table->plan.n; k++)
        free(table->column[k]);
    AD_FREE(table->column, table->uses, table->reads, table->role, table->state_names,
            table->coordinates, table->momenta, table->rate_names, table->input_names);
    hnn_plan_free(&table->plan);
    *table = (struct hnn_table){0};
}
