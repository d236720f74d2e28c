/* The inertia of a Hessian less a multiple of a mass. */
#ifndef PHYSICS_PATH_INERTIA_H
#define PHYSICS_PATH_INERTIA_H

#include "ends.h"
#include "spectrum.h"

/* Times the scale of the spectrum: not in it. */
#define PHYS_BEYOND_SPECTRUM 1e6

struct phys_inertia {
    struct phys_hessian *hessian;
    size_t dof, inner, side; /* side: 2 dof of a condensed element, slice before and slice behind */
    double *K;               /* [inner][inner] inner block, or all of an element */
    double *C;               /* [2 dof][inner] coupling of inner nodes to slices, and solved */
    double *S, *before;      /* [2 dof][2 dof] condensed elements */
    double *D, *X, *Y;       /* [dof][dof] */
    const struct phys_end_space *free; /* where ends move: the directions; ... */
    double *W, *first, *ends; /* ... [dof][dof] what is left of the first slice, its coupling to the
                                 next one, and [2 dof][2 dof] of both ends; with room */
    double *work;
    int *pivots;
    size_t *order; /* [inner + side] place in an element of inner nodes, slice before, behind */
    double mass[PHYS_RULE_MOST]; /* of a slice and of each inner node: sigma counts times it ... */
    bool integral;               /* ... and the length of the element in units of dt */
    double largest;              /* entry of any element ... */
    double scale;                /* ... and of the spectrum */
    double log_determinant;      /* of H - sigma, of the last sigma */
    bool wide; /* so many coordinates that the matrix goes by coordinate: no conjugate points */
    bool lost; /* out of memory for them, or for that matrix */
};

/* Takes the elements of h as they are, and `ends`, in their coordinates, where h->ends moves.
   False: out of memory; to be freed in any case. */
bool phys_inertia_new(struct phys_inertia *c, struct phys_hessian *h,
                      const struct phys_end_space *ends);
void phys_inertia_free(struct phys_inertia *c);
/* Masses that are 1 give the eigenvalues of the Hessian. Those of the second variation are measured
   against the integral of x^2: node k has the mass of an element's length times the integral of its
   polynomial, which the points of a rule give exactly, and a slice that of both its elements. */
void phys_inertia_masses(struct phys_inertia *c, bool integral);
/* Number of eigenvalues below sigma, and conjugate points in a spectrum to keep those in, or NULL.
   Any number where it is stopped. */
size_t phys_inertia_below(struct phys_inertia *c, double sigma, struct phys_spectrum *spectrum);

#endif
