/* What a tape refused. */
#ifndef TESTS_AUTODIFF_REFUSED_H
#define TESTS_AUTODIFF_REFUSED_H

#include "autodiff/autodiff.h"

/* The tape's error names the operation, how many values were recorded before it, and a label. */
void assert_refused(ad_tape *t, enum ad_status status, const char *op, const char *label);

#endif
