/* Saves and resumes trainings: with the model, everything that the next step depends on. The file
   contains nothing else, so that a resumed run writes the same bytes as an uninterrupted one. */
#include "train.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_ROOM = 480, HASH_ROOM = 40 };

static const char folder[] = "training";

/* All settings of the training but its length. */
static void settings_text(const hnn_trainer *t, char text[TEXT_ROOM])
{
    const struct hnn_training *s = &t->settings;
    snprintf(
        text, TEXT_ROOM,
        "optimiser=%s schedule=%s batch=%zu learning_rate=%.17g weight_decay=%.17g "
        "momentum=%.17g average=%.17g rollout=%zu dt=%.17g every=%zu patience=%zu seed=%" PRIu64
        "%s",
        s->optimiser->name, s->schedule->name, s->batch, s->learning_rate, s->weight_decay,
        s->momentum, s->average, s->rollout, s->rollout ? s->dt : 0.0, s->every, s->patience,
        s->seed, s->loss ? " loss=own" : "");
    if (s->clip > 0)
        snprintf(text + strlen(text), TEXT_ROOM - strlen(text), " clip=%.17g", s->clip);
    if (s->free_starts)
        snprintf(text + strlen(text), TEXT_ROOM - strlen(text), " free_starts=1");
    if (s->hold)
        snprintf(text + strlen(text), TEXT_ROOM - strlen(text), " hold=1");
    if (s->stepping)
        snprintf(text + strlen(text), TEXT_ROOM - strlen(text), " stepping=%s",
                 hnn_steppings[s->stepping]);
}

static void data_text(const hnn_trainer *t, char text[HASH_ROOM])
{
    snprintf(text, HASH_ROOM, "%016" PRIx64 " %016" PRIx64, t->train.hash, t->test.hash);
}

static void *method_state(hnn_trainer *t, size_t *n, enum ad_type *type)
{
    *type = t->problem.type;
    return t->settings.optimiser->state(t->method, n, type);
}

/* ---- writing ---- */

static void write_random(const hnn_trainer *t, phys_hdf5 *file)
{
    const uint64_t *w = t->train.epoch.state;
    char text[80];
    snprintf(text, sizeof text, "%016" PRIx64 " %016" PRIx64 " %016" PRIx64 " %016" PRIx64, w[0],
             w[1], w[2], w[3]);
    phys_hdf5_text(file, folder, "random", text);
    phys_hdf5_integer(file, folder, "position", (int64_t)t->train.position, NULL);
}

static void write_history(const hnn_trainer *t, phys_hdf5 *file)
{
    phys_hdf5_extendable(file, "training/history", AD_F64, 2, (size_t[]){0, 3});
    phys_hdf5_text(file, "training/history", "columns", "step,train_loss,test_loss");
    for (size_t k = 0; k < t->rows; k++) {
        const struct hnn_row *r = &t->history[k];
        phys_hdf5_append(file, "training/history",
                         (double[]){(double)r->step, r->train_loss, r->test_loss});
    }
}

/* own_loss: of all samples, by a loss of the caller's own. */
static void write_state(hnn_trainer *t, double own_loss, phys_hdf5 *file)
{
    char settings[TEXT_ROOM], data[HASH_ROOM];
    size_t n;
    enum ad_type type;
    const void *state = method_state(t, &n, &type);
    settings_text(t, settings);
    data_text(t, data);
    phys_hdf5_folder(file, folder);
    phys_hdf5_text(file, folder, "settings", settings);
    phys_hdf5_text(file, folder, "data", data);
    phys_hdf5_integer(file, folder, "step", (int64_t)t->step, NULL);
    phys_hdf5_integer(file, folder, "count", (int64_t)*t->settings.optimiser->count(t->method),
                      NULL);
    phys_hdf5_number(file, folder, "loss_sum", t->loss_sum, NULL);
    phys_hdf5_integer(file, folder, "loss_count", (int64_t)t->loss_count, NULL);
    phys_hdf5_number(file, folder, "best_loss", t->best_loss, NULL);
    phys_hdf5_integer(file, folder, "best_step", (int64_t)t->best_step, NULL);
    if (t->rate != t->settings.learning_rate)
        phys_hdf5_number(file, folder, "rate", t->rate, NULL);
    if (t->settings.loss)
        phys_hdf5_number(file, folder, "own_loss", own_loss, NULL);
    write_random(t, file);
    write_history(t, file);
    phys_hdf5_write(file, "training/optimiser", type, 1, &n, state);
    if (t->average)
        phys_hdf5_write(file, "training/average", AD_F64, 1, &t->problem.n, t->average);
    if (t->average || t->best) /* the model's own are then the mean, or the best ones */
        phys_hdf5_write(file, "training/parameters", t->problem.type, 1, &t->problem.n,
                        hnn_problem_point(&t->problem));
}

static enum ad_status write_file(hnn_trainer *t, double own_loss, const char *name,
                                 const char *command, struct ad_error *error)
{
    phys_hdf5 *file;
    if (phys_hdf5_create(name, &file, error) != AD_OK)
        return error->status;
    if (hnn_model_write(t->model, file, command, error) != AD_OK) {
        phys_hdf5_abandon(file);
        return error->status;
    }
    write_state(t, own_loss, file);
    return phys_hdf5_commit(file, error);
}

