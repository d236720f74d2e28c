/* The Hessian of the action (hessian.h) from the derivatives of L at all points. By the rule's
   table K_ab = dt weight (q_a q_b L_qq + q_a v_b / dt L_qv + v_a q_b / dt L_vq + v_a v_b / dt^2
   L_vv) couples nodes a and b of an element. */
#include "hessian.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 128 }; /* points that are evaluated at once, at most */

/* ---- making ---- */

static bool allocate(struct phys_hessian *h)
{
    h->gradient = malloc(h->elements * h->side * sizeof(double));
    h->point = malloc((h->table.points + h->repeat) * sizeof *h->point);
    if (!h->of->second)
        return h->gradient && h->point;
    h->order = h->of->coupling.order;
    h->around = h->of->coupling.width;
    h->width = h->around < h->dof / 2 ? 2 * h->around + 1 : h->dof;
    if (h->elements > SIZE_MAX / sizeof(double) / (h->side * (h->table.degree + 1) * h->width))
        return false;
    h->element = calloc(phys_hessian_size(h), sizeof(double));
    h->stiffness = malloc(h->dof * sizeof(double));
    h->rows = malloc(2 * h->dof * sizeof *h->rows);
    h->share = malloc(2 * h->dof * sizeof *h->share);
    return h->rows && h->share && h->element && h->gradient && h->stiffness && h->point;
}

enum ad_status phys_hessian_over(struct phys_hessian *h, struct phys_derivatives *of,
                                 const struct phys_rule *rule, size_t slices, double dt,
                                 struct ad_error *error)
{
    *h = (struct phys_hessian){.of = of, .repeat = rule->repeat, .dof = of->dof, .dt = dt};
    rule->fill(rule, &h->table);
    h->elements = slices - 1;
    h->points = h->table.points * h->elements + rule->repeat;
    h->side = (h->table.degree + 1) * h->dof;
    return allocate(h) ? AD_OK
                       : ad_fail(error, AD_E_MEMORY, "out of memory for second derivatives");
}

enum ad_status phys_hessian_new(struct phys_hessian *h, const struct phys_system *system,
                                const struct phys_rule *rule, size_t slices, double dt,
                                const struct phys_action *action, struct ad_error *error)
{
    struct phys_rule_table table;
    if (rule->repeat)
        action = NULL; /* q is the path there, and a derivative by it includes that by v */
    rule->fill(rule, &table);
    size_t points = table.points * (slices - 1) + rule->repeat;
    struct phys_derivatives *own = calloc(1, sizeof *own);
    *h = (struct phys_hessian){.own = own};
    if (!own)
        return ad_fail(error, AD_E_MEMORY, "out of memory for second derivatives");
    if (phys_derivatives_new(own, system, points < BLOCK ? points : BLOCK, action, error) == AD_OK)
        phys_hessian_over(h, own, rule, slices, dt, error);
    h->own = own;
    return error->status;
}

void phys_hessian_free(struct phys_hessian *h)
{
    if (h->own)
        phys_derivatives_free(h->own);
    AD_FREE(h->own, h->rows, h->share, h->element, h->gradient, h->stiffness, h->point, h->mass);
}

bool phys_hessian_keep_mass(struct phys_hessian *h)
{
    size_t matrix = h->dof * (h->around + 1);
    if (h->points > SIZE_MAX / sizeof(double) / matrix)
        return false;
    h->mass = calloc(h->points * matrix, sizeof *h->mass); /* zero where nothing is coupled */
    return h->mass != NULL;
}

/* ---- points of a path ---- */

/* How the points of an element of length dt hang on its nodes: weight * dt, and q and v.
   Left+repeat has one point more, of the last element alone. */
static void place_points(struct phys_hessian *h)
{
    for (size_t j = 0; j < h->table.points; j++) {
        struct phys_hessian_point *at = &h->point[j];
        at->weight = h->table.weight[j] * h->dt;
        at->time = h->table.time[j] * h->dt;
        for (size_t k = 0; k <= h->table.degree; k++) {
            at->q[k] = h->table.q[j][k];
            at->v[k] = h->table.v[j][k] / h->dt;
        }
    }
    if (h->repeat)
        h->point[h->table.points] = (struct phys_hessian_point){
            .weight = h->dt, .time = h->dt, .q = {0, 1}, .v = {-1 / h->dt, 1 / h->dt}};
}

