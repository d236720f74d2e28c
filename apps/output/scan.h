/* --scan NAME=FROM:TO:N: a subcommand run for each value of a parameter, or of two, and the numbers
   of its reports as one table. Outputs are those of the table. */
#ifndef APPS_OUTPUT_SCAN_H
#define APPS_OUTPUT_SCAN_H

#include "apps/command.h"
#include "report.h"

/* Adds the report of the run that is on: common->scanning. */
void scan_take(struct scan *scan, const struct report *report);

#endif
