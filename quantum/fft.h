/* Discrete Fourier transforms of power-of-two length, for convolutions. Of the fast libraries that
   Debian packages, those in double precision are GPL and the permissive ones single precision. */
#ifndef QUANTUM_FFT_H
#define QUANTUM_FFT_H

#include "autodiff/autodiff.h"

struct qm_fft {
    size_t n;
    double *cosine, *sine; /* [n/2] of 2 pi k/n */
    double *re, *im;       /* [n] the other half of every pass */
};

/* n >= 2 is a power of two. Ends with qm_fft_free. */
enum ad_status qm_fft_new(size_t n, struct qm_fft *fft, struct ad_error *error);
void qm_fft_free(struct qm_fft *fft);
/* sum_k x_k exp(-2 pi i j k/n), in place; with re and im exchanged it is n times the inverse. */
void qm_fft_run(struct qm_fft *fft, double *re, double *im);

#endif