static size_t element_of(const struct phys_hessian *h, size_t p)
{
    return p / h->elements == h->table.points ? h->elements - 1 : p % h->elements;
}

double phys_hessian_slice_time(const struct phys_hessian *h, size_t i)
{
    return (h->mesh ? h->mesh[i] : (double)i) * h->dt;
}

double phys_hessian_time(const struct phys_hessian *h, size_t p)
{
    size_t j = p / h->elements, e = element_of(h, p);
    double time = j < h->table.points ? h->table.time[j] : 1;
    return ((h->mesh ? h->mesh[e] : (double)e) + time * phys_hessian_length(h, e)) * h->dt;
}

/* A block of points of the path: point first + c is in column c < count. */
struct block {
    size_t first, count;
};

static struct block block_from(const struct phys_hessian *h, size_t first)
{
    size_t rest = h->points - first;
    return (struct block){first, rest < h->of->columns ? rest : h->of->columns};
}

/* Points of a block at one place of elements that follow each other: columns [from, to). */
struct stretch {
    size_t from, to, element;
    const struct phys_hessian_point *at;
};

/* Those behind the present ones; false: there are none. */
static bool next_stretch(const struct phys_hessian *h, struct block b, struct stretch *s)
{
    s->from = s->to;
    size_t p = b.first + s->from, rest = b.count - s->from;
    if (rest == 0)
        return false;
    s->element = element_of(h, p);
    s->at = &h->point[p / h->elements];
    s->to += rest < h->elements - s->element ? rest : h->elements - s->element;
    return true;
}

/* q and v of coordinate d at a stretch, in the columns of q and v. */
static void set_stretch(const struct phys_hessian *h, const struct stretch *s, const double *path,
                        size_t d, double *q, double *v)
{
    size_t slices = h->elements + 1, degree = h->table.degree, count = s->to - s->from;
    q += s->from;
    v += s->from;
    for (size_t k = 0; k <= degree; k++) {
        const double *x = path + (k < degree ? (k * h->dof + d) * slices : d * slices + 1);
        const double of_q = s->at->q[k], of_v = s->at->v[k];
        for (size_t c = 0; c < count; c++) {
            q[c] = (k ? q[c] : 0) + of_q * x[s->element + c];
            v[c] = (k ? v[c] : 0) + of_v * x[s->element + c];
        }
    }
    for (size_t c = 0; h->mesh && c < count; c++)
        v[c] /= phys_hessian_length(h, s->element + c);
}

/* The path, or q, v and t of a block; columns beyond it repeat its last point. */
static void set_block(struct phys_hessian *h, struct block b, const double *path, double start,
                      ad_program *program)
{
    size_t n = h->of->columns;
    double *q = h->of->work, *v = q + h->dof * n, *t = v + h->dof * n;
    if (h->of->path.tape) {
        ad_set(program, h->of->path, path);
        return;
    }
    for (struct stretch s = {0}; next_stretch(h, b, &s);) {
        for (size_t c = s.from, e = s.element; c < s.to; c++, e++)
            t[c] = start + phys_hessian_slice_time(h, e) + s.at->time * phys_hessian_length(h, e);
        for (size_t d = 0; d < h->dof; d++)
            set_stretch(h, &s, path, d, q + d * n, v + d * n);
    }
    for (size_t row = 0; row < 2 * h->dof + 1; row++) /* of q, v and t */
        for (size_t c = b.count; c < n; c++)
            q[row * n + c] = q[row * n + b.count - 1];
    phys_derivatives_set(h->of, program);
}

/* ---- adding up ---- */

static void add_gradient(struct phys_hessian *h, struct block b, ad_program *program)
{
    size_t n = h->of->columns;
    const double *by_q = ad_data(program, h->of->L_q), *by_v = ad_data(program, h->of->L_v);
    for (struct stretch s = {0}; next_stretch(h, b, &s);)
        for (size_t a = 0; a <= h->table.degree; a++) {
            const double weight = s.at->weight, of_v = weight * s.at->v[a];
            for (size_t d = 0; d < h->dof; d++) {
                double *g = h->gradient + s.element * h->side + a * h->dof + d;
                for (size_t c = s.from, e = s.element; c < s.to; c++, e++, g += h->side) {
                    double of_q = weight * phys_hessian_length(h, e) * s.at->q[a];
                    *g += of_q * by_q[d * n + c] + of_v * by_v[d * n + c];
                }
            }
        }
}

