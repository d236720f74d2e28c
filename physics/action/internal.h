/* For physics/ only: the table of action rules (rules.def). */
#ifndef PHYSICS_ACTION_INTERNAL_H
#define PHYSICS_ACTION_INTERNAL_H

#include "action.h"
#include "physics/lagrangian/internal.h"

#define RULE(name) extern const struct phys_rule phys_rule_##name;
#include "rules.def"
#undef RULE
extern const struct phys_rule phys_rules_gauss[]; /* ends with one without a name */

#endif
