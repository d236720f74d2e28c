/* Roots of an end map by boxes (covering.h). The centre of each box has the map's value g and
   Jacobian J. From those of its parent and siblings follows by how much the map departs from its
   linear part on the box. A box is left out where, for some direction u, |u g| is more than the
   linear part and this departure can make up. Where J varies by less than half of itself, as J^-1
   sees it, the box has one root at most, to which Newton's method leads. Other boxes are
   divided. */
#include "covering.h"
#include "physics/io/random.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    DOF = PHYS_END_MAP_DOF,
    COARSEST = 8,
    DEEPEST = 15,
    ITERATIONS = 25,
    HALVINGS = 6,
    LOOKS = 300
};

static const double TOLERANCE = 1e-13; /* of the motions of a covering, per step ... */
static const double TIGHT = 1e-13;     /* ... and of roots */
static const double CLOSED = 1e-9;     /* |miss| of a root */
static const double SINGULAR = 1e-6;   /* a singular value that is 0, relative to the largest, or to
                                          that of a free motion */
static const double NEGLIGIBLE = 1e-4; /* share of the velocities that ends a covering */
static const double SAFETY = 2;        /* times the departure from the linear part that is seen */
static const double LINEAR = 0.25;     /* a change of J on a box that leaves it one root at most */
static const double SAME = 1e-6;       /* distance of roots that are one, relative to the speed */
static const double SPREAD = 0.02, NEIGHBOUR = 0.2; /* of a family's roots, relative to the speed */

struct box {
    double x[DOF], half;         /* centre, w = frame x; half its edge */
    double g[DOF], J[DOF * DOF]; /* by x */
    bool lost;
    int depth;
};

struct cover {
    struct phys_covering *c;
    size_t n;
    double frame[DOF][DOF]; /* rows: edges of the boxes */
    struct box *box;
    size_t boxes, room;
    double volume; /* of the boxes that are still to be divided */
};

static double norm(size_t n, const double *a)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum = hypot(sum, a[k]);
    return sum;
}

static double distance(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum = hypot(sum, a[k] - b[k]);
    return sum;
}

static void place(const struct cover *s, const double *x, double *w)
{
    for (size_t i = 0; i < s->n; i++) {
        w[i] = 0;
        for (size_t k = 0; k < s->n; k++)
            w[i] += s->frame[k][i] * x[k];
    }
}

static void evaluate(struct cover *s, struct box *b)
{
    double w[DOF], J[DOF * DOF];
    place(s, b->x, w);
    b->lost = !phys_end_map_at(s->c->map, w, TOLERANCE, b->g, J);
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; k < s->n; k++) {
            b->J[i * s->n + k] = 0;
            for (size_t j = 0; j < s->n; j++)
                b->J[i * s->n + k] += J[i * s->n + j] * s->frame[k][j];
        }
}

/* ---- roots ---- */

/* A root from w, and its singular directions `null` [rows of return's dimension]; -1: none. */
static int polish(struct phys_end_map *map, double *w, double null[][DOF])
{
    size_t n = map->dof;
    double g[DOF], J[DOF * DOF], next[DOF], there[DOF], other[DOF * DOF];
    struct phys_singular s;
    if (!phys_end_map_at(map, w, TIGHT, g, J))
        return -1;
    for (int k = 0; k < ITERATIONS; k++) {
        double step[DOF] = {0}, length = 1, size = norm(n, g);
        phys_singular_values(n, J, &s);
        double least = SINGULAR * fmax(s.size[0], map->time * map->unit[0] / map->reach);
        for (size_t r = 0; r < n && s.size[r] > least; r++) {
            double along = 0;
            for (size_t i = 0; i < n; i++)
                along += s.left[r][i] * g[i] / s.size[r];
            for (size_t i = 0; i < n; i++)
                step[i] -= along * s.right[r][i];
        }
        if (size <= CLOSED && norm(n, step) <= SAME * (norm(n, w) + map->speed)) {
            int dimension = 0;
            for (size_t r = 0; r < n; r++)
                if (s.size[r] <= least)
                    memcpy(null[dimension++], s.right[r], sizeof s.right[r]);
            if (size > 1e-3 * CLOSED && k + 1 < ITERATIONS && dimension == 0)
                for (size_t i = 0; i < n; i++)
                    w[i] += step[i];
            return dimension;
        }
        int h = 0;
        for (; h < HALVINGS; h++, length *= 0.5) {
            for (size_t i = 0; i < n; i++)
                next[i] = w[i] + length * step[i];
            if (phys_end_map_at(map, next, TIGHT, there, other) && norm(n, there) < size)
                break;
        }
        if (h == HALVINGS)
            return -1;
        memcpy(w, next, sizeof next);
        memcpy(g, there, sizeof g);
        memcpy(J, other, sizeof J);
    }
    return -1;
}

