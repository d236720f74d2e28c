/* Roots of an end map by boxes (covering.h). The centre of each box has the map's value g and
   Jacobian J. From those of its parent and siblings follows by how much the map departs from its
   linear part on the box. A box is left out where, for some direction u, |u g| is more than the
   linear part and twice this departure can make up. Where J varies by less than a quarter of
   itself, as J^-1 sees it, the box has one root at most, to which Newton's method leads. Other
   boxes are divided. */
#include "covering.h"
#include "autodiff/free.h"
#include "end_box.h"
#include "physics/io/grow.h"
#include "physics/io/random.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DOF = PHYS_END_MAP_DOF, DEEPEST = 15, LOOKS = 300, LOOKING = 8 };
enum { AHEAD = 512 }; /* boxes for each of many ranks that are divided at once */

/* Boxes across the speeds at first, of two and of three coordinates: beside fewer of them a box
   with a steep root looks linear, and is left out. */
enum { COARSEST = 16, COARSEST_THREE = 8 };

static const double TOLERANCE = 1e-13; /* of the motions of a covering, per step */
static const double NEGLIGIBLE = 1e-4; /* share of the velocities that ends a covering */
static const double SAFETY = 2;        /* times the departure from the linear part that is seen */
static const double LINEAR = 0.25;     /* a change of J on a box that leaves it one root at most */

/* The children of a box, and what their motions took. */
struct division {
    struct phys_end_box child[1 << DOF];
    size_t steps;
};

struct cover {
    struct phys_covering *c;
    size_t n;
    double frame[DOF][DOF]; /* rows: edges of the boxes */
    struct phys_end_box *box;
    size_t boxes;
    double volume;             /* of the boxes that are still to be divided */
    struct division *division; /* of boxes `first` to first + divided - 1 */
    size_t first, divided;
};

static void place(const struct cover *s, const double *x, double *w)
{
    for (size_t i = 0; i < s->n; i++) {
        w[i] = 0;
        for (size_t k = 0; k < s->n; k++)
            w[i] += s->frame[k][i] * x[k];
    }
}

static void evaluate(struct cover *s, struct phys_end_box *b)
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

/* Whether the ball `outer` reaches into the box, and the box out of `inner`. */
static bool in_shell(const struct cover *s, const struct phys_end_box *b)
{
    double near = 0, far = 0;
    for (size_t k = 0; k < s->n; k++) {
        near = hypot(near, fmax(0, fabs(b->x[k]) - b->half));
        far = hypot(far, fabs(b->x[k]) + b->half);
    }
    return near < s->c->outer && far > s->c->inner;
}

/* A family through the box, with J close to that of its root in the directions across. */
static bool is_family(struct cover *s, const struct phys_end_box *b, struct ad_error *error)
{
    size_t n = s->n;
    double w[DOF], at[DOF], g[DOF], J[DOF * DOF], here[DOF * DOF];
    struct phys_singular root;
    if (phys_end_norm(n, b->g) > 0.5)
        return false;
    place(s, b->x, w);
    memcpy(at, w, sizeof at);
    int dimension = phys_cover_near(s->c, at, error);
    if (dimension <= 0 || phys_end_distance(n, w, at) > 2 * sqrt((double)n) * b->half ||
        !phys_end_map_at(s->c->map, at, PHYS_END_MAP_TIGHT, g, J) ||
        !phys_end_map_at(s->c->map, w, TOLERANCE, g, here))
        return false;
    phys_singular_values(n, J, &root);
    size_t rank = n - (size_t)dimension;
    if (rank == 0)
        return phys_end_norm(n, b->g) < 1e-4;
    double apart = 0;
    for (size_t k = 0; k < n * n; k++)
        apart = hypot(apart, here[k] - J[k]);
    return apart < 0.5 * root.size[rank - 1];
}

enum verdict { OUT, DONE, DIVIDE };

