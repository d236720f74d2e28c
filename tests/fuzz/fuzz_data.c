/* Fuzzer of data sets: no input crashes the reader; accepted data are finite and complete, and
   refusals have a message. The first byte chooses the settings, the rest is the file. */
#include "fuzz.h"

#include "hnn/data/data.h"

#include <math.h>

static void check_samples(const struct hnn_samples *samples, size_t states, size_t targets)
{
    for (size_t k = 0; k < states * samples->n; k++)
        fuzz_require(isfinite(samples->x[k]));
    for (size_t k = 0; k < targets * samples->n; k++)
        fuzz_require(isfinite(samples->target[k]));
}

int fuzz_data(const uint8_t *data, size_t size)
{
    static const struct hnn_dataset_settings kinds[] = {
        {.state = NULL},
        {.state = "1,2", .rate = "2,1"},
        {.state = "q,p", .rate = "dqdt,dpdt", .test_fraction = 0.5, .split = HNN_SPLIT_RANDOM},
        {.time = "1", .trial = "2", .differences = HNN_CENTRAL},
        {.time = "t", .test_fraction = 0.3},
        {.state = "2,3", .trial = "1", .rollout = 2, .dt = 1, .test_fraction = 0.4},
        {.state = "2,3", .time = "1", .rollout = 1},
        {.state = "q,\"p, x\"", .rate = "1,3", .split = HNN_SPLIT_TRIAL, .test_fraction = 0.5},
    };
    if (size == 0)
        return 0;
    struct hnn_dataset_settings settings = kinds[data[0] % 8];
    settings.size = sizeof settings;
    struct hnn_dataset d;
    struct ad_error error = {0};
    settings.file = fuzz_file(data + 1, size - 1);
    if (hnn_dataset_read(&settings, &d, &error) == AD_OK) {
        size_t states = 2 * d.dof;
        fuzz_require(d.train.n > 0 && states > 0);
        check_samples(&d.train, states, states * (settings.rollout ? settings.rollout : 1));
        check_samples(&d.test, states, states * (settings.rollout ? settings.rollout : 1));
    } else {
        fuzz_require(error.message[0] &&
                     (error.status == AD_E_INPUT || error.status == AD_E_ARGUMENT));
    }
    hnn_dataset_free(&d);
    return 0;
}