static struct phys_end_root *add_root(struct phys_end_roots *roots, const double *w, size_t n,
                                      struct ad_error *error)
{
    struct phys_end_root *grown = realloc(roots->root, (roots->n + 1) * sizeof *grown);
    if (!grown) {
        ad_fail(error, AD_E_MEMORY, "out of memory for another path");
        return NULL;
    }
    roots->root = grown;
    grown[roots->n] = (struct phys_end_root){.family = roots->n};
    memcpy(grown[roots->n].w, w, n * sizeof *w);
    return &grown[roots->n++];
}

/* Whether roots go on from w in the direction of `null`: that w is no fold. */
static bool goes_on(struct phys_end_map *map, const double *w, const double *null, double by)
{
    double next[DOF], other[DOF][DOF];
    for (size_t i = 0; i < map->dof; i++)
        next[i] = w[i] + by * null[i];
    return polish(map, next, other) > 0 && distance(map->dof, w, next) > 0.5 * by;
}

/* Whether two roots of families are joined by one half-way. */
static bool joined(struct phys_end_map *map, const double *a, const double *b)
{
    double middle[DOF], null[DOF][DOF], apart = distance(map->dof, a, b);
    for (size_t i = 0; i < map->dof; i++)
        middle[i] = 0.5 * (a[i] + b[i]);
    return polish(map, middle, null) > 0 && distance(map->dof, a, middle) < 0.75 * apart &&
           distance(map->dof, b, middle) < 0.75 * apart;
}

static void keep_family(struct phys_covering *c, const double *w, size_t dimension,
                        struct ad_error *error)
{
    size_t n = c->map->dof, had = c->roots->n, family = had;
    for (size_t k = 0; k < had; k++) { /* one of its roots is near: a smooth family has no other */
        const struct phys_end_root *a = &c->roots->root[k];
        if (a->dimension > 0 && distance(n, a->w, w) < SPREAD * c->outer) {
            c->roots->root[a->family].coverings |= 1u << c->number;
            return;
        }
    }
    for (size_t k = 0; k < had; k++) {
        const struct phys_end_root *a = &c->roots->root[k];
        if (a->dimension == 0 || a->family == family ||
            distance(n, a->w, w) > NEIGHBOUR * c->outer || !joined(c->map, a->w, w))
            continue;
        size_t from = family < a->family ? a->family : family;
        size_t to = family < a->family ? family : a->family;
        for (size_t j = 0; j < had; j++)
            if (c->roots->root[j].family == from)
                c->roots->root[j].family = to;
        family = to;
    }
    struct phys_end_root *root = add_root(c->roots, w, n, error);
    if (!root)
        return;
    root->dimension = dimension;
    root->family = family;
    c->roots->root[family].coverings |= 1u << c->number;
}

int phys_cover_near(struct phys_covering *c, double *w, struct ad_error *error)
{
    size_t n = c->map->dof;
    double null[DOF][DOF];
    int dimension = polish(c->map, w, null);
    if (dimension < 0)
        return -1;
    if (dimension > 0 && goes_on(c->map, w, null[0], SPREAD * c->outer)) {
        keep_family(c, w, (size_t)dimension, error);
        return dimension;
    }
    struct phys_end_root *known = NULL;
    for (size_t k = 0; k < c->roots->n && !known; k++)
        if (distance(n, c->roots->root[k].w, w) <= SAME * (norm(n, w) + c->map->speed))
            known = &c->roots->root[k];
    if (!known)
        known = add_root(c->roots, w, n, error);
    if (known)
        known->coverings |= 1u << c->number;
    return 0;
}

/* ---- boxes ---- */

/* x = J^-1 g; false: J is singular. */
static bool solve(size_t n, const double *J, const double *g, double *x)
{
    double a[DOF * DOF];
    memcpy(a, J, n * n * sizeof *J);
    memcpy(x, g, n * sizeof *g);
    return phys_lapack_lu_solve_once(n, a, x) == 0 && isfinite(norm(n, x));
}

/* Whether |u g| exceeds what the linear part and the departure `off` can make up. */
static bool separates(size_t n, const struct box *b, const double *u, double off)
{
    double length = norm(n, u), here = 0, most = 0;
    for (size_t i = 0; i < n; i++)
        here += u[i] * b->g[i];
    for (size_t k = 0; k < n; k++) {
        double part = 0;
        for (size_t i = 0; i < n; i++)
            part += u[i] * b->J[i * n + k];
        most += fabs(part) * b->half;
    }
    return length > 0 && fabs(here) > most + off * length;
}