static enum verdict judge(struct cover *s, const struct phys_end_box *b,
                          const struct phys_end_box *parent, const struct phys_end_box *child,
                          size_t children, struct ad_error *error)
{
    size_t n = s->n;
    double turns, x[DOF], w[DOF];
    bool lost = b->lost || parent->lost;
    for (size_t c = 0; c < children; c++)
        lost = lost || child[c].lost;
    if (lost)
        return DIVIDE;
    turns = phys_end_box_varies(n, b->J, parent->J);
    for (size_t c = 0; c < children; c++)
        turns = fmax(turns, phys_end_box_varies(n, b->J, child[c].J));
    if (phys_end_box_left_out(n, b, SAFETY * phys_end_box_departure(n, parent, child, children)))
        return OUT;
    if (turns < LINEAR && phys_end_solve(n, b->J, b->g, x)) {
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

static void push(struct cover *s, const struct phys_end_box *b, struct ad_error *error)
{
    if (!phys_grow(&s->box, s->boxes, sizeof *s->box)) {
        ad_fail(error, AD_E_MEMORY, "out of memory for boxes of velocities");
        return;
    }
    s->box[s->boxes++] = *b;
    s->volume += pow(2 * b->half, (double)s->n);
}

/* A box that is not divided any more counts as undecided, unless a root was found beside
 * it. */
static void give_up(struct cover *s, const struct phys_end_box *b, bool look,
                    struct ad_error *error)
{
    double w[DOF], edge = 2 * b->half;
    place(s, b->x, w);
    for (size_t k = 0; k < s->c->roots->n; k++) {
        const struct phys_end_root *root = &s->c->roots->root[k];
        if (s->c->roots->root[root->family].coverings >> s->c->number & 1 &&
            phys_end_near(s->n, root->w, w, 4 * edge))
            return;
    }
    s->c->undecided += pow(edge, (double)s->n);
    if (look)
        phys_cover_near(s->c, w, error);
}

static enum ad_status divide_box(void *context, size_t k, void *result, struct ad_error *error)
{
    struct cover *s = context;
    struct division *d = result;
    const struct phys_end_box *parent = &s->box[s->first + k];
    const size_t before = s->c->map->steps;
    for (size_t c = 0; c < (size_t)1 << s->n; c++) {
        struct phys_end_box *child = &d->child[c];
        *child = (struct phys_end_box){.half = 0.5 * parent->half, .depth = parent->depth + 1};
        for (size_t i = 0; i < s->n; i++)
            child->x[i] = parent->x[i] + (c >> i & 1 ? 0.5 : -0.5) * parent->half;
        evaluate(s, child);
    }
    d->steps = s->c->map->steps - before;
    s->c->map->steps = before;
    return error->status;
}

/* Children of the boxes from k on, by all ranks. */
static enum ad_status look_ahead(struct cover *s, size_t k, struct ad_error *error)
{
    struct ad_ranks *ranks = s->c->ranks;
    const size_t most = ranks ? AHEAD * ranks->count : 1, left = s->boxes - k;
    if (!s->division && !(s->division = malloc(most * sizeof *s->division)))
        ad_fail(error, AD_E_MEMORY, "out of memory for boxes of velocities");
    if (s->c->agree)
        s->c->agree(s->c->context, error);
    s->first = k;
    s->divided = left < most ? left : most;
    return ad_ranks_agree(ranks, error) == AD_OK
               ? ad_ranks_deal(ranks, s->divided, sizeof *s->division, divide_box, s, s->division,
                               error)
               : error->status;
}

/* Box k, of which `parent` is a copy. */
static void divide(struct cover *s, size_t k, const struct phys_end_box *parent,
                   struct ad_error *error)
{
    const size_t children = (size_t)1 << s->n;
    if (k >= s->first + s->divided && look_ahead(s, k, error) != AD_OK)
        return;
    const struct division *d = &s->division[k - s->first];
    s->c->map->steps += d->steps;
    for (size_t c = 0; c < children && error->status == AD_OK; c++)
        if (in_shell(s, &d->child[c]) &&
            judge(s, &d->child[c], parent, d->child, children, error) == DIVIDE) {
            if (d->child[c].depth < DEEPEST)
                push(s, &d->child[c], error);
            else
                give_up(s, &d->child[c], true, error);
        }
}

/* Boxes of equal size in a frame of random directions. */
static void begin(struct cover *s, struct ad_error *error)
{
    struct phys_random random;
    double work[2 * DOF], shift[DOF] = {0}, rows[DOF * DOF];
    phys_random_seed(&random, s->c->seed);
    for (size_t k = 0; k < s->n * s->n; k++)
        rows[k] = phys_random_normal(&random);
    phys_lapack_orthonormal_rows(s->n, s->n, rows, work);
    for (size_t k = 0; k < s->n; k++) {
        memcpy(s->frame[k], rows + k * s->n, s->n * sizeof *rows);
        shift[k] = phys_random_uniform(&random);
    }
    const size_t coarsest = s->n == 2 ? COARSEST : COARSEST_THREE, across = coarsest + 1;
    size_t all = 1;
    bool any = false;
    for (size_t k = 0; k < s->n; k++)
        all *= across;
    for (size_t i = 0; i < all && error->status == AD_OK; i++) {
        struct phys_end_box b = {.half = s->c->outer / (double)coarsest};
        size_t j = i;
        for (size_t k = 0; k < s->n; k++, j /= across)
            b.x[k] = -s->c->outer + b.half * (2 * ((double)(j % across) - shift[k]) + 1);
        if (!in_shell(s, &b))
            continue;
        evaluate(s, &b);
        push(s, &b, error);
        any = any || !b.lost;
    }
    if (!any && error->status == AD_OK &&
        (!s->c->map->proceed || s->c->map->proceed(s->c->map->context)))
        ad_fail(error, AD_E_ACCURACY,
                "no motion from the first end can be followed: L may be singular there");
}

enum ad_status phys_cover(struct phys_covering *c, struct ad_error *error)
{
    struct cover s = {.c = c, .n = c->map->dof};
    size_t left = c->steps > c->map->steps ? c->steps - c->map->steps : 0, stride = 0;
    double ball = s.n == 2 ? acos(-1) : 4 * acos(-1) / 3;
    double shell = ball * (pow(c->outer, (double)s.n) - pow(c->inner, (double)s.n));
    c->undecided = 0;
    c->exhausted = false;
    begin(&s, error);
    for (size_t k = 0; k < s.boxes && error->status == AD_OK; k++) {
        struct phys_end_box parent = s.box[k];
        if (c->map->proceed && !c->map->proceed(c->map->context)) {
            c->undecided += s.volume;
            break;
        }
        c->exhausted = c->exhausted || (!stride && c->map->steps + left / LOOKING > c->steps);
        if (!stride && (c->exhausted || s.volume <= NEGLIGIBLE * shell))
            stride = 1 + (s.boxes - k) / LOOKS;
        s.volume -= pow(2 * parent.half, (double)s.n);
        if (stride)
            give_up(&s, &parent, k % stride == 0 && c->map->steps < c->steps, error);
        else
            divide(&s, k, &parent, error);
        if (c->found && error->status == AD_OK)
            c->found(c->context, error);
    }
    c->undecided /= shell;
    AD_FREE(s.box, s.division);
    return error->status;
}
