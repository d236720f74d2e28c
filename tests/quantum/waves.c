/* Helpers for tests of wave packets (waves.h). */
#include "waves.h"

#include <stdlib.h>

struct phys_system system_with(const char *scene, size_t n, const struct parameter *parameters)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open(scene, &system, &error);
    for (size_t k = 0; k < n; k++)
        phys_system_set(&system, parameters[k].name, parameters[k].value, &error);
    assert_no_error(&error);
    return system;
}

const struct phys_rule *rule_named(const char *name)
{
    struct ad_error error = {0};
    const struct phys_rule *rule = phys_rule_find(name, &error);
    assert_no_error(&error);
    return rule;
}

void move(const struct qm_method *method, const struct qm_slice *slice, size_t steps,
          size_t packets, qm_complex *psi)
{
    qm_propagator *propagator;
    struct ad_error error = {0};
    qm_propagator_new(method, slice, &propagator, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < steps; k++)
        qm_propagate(propagator, packets, psi, &error);
    assert_no_error(&error);
    qm_propagator_free(propagator);
}

double distance(size_t n, const qm_complex *a, const qm_complex *b)
{
    double largest = 0;
    for (size_t k = 0; k < n; k++)
        largest = fmax(largest, cabs(a[k] - b[k]));
    return largest;
}

double packet_error(const struct qm_method *method, const struct qm_slice *slice,
                    const struct qm_quadratic *exact, const struct qm_gaussian *packet,
                    size_t steps)
{
    size_t n = slice->grid.n;
    qm_complex *psi = malloc(2 * n * sizeof *psi);
    assert_non_null(psi);
    qm_packet(&slice->grid, slice->hbar, packet, 1, 0, psi);
    move(method, slice, steps, 1, psi);
    qm_exact_packet(exact, slice->hbar, packet, (double)steps * slice->dt, &slice->grid, psi + n);
    double error = distance(n, psi, psi + n);
    free(psi);
    return error;
}
