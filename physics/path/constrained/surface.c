/* Tangent spaces of constraints along a path (surface.h). */
#include "nodes.h"
#include "autodiff/derivatives.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- making ---- */

/* sum mu g_qq by the slope of mu g in dof lanes, along each coordinate. */
static enum ad_status record(struct phys_surface *s, struct ad_error *error)
{
    const size_t dof = s->dof;
    s->q = ad_input(s->tape, dof, 1, "q");
    s->t = ad_input(s->tape, 1, 1, "t");
    s->mu = ad_input(s->tape, s->n, 1, "mu");
    ad_var lanes = ad_broadcast(s->q, dof, dof), slope, unit = phys_unit_matrix(s->tape, dof);
    ad_var g = phys_system_constraint(s->at->system, lanes, ad_broadcast(s->t, 1, dof));
    if (ad_grad(ad_dot(g, ad_broadcast(s->mu, s->n, dof)), 1, &lanes, &slope) == AD_OK &&
        ad_jvp(slope, 1, &lanes, &unit, &s->curvature) == AD_OK &&
        ad_compile(s->tape, 1, &s->curvature, &s->program) == AD_OK)
        ad_native_lazy(s->program);
    return phys_tape_status(s->tape, error);
}

static enum ad_status allocate(struct phys_surface *s, struct ad_error *error)
{
    const struct phys_hessian *h = s->whole;
    const size_t n = s->n, dof = s->dof;
    struct phys_hessian *to = &s->tangent;
    *to = (struct phys_hessian){.table = h->table,
                                .dof = s->left,
                                .elements = h->elements,
                                .points = h->points,
                                .side = (h->table.degree + 1) * s->left,
                                .dt = h->dt,
                                .mesh = h->mesh,
                                .reach = s->left - 1,
                                .around = s->left - 1,
                                .width = s->left};
    to->element = malloc(phys_hessian_size(to) * sizeof(double));
    to->stiffness = malloc(s->left * sizeof(double));
    s->order = malloc(s->left * sizeof *s->order);
    s->moves = calloc(2 * s->left, sizeof *s->moves);
    for (size_t end = 0; s->moves && h->ends && end < 2; end++)
        to->free[end] = s->moves + end * s->left;
    s->Z = malloc((s->nodes * s->left * dof + 2 * n * dof + n * n + n + 2 * dof + dof * dof) *
                  sizeof *s->Z);
    s->tape = ad_tape_new(AD_F64);
    for (uint32_t i = 0; s->order && i < s->left; i++)
        s->order[i] = i;
    to->order = s->order;
    if (!to->element || !to->stiffness || !s->order || !s->moves || !s->Z || !s->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory for constraints of a path");
    s->Q = s->Z + s->nodes * s->left * dof;
    s->W = s->Q + n * dof;
    s->A = s->W + n * dof;
    s->b = s->A + n * n;
    s->x = s->b + n;
    s->H = s->x + 2 * dof;
    return record(s, error);
}

enum ad_status phys_surface_new(const struct phys_system *system, const struct phys_hessian *whole,
                                struct phys_surface **surface, struct ad_error *error)
{
    *surface = NULL;
    if (!system->scene->constraint)
        return AD_OK;
    struct phys_surface *s = calloc(1, sizeof *s);
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *s = (struct phys_surface){.whole = whole,
                               .dof = system->dof,
                               .n = system->scene->n_constraints,
                               .left = system->dof - system->scene->n_constraints,
                               .nodes = whole->elements * whole->table.degree + 1};
    if (phys_constraints_new(system, &s->at, error) == AD_OK && allocate(s, error) == AD_OK)
        *surface = s;
    else
        phys_surface_free(s);
    return error->status;
}

void phys_surface_free(struct phys_surface *s)
{
    if (!s)
        return;
    phys_hessian_free(&s->tangent);
    phys_constraints_free(s->at);
    ad_program_free(s->program);
    ad_tape_free(s->tape);
    AD_FREE(s->order, s->moves, s->Z, s);
}

/* ---- paths and gradients ---- */

/* Whether normals turn by less than a right angle from node j - 1, whose are in s->W, to j. */
static bool follows(struct phys_surface *s, const double *path, size_t j)
{
    phys_surface_get(s, path, j, s->x);
    if (!phys_surface_normals(s, j, s->x))
        return false;
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; k < s->n; k++)
            s->A[i * s->n + k] = phys_dot(s->dof, s->Q + i * s->dof, s->W + k * s->dof);
    memcpy(s->W, s->Q, s->n * s->dof * sizeof *s->W);
    return j == 0 || phys_lapack_lu_sign(s->n, s->A, s->at->pivots) > 0;
}

