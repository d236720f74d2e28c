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

enum { STOP = 1, SAVE = 2 };

/* What this rank wants after a step, or any of all ranks: rank 0 says when to save. */
static unsigned wanted(struct train_run *run, const hnn_trainer *trainer)
{
    struct ad_ranks *ranks = run->options->common.ranks;
    bool due = hnn_trainer_seconds(trainer) >= run->next_checkpoint;
    unsigned char mine = (interrupted() ? STOP : 0) | (due ? SAVE : 0);
    if (!ranks)
        return mine;
    mine &= ranks->rank == 0 ? STOP | SAVE : STOP;
    ad_ranks_gather(ranks, &mine, 1, run->wanted, &run->failed);
    for (size_t k = 0; k < ranks->count; k++)
        mine |= run->wanted[k];
    return mine;
}

bool train_after_step(void *context, hnn_trainer *trainer)
{
    struct train_run *run = context;
    unsigned want = wanted(run, trainer);
    show(run);
    if (want & SAVE) {
        struct ad_error ignored = {0}; /* a training does not end for want of its picture */
        train_save(run, &run->failed);
        train_publish(run, false, &ignored);
        run->next_checkpoint = hnn_trainer_seconds(trainer) + run->options->checkpoint;
    }
    return !(want & STOP) && run->failed.status == AD_OK;
}
