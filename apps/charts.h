/* The measurements behind `leastaction chart`. Each writes its data and picture to `folder`, prints
   its figures to `out`, and returns the exit status. `quick`: fewer repetitions. */
#ifndef APPS_CHARTS_H
#define APPS_CHARTS_H

#include <stdbool.h>
#include <stdio.h>

/* Gradients of the action by the tape against hand-written C. */
int chart_gradients(const char *folder, bool quick, FILE *out);

#endif
