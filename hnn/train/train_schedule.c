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

static double between(double from, double to, double share)
{
    return to + (from - to) / 2 * (1 + cos(3.14159265358979323846 * share));
}

/* L. N. Smith, N. Topin, arXiv 1708.07120, with the shares and rates of PyTorch's OneCycleLR. */
static double one_cycle(size_t step, size_t steps)
{
    const double peak = fmax(0.3 * (double)steps - 1, 0), last = (double)steps - 1,
                 at = (double)step;
    if (at < peak)
        return between(1.0 / 25, 1, at / peak);
    return at < last ? between(1, 4e-6, (at - peak) / (last - peak)) : last > 0 ? 4e-6 : 1;
}

static double warm_up(size_t step, size_t steps)
{
    return fmin(1, 10 * (double)(step + 1) / (double)steps);
}

static const struct hnn_schedule schedule_constant = {"constant", "the same throughout", constant},
                                 schedule_cosine = {"cosine", "half a cosine, down to 0", cosine},
                                 schedule_step = {"step", "a tenth after each third", thirds},
                                 schedule_cycle = {"onecycle", "up for 0.3 of the steps, then down",
                                                   one_cycle},
                                 schedule_warm = {"warmup", "up for a tenth of the steps", warm_up};

const struct hnn_schedule *const hnn_schedules[] = {
    &schedule_constant, &schedule_cosine, &schedule_step, &schedule_cycle, &schedule_warm, NULL};

const struct hnn_schedule *hnn_schedule_find(const char *name, struct ad_error *error)
{
    const char *names[LENGTH(hnn_schedules)] = {NULL};
    size_t k = 0;
    for (; hnn_schedules[k]; k++)
        names[k] = hnn_schedules[k]->name;
    return hnn_find("schedule", name, names, &k, error) == AD_OK ? hnn_schedules[k] : NULL;
}
