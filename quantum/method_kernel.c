/* Propagation by the whole matrix: zgemv for one packet, zgemm for several. */
#include "autodiff/free.h"
#include "internal.h"

#include <stdlib.h>
#include <string.h>

struct dense {
    size_t n, room; /* packets that `work` has room for */
    qm_complex *K, *work;
};

static void cost(const struct qm_slice *slice, struct qm_cost *cost)
{
    double n = (double)slice->grid.n;
    *cost = (struct qm_cost){.bytes = 16 * n * n, .setup = 100 * n * n, .step = 8 * n * n};
}

static bool aliases(const struct qm_slice *slice)
{
    (void)slice;
    return true;
}

static void close_dense(void *state)
{
    struct dense *dense = state;
    if (!dense)
        return;
    AD_FREE(dense->K, dense->work, dense);
}

static enum ad_status open_dense(const struct qm_slice *slice, void **state, struct ad_error *error)
{
    size_t n = slice->grid.n;
    struct dense *dense = *state = calloc(1, sizeof *dense);
    if (dense) {
        dense->n = n;
        dense->K = n < SIZE_MAX / n / sizeof(qm_complex) ? malloc(n * n * sizeof *dense->K) : NULL;
    }
    if (!dense || !dense->K)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    return qm_kernel(slice, dense->K, error);
}

static enum ad_status step_dense(void *state, size_t packets, qm_complex *psi,
                                 struct ad_error *error)
{
    struct dense *dense = state;
    size_t n = dense->n, bytes = n * packets * sizeof *psi;
    if (packets > dense->room) {
        free(dense->work);
        dense->work = malloc(bytes);
        dense->room = dense->work ? packets : 0;
    }
    if (!dense->work)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu packets", packets);
    memcpy(dense->work, psi, bytes);
    qm_kernel_apply(n, dense->K, packets, dense->work, psi);
    return AD_OK;
}

const struct qm_method qm_method_kernel = {
    "kernel",   "the sum over straight paths, a matrix", aliases, cost, open_dense, step_dense,
    close_dense};
