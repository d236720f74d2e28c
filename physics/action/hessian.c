/* The Hessian of the action from the tape (hessian.h). The second derivatives of L at all points of
   the path come from two programs of second gradients: with a unit vector u as the seed,
       d/dq <L_q, u> and d/dv <L_q, u>   are column u of L_qq and L_vq at every point,
       d/dq <L_v, u> and d/dv <L_v, u>   those of L_qv and L_vv,
   so 2 runs for each colour of coordinates that no row couples (coupling.h) give them all, whatever
   the number of slices; all runs but the first recompute only what depends on the seed. By the
   rule's table
       K_ab = dt weight (q_a q_b L_qq + q_a v_b / dt L_qv + v_a q_b / dt L_vq + v_a v_b / dt^2 L_vv)
   couples nodes a and b of an element. */
#include "hessian.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- making ---- */

/* L at the points, on the tape of the action or on one of its own. */
static ad_var lagrangian(struct phys_hessian *h, const struct phys_system *system,
                         const struct phys_action *action)
{
    if (action) {
        h->path = ad_hold(action->path);
        h->q = action->points.q;
        h->v = action->points.v;
        return action->L;
    }
    h->q = ad_hold(ad_input(h->tape, h->dof, h->points, "q"));
    h->v = ad_hold(ad_input(h->tape, h->dof, h->points, "v"));
    h->t = ad_hold(ad_input(h->tape, 1, h->points, "t"));
    return phys_system_lagrangian(system, h->q, h->v, h->t);
}

static enum ad_status record(struct phys_hessian *h, const struct phys_system *system,
                             const struct phys_action *action, struct ad_error *error)
{
    if (!action && !(h->tape = ad_tape_new(AD_F64)))
        return ad_fail(error, AD_E_MEMORY, "out of memory for second derivatives");
    ad_var L = lagrangian(h, system, action), at[2] = {h->q, h->v}, by[2];
    ad_tape *tape = L.tape;
    h->seed = ad_input(tape, h->dof, 1, "seed");
    ad_grad(L, 2, at, by);
    h->L_q = by[0];
    h->L_v = by[1];
    ad_grad(ad_dot(h->L_q, h->seed), 2, at, by);
    h->L_qq = by[0];
    h->L_vq = by[1];
    ad_grad(ad_dot(h->L_v, h->seed), 2, at, by);
    h->L_qv = by[0];
    h->L_vv = by[1];
    if (phys_tape_status(tape, error) != AD_OK)
        return error->status;
    if (ad_compile(tape, 3, (ad_var[]){h->L_q, h->L_qq, h->L_vq}, &h->by_q) != AD_OK ||
        ad_compile(tape, 3, (ad_var[]){h->L_v, h->L_qv, h->L_vv}, &h->by_v) != AD_OK)
        return phys_tape_status(tape, error);
    return AD_OK;
}

static bool allocate(struct phys_hessian *h)
{
    size_t matrix = h->side * h->side;
    if (h->elements > SIZE_MAX / sizeof(double) / matrix)
        return false;
    h->element = calloc(h->elements * matrix, sizeof(double));
    h->gradient = malloc(h->elements * h->side * sizeof(double));
    h->stiffness = malloc(h->dof * sizeof(double));
    h->work = malloc(((2 * h->dof + 1) * h->points + h->dof) * sizeof(double));
    h->rows = malloc(h->dof * sizeof *h->rows);
    return h->rows && h->element && h->gradient && h->stiffness && h->work;
}

enum ad_status phys_hessian_new(struct phys_hessian *h, const struct phys_system *system,
                                const struct phys_rule *rule, size_t slices, double dt,
                                const struct phys_action *action, struct ad_error *error)
{
    if (rule->repeat)
        action = NULL; /* q is the path there, and a derivative by it includes that by v */
    *h = (struct phys_hessian){.repeat = rule->repeat, .dof = system->dof, .dt = dt};
    rule->fill(rule, &h->table);
    h->elements = slices - 1;
    h->points = h->table.points * h->elements + rule->repeat;
    h->side = (h->table.degree + 1) * h->dof;
    if (!allocate(h) || !phys_coupling_new(&h->coupling, system))
        return ad_fail(error, AD_E_MEMORY, "out of memory for second derivatives");
    return record(h, system, action, error);
}

void phys_hessian_free(struct phys_hessian *h)
{
    ad_program_free(h->by_q);
    ad_program_free(h->by_v);
    ad_tape_free(h->tape);
    phys_coupling_free(&h->coupling);
    free(h->work);
    free(h->rows);
    free(h->element);
    free(h->gradient);
    free(h->stiffness);
    free(h->mass);
}

