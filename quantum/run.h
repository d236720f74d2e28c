/* Whole runs of wave packets: a box that holds them, what the phases of a slice need, and samples
   on the way, with the error at the end. */
#ifndef QM_RUN_H
#define QM_RUN_H

#include "quantum/quantum.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- before ---- */

/* A box that holds the motion of a packet: outwards until the potential turns it back or, where
   nothing does, 46 sigma away. Where L has no potential of its own, 4 sigma and some. */
void qm_box(const struct phys_system *system, double hbar, const struct qm_gaussian *packet,
            double *low, double *high);
/* The share of a packet inside of a box, 0 to 1. */
double qm_inside(const struct qm_grid *box, const struct qm_gaussian *packet);

/* Limits within which an aliased slice would not be, rounded to four digits to the safe side. */
struct qm_advice {
    double dt, points, box; /* at least, NaN: none found; at least; at most */
};
struct qm_advice qm_aliasing_advice(const struct qm_slice *slice,
                                    const struct qm_aliasing *aliasing);

/* ---- a run ---- */

struct qm_run_settings {
    struct qm_slice slice;
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
    size_t n; /* samples: the start, every so many slices, the end */
    double *t;
    struct qm_moments *moments;    /* [n x packets] */
    double *density;               /* [n x points] |psi|^2 of the first packet */
    double *classical;             /* [n] see qm_classical */
    qm_complex *psi;               /* [points x packets] at the end */
    double error;                  /* qm_error; NaN: not asked for, or stopped */
    const char *truth;             /* what the error is against */
    double seconds, setup_seconds; /* of propagating; of building what propagates */
    bool stopped;                  /* by progress */
};

/* Runs and measures. AD_E_ARGUMENT, AD_E_MEMORY and what qm_propagator_new, qm_classical and
   qm_error return. Ends with qm_run_free, whatever it returned. */
enum ad_status qm_run(const struct qm_run_settings *settings, struct qm_run_result *result,
                      struct ad_error *error);
void qm_run_free(struct qm_run_result *result); /* takes zero-initialised ones too */

#ifdef __cplusplus
}
#endif
#endif