/* Directions in which node j at q meets its constraints: the normals of what moves; of constraints
   that depend on nothing that does, their own, along which it is not to be moved. */
static void find_directions(struct phys_surface *s, size_t j, const double *q)
{
    const size_t size = s->dof * sizeof *s->W;
    phys_surface_free_normals(s, j, q);
    memcpy(s->W, s->at->G, s->n * size);
    if (!phys_surface_at_end(s, j))
        return;
    phys_constraints_evaluate(s->at, q, NULL, phys_surface_time(s, j));
    for (size_t i = 0; i < s->n; i++)
        if (phys_norm(s->dof, s->W + i * s->dof) == 0)
            memcpy(s->W + i * s->dof, s->at->G + i * s->dof, size);
}

static enum ad_status refuse_end(const struct phys_surface *s, size_t j, double off,
                                 struct ad_error *error)
{
    char by[40] = "";
    if (isfinite(off))
        snprintf(by, sizeof by, ", which are off by %.3g", off);
    *error = (struct ad_error){0};
    return ad_fail(error, AD_E_ARGUMENT,
                   "%s: no free coordinates near the guess make the %s of the path keep the "
                   "constraints; expected other values of those that are given%s",
                   s->at->system->scene->name, j ? "end" : "start", by);
}

static enum ad_status meet(struct phys_surface *s, double *path, size_t j, struct ad_error *error)
{
    double *q = s->x, *before = q + s->dof, moved = 0;
    phys_surface_get(s, path, j, q);
    find_directions(s, j, q);
    memcpy(before, q, s->dof * sizeof *q);
    if (phys_constraints_meet(s->at, s->W, phys_surface_time(s, j), q, NULL, error) != AD_OK)
        return phys_surface_at_end(s, j) ? refuse_end(s, j, NAN, error) : error->status;
    for (size_t d = 0; d < s->dof; d++) {
        if (phys_surface_moves(s, j, d))
            path[phys_surface_place(s, s->dof, j, d)] = q[d];
        else
            moved = fmax(moved, fabs(q[d] - before[d]));
    }
    return moved > 1e-9 * phys_norm(s->dof, q) ? refuse_end(s, j, moved, error) : AD_OK;
}

enum ad_status phys_surface_meet(struct phys_surface *s, double *path, struct ad_error *error)
{
    for (size_t j = 0; j < s->nodes; j++)
        if (phys_surface_some_move(s, j) && meet(s, path, j, error) != AD_OK)
            return error->status;
    for (size_t j = 0; j < s->nodes; j++)
        if (!follows(s, path, j))
            return ad_fail(error, AD_E_NONFINITE,
                           "%s: the path jumps from one side of its constraints to another at "
                           "t = %g; try a start nearer to a path that keeps them",
                           s->at->system->scene->name, phys_surface_time(s, j));
    return AD_OK;
}

bool phys_surface_project(struct phys_surface *s, const double *path, size_t i, size_t k, double *x)
{
    const size_t j = i * s->whole->table.degree + k;
    phys_surface_get(s, path, j, s->x);
    const bool independent = phys_surface_normals(s, j, s->x);
    phys_take_off(s->dof, s->n, s->Q, x);
    return independent;
}

void phys_surface_project_end(struct phys_surface *s, size_t end, const double *q, double *x)
{
    const size_t j = end * (s->nodes - 1);
    phys_surface_free_normals(s, j, q);
    phys_take_off(s->dof, s->n, s->Q, x);
    for (size_t d = 0; d < s->dof; d++)
        x[d] = phys_surface_moves(s, j, d) ? x[d] : 0;
}

double phys_surface_gradient(struct phys_surface *s, const double *path, double *gradient)
{
    double sum = 0, *q = s->x, *x = s->x + s->dof;
    for (size_t j = 0; j < s->nodes; j++) {
        if (!phys_surface_some_move(s, j))
            continue;
        phys_surface_get(s, path, j, q);
        phys_surface_get(s, gradient, j, x);
        if (phys_surface_at_end(s, j))
            phys_surface_project_end(s, j > 0, q, x);
        else if (phys_surface_normals(s, j, q))
            phys_take_off(s->dof, s->n, s->Q, x);
        else
            return NAN;
        for (size_t d = 0; d < s->dof; d++)
            gradient[phys_surface_place(s, s->dof, j, d)] = x[d];
        sum += phys_dot(s->dof, x, x);
    }
    return sqrt(sum);
}

void phys_surface_to(const struct phys_surface *s, const double *x, double *u)
{
    for (size_t j = 0; j < s->nodes; j++)
        for (size_t i = 0; i < s->left; i++) {
            const double *Z = s->Z + (j * s->left + i) * s->dof;
            double sum = 0;
            for (size_t d = 0; d < s->dof; d++)
                sum += Z[d] * x[phys_surface_place(s, s->dof, j, d)];
            u[phys_surface_place(s, s->left, j, i)] = sum;
        }
}