enum ad_status hnn_trainer_save(hnn_trainer *t, const char *name, const char *command,
                                struct ad_error *error)
{
    if (AD_LACKS(error, t, name))
        return error->status;
    struct ad_ranks *ranks = t->settings.ranks;
    double own_loss = t->settings.loss ? hnn_trainer_train_loss(t) : 0;
    if (hnn_trainer_deliver(t, error) == AD_OK && (!ranks || ranks->rank == 0))
        write_file(t, own_loss, name, command, error);
    return ad_ranks_agree(ranks, error);
}

/* ---- reading ---- */

struct reading {
    hnn_trainer *t;
    const char *name;
    phys_hdf5 *file;
    struct ad_error *error;
};

static bool failed(const struct reading *r) { return r->error->status != AD_OK; }

/* The blank before the first word that differs, or its end where one text goes on; settings are
   NAME=VALUE separated by blanks. */
static size_t difference(const char *a, const char *b)
{
    size_t word = 0, i = 0;
    for (; a[i] && a[i] == b[i]; i++)
        if (a[i] == ' ')
            word = i;
    return (a[i] == '\0' && b[i] == ' ') || (b[i] == '\0' && a[i] == ' ') ? i : word;
}

/* The word at a blank, `*length` characters of it. */
static const char *word_at(const char *text, int *length)
{
    text += *text == ' ';
    *length = (int)strcspn(text, " ");
    if (*length)
        return text;
    *length = (int)strlen("nothing");
    return "nothing";
}

static void expect_text(const struct reading *r, const char *attribute, const char *expected,
                        const char *what)
{
    char *text = NULL;
    if (!failed(r) && phys_hdf5_get_text(r->file, folder, attribute, &text, r->error) == AD_OK &&
        strcmp(text, expected) != 0) {
        size_t at = difference(text, expected);
        int length[2];
        const char *there = word_at(text + at, &length[0]);
        const char *now = word_at(expected + at, &length[1]);
        ad_fail(r->error, AD_E_INPUT,
                "%s: %s: %.*s there, %.*s now; expected the same, or another "
                "file",
                r->name, what, length[0], there, length[1], now);
    }
    free(text);
}

static double read_number(const struct reading *r, const char *attribute)
{
    double value = 0;
    if (!failed(r))
        phys_hdf5_get(r->file, folder, attribute, &value, r->error);
    return value;
}

static bool is_count(double value) { return value >= 0 && value < 0x1p53; }

static size_t read_count(const struct reading *r, const char *attribute)
{
    double value = read_number(r, attribute);
    if (!failed(r) && !is_count(value))
        ad_fail(r->error, AD_E_INPUT, "%s: damaged: attribute '%s' is %g", r->name, attribute,
                value);
    return failed(r) ? 0 : (size_t)value;
}

/* `n` elements of a dataset into `to`. */
static void read_vector(const struct reading *r, const char *name, enum ad_type type, size_t n,
                        void *to)
{
    struct phys_hdf5_item item;
    if (failed(r) || phys_hdf5_shape(r->file, name, &item, r->error) != AD_OK)
        return;
    double *values = malloc(n * sizeof *values + 1);
    if (!values)
        ad_fail(r->error, AD_E_MEMORY, "out of memory");
    else if (item.rank != 1 || item.dims[0] != n)
        ad_fail(r->error, AD_E_INPUT, "%s: damaged: '%s' has another shape, expected %zu", r->name,
                name, n);
    else if (phys_hdf5_read(r->file, name, 0, n, values, r->error) == AD_OK)
        hnn_from_double(type, n, values, to);
    free(values);
}

static void read_history(const struct reading *r)
{
    struct phys_hdf5_item item;
    double record[3];
    if (failed(r) || phys_hdf5_shape(r->file, "training/history", &item, r->error) != AD_OK)
        return;
    if (item.rank != 2 || item.dims[1] != 3) {
        ad_fail(r->error, AD_E_INPUT, "%s: damaged: 'training/history' has another shape", r->name);
        return;
    }
    r->t->rows = 0;
    for (size_t k = 0; k < item.dims[0] && !failed(r); k++) {
        if (phys_hdf5_read(r->file, "training/history", k, 1, record, r->error) != AD_OK)
            return;
        if (!is_count(record[0])) {
            ad_fail(r->error, AD_E_INPUT, "%s: damaged: 'training/history' has step %g in row %zu",
                    r->name, record[0], k);
            return;
        }
        struct hnn_row row = {(size_t)record[0], record[1], record[2], (double)NAN};
        hnn_history_add(r->t, &row, r->error);
    }
}

