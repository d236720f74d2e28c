/* Observables of a scene along a motion (conserved.h). */
#include "conserved.h"
#include "internal.h"

#include <math.h>
#include <stdlib.h>

/* States as columns: rows q, v and t of x, [n] each. */
static void by_rows(size_t rows, size_t n, const double *x, const double *t, double *to)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < rows; k++)
            to[k * n + i] = x[i * rows + k];
        to[rows * n + i] = t[i];
    }
}

/* Observables first <= k < last at n states. */
static enum ad_status evaluate(ad_tape *tape, const struct phys_system *system, size_t first,
                               size_t last, size_t n, const double *states, double *value,
                               struct ad_error *error)
{
    const size_t dof = system->dof;
    ad_var q = ad_input(tape, dof, n, "q"), v = ad_input(tape, dof, n, "v"),
           t = ad_input(tape, 1, n, "t");
    ad_program *program = NULL;
    for (size_t k = first; k < last && phys_tape_status(tape, error) == AD_OK; k++) {
        ad_var y = phys_system_observable(system, k, q, v, t);
        if (ad_compile(tape, 1, &y, &program) == AD_OK) {
            ad_set(program, q, states);
            ad_set(program, v, states + dof * n);
            ad_set(program, t, states + 2 * dof * n);
            ad_run(program);
            ad_get(program, y, value + (k - first) * n);
        }
        ad_program_free(program);
        program = NULL;
    }
    return phys_tape_status(tape, error);
}

enum ad_status phys_observe(const struct phys_system *system, size_t n, const double *x,
                            const double *t, double *value, struct ad_error *error)
{
    if (AD_LACKS(error, system, x, t, value) || AD_LACKS(error, system->scene))
        return error->status;
    const size_t dof = system->dof;
    double *states = malloc((2 * dof + 1) * (n + 1) * sizeof *states);
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!states || !tape) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    } else if (n > 0) {
        by_rows(2 * dof, n, x, t, states);
        evaluate(tape, system, 0, system->scene->n_observables, n, states, value, error);
    }
    ad_tape_free(tape);
    free(states);
    return error->status;
}

double phys_observe_state(const struct phys_system *system, size_t k, const double *x, double t)
{
    const size_t dof = system->dof;
    struct ad_error ignored = {0}; /* of the same state the motion complains */
    double value = (double)NAN, *state = malloc((2 * dof + 1) * sizeof *state);
    ad_tape *tape = ad_tape_new(AD_F64);
    if (state && tape) {
        by_rows(2 * dof, 1, x, &t, state);
        evaluate(tape, system, k, k + 1, 1, state, &value, &ignored);
    }
    ad_tape_free(tape);
    free(state);
    return value;
}
