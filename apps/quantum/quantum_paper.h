/* The published variant beside the same scene done right: run (quantum_paper.c), drawn
   (quantum_paper_picture.c). */
#ifndef APPS_QUANTUM_PAPER_H
#define APPS_QUANTUM_PAPER_H

#include "quantum.h"
#include "quantum/published.h"

void paper_picture(const struct qm_published *published, const struct quantum_run *run,
                   const struct quantum_result *result, const qm_complex *K, struct plot *plot);

#endif
