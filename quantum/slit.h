/* A packet that meets a barrier with two Gaussian slits, in the plane, and the fringes on a screen
   behind it:

       struct qm_slit slit;
       struct qm_slit_setup setup = qm_slit_defaults();
       if (qm_slit_new(&setup, &slit, &error) == AD_OK)
           while (qm_slit_advance(&slit))
               ;
       qm_slit_measure(&slit);          slit.fringe beside qm_exact_fringe
       qm_slit_free(&slit);

   Units, errors and threads as in quantum.h. */
#ifndef QUANTUM_SLIT_H
#define QUANTUM_SLIT_H

#include "quantum/quantum.h"

AD_HEADER_BEGIN

/* Lengths are in units of the spreading of waves behind slits of width sigma; x crosses the barrier
   at 0, y runs along it. All values are positive. */
struct qm_slit_setup {
    size_t size;          /* sizeof(struct qm_slit_setup) */
    double apart, sigma;  /* distance of the slits, centre to centre, and their width */
    double speed, flight; /* of the packet; time from the slits to the screen */
    double mass, hbar;
    size_t points, steps; /* of the grid along x and along y; slices */
    size_t threads;
};
void qm_slit_defaults_to(struct qm_slit_setup *settings);
static inline struct qm_slit_setup qm_slit_defaults(void)
{
    struct qm_slit_setup settings;
    settings.size = sizeof settings;
    qm_slit_defaults_to(&settings);
    return settings;
}

struct qm_slit {
    struct qm_slit_setup *setup;
    double dt;
    struct qm_grid x, y;
    size_t done, every;                      /* slices done; between frames */
    qm_complex *Kx, *Ky, *mask, *psi, *work; /* mask, psi, work [x.n x y.n] */
    size_t frames;
    double *density;  /* [frames x x.n x y.n] |psi|^2 */
    double *time;     /* [frames] */
    double *screen;   /* [y.n] |psi|^2 on the screen when the packet arrives */
    double *expected; /* [y.n] of thin slits, with the same maximum */
    double norm;      /* at the end */
    double fringe;    /* distance of bright fringes, from the dark lines beside the middle */
    double closed;    /* the same of thin slits, qm_exact_fringe */
};

/* Prepares kernels, barrier and packet, up to the first slice; free with qm_slit_free in any case.
   AD_E_ARGUMENT for a grid that cannot represent the waves, and for slices that step over the
   barrier. */
enum ad_status qm_slit_new(const struct qm_slit_setup *setup, struct qm_slit *slit,
                           struct ad_error *error);
/* Advances to the next frame; false at the end. */
bool qm_slit_advance(struct qm_slit *slit);
/* Measures the screen, fringe and norm of the present psi; fringe is NaN if no dark lines are
   found. */
void qm_slit_measure(struct qm_slit *slit);
void qm_slit_free(struct qm_slit *slit);

AD_HEADER_END
#endif
