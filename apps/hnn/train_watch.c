/* Between the steps of a training: the progress line, and checkpoints. */
#include "train.h"
#include "apps/interrupt.h"

#include <math.h>

static void show(struct train_run *run)
{
    size_t rows;
    const struct hnn_row *history = hnn_trainer_history(run->trainer, &rows);
    if (rows == 0 || !progress_due(&run->progress))
        return;
    const struct hnn_row *row = &history[rows - 1];
    double done = (double)hnn_trainer_step(run->trainer), all = (double)run->settings.steps;
    if (isfinite(row->test_loss))
        progress_line(&run->progress, done, all,
                      "step %.0f of %.0f, train loss %.4g, test loss %.4g", done, all,
                      row->train_loss, row->test_loss);
    else
        progress_line(&run->progress, done, all, "step %.0f of %.0f, train loss %.4g", done, all,
                      row->train_loss);
}

enum ad_status train_save(struct train_run *run, struct ad_error *error)
{
    const struct common *common = &run->options->common;
    return hnn_trainer_save(run->trainer, common->out, common->command, error);
}

/* What any rank wants after a step; rank 0 says when to save. */
static void decide(struct train_run *run, const hnn_trainer *trainer, bool *stop, bool *save)
{
    struct ad_ranks *ranks = run->options->common.ranks;
    bool due = hnn_trainer_seconds(trainer) >= run->next_checkpoint;
    double wanted[2] = {interrupted() ? -1 : 0, due && (!ranks || ranks->rank == 0) ? -1 : 0};
    ad_ranks_least(ranks, 2, wanted, &run->failed);
    *stop = wanted[0] < 0;
    *save = wanted[1] < 0;
}

bool train_after_step(void *context, hnn_trainer *trainer)
{
    struct train_run *run = context;
    bool stop, save;
    decide(run, trainer, &stop, &save);
    show(run);
    if (save) {
        struct ad_error ignored = {0}; /* a training does not end for want of its picture */
        train_save(run, &run->failed);
        train_publish(run, false, &ignored);
        run->next_checkpoint = hnn_trainer_seconds(trainer) + run->options->checkpoint;
    }
    return !stop && run->failed.status == AD_OK;
}
