/* Records the steps of a path run (path.h). */
#include "autodiff/free.h"
#include "path.h"
#include "apps/interrupt.h"
#include "physics/io/grow.h"

#include <stdlib.h>
#include <string.h>

enum { FRAMES = 60 }; /* kept for a picture, about */

static size_t path_size(const struct path_run *run)
{
    return run->system.dof * run->settings.slices;
}

void path_record_begin(struct path_record *record, const struct path_run *run, phys_hdf5 *file,
                       bool pictures)
{
    *record = (struct path_record){.run = run, .file = file};
    if (pictures)
        record->frame_every = run->settings.steps / FRAMES + 1;
    progress_start(&record->progress, run->options->common.quiet, run->options->common.log);
}

void path_record_free(struct path_record *record)
{
    progress_end(&record->progress);
    AD_FREE(record->figures, record->frame_step, record->frames);
    *record = (struct path_record){0};
}

static bool keep_figures(struct path_record *record, const struct phys_path_step *step)
{
    if (!phys_grow(&record->figures, record->n, sizeof *record->figures))
        return false;
    record->figures[record->n++] =
        (struct phys_path_figures){.action = step->action,
                                   .action_mean = step->action_mean,
                                   .kinetic_mean = step->kinetic_mean,
                                   .potential_mean = step->potential_mean,
                                   .objective = step->objective,
                                   .grad_norm = step->grad_norm};
    return true;
}

static bool keep_frame(struct path_record *record, const struct phys_path_step *step)
{
    size_t size = path_size(record->run), n = record->n_frames;
    if (!phys_grow(&record->frames, n, size * sizeof *record->frames) ||
        !phys_grow(&record->frame_step, n, sizeof *record->frame_step))
        return false;
    memcpy(record->frames + n * size, step->path, size * sizeof *record->frames);
    record->frame_step[n] = step->step;
    record->n_frames++;
    return true;
}

/* Descents take them all; newton ends where the path is stationary: 0, not known. */
static double all_steps(const struct path_record *record)
{
    return record->run->solver->rated ? (double)record->run->settings.steps : 0;
}

static void show(struct path_record *record, const struct phys_path_step *step)
{
    if (progress_due(&record->progress))
        progress_line(&record->progress, (double)step->step, all_steps(record),
                      "%s  step %zu of %zu  S %.6g  |gradient| %.3g",
                      record->run->system.scene->name, step->step, record->run->settings.steps,
                      step->action_mean, step->grad_norm);
}

bool path_record_step(void *context, const struct phys_path_step *step)
{
    struct path_record *record = context;
    if (!keep_figures(record, step))
        record->failed = true;
    if (record->frame_every && step->step % record->frame_every == 0 && !keep_frame(record, step))
        record->failed = true;
    if (record->file && step->step % record->run->every == 0) {
        double number = (double)step->step;
        phys_hdf5_append(record->file, "step", &number);
        phys_hdf5_append(record->file, "path", step->path);
    }
    show(record, step);
    return !record->failed && !interrupted();
}

bool path_record_proceed(void *context)
{
    struct path_record *record = context;
    if (record->n == 0 && progress_due(&record->progress))
        progress_line(&record->progress, 0, 0, "%s  looking for paths, %zu so far",
                      record->run->system.scene->name, record->run->solutions.n);
    else if (progress_due(&record->progress))
        progress_line(&record->progress, (double)record->n, all_steps(record),
                      "%s  step %zu of %zu is under way", record->run->system.scene->name,
                      record->n, record->run->settings.steps);
    return !interrupted();
}
