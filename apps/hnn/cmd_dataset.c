/* leastaction dataset: observations of the systems of the published Hamiltonian neural networks;
   dataset_pixels.c renders frames. */
#include "apps/command.h"
#include "dataset.h"
#include "apps/output/result.h"
#include "autodiff/clock.h"
#include "hnn/data/data.h"
#include "hnn/pixels/frames.h"
#include "physics/io/hdf5_file.h"

#include <stdlib.h>
#include <string.h>

/* ---- options ---- */

static struct hnn_sampling sampling_of(const struct hnn_task *task, const struct dataset_options *o)
{
    struct hnn_sampling s = task->published;
    s.trials = option_count_or(o->trials, s.trials);
    s.points = option_count_or(o->points, s.points);
    s.time = option_number_or(o->time, s.time);
    s.noise = option_number_or(o->noise, s.noise);
    s.radius_min = option_number_or(o->min_radius, s.radius_min);
    s.radius_max = option_number_or(o->max_radius, s.radius_max);
    s.spread = option_number_or(o->spread, s.spread);
    s.strength = option_number_or(o->strength, s.strength);
    return s;
}

/* ---- CSV ---- */

static void write_csv(const struct hnn_observations *o, FILE *out)
{
    for (size_t k = 0; k < o->cols; k++)
        fprintf(out, "%s%s", k ? "," : "", o->names[k]);
    fputc('\n', out);
    for (size_t i = 0; i < o->rows; i++)
        for (size_t k = 0; k < o->cols; k++)
            fprintf(out, "%.17g%c", o->values[k * o->rows + i], k + 1 < o->cols ? ',' : '\n');
}

static enum ad_status save_csv(const struct hnn_observations *o, const char *file,
                               struct ad_error *error)
{
    struct result result;
    if (result_begin(&result, file, error) != AD_OK)
        return error->status;
    write_csv(o, result.out);
    return result_commit(&result, error);
}

/* ---- HDF5 ---- */

static char *joined_names(const struct hnn_observations *o)
{
    size_t size = 1;
    for (size_t k = 0; k < o->cols; k++)
        size += strlen(o->names[k]) + 1;
    char *text = malloc(size), *to = text;
    for (size_t k = 0; k < o->cols && text; k++) {
        to = stpcpy(to, k ? "," : "");
        to = stpcpy(to, o->names[k]);
    }
    return text;
}

static void write_settings(const struct hnn_task *task, const struct hnn_sampling *s,
                           const struct common *common, phys_hdf5 *file)
{
    phys_hdf5_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_hdf5_text(file, "/", "command", common->command);
    phys_hdf5_text(file, "/", "task", task->name);
    phys_hdf5_text(file, "/", "hamiltonian", task->what);
    phys_hdf5_integer(file, "/", "seed", (int64_t)common->seed, NULL);
    phys_hdf5_integer(file, "/", "trials", (int64_t)s->trials, NULL);
    phys_hdf5_integer(file, "/", "points", (int64_t)s->points, NULL);
    phys_hdf5_number(file, "/", "time", s->time, "1");
    phys_hdf5_number(file, "/", "noise", s->noise, "1");
    phys_hdf5_number(file, "/", "min_radius", s->radius_min, "1");
    phys_hdf5_number(file, "/", "max_radius", s->radius_max, "1");
    phys_hdf5_number(file, "/", "spread", s->spread, "1");
    phys_hdf5_number(file, "/", "strength", s->strength, "1");
}

static enum ad_status save_hdf5(const struct hnn_task *task, const struct hnn_sampling *s,
                                const struct common *common, const struct hnn_observations *o,
                                const char *name, struct ad_error *error)
{
    phys_hdf5 *file;
    char *columns = joined_names(o);
    if (!columns)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_hdf5_create(name, &file, error) == AD_OK) {
        write_settings(task, s, common, file);
        phys_hdf5_text(file, "/", "columns", columns);
        for (size_t k = 0; k < o->cols; k++) {
            phys_hdf5_write(file, o->names[k], AD_F64, 1, &o->rows, o->values + k * o->rows);
            phys_hdf5_text(file, o->names[k], "unit", "1");
        }
        phys_hdf5_commit(file, error);
    }
    free(columns);
    return error->status;
}

/* ---- the command ---- */

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n >= m && strcmp(text + n - m, end) == 0;
}

bool dataset_is_hdf5(const char *out) { return ends_with(out, ".h5") || ends_with(out, ".hdf5"); }

