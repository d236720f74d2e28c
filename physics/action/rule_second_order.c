/* Rules of second order. Their discrete motions are the implicit midpoint rule and, for separable
   L, Stoermer-Verlet (Marsden, West, Discrete mechanics and variational integrators, Acta Numerica
   2001, section 2.6). */
#include "internal.h"

static void midpoint(const struct phys_rule *rule, struct phys_rule_table *table)
{
    (void)rule;
    *table = (struct phys_rule_table){.degree = 1,
                                      .points = 1,
                                      .node = {0, 1},
                                      .time = {0.5},
                                      .weight = {1},
                                      .q = {{0.5, 0.5}},
                                      .v = {{-1, 1}}};
}

static void trapezoid(const struct phys_rule *rule, struct phys_rule_table *table)
{
    (void)rule;
    *table = (struct phys_rule_table){.degree = 1,
                                      .points = 2,
                                      .node = {0, 1},
                                      .time = {0, 1},
                                      .weight = {0.5, 0.5},
                                      .q = {{1, 0}, {0, 1}},
                                      .v = {{-1, 1}, {-1, 1}}};
}

const struct phys_rule phys_rule_midpoint = {
    "midpoint", "difference, L in the middle, second order", 2, 1, false, midpoint};
const struct phys_rule phys_rule_trapezoid = {
    "trapezoid", "difference, mean of L at both ends, second order", 2, 1, false, trapezoid};
