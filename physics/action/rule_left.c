/* The published rules: forward difference and rectangle, of first order. For separable L the
   stationary path of `left` is the semi-implicit Euler path. `left+repeat` counts the last slice
   too, with the velocity before it, which moves the stationary path off the true one. */
#include "internal.h"

static void fill(const struct phys_rule *rule, struct phys_rule_table *table)
{
    (void)rule;
    *table = (struct phys_rule_table){
        .degree = 1, .points = 1, .node = {0, 1}, .weight = {1}, .q = {{1, 0}}, .v = {{-1, 1}}};
}

const struct phys_rule phys_rule_left = {
    "left", "forward difference and rectangle, first order", 1, 1, false, fill};
const struct phys_rule phys_rule_left_repeat = {
    "left+repeat", "the same with the last velocity used twice, as published", 1, 1, true, fill};
