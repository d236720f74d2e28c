/* Reads data sets (data.h): a table is read, its rows are divided into training and test and become
   samples. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "data_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const hnn_differences_names[] = {"forward", "central", NULL};
const char *const hnn_split_names[] = {"tail", "random", "trial", NULL};

/* The test has data of its own. */
static bool has_test(const struct hnn_dataset_settings *s)
{
    return s->test_file || s->test_columns;
}

static enum ad_status check_settings(const struct hnn_dataset_settings *s, struct ad_error *error)
{
    double f = s->test_fraction;
    if (!s->file == !s->columns)
        return ad_fail(error, AD_E_ARGUMENT, "a data set needs a file or columns, got %s",
                       s->file ? "both" : "none");
    if (s->test_file && s->test_columns)
        return ad_fail(error, AD_E_ARGUMENT, "test samples: expected a file or columns, got both");
    if (s->columns && s->skip_rows)
        return ad_fail(error, AD_E_ARGUMENT, "lines are skipped in files alone, not in columns");
    if (s->differences > HNN_CENTRAL || s->split > HNN_SPLIT_TRIAL)
        return ad_fail(error, AD_E_ARGUMENT,
                       "differences and split of a data set: expected 0 to %d and 0 to %d, got %d "
                       "and %d",
                       HNN_CENTRAL, HNN_SPLIT_TRIAL, (int)s->differences, (int)s->split);
    if (!(f >= 0 && f < 1))
        return ad_fail(error, AD_E_ARGUMENT,
                       "test fraction: expected at least 0 and less than 1, got %g", f);
    if (f > 0 && has_test(s))
        return ad_fail(
            error, AD_E_ARGUMENT,
            "test samples: expected a file of their own or a fraction, got both; leave one out");
    if (s->rollout > HNN_ROLLOUT_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "rollout: expected at most %d steps, got %zu",
                       HNN_ROLLOUT_MOST, s->rollout);
    if (s->rollout && !s->time && !(s->dt > 0 && isfinite(s->dt)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "a loss on rollouts needs the time column, or the time step");
    if (s->rollout && !s->time && s->skip_missing)
        return ad_fail(error, AD_E_ARGUMENT, "rollouts with skipped rows need the time column");
    return AD_OK;
}

/* ---- sizes of states and rates ---- */

/* Rows of states and rates, and what is to be summed of each. */
struct moments {
    const struct hnn_samples *samples;
    size_t x_rows, held, rows;
    const double *mean; /* [rows]; NULL: sums of the values, else of squares about it */
};

static void add_moments(void *context, size_t k, double *sum)
{
    const struct moments *m = context;
    for (size_t r = 0; r < m->rows; r++) {
        const double *row = r < m->x_rows ? m->samples->x + r * m->held
                                          : m->samples->target + (r - m->x_rows) * m->held;
        sum[r] += m->mean ? (row[k] - m->mean[r]) * (row[k] - m->mean[r]) : row[k];
    }
}

/* Squares of q_next - q of all sites: of a ring, and between walls. */
static void add_squares_apart(void *context, size_t k, double *sum)
{
    const struct hnn_dataset *data = context;
    const size_t held = hnn_samples_held(&data->train), last = data->dof - 1;
    const double *q = data->train.x + k;
    double inside = 0;
    for (size_t site = 0; site < last; site++)
        inside += pow(q[(site + 1) * held] - q[site * held], 2);
    sum[0] += inside + pow(q[0] - q[last * held], 2);
    sum[1] += inside + pow(q[last * held], 2);
}

/* Squares of the rates in the first step of rollouts. */
static void add_first_rates(void *context, size_t k, double *sum)
{
    const struct hnn_dataset *data = context;
    const struct hnn_samples *s = &data->train;
    const size_t held = hnn_samples_held(s);
    for (size_t r = 0; r < 2 * data->dof; r++)
        sum[r] += pow((s->target[r * held + k] - s->x[r * held + k]) / s->steps[k], 2);
}

/* A component that never changes keeps its unit. */
static double positive(double size) { return size > 0 ? size : 1; }

static enum ad_status measure_scales(const struct hnn_dataset_settings *s,
                                     struct hnn_dataset *dataset, struct ad_error *error)
{
    const struct hnn_samples *train = &dataset->train;
    const size_t n = 2 * dataset->dof, wide = n + dataset->inputs,
                 rows = wide + (s->rollout ? 0 : n);
    struct moments m = {train, wide, hnn_samples_held(train), rows, NULL};
    double *mean = malloc(2 * rows * sizeof *mean), *square = mean ? mean + rows : NULL;
    dataset->centre = malloc((2 * wide + n) * sizeof(double));
    if (!mean || !dataset->centre)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (ad_ranks_agree(s->ranks, error) == AD_OK)
        hnn_samples_sum(s->ranks, train, rows, add_moments, &m, mean, error);
    for (size_t r = 0; r < rows && error->status == AD_OK; r++)
        mean[r] /= (double)train->n;
    m.mean = mean;
    if (error->status == AD_OK &&
        hnn_samples_sum(s->ranks, train, rows, add_moments, &m, square, error) == AD_OK) {
        dataset->scale = dataset->centre + wide;
        dataset->rate = dataset->scale + wide;
        for (size_t r = 0; r < rows; r++) {
            double deviation = sqrt(square[r] / (double)train->n);
            if (r < wide) {
                dataset->centre[r] = mean[r];
                dataset->scale[r] = positive(deviation);
            } else
                dataset->rate[r - wide] = positive(hypot(mean[r], deviation));
        }
    }
    free(mean);
    if (error->status == AD_OK && s->rollout &&
        hnn_samples_sum(s->ranks, train, n, add_first_rates, dataset, dataset->rate, error) ==
            AD_OK)
        for (size_t r = 0; r < n; r++)
            dataset->rate[r] = sqrt(dataset->rate[r] / (double)train->n);
    if (error->status == AD_OK && hnn_samples_sum(s->ranks, train, 2, add_squares_apart, dataset,
                                                  dataset->apart, error) == AD_OK)
        for (size_t k = 0; k < 2; k++)
            dataset->apart[k] =
                positive(sqrt(dataset->apart[k] / (double)(train->n * dataset->dof)));
    return error->status;
}

enum ad_status hnn_dataset_normalise(const struct hnn_dataset *data, hnn_model *model,
                                     struct ad_error *error)
{
    if (AD_LACKS(error, data, model))
        return error->status;
    const size_t rows = 2 * data->dof + data->inputs;
    double *centre = calloc(2 * (rows + 1), sizeof *centre);
    if (!centre)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *scale = centre + rows + 1;
    memcpy(centre, data->centre, rows * sizeof *centre);
    memcpy(scale, data->scale, rows * sizeof *scale);
    scale[rows] = data->apart[hnn_model_settings(model)->lattice == HNN_FIXED_ENDS];
    hnn_model_normalise(model, centre, scale, data->rate, error);
    free(centre);
    return error->status;
}

/* ---- the data set ---- */

/* Steps of rollouts are those of the file. */
static enum ad_status find_step(const struct hnn_dataset_settings *s, const struct hnn_table *table,
                                double *dt, struct ad_error *error)
{
    *dt = table->plan.time == HNN_NO_COLUMN ? s->dt : table->step;
    if (s->dt > 0 && fabs(s->dt - *dt) > 1e-4 * *dt)
        return ad_fail(error, AD_E_ARGUMENT, "%s: the time step is %.9g there, not %.9g",
                       table->file, *dt, s->dt);
    return AD_OK;
}

/* Properties of all samples, and the use of each row. */
static enum ad_status assign(const struct hnn_dataset_settings *s, struct hnn_table *table,
                             struct hnn_dataset *dataset, struct ad_error *error)
{
    size_t usable = hnn_roles_usable(table);
    if (usable == 0)
        return ad_fail(
            error, AD_E_INPUT,
            "%s: %zu rows of %zu trajectories give no samples: expected more consecutive rows",
            table->file, table->rows, table->trials);
    if (s->rollout && find_step(s, table, &dataset->dt, error) != AD_OK)
        return error->status;
    return s->test_fraction > 0 ? hnn_roles_split(s, table, usable, error) : AD_OK;
}

/* Numbers of skipped rows and gaps, for the caller's report. */
static void note_left_out(struct hnn_dataset *dataset, const struct hnn_table *table)
{
    bool needs_steps = !table->plan.rate && table->plan.time != HNN_NO_COLUMN;
    for (size_t i = 1; i < table->rows && needs_steps; i++)
        dataset->gaps += !hnn_table_begins(table, i) && !hnn_table_follows(table, i);
    dataset->longest = fmax(dataset->longest, table->longest);
    dataset->missing += table->missing;
}

/* Reads the test set from a file of its own. */
static enum ad_status read_test(const struct hnn_dataset_settings *s, struct hnn_dataset *dataset,
                                struct hnn_table *test, struct ad_error *error)
{
    struct hnn_dataset other = {0};
    if (hnn_table_read(s, s->test_file, s->test_columns, test, error) != AD_OK ||
        assign(s, test, &other, error) != AD_OK)
        return error->status;
    if (test->plan.components != 2 * dataset->dof)
        return ad_fail(error, AD_E_INPUT, "%s: expected %zu columns of state as in %s, found %zu",
                       test->file, 2 * dataset->dof, s->file ? s->file : "the columns",
                       test->plan.components);
    for (size_t i = 0; i < test->rows; i++)
        if (test->role[i] == HNN_TRAIN)
            test->role[i] = HNN_TEST;
    note_left_out(dataset, test);
    return AD_OK;
}

static void take_names(struct hnn_dataset *dataset, struct hnn_table *table)
{
    dataset->state_names = table->state_names;
    dataset->rate_names = table->rate_names;
    dataset->coordinates = table->coordinates;
    dataset->momenta = table->momenta;
    dataset->input_names = table->input_names;
    table->state_names = table->coordinates = table->momenta = table->rate_names = NULL;
    table->input_names = NULL;
}

enum ad_status hnn_dataset_read(const struct hnn_dataset_settings *settings,
                                struct hnn_dataset *dataset, struct ad_error *error)
{
    struct hnn_table table = {0}, other = {0};
    if (dataset)
        *dataset = (struct hnn_dataset){0};
    if (AD_LACKS(error, settings, dataset))
        return error->status;
    AD_OWN(hnn_dataset_settings, settings, seed, error);
    if (check_settings(settings, error) == AD_OK &&
        hnn_table_read(settings, settings->file, settings->columns, &table, error) == AD_OK &&
        assign(settings, &table, dataset, error) == AD_OK) {
        dataset->dof = table.plan.components / 2;
        dataset->inputs = table.plan.inputs;
        dataset->controls = table.plan.controls;
        dataset->timed = table.plan.inputs && table.plan.input[0] == table.plan.time;
        dataset->varied = table.varied;
        dataset->trials = table.trials;
        dataset->trials_by_time = table.by_time && table.trials > 1;
        dataset->units_line = table.units_line;
        note_left_out(dataset, &table);
        take_names(dataset, &table);
        bool apart = has_test(settings);
        if ((!apart || read_test(settings, dataset, &other, error) == AD_OK) &&
            (hnn_samples_make(settings, &table, apart ? &other : &table, dataset, error),
             ad_ranks_agree(settings->ranks, error)) == AD_OK)
            measure_scales(settings, dataset, error);
    }
    hnn_table_free(&other);
    hnn_table_free(&table);
    return error->status;
}

void hnn_dataset_free(struct hnn_dataset *dataset)
{
    if (!dataset)
        return;
    AD_FREE(dataset->values, dataset->centre, dataset->state_names, dataset->coordinates,
            dataset->momenta, dataset->rate_names, dataset->input_names);
    *dataset = (struct hnn_dataset){0};
}
