/* The double slit as a command: run (quantum_slit.c), drawn (quantum_slit_picture.c). */
#ifndef APPS_QUANTUM_SLIT_H
#define APPS_QUANTUM_SLIT_H

#include "quantum.h"
#include "quantum/slit.h"

struct slit_run {
    struct qm_slit slit;
    double seconds, setup_seconds;
    bool interrupted;
};

void slit_picture(const struct qm_slit *slit, struct plot *plot);

#endif