static bool left_out(size_t n, const struct box *b, double off)
{
    struct phys_singular s;
    if (separates(n, b, b->g, off))
        return true;
    phys_singular_values(n, b->J, &s);
    for (size_t r = 0; r < n; r++)
        if (separates(n, b, s.left[r], off))
            return true;
    for (size_t k = 0; k < n && s.size[n - 1] > 0; k++) { /* rows of J^-1 */
        double u[DOF] = {0};
        for (size_t i = 0; i < n; i++)
            for (size_t r = 0; r < n; r++)
                u[i] += s.right[r][k] * s.left[r][i] / s.size[r];
        if (separates(n, b, u, off))
            return true;
    }
    return false;
}

/* The largest row sum of J^-1 (other - J). */
static double varies(size_t n, const double *J, const double *other)
{
    double sum[DOF] = {0}, most = 0;
    for (size_t k = 0; k < n; k++) {
        double d[DOF], x[DOF];
        for (size_t i = 0; i < n; i++)
            d[i] = other[i * n + k] - J[i * n + k];
        if (!solve(n, J, d, x))
            return (double)INFINITY;
        for (size_t i = 0; i < n; i++)
            sum[i] += fabs(x[i]);
    }
    for (size_t i = 0; i < n; i++)
        most = fmax(most, sum[i]);
    return most;
}

/* Whether the ball `outer` reaches into the box, and the box out of `inner`. */
static bool in_shell(const struct cover *s, const struct box *b)
{
    double near = 0, far = 0;
    for (size_t k = 0; k < s->n; k++) {
        near = hypot(near, fmax(0, fabs(b->x[k]) - b->half));
        far = hypot(far, fabs(b->x[k]) + b->half);
    }
    return near < s->c->outer && far > s->c->inner;
}

/* A family through the box, with J close to that of its root in the directions across. */
static bool is_family(struct cover *s, const struct box *b, struct ad_error *error)
{
    size_t n = s->n;
    double w[DOF], at[DOF], g[DOF], J[DOF * DOF], here[DOF * DOF];
    struct phys_singular root, own;
    if (norm(n, b->g) > 0.5)
        return false;
    place(s, b->x, w);
    memcpy(at, w, sizeof at);
    int dimension = phys_cover_near(s->c, at, error);
    if (dimension <= 0 || distance(n, w, at) > 2 * sqrt((double)n) * b->half ||
        !phys_end_map_at(s->c->map, at, TIGHT, g, J) ||
        !phys_end_map_at(s->c->map, w, TOLERANCE, g, here))
        return false;
    phys_singular_values(n, J, &root);
    phys_singular_values(n, here, &own);
    size_t rank = n - (size_t)dimension;
    if (rank == 0)
        return norm(n, b->g) < 1e-4;
    double apart = 0;
    for (size_t k = 0; k < n * n; k++)
        apart = hypot(apart, here[k] - J[k]);
    return apart < 0.5 * root.size[rank - 1];
}

enum verdict { OUT, DONE, DIVIDE };

static enum verdict judge(struct cover *s, const struct box *b, const struct box *parent,
                          const struct box *child, size_t children, struct ad_error *error)
{
    size_t n = s->n;
    double off = 0, turns = 0, x[DOF], w[DOF];
    if (b->lost || parent->lost)
        return DIVIDE;
    for (size_t c = 0; c < children; c++) {
        if (child[c].lost)
            return DIVIDE;
        double by_value[DOF], by_slope[DOF] = {0};
        for (size_t i = 0; i < n; i++) {
            by_value[i] = child[c].g[i] - parent->g[i];
            for (size_t k = 0; k < n; k++) {
                size_t ik = i * n + k;
                by_value[i] -= parent->J[ik] * (child[c].x[k] - parent->x[k]);
                by_slope[i] += 0.5 * b->half * fabs(child[c].J[ik] - parent->J[ik]);
            }
        }
        off = fmax(off, fmax(norm(n, by_value), norm(n, by_slope)));
        turns = fmax(turns, varies(n, b->J, child[c].J));
    }
    turns = fmax(turns, varies(n, b->J, parent->J));
    if (left_out(n, b, SAFETY * off))
        return OUT;
    if (turns < LINEAR && solve(n, b->J, b->g, x)) {
        for (size_t k = 0; k < n; k++) {
            if (fabs(x[k]) > 1.5 * b->half)
                return OUT;
            x[k] = b->x[k] - x[k];
        }
        place(s, x, w);
        if (phys_cover_near(s->c, w, error) >= 0)
            return DONE;
    }
    return b->depth >= 3 && is_family(s, b, error) ? DONE : DIVIDE;
}