bool phys_hessian_keep_mass(struct phys_hessian *h)
{
    size_t matrix = h->dof * h->dof;
    if (h->points > SIZE_MAX / sizeof(double) / matrix)
        return false;
    h->mass = calloc(h->points * matrix, sizeof *h->mass); /* zero where nothing is coupled */
    return h->mass != NULL;
}

/* ---- points of a path ---- */

/* A point of the path: its element, weight * dt, and how q and v hang on the element's nodes. */
struct point {
    size_t element;
    double weight, time; /* time in the element */
    double q[PHYS_RULE_MOST + 1], v[PHYS_RULE_MOST + 1];
};

static struct point point(const struct phys_hessian *h, size_t p)
{
    size_t j = p / h->elements, nodes = h->table.degree + 1;
    struct point at = {.element = p % h->elements};
    if (j == h->table.points) { /* left+repeat */
        return (struct point){.element = h->elements - 1,
                              .weight = h->dt,
                              .time = h->dt,
                              .q = {0, 1},
                              .v = {-1 / h->dt, 1 / h->dt}};
    }
    at.weight = h->table.weight[j] * h->dt;
    at.time = h->table.time[j] * h->dt;
    for (size_t k = 0; k < nodes; k++) {
        at.q[k] = h->table.q[j][k];
        at.v[k] = h->table.v[j][k] / h->dt;
    }
    return at;
}

double phys_hessian_time(const struct phys_hessian *h, size_t p)
{
    struct point at = point(h, p);
    return (double)at.element * h->dt + at.time;
}

/* Sets the path, or q, v and t of all points, in both programs. */
static void set_points(struct phys_hessian *h, const double *path, double start)
{
    ad_program *const programs[] = {h->by_q, h->by_v};
    size_t n = h->points, slices = h->elements + 1, degree = h->table.degree;
    double *q = h->work, *v = q + h->dof * n, *t = v + h->dof * n;
    for (size_t k = 0; h->path.tape && k < 2; k++)
        ad_set(programs[k], h->path, path);
    if (h->path.tape)
        return;
    for (size_t p = 0; p < n; p++) {
        struct point at = point(h, p);
        t[p] = start + (double)at.element * h->dt + at.time;
        for (size_t d = 0; d < h->dof; d++) {
            double *qd = &q[d * n + p], *vd = &v[d * n + p];
            *qd = *vd = 0;
            for (size_t k = 0; k <= degree; k++) {
                double x = k < degree ? path[(k * h->dof + d) * slices + at.element]
                                      : path[d * slices + at.element + 1];
                *qd += at.q[k] * x;
                *vd += at.v[k] * x;
            }
        }
    }
    for (size_t k = 0; k < 2; k++) {
        ad_set(programs[k], h->q, q);
        ad_set(programs[k], h->v, v);
        ad_set(programs[k], h->t, t);
    }
}

/* ---- adding up ---- */

static void add_gradient(struct phys_hessian *h)
{
    const double *by_q = ad_data(h->by_q, h->L_q), *by_v = ad_data(h->by_v, h->L_v);
    memset(h->gradient, 0, h->elements * h->side * sizeof *h->gradient);
    for (size_t p = 0; p < h->points; p++) {
        struct point at = point(h, p);
        double *g = h->gradient + at.element * h->side;
        for (size_t a = 0; a <= h->table.degree; a++)
            for (size_t d = 0; d < h->dof; d++)
                g[a * h->dof + d] += at.weight * (at.q[a] * by_q[d * h->points + p] +
                                                  at.v[a] * by_v[d * h->points + p]);
    }
}

/* Rows of column `seed` that are not zero at all points, in h->rows. */
static size_t find_rows(struct phys_hessian *h, size_t seed, const double *by_q, const double *by_v)
{
    size_t n = 0;
    for (size_t k = h->coupling.start[seed]; k < h->coupling.start[seed + 1]; k++) {
        size_t d = h->coupling.row[k], p = d * h->points, end = p + h->points;
        while (p < end && by_q[p] == 0 && by_v[p] == 0)
            p++;
        size_t apart = d > seed ? d - seed : seed - d;
        if (p < end) {
            h->rows[n++] = d;
            h->reach = apart > h->reach ? apart : h->reach;
        }
    }
    return n;
}

