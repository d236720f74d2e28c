/* The published variant beside the same scene with a correct kernel: run (quantum_paper.c), picture
   (quantum_paper_picture.c). */
#ifndef APPS_QUANTUM_QUANTUM_PAPER_H
#define APPS_QUANTUM_QUANTUM_PAPER_H

#include "quantum.h"
#include "quantum/published.h"

struct paper {
    struct qm_published old;
    struct quantum_run run; /* done right */
};

enum ad_status paper_picture(const void *paper, struct plot *plot, struct ad_error *error);

#endif
