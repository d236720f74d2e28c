/* The matrix of Newton's method for stages, 1 - h a_ij J_i. The Jacobians of a lattice take one
   difference of rates for each colour of coordinates that none of them couples, and in the order
   of the pattern the matrix is a band: unknowns are ordered by coordinate, then half, then stage.
 */
#include "stages.h"
#include "physics/ode/internal.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* Changes of the rates below this share of what their terms add up to count as rounding. */
static const double noise = DBL_EPSILON / 1e-12;

/* Coordinates that have `parts` components each: k, k + m, ... of the m coordinates. */
static size_t coordinates(const struct phys_stages *g) { return g->coupling.n; }
static size_t parts(const struct phys_stepper *s, const struct phys_stages *g)
{
    return s->n / coordinates(g);
}

static size_t place(const struct phys_stepper *s, const struct phys_stages *g, size_t stage,
                    size_t k)
{
    const size_t m = coordinates(g);
    return (g->coupling.place[k % m] * parts(s, g) + k / m) * g->s + stage;
}

enum ad_status phys_stages_matrix_new(struct phys_stepper *s, struct phys_stages *g,
                                      struct ad_error *error)
{
    const size_t n = s->n, N = g->s * n;
    if (g->memory)
        return AD_OK;
    if (!phys_ode_coupling(s->ode, &g->coupling))
        return ad_fail(error, AD_E_MEMORY, "out of memory for Newton's method");
    const size_t lanes = parts(s, g) * g->coupling.colours;
    const size_t width = parts(s, g) * g->s * (g->coupling.width + 1) - 1;
    if (!(g->memory = malloc((lanes * N + 4 * N + n) * sizeof *g->memory)) ||
        !phys_lu_new(&g->matrix, N, width))
        return ad_fail(error, AD_E_MEMORY, "out of memory for Newton's method");
    g->J = g->memory;
    g->moved = g->J + lanes * N;
    g->shift = g->moved + N;
    g->shorter = g->shift + N;
    g->right = g->shorter + N;
    g->base = g->right + N;
    return AD_OK;
}

void phys_stages_matrix_free(struct phys_stages *g)
{
    phys_pattern_free(&g->coupling);
    phys_lu_free(&g->matrix);
    free(g->memory);
}

static double *lane(const struct phys_stepper *s, const struct phys_stages *g, size_t stage,
                    size_t part, size_t colour)
{
    return g->J + ((stage * parts(s, g) + part) * g->coupling.colours + colour) * s->n;
}

/* By differences; their error costs digits per iteration, not the result. */
static enum ad_status jacobian(struct phys_stepper *s, struct phys_stages *g, size_t stage,
                               double h, struct ad_error *error)
{
    const size_t n = s->n, m = coordinates(g);
    const double t = s->t + g->c[stage] * h;
    double *at = g->point, *shift = g->shift + stage * n;
    phys_stages_combine(n, g->s, s->y, h, g->a[stage], g->F, at);
    if (phys_stepper_rate(s, t, at, g->base, error) != AD_OK)
        return error->status;
    for (size_t part = 0; part < parts(s, g); part++)
        for (size_t colour = 0; colour < g->coupling.colours; colour++) {
            double *J = lane(s, g, stage, part, colour);
            memcpy(g->moved, at, n * sizeof *at);
            for (size_t j = 0, k = part * m; j < m; j++, k++)
                if (g->coupling.colour[j] == colour) {
                    const double size = phys_stages_size(s, g, h, k);
                    g->moved[k] += sqrt(DBL_EPSILON) * (size > g->least ? size : 1);
                    shift[k] = g->moved[k] - at[k];
                }
            if (phys_stepper_rate(s, t, g->moved, J, error) != AD_OK)
                return error->status;
            for (size_t k = 0; k < n; k++)
                J[k] -= g->base[k];
        }
    return AD_OK;
}

/* d rate_i / d y_k at a stage, of coupled components. */
static double slope(const struct phys_stepper *s, const struct phys_stages *g, size_t stage,
                    size_t i, size_t k)
{
    const size_t m = coordinates(g);
    return lane(s, g, stage, k / m, g->coupling.colour[k % m])[i] / g->shift[stage * s->n + k];
}

/* Row i, column k of all stages, and what rounding of y_k makes of rate i. */
static void enter(struct phys_stepper *s, struct phys_stages *g, double h, size_t i, size_t k)
{
    for (size_t stage = 0; stage < g->s; stage++) {
        const double x = slope(s, g, stage, i, k);
        for (size_t other = 0; other < g->s; other++)
            *phys_lu_at(&g->matrix, place(s, g, stage, i), place(s, g, other, k)) =
                (stage == other && i == k) - h * g->a[stage][other] * x;
        g->moved[stage * s->n + i] += fabs(h * x) * noise * g->size[k];
    }
}

/* x [s][n] becomes the solution. */
static void solve(struct phys_stepper *s, struct phys_stages *g, double *x)
{
    const size_t n = s->n;
    for (size_t k = 0; k < g->s * n; k++)
        g->right[place(s, g, k / n, k % n)] = x[k];
    phys_lu_solve(&g->matrix, g->right);
    for (size_t k = 0; k < g->s * n; k++)
        x[k] = g->right[place(s, g, k / n, k % n)];
}

enum ad_status phys_stages_linearise(struct phys_stepper *s, struct phys_stages *g, double h,
                                     struct ad_error *error)
{
    const struct phys_pattern *p = &g->coupling;
    for (size_t stage = 0; stage < g->s; stage++)
        if (jacobian(s, g, stage, h, error) != AD_OK)
            return error->status;
    phys_lu_clear(&g->matrix, g->matrix.n, g->matrix.width);
    memset(g->moved, 0, g->s * s->n * sizeof *g->moved);
    for (size_t j = 0; j < p->n; j++)
        for (size_t a = p->start[j]; a < p->start[j + 1]; a++)
            for (size_t k = j; k < s->n; k += p->n)
                for (size_t i = p->row[a]; i < s->n; i += p->n)
                    enter(s, g, h, i, k);
    if (phys_lu_factor(&g->matrix) != 0)
        return ad_fail(error, AD_E_NONFINITE, "the stage equations are singular");
    solve(s, g, g->moved);
    for (size_t k = 0; k < g->s * s->n; k++)
        if (fabs(g->moved[k]) < INFINITY)
            g->size[k % s->n] = fmax(g->size[k % s->n], fabs(g->moved[k]));
    return AD_OK;
}

void phys_stages_correct(struct phys_stepper *s, struct phys_stages *g) { solve(s, g, g->G); }
