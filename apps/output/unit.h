/* Units as printed. */
#ifndef APPS_OUTPUT_UNIT_H
#define APPS_OUTPUT_UNIT_H

#include <stdio.h>
#include <string.h>

/* Pure numbers carry the unit 1, which a reader need not see. */
static inline const char *unit_shown(const char *unit)
{
    return unit && strcmp(unit, "1") != 0 ? unit : "";
}

/* A unit behind a number: with a blank before it. */
static inline const char *unit_blank(const char *unit) { return *unit_shown(unit) ? " " : ""; }
/* The unit of a force, of an energy over a coordinate's: nothing where all are pure numbers. */
enum { UNIT_FORCE = 64 };
static inline void unit_of_force(const char *energy, const char *length, char unit[UNIT_FORCE])
{
    const char *below = unit_shown(length);
    snprintf(unit, UNIT_FORCE, "%s%s%s", *below && !*unit_shown(energy) ? "1" : unit_shown(energy),
             *below ? "/" : "", below);
}

#endif