/* Action and mean energy v L_v - L of a block. */
static void add_values(struct phys_hessian *h, struct block b)
{
    const struct phys_derivatives *of = h->of;
    size_t n = of->columns;
    const double *L = ad_data(of->first, of->L), *L_v = ad_data(of->first, of->L_v);
    const double *v = of->work + h->dof * n;
    for (size_t c = 0; c < b.count; c++) {
        double weight = h->point[(b.first + c) / h->elements].weight, vp = 0;
        weight *= phys_hessian_length(h, element_of(h, b.first + c));
        for (size_t d = 0; d < h->dof; d++)
            vp += v[d * n + c] * L_v[d * n + c];
        h->action += weight * L[c];
        h->kinetic += weight * vp / 2;
        if (b.first + c == 0)
            h->energy = h->least = h->most = vp - L[c];
        h->least = fmin(h->least, vp - L[c]);
        h->most = fmax(h->most, vp - L[c]);
    }
}

/* What multiplies a seed at a block: second derivatives, [dof x columns] each. */
struct second {
    const double *qq, *vq, *qv, *vv;
};

/* Rows of column `seed` that are not zero at all points of a block, in h->rows, and their places in
   the second half of it. */
static size_t find_rows(struct phys_hessian *h, struct block b, size_t seed, struct second L)
{
    const struct phys_pattern *coupling = &h->of->coupling;
    size_t n = 0;
    for (size_t k = coupling->start[seed]; k < coupling->start[seed + 1]; k++) {
        size_t d = coupling->row[k], p = d * h->of->columns, end = p + b.count;
        size_t at = coupling->place[d], of = coupling->place[seed];
        while (p < end && L.qq[p] == 0 && L.vq[p] == 0 && L.qv[p] == 0 && L.vv[p] == 0)
            p++;
        size_t apart = at > of ? at - of : of - at;
        if (p < end) {
            h->rows[n] = d;
            h->rows[h->dof + n++] = at;
            h->reach = apart > h->reach ? apart : h->reach;
        }
    }
    return n;
}

/* Contribution of column `seed` of the second derivatives at a block to the couplings of each node
   k with itself and those behind it: with L_q and L_v by its q and v, those of node a follow. */
static void add_column(struct phys_hessian *h, struct block b, size_t seed)
{
    ad_program *program = h->of->second;
    const struct second L = {ad_data(program, h->of->L_qq), ad_data(program, h->of->L_vq),
                             ad_data(program, h->of->L_qv), ad_data(program, h->of->L_vv)};
    const size_t rows = find_rows(h, b, seed, L), n = h->of->columns, degree = h->table.degree;
    const size_t to = h->of->coupling.place[seed];
    double *restrict of_q = h->share, *restrict of_v = of_q + h->dof;
    size_t first = to, end = to + 1;
    for (size_t r = 0; r < rows; r++) {
        const size_t place = h->rows[h->dof + r];
        first = place < first ? place : first;
        end = place < end ? end : place + 1;
    }
    memset(of_q + first, 0, (end - first) * sizeof *of_q);
    memset(of_v + first, 0, (end - first) * sizeof *of_v);
    for (size_t c = 0; c < b.count; c++) {
        const struct phys_hessian_point *at = &h->point[(b.first + c) / h->elements];
        const size_t e = element_of(h, b.first + c), width = h->width;
        const double length = phys_hessian_length(h, e), rate = 1 / length;
        for (size_t k = 0; k <= degree; k++) {
            const double by_q = at->weight * at->q[k] * length, by_v = at->weight * at->v[k];
            double *column = h->element + phys_hessian_place(h, e, 0, to, k, to) - to;
            for (size_t r = 0; r < rows; r++) {
                const size_t p = h->rows[r] * n + c, place = h->rows[h->dof + r];
                of_q[place] = by_q * L.qq[p] + by_v * L.qv[p];
                of_v[place] = rate * (by_q * L.vq[p] + by_v * L.vv[p]);
            }
            for (size_t a = k; a <= degree; a++) {
                double *restrict sum = column + a * width;
                const double q = at->q[a], v = at->v[a];
#pragma omp simd
                for (size_t i = first; i < end; i++)
                    sum[i] += of_q[i] * q + of_v[i] * v;
            }
        }
    }
}

