/* A periodic motion in a report, of simulate and of path. */
#ifndef APPS_OUTPUT_PERIODIC_H
#define APPS_OUTPUT_PERIODIC_H

#include "apps/output/report.h"
#include "physics/stability/periodic.h"

/* Period, closure, start, kind and multipliers; nothing of a motion that was not asked for. */
void report_periodic(const struct phys_system *system, const struct phys_periodic *motion,
                     struct report *report);

#endif
