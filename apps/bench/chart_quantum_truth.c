/* Truths for chart quantum: a closed form, or qm_reference. */
#include "chart_quantum.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

enum { POINTS = 3645 };

enum ad_status quantum_reference_new(const struct quantum_problem *problem,
                                     const struct phys_system *system, bool quick,
                                     struct quantum_reference *reference, struct ad_error *error)
{
    size_t n = quick ? POINTS / 3 : POINTS;
    *reference =
        (struct quantum_reference){.problem = problem, .grid = {problem->low, problem->high, n}};
    if (problem->exact)
        return AD_OK;
    struct qm_slice slice = {.size = sizeof slice,
                             .system = system,
                             .grid = reference->grid,
                             .walls = QM_REFLECT,
                             .dt = problem->time,
                             .hbar = 1};
    struct qm_reference found;
    reference->psi = malloc(n * sizeof *reference->psi);
    if (!reference->psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    return qm_reference(&slice, &problem->packet, problem->time, quick ? 1e-7 : 1e-8,
                        reference->psi, &found, error);
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
