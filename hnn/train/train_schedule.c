/* Learning-rate schedules. */
#include "train.h"

#include <math.h>

static double constant(size_t step, size_t steps)
{
    (void)step, (void)steps;
    return 1;
}

static double cosine(size_t step, size_t steps)
{
    return 0.5 * (1 + cos(3.14159265358979323846 * (double)step / (double)steps));
}

static double thirds(size_t step, size_t steps)
{
    return step < steps / 3 ? 1 : step < 2 * (steps / 3) ? 0.1 : 0.01;
}

static const struct hnn_schedule schedule_constant = {"constant", "the same throughout", constant},
                                 schedule_cosine = {"cosine", "half a cosine, down to 0", cosine},
                                 schedule_step = {"step", "a tenth after each third", thirds};

const struct hnn_schedule *const hnn_schedules[] = {&schedule_constant, &schedule_cosine,
                                                    &schedule_step, NULL};

const struct hnn_schedule *hnn_schedule_find(const char *name, struct ad_error *error)
{
    const char *names[LENGTH(hnn_schedules)] = {NULL};
    size_t k = 0;
    for (; hnn_schedules[k]; k++)
        names[k] = hnn_schedules[k]->name;
    return hnn_find("schedule", name, names, &k, error) == AD_OK ? hnn_schedules[k] : NULL;
}
