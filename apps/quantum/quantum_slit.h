/* The double slit: set up (quantum_slit_setup.c), run (quantum_slit.c), drawn
   (quantum_slit_picture.c). */
#ifndef APPS_QUANTUM_SLIT_H
#define APPS_QUANTUM_SLIT_H

#include "apps/output/plot.h"
#include "quantum/quantum.h"

/* Lengths in units where the wave behind slits of width sigma spreads; x crosses the barrier at 0,
   y runs along it. */
struct slit_setup {
    double apart, sigma, speed, flight, mass; /* the screen is at speed * flight */
};

struct slit {
    struct slit_setup setup;
    double hbar, dt;
    struct qm_grid x, y;
    size_t steps, every;
    qm_complex *Kx, *Ky, *mask, *psi, *work; /* mask, psi, work [x.n x y.n] */
    size_t frames;
    double *density;  /* [frames x x.n x y.n] */
    double *time;     /* [frames] */
    double *screen;   /* [y.n] |psi|^2 at the screen when the packet is there */
    double *expected; /* [y.n] of the closed form, as high at the most */
    double fringe, norm, seconds, setup_seconds;
    bool interrupted;
};

struct quantum_options;

/* Everything up to the start of the run, for slit_free whatever it returned. */
enum ad_status slit_prepare(const struct quantum_options *options, struct slit *slit,
                            struct ad_error *error);
void slit_free(struct slit *slit);
void slit_picture(const struct slit *slit, struct plot *plot);

#endif
