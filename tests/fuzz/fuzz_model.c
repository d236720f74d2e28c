/* Fuzzer of models in HDF5. A text describes the file, one line each:

     NAME=VALUE         an attribute: a number if it reads as one, else, or after ", a text
     NAME 3 2           a dataset of these dimensions

   so that every file is valid HDF5, and only the checks of the readers of models and trainings are
   exercised. Bytes that begin as a run file with a checksum are used as the file. All are read as
   safetensors first. */
#include "fuzz.h"

#include "apps/options.h"
#include "hnn/model/exchange.h"
#include "hnn/train/train.h"
#include "physics/io/hdf5_file.h"

#include <unistd.h>

enum { MOST_NUMBERS = 4096 };

static void attribute(phys_hdf5 *file, char *name, char *value)
{
    double number;
    char *slash = strchr(name, '/');
    const char *folder = slash ? "training" : "/";
    if (options_number(value, &number))
        phys_hdf5_number(file, folder, slash ? slash + 1 : name, number, NULL);
    else
        phys_hdf5_text(file, folder, slash ? slash + 1 : name, value + (*value == '"'));
}

static void dataset(phys_hdf5 *file, const char *name, const char *at)
{
    static double values[MOST_NUMBERS];
    size_t dims[PHYS_HDF5_RANK], rank = 0, n = 1;
    char *end;
    for (size_t k = 0; k < MOST_NUMBERS; k++)
        values[k] = (double)(k % 7) - 2.5;
    for (; rank < PHYS_HDF5_RANK; rank++, at = end) {
        dims[rank] = strtoul(at, &end, 10);
        if (end == at)
            break;
        if (dims[rank] == 0 || dims[rank] > MOST_NUMBERS / n)
            return;
        n *= dims[rank];
    }
    if (rank > 0)
        phys_hdf5_write(file, name, AD_F64, rank, dims, values);
}

static void write_file(const char *name, char *text)
{
    struct ad_error error = {0};
    phys_hdf5 *file;
    fuzz_require(phys_hdf5_create(name, &file, &error) == AD_OK);
    phys_hdf5_folder(file, "training");
    for (char *line; (line = strtok_r(text, "\n", &text));) {
        char *equals = strchr(line, '='), *space = strchr(line, ' ');
        if (equals) {
            *equals = '\0';
            attribute(file, line, equals + 1);
        } else if (space) {
            *space = '\0';
            dataset(file, line, space + 1);
        }
    }
    if (phys_hdf5_commit(file, &error) != AD_OK) /* what cannot be written is not what is read */
        unlink(name);
}

/* Goes on with a training of the smallest model. */
static void resume(const char *name)
{
    static const double x[] = {1, 0, 0.5, -1}, rate[] = {0, -1, -1, -0.5};
    const struct hnn_samples samples = {.n = 2, .x = x, .target = rate}, none = {0};
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_training training = hnn_training_defaults();
    struct ad_error error = {0};
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    settings.layers = 2;
    settings.hidden[0] = 3;
    if (hnn_model_new(&settings, &model, &error) == AD_OK &&
        hnn_trainer_new(model, &training, &samples, &none, &trainer, &error) == AD_OK &&
        hnn_trainer_resume(trainer, name, &error) != AD_OK)
        fuzz_require(error.message[0]);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
}

/* The same bytes as safetensors. */
static void import(const char *name)
{
    const struct hnn_settings assumed = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_exchange exchange;
    struct ad_error error = {0};
    hnn_model *model;
    if (hnn_model_import(name, &assumed, &model, &exchange, &error) != AD_OK)
        fuzz_require(!model && error.message[0]);
    hnn_model_free(model);
}

int fuzz_model(const uint8_t *data, size_t size)
{
    static const char sealed[] = "leastaction, sealed";
    struct ad_error error = {0};
    hnn_model *model;
    const char *name = fuzz_file(data, size);
    import(name);
    if (size < sizeof sealed - 1 || memcmp(data, sealed, sizeof sealed - 1) != 0) {
        char *text = fuzz_text(data, size);
        write_file(name, text);
        free(text);
    }
    if (hnn_model_load(name, &model, &error) == AD_OK) {
        double state[64] = {0.1}, field[64];
        if (hnn_model_settings(model)->dof <= 32)
            hnn_model_field(model, state, field);
    } else {
        fuzz_require(!model && error.message[0]);
    }
    hnn_model_free(model);
    resume(name);
    return 0;
}
