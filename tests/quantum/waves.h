/* Helpers for tests of wave packets: systems by name, slices, and distances of wave functions. */
#ifndef TESTS_QUANTUM_WAVES_H
#define TESTS_QUANTUM_WAVES_H

#include "tests/close.h"
#include "quantum/quantum.h"

#include <complex.h>

#define assert_no_error(e)                                                                         \
    do {                                                                                           \
        if ((e)->status != AD_OK)                                                                  \
            fail_msg("%s", (e)->message);                                                          \
    } while (0)

/* A scene with parameters, given as pairs of names and values up to NULL. */
struct parameter {
    const char *name;
    double value;
};
struct phys_system system_with(const char *scene, size_t n, const struct parameter *parameters);
const struct phys_rule *rule_named(const char *name);

/* Moves psi [n x packets] on by `steps` slices. */
void move(const struct qm_method *method, const struct qm_slice *slice, size_t steps,
          size_t packets, qm_complex *psi);
/* Largest |a - b| of [n]. */
double distance(size_t n, const qm_complex *a, const qm_complex *b);
/* Largest distance of the packet moved `steps` slices from the exact one. */
double packet_error(const struct qm_method *method, const struct qm_slice *slice,
                    const struct qm_quadratic *exact, const struct qm_gaussian *packet,
                    size_t steps);

#endif