static void read_random(const struct reading *r)
{
    char *text = NULL;
    size_t position = read_count(r, "position");
    if (failed(r) || !r->t->train.order ||
        phys_hdf5_get_text(r->file, folder, "random", &text, r->error) != AD_OK)
        return;
    struct phys_random random = {{0}, 0, false};
    char *at = text;
    for (int k = 0; k < 4; k++)
        random.state[k] = strtoull(at, &at, 16);
    free(text);
    if (position > r->t->train.n)
        ad_fail(r->error, AD_E_INPUT, "%s: damaged: attribute 'position' is %zu", r->name,
                position);
    else
        hnn_data_return(&r->t->train, &random, position);
}

static void read_state(const struct reading *r)
{
    hnn_trainer *t = r->t;
    char settings[TEXT_ROOM], data[HASH_ROOM];
    size_t n;
    enum ad_type type;
    struct ad_error none = {0};
    void *state = method_state(t, &n, &type), *point = hnn_problem_point(&t->problem);
    settings_text(t, settings);
    data_text(t, data);
    expect_text(r, "settings", settings, "was trained with other settings");
    expect_text(r, "data", data, "was trained on other data");
    t->step = read_count(r, "step");
    *t->settings.optimiser->count(t->method) = read_count(r, "count");
    t->loss_sum = read_number(r, "loss_sum");
    t->loss_count = read_count(r, "loss_count");
    t->best_loss = read_number(r, "best_loss");
    t->best_step = read_count(r, "best_step");
    if (phys_hdf5_get(r->file, folder, "rate", &t->rate, &none) != AD_OK)
        t->rate = t->settings.learning_rate;
    read_random(r);
    read_history(r);
    read_vector(r, "training/optimiser", type, n, state);
    if (t->average)
        read_vector(r, "training/average", AD_F64, t->problem.n, t->average);
    if (t->best)
        memcpy(t->best, hnn_learner_point(t), t->size_bytes);
    if (t->average || t->best) {
        read_vector(r, "training/parameters", t->problem.type, t->problem.n, point);
    } else {
        memcpy(point, hnn_learner_point(t), t->size_bytes);
    }
}

/* Another loss of the caller's own has the same settings. */
static void check_loss(const struct reading *r)
{
    double there = r->t->settings.loss ? read_number(r, "own_loss") : 0;
    double now = r->t->settings.loss ? hnn_trainer_train_loss(r->t) : 0;
    if (!failed(r) && !(fabs(now - there) <= 1e-5 * fabs(there)))
        ad_fail(r->error, AD_E_INPUT,
                "%s: was trained with another loss: %g of all samples there, %g now", r->name,
                there, now);
}

static bool same_network(const struct hnn_network *a, const struct hnn_network *b)
{
    return !a == !b && (!a || (strcmp(a->name, b->name) == 0 && a->size == b->size));
}

static bool same_settings(const struct hnn_settings *a, const struct hnn_settings *b)
{
    for (size_t k = 0; k + 1 < a->layers; k++)
        if (a->layers == b->layers && a->hidden[k] != b->hidden[k])
            return false;
    return a->kind == b->kind && a->dof == b->dof && a->layers == b->layers &&
           strcmp(a->activation, b->activation) == 0 && a->field == b->field &&
           a->separable == b->separable && a->dissipation == b->dissipation &&
           a->precision == b->precision && a->start == b->start && a->seed == b->seed &&
           a->inputs == b->inputs && a->controls == b->controls && a->time == b->time &&
           a->angles == b->angles && a->quadratic == b->quadratic && a->lattice == b->lattice &&
           a->control_network == b->control_network && a->pixels == b->pixels &&
           a->autoencoder == b->autoencoder && same_network(a->network, b->network);
}

static bool same_scaling(const hnn_model *a, const hnn_model *b)
{
    const double *p = a->scaling.centre, *q = b->scaling.centre;
    return p && q ? memcmp(p, q, 3 * hnn_scaled(a) * sizeof *p) == 0 : !p && !q;
}

static void read_model(const struct reading *r)
{
    hnn_model *model = r->t->model, *stored = NULL;
    const struct hnn_network *network = model->settings.network;
    if (network)
        hnn_model_load_network(r->name, network, &stored, r->error);
    else
        hnn_model_load(r->name, &stored, r->error);
    if (!failed(r) &&
        (!same_settings(&stored->settings, &model->settings) || !same_scaling(stored, model)))
        ad_fail(r->error, AD_E_INPUT,
                "%s: has other model settings (see `leastaction dump`); expected the same, or "
                "another file",
                r->name);
    if (!failed(r))
        hnn_model_set_parameters(model, stored->parameters);
    hnn_model_free(stored);
}

enum ad_status hnn_trainer_resume(hnn_trainer *t, const char *name, struct ad_error *error)
{
    struct reading r = {t, name, NULL, error};
    if (AD_LACKS(error, t, name) || hnn_trainer_idle(t, error) != AD_OK)
        return error->status;
    read_model(&r);
    if (!failed(&r) && phys_hdf5_open(name, &r.file, error) == AD_OK)
        read_state(&r);
    t->version = t->model->version;
    t->delivered = true;
    if (ad_ranks_agree(t->settings.ranks, error) == AD_OK)
        check_loss(&r);
    phys_hdf5_close(r.file);
    return error->status;
}
