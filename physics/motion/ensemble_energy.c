/* The energies of a member at all times by one program (ensemble_run.h): v L_v - L, a column a
 * time.
 */
#include "ensemble_run.h"

#include <math.h>
#include <stdlib.h>

struct ensemble_energy {
    size_t dof, n;
    ad_program *program;
    ad_var q, v, t, E;
};

void phys_ensemble_energy_free(struct ensemble_energy *energy)
{
    if (energy)
        ad_program_free(energy->program);
    free(energy);
}

struct ensemble_energy *phys_ensemble_energy_new(const struct phys_system *system, size_t n,
                                                 const double *times)
{
    struct ensemble_energy *e = calloc(1, sizeof *e);
    ad_tape *tape = ad_tape_new(AD_F64);
    bool done = e && tape;
    if (done) {
        ad_var p;
        *e = (struct ensemble_energy){.dof = system->dof,
                                      .n = n,
                                      .q = ad_input(tape, system->dof, n, "q"),
                                      .v = ad_input(tape, system->dof, n, "v"),
                                      .t = ad_input(tape, 1, n, "t")};
        ad_var L = phys_system_lagrangian(system, e->q, e->v, e->t);
        done = ad_grad(ad_sum(L), 1, &e->v, &p) == AD_OK;
        e->E = done ? ad_sub(ad_sum_rows(ad_mul(p, e->v)), L) : L;
        done = done && ad_compile(tape, 1, &e->E, &e->program) == AD_OK &&
               ad_set(e->program, e->t, times) == AD_OK;
    }
    ad_tape_free(tape);
    if (done)
        return e;
    phys_ensemble_energy_free(e);
    return NULL;
}

void phys_ensemble_energies(struct ensemble_energy *e, size_t known, const double *x,
                            double *energies)
{
    double *q = ad_data(e->program, e->q), *v = ad_data(e->program, e->v);
    for (size_t k = 0; k < e->dof; k++)
        for (size_t j = 0; j < e->n; j++) {
            const double *at = x + 2 * e->dof * (j < known ? j : 0);
            q[k * e->n + j] = at[k];
            v[k * e->n + j] = at[e->dof + k];
        }
    ad_run(e->program);
    ad_get(e->program, e->E, energies);
    for (size_t j = known; j < e->n; j++)
        energies[j] = (double)NAN;
}
