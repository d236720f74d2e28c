/* What a report says of a learnt scene (hnn_system_open). */
#ifndef APPS_OUTPUT_LEARNT_H
#define APPS_OUTPUT_LEARNT_H

#include "hnn/hnn.h"
#include "report.h"

/* Whose motion the errors are of, and which of n states x [n][2 dof] (q, then v) is the first
   outside the range of training, at what t [n]; NULL: not known when. Nothing of other scenes. */
void report_learnt(const struct phys_system *system, size_t n, const double *t, const double *x,
                   struct report *report);

#endif