void phys_surface_from(const struct phys_surface *s, const double *u, double *x)
{
    for (size_t j = 0; j < s->nodes; j++)
        for (size_t d = 0; d < s->dof; d++) {
            double sum = 0;
            for (size_t i = 0; i < s->left; i++)
                sum +=
                    s->Z[(j * s->left + i) * s->dof + d] * u[phys_surface_place(s, s->left, j, i)];
            x[phys_surface_place(s, s->dof, j, d)] = sum;
        }
}

/* ---- the Hessian ---- */

/* sum mu g_qq in s->H at node j, whose gradient of S gives mu; G is that found last. */
static void find_curvature(struct phys_surface *s, size_t j, const double *q)
{
    const struct phys_hessian *h = s->whole;
    const size_t dof = s->dof, e = j / h->table.degree, k = j % h->table.degree;
    double *S_q = s->x + dof, t = phys_surface_time(s, j);
    for (size_t d = 0; d < dof; d++)
        S_q[d] = (e < h->elements ? h->gradient[e * h->side + k * dof + d] : 0) +
                 (k == 0 && e > 0 ? h->gradient[e * h->side - dof + d] : 0);
    for (size_t i = 0; i < s->n; i++) {
        for (size_t m = 0; m < s->n; m++)
            s->A[i * s->n + m] = phys_dot(dof, s->at->G + i * dof, s->at->G + m * dof);
        if (s->A[i * s->n + i] == 0) /* given coordinates keep it */
            s->A[i * s->n + i] = 1;
        s->b[i] = phys_dot(dof, s->at->G + i * dof, S_q);
    }
    phys_lapack_lu_solve_once(s->n, s->A, s->b);
    ad_set(s->program, s->q, q);
    ad_set(s->program, s->t, &t);
    ad_set(s->program, s->mu, s->b);
    ad_run(s->program);
    ad_get(s->program, s->curvature, s->H);
}

/* to[i] += sign Z_a[i] H z for the block H [dof][dof] of nodes a and b of an element (NULL: s->H).
 */
static void add_column(const struct phys_surface *s, const struct phys_hessian *h, size_t e,
                       size_t a, size_t b, const double *z, const double *Z_a, double *to)
{
    const size_t dof = s->dof;
    const uint32_t *place = s->whole->of->coupling.place;
    for (size_t row = 0; row < dof; row++) {
        double sum = 0;
        for (size_t d = 0; d < dof; d++)
            sum +=
                (h ? phys_hessian_entry(h, e, a, place[row], b, place[d]) : -s->H[row * dof + d]) *
                z[d];
        for (size_t i = 0; i < s->left; i++)
            to[i] += Z_a[i * dof + row] * sum;
    }
}

void phys_surface_reduce(struct phys_surface *s, const double *path)
{
    const struct phys_hessian *h = s->whole;
    struct phys_hessian *to = &s->tangent;
    const size_t dof = s->dof, degree = h->table.degree, block = s->left * dof;
    double mean = 0;
    memset(to->element, 0, phys_hessian_size(to) * sizeof *to->element);
    to->stopped = h->stopped;
    to->proceed = h->proceed;
    to->context = h->context;
    for (size_t d = 0; d < dof; d++)
        mean += h->stiffness[d] / (double)dof;
    for (size_t i = 0; i < s->left; i++)
        to->stiffness[i] = mean;
    for (size_t j = 0; j < s->nodes; j++) {
        double *Z = s->Z + j * block;
        const size_t e = j / degree - (j + 1 == s->nodes), node = j - e * degree;
        phys_surface_get(s, path, j, s->x);
        phys_surface_tangents(s, j, phys_surface_free_normals(s, j, s->x), Z);
        if (!phys_surface_some_move(s, j))
            continue;
        phys_surface_get(s, path, j, s->x);
        find_curvature(s, j, s->x);
        for (size_t i = 0; i < s->left; i++)
            add_column(s, NULL, 0, 0, 0, Z + i * dof, Z,
                       to->element + phys_hessian_place(to, e, node, 0, node, i));
    }
    for (size_t e = 0; e < h->elements; e++)
        for (size_t b = 0; b <= degree; b++)
            for (size_t i = 0; i < s->left; i++)
                for (size_t a = 0; a <= degree; a++)
                    add_column(s, h, e, a, b, s->Z + (e * degree + b) * block + i * dof,
                               s->Z + (e * degree + a) * block,
                               to->element + phys_hessian_place(to, e, a, 0, b, i));
}
