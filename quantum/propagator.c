/* The table of propagation methods, and the handle of one in use. */
#include "internal.h"
#include "autodiff/sized.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

const struct qm_method *const qm_methods[] = {&qm_method_kernel, &qm_method_fft,
                                              &qm_method_crank_nicolson, NULL};

struct qm_propagator {
    const struct qm_method *method;
    void *state;
    struct qm_grid grid;
};

const struct qm_method *qm_method_find(const char *name, struct ad_error *error)
{
    const char *names[sizeof qm_methods / sizeof *qm_methods];
    size_t n = 0;
    for (; qm_methods[n]; n++)
        names[n] = qm_methods[n]->name;
    return qm_methods[phys_find("method", name, n, names, error)]; /* NULL behind the last */
}

enum ad_status qm_propagator_new(const struct qm_method *method, const struct qm_slice *slice,
                                 qm_propagator **propagator, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, propagator) || AD_LACKS(error, method) ||
        qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    qm_propagator *p = calloc(1, sizeof *p);
    if (!p)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    p->method = method;
    p->grid = slice->grid;
    if (method->open(slice, &p->state, error) == AD_OK)
        *propagator = p;
    else
        qm_propagator_free(p);
    return error->status;
}

const struct qm_grid *qm_propagator_grid(const qm_propagator *propagator)
{
    return &propagator->grid;
}

void qm_propagator_free(qm_propagator *propagator)
{
    if (!propagator)
        return;
    propagator->method->close(propagator->state);
    free(propagator);
}

enum ad_status qm_propagate(qm_propagator *propagator, size_t packets, qm_complex *psi,
                            struct ad_error *error)
{
    if (AD_LACKS(error, propagator, packets, psi))
        return error->status;
    for (size_t k = 0; k < propagator->grid.n * packets; k++)
        if (!isfinite(creal(psi[k])) || !isfinite(cimag(psi[k])))
            return ad_fail(error, AD_E_NONFINITE,
                           "psi at point %zu of packet %zu is (%g, %g), expected finite numbers",
                           k / packets, k % packets, creal(psi[k]), cimag(psi[k]));
    return propagator->method->step(propagator->state, packets, psi, error);
}
