/* The history of a training, as CSV and as a picture: whole files, replaced at every checkpoint. */
#include "train.h"
#include "apps/output/figure.h"
#include "apps/output/page.h"
#include "apps/output/result.h"
#include "apps/quote.h"

#include <math.h>
#include <string.h>

/* Of the step that ends a row; lbfgs has none. */
static double rate_of(const struct train_run *run, const struct hnn_row *row)
{
    const struct hnn_training *s = &run->settings;
    bool searched = strcmp(run->options->optimiser, "lbfgs") == 0;
    return searched ? (double)NAN : s->learning_rate * s->schedule->factor(row->step - 1, s->steps);
}

/* Seconds and rates of steps before a resume, which may have had another length, are not known any
   more: their cells are empty. */
static void write_log(const struct train_run *run, FILE *out)
{
    size_t n;
    const struct hnn_row *row = hnn_trainer_history(run->trainer, &n);
    fputs("step,train_loss,test_loss,seconds,learning_rate\n", out);
    for (size_t k = 0; k < n; k++) {
        fprintf(out, "%zu", row[k].step);
        csv_number(out, 9, row[k].train_loss);
        csv_number(out, 9, row[k].test_loss);
        csv_number(out, 9, row[k].seconds);
        csv_number(out, 9, isnan(row[k].seconds) ? row[k].seconds : rate_of(run, &row[k]));
        fputc('\n', out);
    }
}

/* What a logarithmic axis can show; returns whether there is any. */
static bool write_losses(const struct train_run *run, FILE *out, bool *tested)
{
    size_t n, shown = 0;
    const struct hnn_row *row = hnn_trainer_history(run->trainer, &n);
    fputs("# step, train loss, test loss\n", out);
    *tested = false;
    for (size_t k = 0; k < n; k++) {
        const double loss[] = {row[k].train_loss, row[k].test_loss};
        fprintf(out, "%zu", row[k].step);
        for (int i = 0; i < 2; i++)
            if (isfinite(loss[i]) && loss[i] > 0)
                fprintf(out, " %.9g", loss[i]);
            else
                fputs(" NaN", out);
        fputc('\n', out);
        shown += isfinite(loss[0]) && loss[0] > 0;
        *tested = *tested || (isfinite(loss[1]) && loss[1] > 0);
    }
    return shown > 0;
}

/* train, test: the present losses. */
static void draw(const struct train_run *run, double train, double test, struct plot *plot)
{
    struct line found = {0};
    struct figure figure;
    struct layout layout = figure_pair;
    bool tested, any = write_losses(run, plot->data, &tested);
    const double zero = run->loss_of_zero;
    const size_t step = hnn_trainer_step(run->trainer);
    line_add(&found, "%zu of %zu steps", step, run->settings.steps);
    line_add(&found, "train loss %.3g", train);
    if (isfinite(test))
        line_add(&found, "test loss %.3g", test);
    layout.columns = 1;
    layout.found = found.text;
    layout.expression = "sprintf('train %s', what)";
    fputs("what = ", plot->script);
    quote_gnuplot_label(plot->script, train_model_name(run));
    fputc('\n', plot->script);
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure, &(struct panel){.x = "step",
                                          .y = "loss",
                                          .log = any ? "y" : NULL,
                                          .x_range = "[0:*]",
                                          .key = KEY_ABOVE});
    if (any)
        figure_draw(&figure, STYLE(figure_colours[0], 0, 1.6, 0), "train", "data using 1:2");
    if (tested)
        figure_draw(&figure, STYLE(figure_colours[1], 0, 1.6, 0), "test", "data using 1:3");
    if (zero > 0)
        figure_draw(&figure, STYLE(COLOUR_REFERENCE, 0, 1.6, 0), "of a field of 0", "%.9g", zero);
    figure_end(&figure);
}

static bool is_stream(const char *log) { return log && strcmp(log, "-") == 0; }

enum ad_status train_publish(const struct train_run *run, bool last, struct ad_error *error)
{
    const struct train_options *o = run->options;
    struct result log;
    struct plot plot;
    double train = NAN, test = NAN;
    if (o->common.plot) { /* all ranks share these */
        train = hnn_trainer_train_loss(run->trainer);
        test = hnn_trainer_test_loss(run->trainer);
    }
    if (o->common.ranks && o->common.ranks->rank > 0)
        return error->status;
    if (o->log && (last || !is_stream(o->log)) && result_begin(&log, o->log, error) == AD_OK) {
        write_log(run, log.out);
        result_commit(&log, error);
    }
    if (o->common.plot && error->status == AD_OK &&
        plot_begin(&plot, o->common.plot, error) == AD_OK) {
        draw(run, train, test, &plot);
        plot_commit(&plot, error);
    }
    return error->status;
}

enum ad_status train_check_outputs(const struct train_options *o, struct ad_error *error)
{
    struct phys_atomic_file file;
    struct plot plot;
    if (o->common.ranks && o->common.ranks->rank > 0)
        return AD_OK;
    if (page_wanted(o->common.plot))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--plot: expected a name ending in .svg, .png or .gif, got '%s'; try "
                       "leastaction view on the model for a page",
                       o->common.plot);
    const char *const names[] = {o->common.out, is_stream(o->log) ? NULL : o->log};
    for (size_t k = 0; k < 2; k++)
        if (names[k] && phys_atomic_file_begin(&file, names[k], error) == AD_OK)
            phys_atomic_file_abandon(&file);
    if (o->common.plot && error->status == AD_OK &&
        plot_begin(&plot, o->common.plot, error) == AD_OK)
        plot_abandon(&plot);
    return error->status;
}