enum ad_status dataset_show(struct report *report, const struct dataset_options *options,
                            double seconds, struct ad_error *error)
{
    struct common common = options->common;
    report_line(report, "  in %.3g s", seconds);
    report_number(report, "seconds", NULL, "s", seconds);
    report_text(report, "out", "file", options->out);
    common.quiet = common.quiet || strcmp(options->out, "-") == 0;
    return report_show(report, &common, error);
}

static enum ad_status show(const struct hnn_task *task, const struct hnn_sampling *s,
                           const struct hnn_observations *o, const struct dataset_options *options,
                           double seconds, struct ad_error *error)
{
    struct report report = {0};
    report_line(&report, "%s: %zu trajectories of %zu observations", task->name, s->trials,
                s->points);
    report_text(&report, "task", NULL, task->name);
    report_count(&report, "trials", NULL, s->trials);
    report_count(&report, "points", NULL, s->points);
    report_count(&report, "rows", "rows", o->rows);
    report_count(&report, "columns", "columns", o->cols);
    return dataset_show(&report, options, seconds, error);
}

/* A file that cannot be written is found before anything is computed. */
static enum ad_status check_out(const char *name, struct ad_error *error)
{
    struct phys_atomic_file file;
    if (!name)
        return ad_fail(error, AD_E_ARGUMENT,
                       "missing --out FILE.csv or FILE.h5; - is CSV on "
                       "standard output");
    if (strcmp(name, "-") != 0 && phys_atomic_file_begin(&file, name, error) == AD_OK)
        phys_atomic_file_abandon(&file);
    return error->status;
}

/* A task of motion from the table; NULL, without an error, is "pixels". */
static const struct hnn_task *find_task(const char *name, struct ad_error *error)
{
    const char *names[16];
    size_t n = 0;
    for (; hnn_tasks[n] && n + 1 < sizeof names / sizeof *names; n++)
        names[n] = hnn_tasks[n]->name;
    names[n] = "pixels";
    size_t k = phys_find("task", name, n + 1, names, error);
    return k < n ? hnn_tasks[k] : NULL;
}

static enum ad_status observe(const struct hnn_task *task, const struct dataset_options *options,
                              struct ad_error *error)
{
    struct hnn_observations observations = {0};
    struct hnn_sampling sampling = sampling_of(task, options);
    double start = ad_now();
    if (hnn_task_observe(task, &sampling, options->common.seed, &observations, error) == AD_OK) {
        double seconds = ad_now() - start;
        if ((dataset_is_hdf5(options->out)
                 ? save_hdf5(task, &sampling, &options->common, &observations, options->out, error)
                 : save_csv(&observations, options->out, error)) == AD_OK)
            show(task, &sampling, &observations, options, seconds, error);
    }
    hnn_observations_free(&observations);
    return error->status;
}

/* ---- frames of bodies ---- */

static enum ad_status save_frames(const struct hnn_task *task, const struct hnn_sampling *s,
                                  const struct dataset_options *options,
                                  const struct hnn_frames *frames, struct ad_error *error)
{
    phys_hdf5 *file;
    if (phys_hdf5_create(options->out, &file, error) != AD_OK)
        return error->status;
    write_settings(task, s, &options->common, file);
    phys_hdf5_number(file, "/", "right", frames->rod.right, "1");
    phys_hdf5_text(file, "/", "filter", hnn_filters[frames->rod.filter]);
    hnn_frames_write(frames, file);
    return phys_hdf5_commit(file, error);
}

static enum ad_status draw_bodies(const struct hnn_task *task,
                                  const struct dataset_options *options, struct ad_error *error)
{
    struct hnn_video_settings video = hnn_video_published();
    struct hnn_sampling sampling = sampling_of(task, options);
    struct hnn_frames frames = {0};
    if (dataset_check_hdf5(options, error) != AD_OK ||
        dataset_read_size(options->size, &video, error) != AD_OK ||
        (options->filter && hnn_filter_find(options->filter, &video.rod.filter, error) != AD_OK))
        return error->status;
    double start = ad_now();
    if (hnn_bodies_video(task, &sampling, video.height, video.width, video.rod.filter,
                         options->common.seed, &frames, error) == AD_OK &&
        save_frames(task, &sampling, options, &frames, error) == AD_OK)
        dataset_show_frames(options, task->name, &frames, ad_now() - start, error);
    hnn_frames_free(&frames);
    return error->status;
}

#define AT(member) offsetof(struct dataset_options, member)

