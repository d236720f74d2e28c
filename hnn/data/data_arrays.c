/* Data sets from arrays of states and rates: their rows are columns, chosen by number. */
#include "autodiff/free.h"
#include "data.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { DOF_MOST = 1 << 16, DIGITS = 8 /* of 4 DOF_MOST, and a comma */ };

/* "first,first+1,...", n numbers. */
static void list_numbers(size_t first, size_t n, char *list)
{
    for (size_t k = 0; k < n; k++)
        list += sprintf(list, "%s%zu", k ? "," : "", first + k);
}

enum ad_status hnn_dataset_arrays(size_t dof, size_t samples, const double *x, const double *rate,
                                  double test_fraction, struct hnn_dataset *dataset,
                                  struct ad_error *error)
{
    size_t n = 2 * dof;
    if (dataset)
        *dataset = (struct hnn_dataset){0};
    if (AD_LACKS(error, x, rate, dataset))
        return error->status;
    if (!dof || dof > DOF_MOST || samples > UINT32_MAX)
        return ad_fail(error, AD_E_ARGUMENT,
                       "arrays of %zu coordinates and %zu samples: expected 1 to %d, and at most "
                       "4294967295",
                       dof, samples, DOF_MOST);
    const double **column = malloc(2 * n * sizeof *column);
    char *state = malloc(n * DIGITS), *rates = malloc(n * DIGITS);
    if (column && state && rates) {
        for (size_t k = 0; k < n; k++) {
            column[k] = x + k * samples;
            column[n + k] = rate + k * samples;
        }
        list_numbers(1, n, state);
        list_numbers(1 + n, n, rates);
        struct hnn_columns columns = {2 * n, samples, column, NULL};
        struct hnn_dataset_settings settings = {.size = sizeof settings,
                                                .columns = &columns,
                                                .state = state,
                                                .rate = rates,
                                                .test_fraction = test_fraction};
        hnn_dataset_read(&settings, dataset, error);
    } else
        ad_fail(error, AD_E_MEMORY, "out of memory");
    AD_FREE(column, state, rates);
    return error->status;
}