/* The couplings of each node with those before it. */
static void mirror(struct phys_hessian *h)
{
    for (size_t e = 0; e < h->elements; e++)
        for (size_t k = 1; k <= h->table.degree; k++)
            for (size_t j = 0; j < h->dof; j++) {
                size_t first, end;
                phys_hessian_coupled(h, j, &first, &end);
                for (size_t a = 0; a < k; a++) {
                    double *to = h->element + phys_hessian_place(h, e, a, j, k, j);
                    for (size_t i = first; i < end; i++)
                        to[(ptrdiff_t)i - (ptrdiff_t)j] =
                            h->element[phys_hessian_place(h, e, k, j, a, i)];
                }
            }
}

/* What L_vv of a block says in column `seed`: the mean of the diagonal, and all where it is kept.
 */
static void add_masses(struct phys_hessian *h, struct block b, size_t seed)
{
    const struct phys_pattern *coupling = &h->of->coupling;
    size_t n = h->of->columns;
    const double *vv = ad_data(h->of->second, h->of->L_vv);
    double share = 1 / ((double)h->points * h->dt);
    for (size_t c = 0; c < b.count; c++)
        h->stiffness[seed] +=
            share * fabs(vv[seed * n + c]) / phys_hessian_length(h, element_of(h, b.first + c));
    const size_t column = coupling->place[seed];
    for (size_t k = coupling->start[seed]; h->mass && k < coupling->start[seed + 1]; k++) {
        const size_t row = coupling->place[coupling->row[k]];
        for (size_t c = 0; row >= column && c < b.count; c++)
            h->mass[((b.first + c) * h->dof + column) * (h->around + 1) + row - column] =
                vv[coupling->row[k] * n + c];
    }
}

bool phys_hessian_stopped(struct phys_hessian *h)
{
    h->stopped = h->stopped || (h->proceed && !h->proceed(h->context));
    return h->stopped;
}

/* Zeros where something may stand: all else is zero from the start. */
static void clear(struct phys_hessian *h)
{
    const bool full = h->width == h->dof;
    if (full)
        memset(h->element, 0, phys_hessian_size(h) * sizeof *h->element);
    for (size_t column = 0; !full && column < h->elements * h->side; column++) {
        size_t first, end, j = column % h->dof;
        phys_hessian_coupled(h, j, &first, &end);
        for (size_t a = 0; a <= h->table.degree; a++)
            memset(h->element + phys_hessian_place(h, 0, a, first, column / h->dof, j), 0,
                   (end - first) * sizeof *h->element);
    }
    memset(h->stiffness, 0, h->dof * sizeof *h->stiffness);
    if (h->mass) /* has been factored, perhaps */
        memset(h->mass, 0, h->points * h->dof * (h->around + 1) * sizeof *h->mass);
}

void phys_hessian_at(struct phys_hessian *h, const double *path, double start)
{
    const struct phys_derivatives *of = h->of;
    place_points(h);
    clear(h);
    memset(h->gradient, 0, h->elements * h->side * sizeof *h->gradient);
    for (struct block b = block_from(h, 0); b.count > 0; b = block_from(h, b.first + b.count)) {
        set_block(h, b, path, start, of->second);
        for (size_t colour = 0; colour < of->coupling.colours; colour++) {
            if (phys_hessian_stopped(h))
                return;
            phys_derivatives_colour(h->of, colour);
            for (size_t seed = 0; seed < h->dof; seed++)
                if (of->coupling.colour[seed] == colour) {
                    add_column(h, b, seed);
                    add_masses(h, b, seed);
                }
        }
        add_gradient(h, b, of->second);
    }
    mirror(h);
}

void phys_hessian_gradient_at(struct phys_hessian *h, const double *path, double start)
{
    place_points(h);
    h->action = h->kinetic = 0;
    memset(h->gradient, 0, h->elements * h->side * sizeof *h->gradient);
    for (struct block b = block_from(h, 0); b.count > 0; b = block_from(h, b.first + b.count)) {
        ad_program *program = h->of->first ? h->of->first : h->of->second;
        set_block(h, b, path, start, program);
        if (h->of->first)
            ad_run(program);
        else
            phys_derivatives_colour(h->of, 0);
        add_gradient(h, b, program);
        if (h->of->first)
            add_values(h, b);
    }
}
