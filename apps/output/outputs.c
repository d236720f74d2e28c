/* The output files of a run (outputs.h). */
#include "outputs.h"
#include "progress.h"
#include "apps/command.h"
#include "apps/interrupt.h"
#include "page.h"

static void abandon(struct outputs *outputs)
{
    phys_hdf5_abandon(outputs->file);
    outputs->file = NULL;
    result_abandon(&outputs->csv);
    result_abandon(&outputs->page);
    plot_abandon(&outputs->plot);
}

/* Rank 0 writes what all have computed. */
static bool is_writer(const struct common *common)
{
    return !common->ranks || common->ranks->rank == 0;
}

static enum ad_status begin(const struct common *common, struct outputs *outputs,
                            struct ad_error *error)
{
    const bool page = page_wanted(common->plot);
    const char *file = page && !common->out ? common->plot : common->out;
    *outputs = (struct outputs){0};
    if (!is_writer(common))
        return AD_OK;
    if (common->log && !progress_log_begin(common->log))
        return ad_fail(error, AD_E_IO, "%s: cannot be written", common->log);
    if ((file && phys_hdf5_create(file, &outputs->file, error) != AD_OK) ||
        result_begin(&outputs->csv, common->csv, error) != AD_OK ||
        (page && result_begin(&outputs->page, common->plot, error) != AD_OK) ||
        (common->plot && !page && plot_begin(&outputs->plot, common->plot, error) != AD_OK))
        abandon(outputs);
    return error->status;
}

static enum ad_status commit(struct outputs *outputs, bool keep_file, struct ad_error *error)
{
    if (!keep_file)
        phys_hdf5_abandon(outputs->file);
    else
        phys_hdf5_commit(outputs->file, error);
    if (error->status == AD_OK && result_commit(&outputs->csv, error) == AD_OK &&
        result_commit(&outputs->page, error) == AD_OK)
        plot_commit(&outputs->plot, error);
    outputs->file = NULL; /* committing frees it, whatever it returns */
    abandon(outputs);
    return error->status;
}

enum ad_status outputs_run(const struct output_kind *kind, const struct common *common, void *run,
                           enum ad_status (*go)(void *run, struct ad_error *error),
                           struct ad_error *error)
{
    struct outputs outputs;
    struct report report = {0};
    if (common->scanning) {
        if ((!kind->begin || kind->begin(run, &(struct outputs){0}, error) == AD_OK) &&
            (!go || go(run, error) == AD_OK))
            kind->report(run, &report);
        return report_show(&report, common, error);
    }
    begin(common, &outputs, error);
    if (ad_ranks_agree(common->ranks, error) != AD_OK) {
        abandon(&outputs);
        return error->status;
    }
    if ((!kind->begin || kind->begin(run, &outputs, error) == AD_OK) &&
        (!go || go(run, error) == AD_OK)) {
        interrupt_finish();
        kind->report(run, &report);
        if (outputs.file) {
            phys_hdf5_text(outputs.file, "/", "program", "leastaction " LEASTACTION_VERSION);
            phys_hdf5_text(outputs.file, "/", "command", common->command);
            if (report_file(&report, outputs.file, error) == AD_OK &&
                kind->file(run, outputs.file, error) == AD_OK && outputs.page.out)
                page_of_run(outputs.file, common->plot, outputs.page.out, error);
        }
        if (outputs.csv.out && error->status == AD_OK)
            kind->csv(run, outputs.csv.out);
        if (outputs.plot.script && error->status == AD_OK)
            kind->picture(run, &outputs.plot, error);
    }
    if (error->status == AD_OK && is_writer(common))
        commit(&outputs, common->out != NULL, error);
    else
        abandon(&outputs);
    return report_show(&report, common, error); /* nothing where a file cannot be written */
}
