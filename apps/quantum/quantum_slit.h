/* The double slit as a command: run (quantum_slit.c), picture (quantum_slit_picture.c). */
#ifndef APPS_QUANTUM_QUANTUM_SLIT_H
#define APPS_QUANTUM_QUANTUM_SLIT_H

#include "quantum.h"
#include "quantum/slit.h"

struct slit_run {
    const struct quantum_options *options;
    struct qm_slit slit;
    double seconds, setup_seconds;
    bool interrupted;
};

enum ad_status slit_picture(const void *run, struct plot *plot, struct ad_error *error);

#endif