static bool push(struct cover *s, const struct box *b, struct ad_error *error)
{
    if (s->boxes == s->room) {
        size_t room = 2 * s->room + 1024;
        struct box *grown = realloc(s->box, room * sizeof *grown);
        if (!grown)
            return ad_fail(error, AD_E_MEMORY, "out of memory for boxes of velocities") == AD_OK;
        s->box = grown;
        s->room = room;
    }
    s->box[s->boxes++] = *b;
    s->volume += pow(2 * b->half, (double)s->n);
    return true;
}

/* A box that is not divided any more counts as undecided, unless a root was found beside
 * it. */
static void give_up(struct cover *s, const struct box *b, bool look, struct ad_error *error)
{
    double w[DOF], edge = 2 * b->half;
    place(s, b->x, w);
    for (size_t k = 0; k < s->c->roots->n; k++) {
        const struct phys_end_root *root = &s->c->roots->root[k];
        if (distance(s->n, root->w, w) < 4 * edge &&
            s->c->roots->root[root->family].coverings >> s->c->number & 1)
            return;
    }
    s->c->undecided += pow(edge, (double)s->n);
    if (look)
        phys_cover_near(s->c, w, error);
}

static void divide(struct cover *s, const struct box *parent, struct ad_error *error)
{
    struct box child[1 << DOF];
    size_t n = s->n, children = (size_t)1 << n;
    for (size_t c = 0; c < children; c++) {
        child[c] = (struct box){.half = 0.5 * parent->half, .depth = parent->depth + 1};
        for (size_t k = 0; k < n; k++)
            child[c].x[k] = parent->x[k] + (c >> k & 1 ? 0.5 : -0.5) * parent->half;
        evaluate(s, &child[c]);
    }
    for (size_t c = 0; c < children && error->status == AD_OK; c++)
        if (in_shell(s, &child[c]) &&
            judge(s, &child[c], parent, child, children, error) == DIVIDE) {
            if (child[c].depth < DEEPEST)
                push(s, &child[c], error);
            else
                give_up(s, &child[c], true, error);
        }
}

/* Boxes of equal size in a frame of random directions. */
static void begin(struct cover *s, struct ad_error *error)
{
    struct phys_random random;
    double work[2 * DOF], shift[DOF], rows[DOF * DOF];
    phys_random_seed(&random, s->c->seed);
    for (size_t k = 0; k < s->n * s->n; k++)
        rows[k] = phys_random_normal(&random);
    phys_lapack_orthonormal_rows(s->n, s->n, rows, work);
    for (size_t k = 0; k < s->n; k++) {
        memcpy(s->frame[k], rows + k * s->n, s->n * sizeof *rows);
        shift[k] = phys_random_uniform(&random);
    }
    size_t across = COARSEST + 1, all = 1;
    for (size_t k = 0; k < s->n; k++)
        all *= across;
    for (size_t i = 0; i < all && error->status == AD_OK; i++) {
        struct box b = {.half = s->c->outer / COARSEST};
        size_t j = i;
        for (size_t k = 0; k < s->n; k++, j /= across)
            b.x[k] = -s->c->outer + b.half * (2 * ((double)(j % across) - shift[k]) + 1);
        if (!in_shell(s, &b))
            continue;
        evaluate(s, &b);
        push(s, &b, error);
    }
}

enum ad_status phys_cover(struct phys_covering *c, struct ad_error *error)
{
    struct cover s = {.c = c, .n = c->map->dof};
    size_t from = c->map->steps, stride = 0;
    bool ended = false;
    double ball = s.n == 2 ? acos(-1) : 4 * acos(-1) / 3;
    double shell = ball * (pow(c->outer, (double)s.n) - pow(c->inner, (double)s.n));
    c->undecided = 0;
    c->exhausted = false;
    begin(&s, error);
    for (size_t k = 0; k < s.boxes && error->status == AD_OK; k++) {
        struct box parent = s.box[k];
        ended = ended || (c->map->proceed && !c->map->proceed(c->map->context));
        c->exhausted = ended || (!stride && c->map->steps - from > c->steps) || c->exhausted;
        if (!stride && (c->exhausted || s.volume <= NEGLIGIBLE * shell))
            stride = 1 + (s.boxes - k) / LOOKS;
        s.volume -= pow(2 * parent.half, (double)s.n);
        if (stride)
            give_up(&s, &parent, !ended && k % stride == 0, error);
        else
            divide(&s, &parent, error);
    }
    c->undecided /= shell;
    free(s.box);
    return error->status;
}
