/* What the errors of chart quantum are against: a closed form, or Crank-Nicolson on two fine grids,
   extrapolated. */
#include "chart_quantum.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

enum { COARSE = 3645, STEPS = 2000 };

static enum ad_status run(const struct quantum_reference *reference,
                          const struct phys_system *system, size_t factor, size_t steps,
                          qm_complex *psi, struct ad_error *error)
{
    const struct quantum_problem *problem = reference->problem;
    struct qm_slice slice = {.system = system,
                             .grid = reference->grid,
                             .walls = QM_REFLECT,
                             .dt = problem->time / (double)(factor * steps),
                             .hbar = 1};
    qm_propagator *propagator = NULL;
    slice.grid.n *= factor;
    qm_complex *fine = malloc(slice.grid.n * sizeof *fine);
    if (!fine)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    qm_packet(&slice.grid, 1, &problem->packet, 1, 0, fine);
    if (qm_propagator_new(&qm_method_crank_nicolson, &slice, &propagator, error) == AD_OK)
        for (size_t k = 0; k < factor * steps; k++)
            qm_propagate(propagator, 1, fine, error);
    for (size_t a = 0; a < reference->grid.n; a++)
        psi[a] = fine[factor * a + factor / 2];
    qm_propagator_free(propagator);
    free(fine);
    return error->status;
}

enum ad_status quantum_reference_new(const struct quantum_problem *problem,
                                     const struct phys_system *system, bool quick,
                                     struct quantum_reference *reference, struct ad_error *error)
{
    size_t n = quick ? COARSE / 3 : COARSE, steps = quick ? STEPS / 4 : STEPS;
    *reference =
        (struct quantum_reference){.problem = problem, .grid = {problem->low, problem->high, n}};
    if (problem->exact)
        return AD_OK;
    qm_complex *coarse = malloc(n * sizeof *coarse);
    reference->psi = malloc(n * sizeof *reference->psi);
    if (!coarse || !reference->psi)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (run(reference, system, 1, steps, coarse, error) == AD_OK &&
             run(reference, system, 3, steps, reference->psi, error) == AD_OK)
        for (size_t a = 0; a < n; a++)
            reference->psi[a] += (reference->psi[a] - coarse[a]) / 8;
    free(coarse);
    return error->status;
}

void quantum_reference_free(struct quantum_reference *reference) { free(reference->psi); }

/* The cubic through four points of the fine solution. */
static qm_complex interpolated(const struct quantum_reference *reference, double x)
{
    const struct qm_grid *grid = &reference->grid;
    double at = (x - grid->low) / qm_dx(grid) - 0.5;
    double first = fmin(fmax(floor(at) - 1, 0), (double)grid->n - 4);
    qm_complex sum = 0;
    for (int a = 0; a < 4; a++) {
        double l = 1;
        for (int b = 0; b < 4; b++)
            if (b != a)
                l *= (at - first - b) / (double)(a - b);
        sum += l * reference->psi[(size_t)first + (size_t)a];
    }
    return sum;
}

double quantum_reference_error(const struct quantum_reference *reference,
                               const struct qm_grid *grid, const qm_complex *psi, qm_complex *room)
{
    const struct quantum_problem *problem = reference->problem;
    double sum = 0;
    if (problem->exact)
        qm_exact_packet(&problem->quadratic, 1, &problem->packet, problem->time, grid, room);
    else
        for (size_t a = 0; a < grid->n; a++)
            room[a] = interpolated(reference, qm_x(grid, a));
    for (size_t a = 0; a < grid->n; a++)
        sum += pow(cabs(psi[a] - room[a]), 2);
    return sqrt(sum * qm_dx(grid));
}
