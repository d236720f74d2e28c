/* Observations of tasks (observed.h). */
#include "observed.h"
#include "tests/close.h"

struct hnn_observations observed(const char *name, const struct hnn_sampling *sampling,
                                 uint64_t seed)
{
    struct hnn_observations o;
    struct ad_error error = {0};
    const struct hnn_task *task = hnn_task_find(name, &error);
    assert_non_null(task);
    if (hnn_task_observe(task, sampling, seed, &o, &error) != AD_OK)
        fail_msg("%s", error.message);
    return o;
}

struct hnn_sampling published_sampling(const char *name)
{
    struct ad_error error = {0};
    return hnn_task_find(name, &error)->published;
}

double observed_at(const struct hnn_observations *o, size_t column, size_t row)
{
    return o->values[column * o->rows + row];
}
