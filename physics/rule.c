/* The table of action rules. */
#include "internal.h"

const struct phys_rule *const phys_rules[] = {&phys_rule_left, &phys_rule_left_repeat, NULL};

enum { N_RULES = LENGTH(phys_rules) - 1 };

const struct phys_rule *phys_rule_find(const char *name, struct ad_error *error)
{
    const char *names[N_RULES];
    for (size_t k = 0; k < N_RULES; k++)
        names[k] = phys_rules[k]->name;
    return phys_rules[phys_find("action rule", name, N_RULES, names, error)];
}