static const struct option table[] = {
    {"out", "FILE", OPTION_OUTPUT, NULL, "FILE.h5 is HDF5, any other CSV; - is standard output",
     AT(out)},
    {"trials", "N", OPTION_COUNT, NULL, "trajectories [published]", AT(trials)},
    {"points", "N", OPTION_COUNT, NULL, "observations of each [published]", AT(points)},
    {"time", "T", OPTION_NUMBER, NULL, "of the last of them [published]", AT(time)},
    {"noise", "SIGMA", OPTION_NUMBER, NULL, "added to states, not to rates [published]", AT(noise)},
    {"min-radius", "R", OPTION_NUMBER, NULL, "of starts [published]", AT(min_radius)},
    {"max-radius", "R", OPTION_NUMBER, NULL, "of starts [published]", AT(max_radius)},
    {"spread", "X", OPTION_NUMBER, NULL, "of speeds about circular motion [published]", AT(spread)},
    {"strength", "K", OPTION_NUMBER, NULL, "of the potential [published]", AT(strength)},
    {"size", "N", OPTION_TEXT, NULL,
     "of frames, in pixels: N, or HEIGHT,WIDTH [28]; of twobody and threebody: frames are drawn",
     AT(size)},
    {"filter", "NAME", OPTION_TEXT, NULL,
     "filter of a pixel: area (exact), or bilinear (smoother, as published) [area]", AT(filter)},
    {"rows", "A,B", OPTION_TEXT, NULL, "that frames show of a screen of 500 [220,390]", AT(rows)},
    {"columns", "A,B", OPTION_TEXT, NULL, "likewise [165,335]", AT(columns)},
    {"dt", "DT", OPTION_NUMBER, NULL, "seconds between frames [0.05]", AT(dt)},
    {"max-angle", "A", OPTION_NUMBER, NULL, "of starts, from hanging [pi/6]", AT(max_angle)},
    {"max-speed", "W", OPTION_NUMBER, NULL, "of starts, rad/s [1]", AT(max_speed)},
};

/* An option that would do nothing is refused. */
static enum ad_status check_options(const struct dataset_options *options, bool pixels,
                                    struct ad_error *error)
{
    return pixels ? options_refuse(&options->common,
                                   "time noise min-radius max-radius spread strength",
                                   "is not for pixels; leave it out", error)
                  : options_refuse(&options->common, "rows columns dt max-angle max-speed",
                                   "is for pixels only; leave it out", error);
}

static int run(const void *values, struct ad_error *error)
{
    const struct dataset_options *options = values;
    const struct hnn_task *task = find_task(options->common.argument[0], error);
    if (error->status == AD_OK && check_options(options, !task, error) == AD_OK &&
        check_out(options->out, error) == AD_OK)
        (!task                              ? dataset_pixels(options, error)
         : options->size || options->filter ? draw_bodies(task, options, error)
                                            : observe(task, options, error));
    return command_status(error);
}

const struct command command_dataset = {
    .line =
        {.name = "dataset",
         .what = "observed motion for training",
         .arguments = {"TASK"},
         .names = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "TASK is one of\n"
             "  spring     H = p^2 + k q^2, 50 x 30 observations to t = 3, noise 0.1\n"
             "  pendulum   H = p^2 + k (1 - cos q), k = 3, 50 x 45 to t = 3, noise 0.1\n"
             "  twobody    nearly circular orbits, 1000 x 50 to t = 20\n"
             "  threebody  about a turning triangle, 5000 x 20 to t = 5\n"
             "  double-pendulum  angles in [0, 2 pi), rates to 10 (--max-radius), masses and\n"
             "             lengths 1, g = 9.8 (--strength): 600000 states with velocities\n"
             "             (arXiv 2003.04630)\n"
             "  wave       q_tt = k q_xx, k = 1 (--strength), on a ring of 32 sites, length 2 pi, "
             "and\n"
             "  string     on 31 sites between walls, length pi: 100 x 20 to t = 4, of the "
             "longest\n"
             "             four modes, m of amplitude 0.1/m to 1/m; masses 1: momenta are "
             "velocities\n"
             "  pixels     frames of a swinging rod, 200 x 100 pairs of 28 x 28 pixels;\n"
             "             of twobody and threebody with --size: a disc for a body\n"
             "as published (arXiv 1906.01563), waves of our own. Columns: coordinates, momenta or "
             "velocities, their\n"
             "rates, trial, t. All is a pure number: masses and lengths are units of the task."},
    .bytes = sizeof(struct dataset_options),
    .run = run,
};
