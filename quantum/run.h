/* Complete runs of wave packets: a suitable box, limits against aliasing, and samples on the way,
   with the error at the end.

   Units, errors and threads as in quantum.h. */
#ifndef QUANTUM_RUN_H
#define QUANTUM_RUN_H

#include "quantum/quantum.h"

AD_HEADER_BEGIN

/* ---- before a run ---- */

/* A box, low and high [1], that holds the motion of a packet: it extends to where the potential
   turns the packet back or, if nothing does, to 46 sigma. For an L without a separate potential,
   somewhat over 4 sigma.
 */
void qm_box(const struct phys_system *system, double hbar, const struct qm_gaussian *packet,
            double *low, double *high);
/* The fraction of a packet inside the box of a slice, or, around a ring, within half a turn of its
   middle: 0 to 1. */
double qm_inside(const struct qm_slice *slice, const struct qm_gaussian *packet);

/* Limits within which the slice does not alias, rounded to four digits to the safe side. */
struct qm_advice {
    double dt, points, box; /* at least, NaN: none found; at least; at most */
};
struct qm_advice qm_aliasing_advice(const struct qm_slice *slice,
                                    const struct qm_aliasing *aliasing);

/* ---- a run ---- */

struct qm_run_settings {
    size_t size; /* sizeof(struct qm_run_settings) */
    const struct qm_slice *slice;
    const struct qm_method *method;
    size_t steps, every; /* slices; from sample to sample */
    bool leap;           /* one slice of 2^power instead, by squaring the kernel */
    size_t power;
    size_t packets;
    const struct qm_gaussian *packet;              /* [packets] */
    bool normalise;                                /* force the norm to 1 after every slice */
    bool reference;                                /* measure the error at the end */
    bool (*progress)(void *context, size_t slice); /* NULL, or false: stop after this slice */
    void *context;
};

struct qm_run_result {
    size_t n; /* samples: the start, every `every` slices, the end */
    double *t;
    struct qm_moments *moments;    /* [n x packets] */
    double *density;               /* [n x points] |psi|^2 of the first packet */
    double *classical;             /* [n] see qm_classical */
    qm_complex *psi;               /* [points x packets] at the end */
    double error;                  /* qm_error; NaN: not requested, or stopped */
    const char *truth;             /* the truth that the error is against */
    double seconds, setup_seconds; /* seconds of propagating; of building the propagator */
    bool stopped;                  /* by progress */
};

/* Runs and measures. AD_E_ARGUMENT, AD_E_MEMORY and the errors of qm_propagator_new, qm_classical
   and qm_error. Free with qm_run_free in any case. */
enum ad_status qm_run(const struct qm_run_settings *settings, struct qm_run_result *result,
                      struct ad_error *error);
void qm_run_free(struct qm_run_result *result); /* takes zero-initialised ones too */

AD_HEADER_END
#endif
