/* Observations of the published systems; whatever fails, fails the test. */
#ifndef TESTS_HNN_OBSERVED_H
#define TESTS_HNN_OBSERVED_H

#include "hnn/data/data.h"

struct hnn_sampling published_sampling(const char *task);
/* To be freed by hnn_observations_free. */
struct hnn_observations observed(const char *task, const struct hnn_sampling *sampling,
                                 uint64_t seed);
double observed_at(const struct hnn_observations *o, size_t column, size_t row);

#endif
