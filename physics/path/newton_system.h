/* The Newton step: the element matrices of the Hessian as one band matrix over the free nodes, in
   order of time or by coordinate in the order of the Hessian, solved by LAPACK's banded LU; where L
   couples all coordinates, by elements that are reduced to their ends (reduced_elements.h); by
   blocks (block_tridiagonal.h), as damped steps are where ordering by coordinate gives no narrower
   band; or by nested dissection where that is less work (dissected.h). */
#ifndef PHYSICS_PATH_NEWTON_SYSTEM_H
#define PHYSICS_PATH_NEWTON_SYSTEM_H

#include "physics/path/blocks/block_tridiagonal.h"
#include "physics/path/blocks/dissected.h"
#include "physics/path/blocks/reduced_elements.h"
#include "physics/path/ends.h"

struct phys_newton_system {
    struct phys_hessian *hessian;
    size_t hold; /* slices at either end */
    bool free;   /* coordinates at an end move, and some there may be held */
    bool folded; /* the ends are related: nodes from both ends in turn, in one band */
    struct phys_end_space ends; /* what is free there, of scaled coordinates ... */
    double *
        free_part; /* ... as a projector [2 dof][2 dof] where they are related; then room [2 dof] */
    size_t first, n;    /* number of the first unknown among dof * nodes, and how many there are */
    size_t width;       /* diagonals on either side */
    bool by_coordinate; /* unknowns of the matrix by coordinate, then by node; else the other way */
    bool by_blocks;     /* there is no band */
    bool by_elements;   /* nor blocks */
    bool by_fronts;     /* nor these */
    bool no_fronts;     /* where they have failed */
    double operations;  /* that a band or blocks take, about */
    size_t room;        /* numbers in `matrix` */
    double damping;     /* of the factors */
    bool no_memory;     /* for the last factors */
    int *pivots;
    double *scale; /* [dof]: D^-1, by places of the Hessian's order */
    double *matrix, *right;
    struct phys_block_tridiagonal blocks; /* made when first needed ... */
    struct phys_reduced reduced;          /* ... as is this ... */
    struct phys_dissected_path dissected; /* ... and this */
    bool *held;                           /* [n]: unknowns of ends that are given, for fronts */
};

/* Unknowns: every node but those of the `hold` slices at either end. */
enum ad_status phys_newton_system_new(struct phys_newton_system *band, struct phys_hessian *hessian,
                                      size_t hold, struct ad_error *error);
void phys_newton_system_free(struct phys_newton_system *band);

/* The memory of damped factors, about, whatever L couples at most. */
double phys_newton_system_bytes(struct phys_newton_system *band);

/* Takes D = sqrt(stiffness) of each coordinate from the Hessian, for all that follows. */
void phys_newton_system_scale(struct phys_newton_system *band);
/* Factors the Hessian as it is for steps with a damping. False: singular, or no memory. */
bool phys_newton_system_factor(struct phys_newton_system *band, double damping);
/* step = -D^-1 f(D^-1 H D^-1) D^-1 gradient from the factors, where f(x) is 1/x (damping 0: Newton)
   or x/(x^2 + damping^2) (Levenberg). gradient, step: [degree*dof x slices]; the step is 0 where
   the path is held. */
void phys_newton_system_step(struct phys_newton_system *band, const double *gradient, double *step);
/* Norm of D^-1 x over the unknowns. */
double phys_newton_system_norm(const struct phys_newton_system *band, const double *x);
/* The same norm of what rounding makes of the gradient at a path: eps |H| |path|. */
double phys_newton_system_rounding(const struct phys_newton_system *band, const double *path);

#endif
