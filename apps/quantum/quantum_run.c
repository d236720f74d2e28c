/* Runs a wave packet (quantum.h). */
#include "apps/interrupt.h"
#include "quantum.h"

static bool after_slice(void *context, size_t slice)
{
    struct quantum_run *run = context;
    if (progress_due(&run->progress))
        progress_line(&run->progress, (double)slice, (double)run->settings.steps,
                      "slice %zu of %zu", slice, run->settings.steps);
    return !interrupted();
}

enum ad_status quantum_run(void *context, struct ad_error *error)
{
    struct quantum_run *run = context;
    run->settings.progress = after_slice;
    run->settings.context = run;
    progress_start(&run->progress, run->options->common.quiet, run->options->common.log);
    interrupt_catch();
    qm_run(&run->settings, &run->result, error);
    progress_end(&run->progress);
    return error->status;
}
