/* Milliseconds of a training step beside its floor, and microseconds of a field (chart_hnn.h). */
#include "chart_hnn.h"
#include "training_speed.h"

#include <math.h>

enum { ROUNDS = 21, ROUNDS_QUICK = 15, THREADS = 2 }; /* rounds of the published width */

struct evaluation {
    hnn_model *model;
    double rate[2];
};

static void evaluate(void *context)
{
    struct evaluation *e = context;
    hnn_model_field(e->model, (double[]){0.5, -0.7}, e->rate);
}

/* One state at a time, as integrators ask for it, in the precision of the weights. */
static enum ad_status field_microseconds(const struct network *network, size_t rounds, double *us,
                                         struct ad_error *error)
{
    struct evaluation e = {0};
    struct timed job = {.run = evaluate, .context = &e};
    struct hnn_settings settings = network_settings(network);
    if (hnn_model_new(&settings, &e.model, error) == AD_OK) {
        hnn_model_evaluate_in(e.model, network->type);
        time_in_turn(1, &job, rounds);
        *us = 1e-3 * job.nanoseconds;
    }
    hnn_model_free(e.model);
    return error->status;
}

/* ---- one row, three ways ---- */

struct row {
    const struct network *network;
    size_t threads;
    struct training_speed speed;
    double field_us;
};

static double floor_ms(const struct row *row)
{
    return row->speed.products_ms + row->speed.activation_ms;
}

static void print_row(const struct row *row)
{
    const struct training_speed *s = &row->speed;
    printf("%-9s %5zu  %s %7zu %9.2f %8.0f%% %9.2f %9.2f %6.2f", hnn_kinds[row->network->kind],
           row->network->width, hnn_precisions[row->network->type], row->threads, s->step_ms,
           100 * s->share, s->products_ms, s->activation_ms, s->step_ms / floor_ms(row));
    if (isnan(s->hand_ms))
        printf(" %9s %6s", "", "");
    else
        printf(" %9.2f %6.2f", s->hand_ms, s->hand_ratio);
    printf(" %9.1f\n", row->field_us);
    fflush(stdout);
}

static void write_row(const struct row *row, FILE *csv)
{
    const struct training_speed *s = &row->speed;
    fprintf(csv, "%s,%s,%zu,%d,%zu,%.4g,%.3f,%.4g,%.4g,", hnn_kinds[row->network->kind],
            hnn_precisions[row->network->type], row->threads, PUBLISHED_BATCH, row->network->width,
            s->step_ms, s->share, s->products_ms, s->activation_ms);
    if (!isnan(s->hand_ms))
        fprintf(csv, "%.4g,%.3f,", s->hand_ms, s->hand_ratio);
    else
        fputs(",,", csv);
    fprintf(csv, "%.4g\n", row->field_us);
}

static void json_row(const struct row *row, struct json *json)
{
    json_object(json, NULL);
    json_text(json, "model", hnn_kinds[row->network->kind]);
    json_text(json, "precision", hnn_precisions[row->network->type]);
    json_count(json, "width", row->network->width);
    json_count(json, "threads", row->threads);
    json_number(json, "step_ms", row->speed.step_ms);
    json_number(json, "blas_share", row->speed.share);
    json_number(json, "floor_ms", floor_ms(row));
    json_number(json, "ratio", row->speed.step_ms / floor_ms(row));
    json_number(json, "hand_ms", row->speed.hand_ms);
    json_number(json, "hand_ratio", row->speed.hand_ratio);
    json_number(json, "field_us", row->field_us);
    json_end_object(json);
}

/* ---- all ---- */

/* Wide networks are timed less often: a batch of theirs is longer, and disturbed less. */
static enum ad_status one_network(const struct chart_settings *settings,
                                  const struct network *network, FILE *csv, struct json *json,
                                  struct ad_error *error)
{
    struct row row = {.network = network};
    const struct hnn_settings model = network_settings(network);
    size_t rounds = settings->quick ? ROUNDS_QUICK : ROUNDS;
    rounds = rounds * PUBLISHED_WIDTH / network->width;
    if (field_microseconds(network, rounds, &row.field_us, error) != AD_OK)
        return error->status;
    for (row.threads = 1; row.threads <= THREADS; row.threads++) {
        if (training_speed_measure(&model, PUBLISHED_BATCH, row.threads, rounds, &row.speed,
                                   error) != AD_OK)
            break;
        write_row(&row, csv);
        json_row(&row, json);
        if (!settings->quiet)
            print_row(&row);
    }
    return error->status;
}

enum ad_status chart_steps(const struct chart_settings *settings, struct json *json,
                           struct ad_error *error)
{
    struct network networks[NETWORKS_MOST];
    struct result csv;
    size_t n = networks_of_chart(settings->quick, networks);
    if (chart_csv(settings, "hnn-steps", &csv, error) != AD_OK)
        return error->status;
    fputs("model,precision,threads,batch,width,step_ms,blas_share,products_ms,activation_ms,"
          "hand_ms,hand_ratio,field_us\n",
          csv.out);
    if (!settings->quiet)
        printf("%-9s %5s  %s %7s %9s %9s %9s %9s %6s %9s %6s %9s\n", "", "width", "   ", "threads",
               "ms/step", "OpenBLAS", "products", "tanh", "ratio", "by hand", "ratio", "us/field");
    json_array(json, "steps");
    for (size_t k = 0; k < n && error->status == AD_OK; k++)
        one_network(settings, &networks[k], csv.out, json, error);
    json_end_array(json);
    if (error->status == AD_OK)
        result_commit(&csv, error);
    result_abandon(&csv);
    if (error->status == AD_OK && !settings->quiet)
        printf("a step of Adam on %d samples, 2-width-width-outputs, tanh; OpenBLAS: its share of "
               "loss and gradient\non one thread; ratio: to the floor, the products and the tanh "
               "alone, and to the step by hand; field: of one state\n\n",
               PUBLISHED_BATCH);
    return error->status;
}
