/* The files a run was asked to write (outputs.h). */
#include "outputs.h"

void outputs_abandon(struct outputs *outputs)
{
    phys_runfile_abandon(outputs->file);
    outputs->file = NULL;
    result_abandon(&outputs->csv);
    plot_abandon(&outputs->plot);
}

enum ad_status outputs_begin(const struct common *common, struct outputs *outputs,
                             struct ad_error *error)
{
    *outputs = (struct outputs){0};
    if ((common->out && phys_runfile_create(common->out, &outputs->file, error) != AD_OK) ||
        result_begin(&outputs->csv, common->csv, error) != AD_OK ||
        (common->plot && plot_begin(&outputs->plot, common->plot, error) != AD_OK))
        outputs_abandon(outputs);
    return error->status;
}

enum ad_status outputs_commit(struct outputs *outputs, struct ad_error *error)
{
    if (phys_runfile_commit(outputs->file, error) == AD_OK &&
        result_commit(&outputs->csv, error) == AD_OK)
        plot_commit(&outputs->plot, error);
    outputs->file = NULL; /* committing frees it, whatever it returns */
    outputs_abandon(outputs);
    return error->status;
}

enum ad_status outputs_finish(struct outputs *outputs, const struct common *common,
                              struct report *report, struct ad_error *error)
{
    if (error->status == AD_OK)
        outputs_commit(outputs, error);
    else
        outputs_abandon(outputs);
    return report_show(report, common, error);
}
