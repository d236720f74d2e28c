/* leastaction chart hnn: a training step beside its floor, the published network and data size. */
#include "charts.h"
#include "command.h"
#include "json.h"
#include "training_speed.h"

#include <stdio.h>

enum { BATCH = 750, WIDTH = 200 };

static const struct run {
    const char *name;
    enum hnn_kind kind;
    enum ad_type type;
    size_t threads;
} runs[] = {
    {"hnn f32", HNN_HAMILTONIAN, AD_F32, 1},
    {"hnn f32, 2 threads", HNN_HAMILTONIAN, AD_F32, 2},
    {"hnn f64", HNN_HAMILTONIAN, AD_F64, 1},
    {"baseline f32", HNN_BASELINE, AD_F32, 1},
};

enum { RUNS = sizeof runs / sizeof *runs };

static double floor_ms(const struct training_speed *s) { return s->products_ms + s->activation_ms; }

static void print_table(FILE *out, const struct training_speed speeds[RUNS])
{
    fprintf(out, "%-20s %9s %9s %9s %9s %6s\n", "", "ms/step", "OpenBLAS", "products", "tanh",
            "ratio");
    for (size_t k = 0; k < RUNS; k++) {
        const struct training_speed *s = &speeds[k];
        fprintf(out, "%-20s %9.2f %8.0f%% %9.2f %9.2f %6.2f\n", runs[k].name, s->step_ms,
                100 * s->share, s->products_ms, s->activation_ms, s->step_ms / floor_ms(s));
    }
    fprintf(
        out,
        "a step of Adam on %d samples, 2-%d-%d-1, tanh; OpenBLAS: its share of loss and gradient\n"
        "on one thread; ratio: to the floor, the products and the tanh alone\n",
        BATCH, WIDTH, WIDTH);
}

static void print_csv(FILE *out, const struct training_speed speeds[RUNS])
{
    fputs("model,precision,threads,batch,width,step_ms,blas_share,products_ms,activation_ms\n",
          out);
    for (size_t k = 0; k < RUNS; k++) {
        const struct training_speed *s = &speeds[k];
        fprintf(out, "%s,%s,%zu,%d,%d,%.4g,%.3f,%.4g,%.4g\n", hnn_kinds[runs[k].kind],
                runs[k].type == AD_F32 ? "f32" : "f64", runs[k].threads, BATCH, WIDTH, s->step_ms,
                s->share, s->products_ms, s->activation_ms);
    }
}

static void print_json(FILE *out, const struct training_speed speeds[RUNS])
{
    struct json json;
    json_open(&json, out);
    for (size_t k = 0; k < RUNS; k++) {
        json_object(&json, runs[k].name);
        json_number(&json, "step_ms", speeds[k].step_ms);
        json_number(&json, "blas_share", speeds[k].share);
        json_number(&json, "floor_ms", floor_ms(&speeds[k]));
        json_number(&json, "ratio", speeds[k].step_ms / floor_ms(&speeds[k]));
        json_end_object(&json);
    }
    json_close(&json);
}

int chart_hnn(const struct chart_settings *settings, struct ad_error *error)
{
    struct training_speed speeds[RUNS];
    struct result csv;
    chart_csv(settings, "hnn-steps", &csv, error);
    for (size_t k = 0; k < RUNS && error->status == AD_OK; k++) {
        struct hnn_settings model = hnn_defaults(runs[k].kind, 1);
        model.hidden[0] = model.hidden[1] = WIDTH;
        model.precision = runs[k].type;
        training_speed_measure(&model, BATCH, runs[k].threads,
                               settings->quick ? TIMING_QUICK : TIMING_ROUNDS, &speeds[k], error);
    }
    if (error->status == AD_OK) {
        print_csv(csv.out, speeds);
        result_commit(&csv, error);
    }
    result_abandon(&csv);
    if (error->status != AD_OK)
        return command_status(error);
    if (!settings->quiet)
        print_table(stdout, speeds);
    if (settings->json)
        print_json(stdout, speeds);
    return DONE;
}
