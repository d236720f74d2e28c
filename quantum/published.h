/* A packet in a box of 8 by the matrix of arXiv 2303.02115, figure 4, and the same scene with a
   correct kernel, for comparison. The published matrix is exp(i (m (x_a - x_b)^2 / (2 hbar dt) -
   (V_a - V_b) dt / hbar)), normalised after every slice. Its grid aliases; the normalisation hides
   what the ghosts add; its potential acts once, as a kick V' dt.

   Units, errors and threads as in quantum.h; the particle's mass is 1. Errors: as there. */
#ifndef QUANTUM_PUBLISHED_H
#define QUANTUM_PUBLISHED_H

#include "quantum/quantum.h"

AD_HEADER_BEGIN

struct qm_published {
    struct qm_grid grid; /* its points: low + a dx */
    double dt, hbar;
    double phases; /* largest difference of phase of neighbouring paths, in radians */
    double ghost;  /* distance of the first ghost */
    double norm;   /* after one slice, had the matrix its prefactor; 1 is right */
    double kick;   /* largest change of |psi| by a potential of slope 10, relative to the largest
                      |psi| */
    size_t steps, done, frames;
    qm_complex *K;          /* [n x n] */
    qm_complex *psi, *work; /* [n x 2]: without the potential and with it */
    double *density;        /* [frames x n], without */
    double *time, *mean;    /* [frames] */
};

/* Starts at the scale 1 / hbar, 0.25 to 2 (else AD_E_ARGUMENT: below that the packet does not fit
   into the box), up to the first slice. Free with qm_published_free in any case. */
enum ad_status qm_published_new(double scale, struct qm_published *published,
                                struct ad_error *error);
/* Advances one slice; false at the end. */
bool qm_published_advance(struct qm_published *published);
void qm_published_free(struct qm_published *published);

/* The same scene: a free particle between walls, slices whose kernel is unitary (the box, mirrored,
   is one ghost long), and the packet that spreads least in the time, with the speed 15 whatever
   hbar. *system is opened, for phys_system_close even after a failure; slice->system is system. Of
   *slice the size is given. */
enum ad_status qm_published_right(double scale, struct phys_system *system, struct qm_slice *slice,
                                  struct qm_gaussian *packet, size_t *steps,
                                  struct ad_error *error);

AD_HEADER_END
#endif
