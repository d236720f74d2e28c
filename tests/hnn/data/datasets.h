/* Data sets as the tests read them. */
#ifndef TESTS_HNN_DATA_DATASETS_H
#define TESTS_HNN_DATA_DATASETS_H

#include "tests/files.h"
#include "hnn/data/data.h"

/* The data set of these settings; fails the test if it cannot be read. */
struct hnn_dataset dataset_of(const struct hnn_dataset_settings *settings);
/* Fails the test unless it is refused with that status, in words that contain `says`. */
void dataset_refused(const struct hnn_dataset_settings *settings, enum ad_status status,
                     const char *says);
/* A CSV file of rows k = 0 ..., `each` a trajectory: state (k, -k), rates (3 k, 7), trial k / each,
   time 0.25 k. */
struct path dataset_rows(const char *name, size_t rows, size_t each);

#endif