/* Contribution of column `seed` of the second derivatives at point p: with `of_q` that of L_qq and
   L_vq, which multiplies the q of node b; else that of L_qv and L_vv, which multiplies its v. */
static void add_column(struct phys_hessian *h, size_t p, size_t seed, size_t rows,
                       const double *by_q, const double *by_v, bool of_q)
{
    struct point at = point(h, p);
    double *K = h->element + at.element * h->side * h->side;
    for (size_t b = 0; b <= h->table.degree; b++) {
        double share = at.weight * (of_q ? at.q[b] : at.v[b]);
        if (share == 0)
            continue;
        double *column = K + (b * h->dof + seed) * h->side;
        for (size_t a = 0; a <= h->table.degree; a++)
            for (size_t k = 0; k < rows; k++) {
                size_t d = h->rows[k];
                column[a * h->dof + d] +=
                    share * (at.q[a] * by_q[d * h->points + p] + at.v[a] * by_v[d * h->points + p]);
            }
    }
}

/* For all coordinates of a colour. */
static void run_colour(struct phys_hessian *h, ad_program *program, size_t colour)
{
    double *u = h->work + (2 * h->dof + 1) * h->points;
    for (size_t d = 0; d < h->dof; d++)
        u[d] = h->coupling.colour[d] == colour;
    ad_set(program, h->seed, u);
    if (colour == 0)
        ad_run(program);
    else
        ad_rerun(program);
}

static double stiffness(const struct phys_hessian *h, size_t seed)
{
    const double *row = (const double *)ad_data(h->by_v, h->L_vv) + seed * h->points;
    double sum = 0;
    for (size_t p = 0; p < h->points; p++)
        sum += fabs(row[p]);
    return sum / (double)h->points / h->dt;
}

bool phys_hessian_stopped(struct phys_hessian *h)
{
    h->stopped = h->stopped || (h->proceed && !h->proceed(h->context));
    return h->stopped;
}

static void add_columns(struct phys_hessian *h, size_t colour, const double *by_q,
                        const double *by_v, bool of_q)
{
    for (size_t seed = 0; seed < h->dof; seed++) {
        if (h->coupling.colour[seed] != colour)
            continue;
        size_t rows = find_rows(h, seed, by_q, by_v);
        for (size_t p = 0; p < h->points; p++)
            add_column(h, p, seed, rows, by_q, by_v, of_q);
    }
}

/* Columns of L_vv of a colour: the mean of the diagonal, and all where they are kept. */
static void measure_mass(struct phys_hessian *h, size_t colour)
{
    const double *vv = ad_data(h->by_v, h->L_vv);
    for (size_t seed = 0; seed < h->dof; seed++) {
        if (h->coupling.colour[seed] != colour)
            continue;
        h->stiffness[seed] = stiffness(h, seed);
        for (size_t p = 0; h->mass && p < h->points; p++)
            for (size_t k = h->coupling.start[seed]; k < h->coupling.start[seed + 1]; k++) {
                size_t d = h->coupling.row[k];
                h->mass[(p * h->dof + seed) * h->dof + d] = vv[d * h->points + p];
            }
    }
}

/* Zeros where something may stand: all else is zero from the start. */
static void clear(struct phys_hessian *h)
{
    for (size_t column = 0; column < h->elements * h->side; column++) {
        size_t first, end;
        phys_hessian_coupled(h, column % h->side % h->dof, &first, &end);
        for (size_t a = 0; a <= h->table.degree; a++)
            memset(h->element + column * h->side + a * h->dof + first, 0,
                   (end - first) * sizeof *h->element);
    }
}

void phys_hessian_at(struct phys_hessian *h, const double *path, double start)
{
    set_points(h, path, start);
    clear(h);
    for (size_t colour = 0; colour < h->coupling.colours; colour++) {
        if (phys_hessian_stopped(h))
            return;
        run_colour(h, h->by_q, colour);
        const double *qq = ad_data(h->by_q, h->L_qq), *vq = ad_data(h->by_q, h->L_vq);
        add_columns(h, colour, qq, vq, true);
        run_colour(h, h->by_v, colour);
        const double *qv = ad_data(h->by_v, h->L_qv), *vv = ad_data(h->by_v, h->L_vv);
        add_columns(h, colour, qv, vv, false);
        measure_mass(h, colour);
    }
    add_gradient(h);
}

void phys_hessian_gradient_at(struct phys_hessian *h, const double *path, double start)
{
    set_points(h, path, start);
    ad_run(h->by_q);
    ad_run(h->by_v);
    add_gradient(h);
}
