/* Results of a rollout of pixels (pixel_rollout.h): report, CSV, run file. */
#include "pixel_rollout.h"

#include <math.h>

static void report_motion(struct report *report, const struct rollout_model *m)
{
    const struct hnn_latent_motion *motion = &m->motion;
    bool known = !isnan(motion->latent_data);
    report_text(report, "motion", NULL, known ? hnn_motion_names[motion->kind] : NULL);
    report_number(report, "latent_spread", NULL, NULL, motion->latent);
    report_number(report, "latent_spread_data", NULL, NULL, motion->latent_data);
    report_number(report, "frame_spread", NULL, NULL, motion->frames);
    report_number(report, "frame_spread_data", NULL, NULL, motion->frames_data);
    if (known && motion->kind != HNN_MOTION_AS_DATA)
        report_line(
            report,
            "\n%s: it %s: spread of the latent state %.3g, of the data's %.3g; of the frames "
            "%.3g, of the data's %.3g",
            rollout_name(m), hnn_motion_names[motion->kind], motion->latent, motion->latent_data,
            motion->frames, motion->frames_data);
}

static void report_video(const void *context, struct report *report)
{
    const struct pixel_rollout *rollout = context;
#define AT(member) offsetof(struct rollout_model, member)
    static const struct rollout_row rows[] = {
        {"energy_mse", "energy of frames, MSE", AT(energy_mse)},
        {"coordinate_mse", "pixels, MSE", AT(coordinate_mse)},
        {"conserved_drift", "H, largest change", AT(conserved_drift)},
        {"reversal_error", "reversal error", AT(info.reversal_error)},
        {"energy_before", "energy before the change", AT(energy_before)},
        {"energy_after", "energy after it", AT(energy_after)},
    };
#undef AT
    report_line(report, "%s, %zu frames", rollout->settings.integrator->name,
                rollout->settings.n - 1);
    report_text(report, "integrator", NULL, rollout->settings.integrator->name);
    report_count(report, "frames", NULL, rollout->settings.n - 1);
    report_number(report, "true_energy", "true energy", "J", rollout->true_energy);
    if (rollout->options->starts != OPTION_NO_COUNT)
        report_line(report, "  means of %zu starts", rollout->options->starts);
    rollout_report_models(report, sizeof rows / sizeof *rows, rows, rollout->n_models,
                          rollout->model);
    for (size_t k = 0; k < rollout->n_models; k++) {
        report->object = k ? "against" : NULL;
        report_motion(report, &rollout->model[k]);
    }
    report->object = NULL;
}

/* ---- files ---- */

static void write_csv(const void *context, FILE *out)
{
    const struct pixel_rollout *rollout = context;
    fputs("frame,energy_truth", out);
    for (size_t k = 0; k < rollout->n_models; k++) {
        const char *name = k ? "against_" : "";
        fprintf(out, ",%senergy,%sH", name, name);
        for (size_t c = 0; c < rollout->model[k].path.states; c++)
            fprintf(out, ",%sz%zu", name, c + 1);
    }
    fputc('\n', out);
    for (size_t i = 0; i < rollout->settings.n; i++) {
        fprintf(out, "%zu", i);
        csv_number(out, 9, i < rollout->truth.n ? rollout->truth.energy[i] : NAN);
        for (size_t k = 0; k < rollout->n_models; k++) {
            const struct rollout_model *m = &rollout->model[k];
            csv_number(out, 9, m->strip.energy[i]);
            csv_number(out, 9, hnn_path_energy(&m->ode, &m->path, i));
            for (size_t c = 0; c < m->path.states; c++)
                csv_number(out, 9, m->path.x[i * m->path.states + c]);
        }
        fputc('\n', out);
    }
}

static void write_strip(const struct pixel_rollout *rollout, const struct frame_strip *strip,
                        const char *folder, phys_hdf5 *file)
{
    const size_t dims[] = {strip->n, rollout->source.height, rollout->source.width};
    char name[64];
    snprintf(name, sizeof name, "%s/frames", folder);
    phys_hdf5_write(file, name, AD_F32, 3, dims, strip->pixels);
    phys_hdf5_text(file, name, "axes", "time, height, width");
    snprintf(name, sizeof name, "%s/energy", folder);
    phys_hdf5_write(file, name, AD_F64, 1, dims, strip->energy);
}

static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct pixel_rollout *rollout = context;
    static const char *const folder[ROLLOUT_MODELS] = {"model", "against"};
    write_strip(rollout, &rollout->truth, "truth", file);
    for (size_t k = 0; k < rollout->n_models; k++) {
        const struct rollout_model *m = &rollout->model[k];
        char name[64];
        write_strip(rollout, &m->strip, folder[k], file);
        snprintf(name, sizeof name, "%s/latent", folder[k]);
        phys_hdf5_write(file, name, AD_F64, 2, (size_t[]){m->path.n, m->path.states}, m->path.x);
        if (k == 0)
            phys_hdf5_text(file, folder[k], "model", rollout_name(m));
    }
    return error->status;
}

const struct output_kind pixel_rollout_outputs = {report_video, write_file, write_csv,
                                                  pixel_rollout_picture, NULL};
