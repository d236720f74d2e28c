/* What a foreseen film came to (film.h): table, JSON, CSV, run file. */
#include "pixel_rollout.h"
#include "apps/command.h"
#include "apps/output/json.h"

#include <math.h>

static const struct measure {
    const char *key, *what;
    size_t offset; /* in struct film_model */
} measures[] = {
#define AT(member) offsetof(struct film_model, member)
    {"energy_mse", "energy of the frames, mean square error", AT(energy_mse)},
    {"coordinate_mse", "pixels, mean square error", AT(pixel_mse)},
    {"conserved_drift", "H of the model, largest change", AT(conserved_drift)},
    {"reversal_error", "distance from the start, back", AT(info.reversal_error)},
    {"energy_before", "energy of the frames before it was added", AT(energy_before)},
    {"energy_after", "... and after", AT(energy_after)},
#undef AT
};

enum { N_MEASURES = sizeof measures / sizeof *measures };

static double value_of(const struct film_model *m, size_t measure)
{
    return *(const double *)(const void *)((const char *)m + measures[measure].offset);
}

/* ---- table ---- */

static void print_measure(const struct film *film, size_t measure)
{
    bool known = false;
    for (size_t k = 0; k < film->n_models; k++)
        known |= !isnan(value_of(&film->model[k], measure));
    if (!known)
        return;
    printf("  %-42s", measures[measure].what);
    for (size_t k = 0; k < film->n_models; k++)
        if (isnan(value_of(&film->model[k], measure)))
            printf(" %13s", "-");
        else
            printf(" %13.4g", value_of(&film->model[k], measure));
    putchar('\n');
}

static void print_warnings(const struct film *film, const struct film_model *m)
{
    if (m->motion.kind != HNN_MOTION_AS_DATA)
        printf(
            "\n%s: it %s: its latent state moves %.3g times as far as that of the true frames, its "
            "frames %.3g times\n",
            m->file, hnn_motion_names[m->motion.kind], m->motion.latent / m->motion.latent_data,
            m->motion.frames / m->motion.frames_data);
    if (m->outside < m->path.n)
        printf("\n%s: outside its training from frame %g on: %s\n", m->file, film->t[m->outside],
               m->what);
}

void film_print(const struct film *film)
{
    size_t starts = film->options->starts;
    printf("%s, %zu frames", film->settings.integrator->name, film->settings.n - 1);
    if (starts != OPTION_NO_COUNT)
        printf(", means of %zu starts", starts);
    else if (!isnan(film->true_energy))
        printf(", true energy %.4g", film->true_energy);
    printf("\n\n  %-42s", "");
    for (size_t k = 0; k < film->n_models; k++)
        printf(" %13s", film_model_name(&film->model[k]));
    putchar('\n');
    for (size_t k = 0; k < N_MEASURES; k++)
        print_measure(film, k);
    printf("  %-42s", "evaluations");
    for (size_t k = 0; k < film->n_models; k++)
        printf(" %13zu", film->model[k].info.evaluations);
    putchar('\n');
    for (size_t k = 0; k < film->n_models; k++)
        print_warnings(film, &film->model[k]);
}

/* ---- JSON ---- */

static void json_model(struct json *json, const struct film_model *m)
{
    json_text(json, "file", m->file);
    json_text(json, "model", film_model_name(m));
    for (size_t k = 0; k < N_MEASURES; k++)
        json_number(json, measures[k].key, value_of(m, k));
    json_count(json, "evaluations", m->info.evaluations);
    json_text(json, "motion",
              isnan(m->motion.latent_data) ? NULL : hnn_motion_names[m->motion.kind]);
    json_number(json, "latent_spread", m->motion.latent);
    json_number(json, "latent_spread_data", m->motion.latent_data);
    json_number(json, "frame_spread", m->motion.frames);
    json_number(json, "frame_spread_data", m->motion.frames_data);
    json_number(json, "outside_from", m->outside < m->path.n ? m->path.t[m->outside] : (double)NAN);
    json_text(json, "outside", m->outside < m->path.n ? m->what : NULL);
    json_number(json, "seconds", m->info.seconds);
}

void film_print_json(const struct film *film)
{
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "integrator", film->settings.integrator->name);
    json_count(&json, "frames", film->settings.n - 1);
    json_number(&json, "true_energy", film->true_energy);
    json_model(&json, &film->model[0]);
    if (film->n_models > 1) {
        json_object(&json, "against");
        json_model(&json, &film->model[1]);
        json_end_object(&json);
    }
    json_close(&json);
}

/* ---- files ---- */

static void csv_number(double value, FILE *out)
{
    if (isfinite(value))
        fprintf(out, ",%.9g", value);
    else
        fputc(',', out);
}

void film_write_csv(const struct film *film, FILE *out)
{
    fputs("frame,energy_truth", out);
    for (size_t k = 0; k < film->n_models; k++) {
        const char *name = k ? "against_" : "";
        fprintf(out, ",%senergy,%sH", name, name);
        for (size_t c = 0; c < film->model[k].path.states; c++)
            fprintf(out, ",%sz%zu", name, c + 1);
    }
    fputc('\n', out);
    for (size_t i = 0; i < film->settings.n; i++) {
        fprintf(out, "%zu", i);
        csv_number(i < film->truth.n ? film->truth.energy[i] : NAN, out);
        for (size_t k = 0; k < film->n_models; k++) {
            const struct film_model *m = &film->model[k];
            csv_number(m->strip.energy[i], out);
            csv_number(hnn_path_energy(&m->ode, &m->path, i), out);
            for (size_t c = 0; c < m->path.states; c++)
                csv_number(m->path.x[i * m->path.states + c], out);
        }
        fputc('\n', out);
    }
}

static void write_strip(const struct film *film, const struct film_strip *strip, const char *folder,
                        phys_runfile *file)
{
    const size_t dims[] = {strip->n, film->source.height, film->source.width};
    char name[64];
    snprintf(name, sizeof name, "%s/frames", folder);
    phys_runfile_write(file, name, AD_F32, 3, dims, strip->pixels);
    phys_runfile_text(file, name, "axes", "time, height, width");
    snprintf(name, sizeof name, "%s/energy", folder);
    phys_runfile_write(file, name, AD_F64, 1, dims, strip->energy);
}

void film_file(const struct film *film, phys_runfile *file)
{
    static const char *const folder[ROLLOUT_MODELS] = {"model", "against"};
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", film->options->common.command);
    phys_runfile_number(file, "/", "true_energy", film->true_energy, "J");
    write_strip(film, &film->truth, "truth", file);
    for (size_t k = 0; k < film->n_models; k++) {
        const struct film_model *m = &film->model[k];
        char name[64];
        write_strip(film, &m->strip, folder[k], file);
        snprintf(name, sizeof name, "%s/latent", folder[k]);
        phys_runfile_write(file, name, AD_F64, 2, (size_t[]){m->path.n, m->path.states}, m->path.x);
        phys_runfile_text(file, folder[k], "model", film_model_name(m));
    }
}
