/* Units as printed. */
#ifndef APPS_OUTPUT_UNIT_H
#define APPS_OUTPUT_UNIT_H

#include <string.h>

/* Pure numbers carry the unit 1, which a reader need not see. */
static inline const char *unit_shown(const char *unit)
{
    return unit && strcmp(unit, "1") != 0 ? unit : "";
}

/* A unit behind a number: with a blank before it. */
static inline const char *unit_blank(const char *unit) { return *unit_shown(unit) ? " " : ""; }

#endif
