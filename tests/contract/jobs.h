/* Short calls of many parts of the library, for tests that let them fail somewhere. */
#ifndef TESTS_CONTRACT_JOBS_H
#define TESTS_CONTRACT_JOBS_H

#include "autodiff/status.h"

#include <stddef.h>

/* A call, after which its results are freed. The table ends with a job without a name. */
struct job {
    const char *name;
    enum ad_status (*run)(struct ad_error *error);
    size_t tried; /* failing allocations to try */
};
extern const struct job jobs[];

int jobs_open(void **state);
int jobs_close(void **state);

/* From then on they start where L has no values. */
void jobs_to_the_centre(void);

#endif
