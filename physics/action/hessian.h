/* The Hessian of the discretised action, element by element. S = dt sum over points of weight L(q,
   v, t) is a sum over elements, so its Hessian is a sum of small symmetric matrices, one per
   element, which couple the nodes of that element alone. */
#ifndef PHYSICS_ACTION_HESSIAN_H
#define PHYSICS_ACTION_HESSIAN_H

#include "derivatives.h"

/* A point of an element: weight * dt, time in the element, how q and v hang on the nodes. */
struct phys_hessian_point {
    double weight, time, q[PHYS_RULE_MOST + 1], v[PHYS_RULE_MOST + 1];
};

struct phys_ends;
struct phys_hessian {
    struct phys_rule_table table;
    bool repeat;         /* one point more, at the last slice */
    const bool *free[2]; /* [dof]: coordinates of the first and last slice that move; NULL: none */
    const struct phys_ends *ends; /* that says so, and relations between them; NULL: none moves */
    size_t dof, elements, points;
    size_t side; /* of an element's matrix: (degree + 1) dof */
    double dt;
    const double *mesh; /* [elements + 1]: times of the slices in units of dt; NULL: 0, 1, 2 ... */

    struct phys_derivatives *of, *own; /* at its points; own: freed with it, or NULL */
    struct phys_hessian_point *point;  /* room */
    size_t *rows;                      /* [2 dof] room */
    double *share;                     /* [2 dof] room */

    const uint32_t *order; /* [dof]: element matrices have coordinate order[k] at place k */
    /* How far apart the places are that L has coupled so far: of each pair of nodes an element
       matrix has a band of places, and zeros elsewhere. */
    size_t reach;
    /* What L may couple at all is at most `around` apart; element matrices keep `width` places of
       a node in each column: of those, or of all. */
    size_t around, width;
    double *element;  /* [elements][side columns][degree + 1 nodes][width]: phys_hessian_place */
    double *gradient; /* [elements][side]: of the element's part of S, in order of coordinates */
    double action, kinetic;     /* with the gradient alone: integrals of L and of v L_v / 2, ... */
    double energy, least, most; /* ... v L_v - L at the first point, and its range */
    double *stiffness;          /* [dof]: mean over points of |L_vv| / dt on the diagonal */
    /* [points][dof][around + 1]: L_vv by columns, places from the diagonal on, where
       phys_hessian_keep_mass asks for it */
    double *mass;

    bool (*proceed)(void *context); /* asked for each colour; false ends it: `stopped` */
    void *context;
    bool stopped; /* all the above is not filled */
};

/* Room and programs for paths of `slices` slices, by the L that `action` recorded for the same
   rule, slices and dt; NULL: recorded anew, so that `start`, and dt in between, may be any. Ends
   with phys_hessian_free, whatever it returned. */
enum ad_status phys_hessian_new(struct phys_hessian *h, const struct phys_system *system,
                                const struct phys_rule *rule, size_t slices, double dt,
                                const struct phys_action *action, struct ad_error *error);
/* The same with derivatives of L that others use, too. */
enum ad_status phys_hessian_over(struct phys_hessian *h, struct phys_derivatives *of,
                                 const struct phys_rule *rule, size_t slices, double dt,
                                 struct ad_error *error);
void phys_hessian_free(struct phys_hessian *h);

/* From then on phys_hessian_at fills `mass`, too. False: no memory. */
bool phys_hessian_keep_mass(struct phys_hessian *h);
/* The length of element e in units of dt. */
static inline double phys_hessian_length(const struct phys_hessian *h, size_t e)
{
    return h->mesh ? h->mesh[e + 1] - h->mesh[e] : 1;
}
/* When slice i is, and point p of the path, from its beginning. */
double phys_hessian_slice_time(const struct phys_hessian *h, size_t i);
double phys_hessian_time(const struct phys_hessian *h, size_t p);

/* Whether `proceed` says or has said that it ends. */
bool phys_hessian_stopped(struct phys_hessian *h);
/* Fills element, gradient and stiffness at a path [degree*dof x slices] that begins at `start`, 0
   where L is an action's. */
void phys_hessian_at(struct phys_hessian *h, const double *path, double start);
/* Places [first, end) that place j may be coupled to. */
static inline void phys_hessian_coupled(const struct phys_hessian *h, size_t j, size_t *first,
                                        size_t *end)
{
    *first = j > h->reach ? j - h->reach : 0;
    *end = h->dof - j > h->reach + 1 ? j + h->reach + 1 : h->dof;
}
/* Where element e has the entry of place i of node a and place j of node b, which may be coupled.
 */
static inline size_t phys_hessian_place(const struct phys_hessian *h, size_t e, size_t a, size_t i,
                                        size_t b, size_t j)
{
    size_t column = e * h->side + b * h->dof + j;
    return (column * (h->table.degree + 1) + a) * h->width + i +
           (h->width < h->dof ? h->around - j : 0);
}
/* That entry, of any two. */
static inline double phys_hessian_entry(const struct phys_hessian *h, size_t e, size_t a, size_t i,
                                        size_t b, size_t j)
{
    return (i > j ? i - j : j - i) > h->around ? 0
                                               : h->element[phys_hessian_place(h, e, a, i, b, j)];
}
/* How many numbers `element` has. */
static inline size_t phys_hessian_size(const struct phys_hessian *h)
{
    return h->elements * h->side * (h->table.degree + 1) * h->width;
}
/* Fills the gradients of the elements alone; action and kinetic where L is not an action's. */
void phys_hessian_gradient_at(struct phys_hessian *h, const double *path, double start);

#endif
