/* Galerkin rules: on each element the path is a polynomial of degree s through s + 1 Lobatto nodes,
   and L is integrated by Gauss's s points; the path at the slices converges with order 2s (Ober-
   Bloebaum, Saake, Construction and analysis of higher order Galerkin variational integrators,
   Adv. Comput. Math. 2015). */
#include "internal.h"

#include <math.h>
#include <stdatomic.h>

/* Legendre's P_n and P_n-1 at x. */
static void legendre(size_t n, double x, double *p, double *before)
{
    *before = 1;
    *p = x;
    for (size_t k = 2; k <= n; k++) {
        double next = ((double)(2 * k - 1) * x * *p - (double)(k - 1) * *before) / (double)k;
        *before = *p;
        *p = next;
    }
}

enum { STEPS = 50 }; /* of Newton's method, which needs five or so */

/* Gauss's n points and weights on [0, 1]. */
static void gauss(size_t n, double *point, double *weight)
{
    for (size_t k = 0; k < n; k++) {
        double x = -cos(M_PI * ((double)k + 0.75) / ((double)n + 0.5)), p, before, slope = 1;
        for (int step = 0; step < STEPS; step++) {
            legendre(n, x, &p, &before);
            slope = (double)n * (before - x * p) / (1 - x * x);
            x -= p / slope;
            if (fabs(p / slope) < 1e-16)
                break;
        }
        point[k] = 0.5 * (1 + x);
        weight[k] = 1 / ((1 - x * x) * slope * slope);
    }
}

/* n + 1 Lobatto nodes on [0, 1]: the ends, and the extrema of P_n. */
static void lobatto(size_t n, double *node)
{
    for (size_t k = 0; k <= n; k++) {
        double x = -cos(M_PI * (double)k / (double)n), p, before;
        for (int step = 0; step < STEPS && k > 0 && k < n; step++) {
            legendre(n, x, &p, &before);
            double change = (x * p - before) / ((double)(n + 1) * p);
            x -= change;
            if (fabs(change) < 1e-16)
                break;
        }
        node[k] = 0.5 * (1 + x);
    }
}

/* Lagrange's polynomial that is 1 at node k of n + 1 and 0 at the others, and its slope. */
static void basis(size_t n, const double *node, size_t k, double at, double *value, double *slope)
{
    *value = 1;
    *slope = 0;
    for (size_t j = 0; j <= n; j++) {
        if (j == k)
            continue;
        double scale = 1 / (node[k] - node[j]);
        *slope = *slope * (at - node[j]) * scale + *value * scale;
        *value *= (at - node[j]) * scale;
    }
}

static void make(size_t s, struct phys_rule_table *table)
{
    *table = (struct phys_rule_table){.degree = s, .points = s};
    gauss(s, table->time, table->weight);
    lobatto(s, table->node);
    for (size_t j = 0; j < s; j++)
        for (size_t k = 0; k <= s; k++)
            basis(s, table->node, k, table->time[j], &table->q[j][k], &table->v[j][k]);
}

/* Made once for each degree; threads that come meanwhile make their own. */
static void fill(const struct phys_rule *rule, struct phys_rule_table *table)
{
    enum { NONE, MAKING, MADE };
    static struct phys_rule_table tables[PHYS_RULE_MOST + 1];
    static atomic_int states[PHYS_RULE_MOST + 1];
    const size_t s = rule->degree;
    int none = NONE;
    if (atomic_load(&states[s]) == MADE) {
        *table = tables[s];
        return;
    }
    make(s, table);
    if (atomic_compare_exchange_strong(&states[s], &none, MAKING)) {
        tables[s] = *table;
        atomic_store(&states[s], MADE);
    }
}

#define GAUSS(n)                                                                                   \
    {                                                                                              \
        "gauss" #n, "polynomials of degree " #n ", order 2 x " #n, 2 * n, n, false, fill           \
    }

const struct phys_rule phys_rules_gauss[] = {
    GAUSS(2),  GAUSS(3),  GAUSS(4),  GAUSS(5),  GAUSS(6),  GAUSS(7),  GAUSS(8),  GAUSS(9),
    GAUSS(10), GAUSS(11), GAUSS(12), GAUSS(13), GAUSS(14), GAUSS(15), GAUSS(16), GAUSS(17),
    GAUSS(18), GAUSS(19), GAUSS(20), GAUSS(21), GAUSS(22), GAUSS(23), GAUSS(24), {0}};

_Static_assert(LENGTH(phys_rules_gauss) == PHYS_RULE_MOST, "gauss2 to gaussMOST, and the end");
