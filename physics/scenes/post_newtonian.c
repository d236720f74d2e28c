/* The first post-Newtonian terms on a tape (attraction.h). */
#include "autodiff/free.h"
#include "attraction.h"

#include <stdlib.h>

static const double c_squared = 299792458.0 * 299792458.0;

/* Pairs a < b of bodies and their strengths; all arrays in one block. */
struct pairs {
    size_t n;
    uint32_t *a, *b, *rows; /* [n] each, rows for one axis */
    ad_var *strength;       /* G m_a m_b [n] */
    ad_var *at_a, *at_b;    /* G m_b, G m_a [n]: the contributions to each other's potential */
};

static bool list_pairs(struct pairs *p, size_t bodies, const ad_var m[], ad_var G)
{
    size_t n = bodies * (bodies - 1) / 2, k = 0;
    *p = (struct pairs){.n = n};
    p->strength = malloc(3 * n * sizeof *p->strength);
    p->a = malloc((2 * n + n + bodies) * sizeof *p->a);
    if (!p->strength || !p->a)
        return false;
    p->at_a = p->strength + n;
    p->at_b = p->at_a + n;
    p->b = p->a + n;
    p->rows = p->b + n;
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++, k++) {
            p->a[k] = (uint32_t)i;
            p->b[k] = (uint32_t)j;
            p->strength[k] = ad_mul(ad_mul(G, m[i]), m[j]);
            p->at_a[k] = ad_mul(G, m[j]);
            p->at_b[k] = ad_mul(G, m[i]);
        }
    return true;
}

static void free_pairs(struct pairs *p) { AD_FREE(p->strength, p->a); }

/* Coordinate `axis` of the bodies in `list`. */
static ad_var axis_of(const struct pairs *p, ad_var x, size_t dims, size_t axis, size_t n,
                      const uint32_t *list)
{
    for (size_t k = 0; k < n; k++)
        p->rows[k] = (uint32_t)(list[k] * dims + axis);
    return ad_gather_rows(x, n, p->rows);
}

/* Running sums begin with nothing. */
static void add(ad_var *sum, ad_var term) { *sum = sum->tape ? ad_add(*sum, term) : term; }

static ad_var record(struct pairs *p, ad_var q, ad_var v, size_t bodies, size_t dims, ad_var m[])
{
    ad_var square = {0}, va_n = {0}, vb_n = {0}, va_vb = {0}, speeds = {0}, d[8];
    uint32_t every[64];
    phys_pair_differences(q, bodies, dims, d);
    for (size_t body = 0; body < bodies; body++)
        every[body] = (uint32_t)body;
    for (size_t axis = 0; axis < dims; axis++) {
        ad_var va = axis_of(p, v, dims, axis, p->n, p->a);
        ad_var vb = axis_of(p, v, dims, axis, p->n, p->b);
        add(&square, ad_square(d[axis]));
        add(&va_n, ad_mul(va, d[axis]));
        add(&vb_n, ad_mul(vb, d[axis]));
        add(&va_vb, ad_mul(va, vb));
        add(&speeds, ad_square(axis_of(p, v, dims, axis, bodies, every)));
    }
    ad_var near = ad_recip(ad_sqrt(square)); /* 1 / r */
    ad_var both = ad_add(ad_gather_rows(speeds, p->n, p->a), ad_gather_rows(speeds, p->n, p->b));
    ad_var along = ad_mul(ad_mul(va_n, vb_n), ad_square(near));
    ad_var moving = ad_sub(ad_sub(ad_mul(3, both), ad_mul(7, va_vb)), along);
    ad_var potential =
        ad_add(ad_scatter_rows(ad_mul(phys_stacked(p->n, p->at_a), near), p->a, bodies),
               ad_scatter_rows(ad_mul(phys_stacked(p->n, p->at_b), near), p->b, bodies));
    ad_var alone = ad_sub(ad_mul(0.125, ad_square(speeds)), ad_mul(0.5, ad_square(potential)));
    ad_var pairs = ad_mul(ad_mul(phys_stacked(p->n, p->strength), near), ad_mul(0.5, moving));
    return ad_add(ad_sum_rows(ad_mul(phys_stacked(bodies, m), alone)), ad_sum_rows(pairs));
}

ad_var phys_post_newtonian(ad_var q, ad_var v, size_t bodies, size_t dims, ad_var m[], ad_var G)
{
    struct pairs p;
    ad_var L;
    if (bodies < 2 || bodies > 64 || dims > 3)
        return ad_refuse(q.tape, AD_E_ARGUMENT, "relativity: %zu bodies, expected 2 to 64", bodies);
    if (list_pairs(&p, bodies, m, G))
        L = ad_mul(1 / c_squared, record(&p, q, v, bodies, dims, m));
    else
        L = ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    free_pairs(&p);
    return L;
}
