/* Newton's method on one grid: action, gradient and Hessian are recorded once, for any number of
   paths and evaluations. */
#ifndef PHYSICS_PATH_NEWTON_H
#define PHYSICS_PATH_NEWTON_H

#include "newton_system.h"
#include "path_program.h"
#include "spectrum.h"

/* Points of a block of derivatives that grids of four elements and of thousands share. */
enum { PHYS_LADDER_COLUMNS = 32 };
/* Coordinates in one element of the rule of higher order (phys_path_discretisation), at most, and
   by how much its degree is higher. */
enum { PHYS_FINER_MOST = 160, PHYS_FINER_DEGREES = 2 };

struct phys_newton {
    struct phys_path_settings settings;
    struct phys_path_program path;
    struct phys_hessian hessian;
    struct phys_newton_system band, whole;      /* whole: of all coordinates, beside tangent ones */
    struct phys_ends tangent_ends;              /* of those */
    double *gradient, *before, *step, *tangent; /* [n] each: gradient of the action; room */
    double *at;                                 /* [n]: where the Hessian is of, if it is `known` */
    double unit;                                /* action in units of the objective */
    double damping;
    double share;         /* of Newton's step, where it is shortened instead ... */
    bool natural;         /* ... as it is now */
    double rounding;      /* of the gradient, several times, at the last Hessian */
    bool lengthened;      /* the last step */
    double first;         /* length of the first step */
    bool rough;           /* asked: the path to a thousandth of that ... */
    bool arrived;         /* ... is there */
    bool sparing;         /* Adam ends where the next steps converge */
    bool known, factored; /* factored: with the band's damping */
    bool settled;         /* no repetition of the last step makes the gradient smaller */
};

/* Of the settings `reference` is ignored. `of`: by these derivatives alone, without a recording of
   its own and machine code; NULL: with them, the former but on a mesh. Ends with phys_newton_free,
   whatever it returned. */
enum ad_status phys_newton_new(struct phys_newton *newton, const struct phys_system *system,
                               const struct phys_path_settings *settings,
                               struct phys_derivatives *of, struct ad_error *error);
void phys_newton_free(struct phys_newton *newton);
/* As phys_path_solve. */
enum ad_status phys_newton_solve(struct phys_newton *newton, double *path,
                                 struct phys_path_info *info, struct ad_error *error);
/* The same by Newton's steps alone, to rounding, unreported. Whether it arrived; the only error is
   AD_E_MEMORY. */
bool phys_newton_settle(struct phys_newton *newton, double *path, struct phys_path_info *info,
                        struct ad_error *error);
/* Whether Newton's method converges from there to the one path nearby: its steps get shorter fast.
 */
bool phys_newton_converges(struct phys_newton *newton, const double *path);
/* As phys_path_solve, by derivatives that several grids share. `sparing`: no more steps of Adam
   than lead to where Newton's method converges. */
enum ad_status phys_newton_over(const struct phys_system *system,
                                const struct phys_path_settings *settings,
                                struct phys_derivatives *of, bool sparing, double *path,
                                struct phys_path_info *info, struct ad_error *error);
/* Whether L depends on time explicitly: AD_E_ARGUMENT. */
bool phys_lacks_energy(const struct phys_system *system, struct ad_error *error);
/* As phys_path_free_time, by them, of a system that keeps its energy. */
enum ad_status phys_newton_free_time(const struct phys_system *system,
                                     struct phys_path_settings *settings,
                                     struct phys_derivatives *of, double energy, double *path,
                                     struct phys_path_info *info, struct ad_error *error);
/* As phys_hessian_spectrum. */
enum ad_status phys_newton_spectrum(struct phys_newton *newton, enum phys_spectrum_parts parts,
                                    const double *path, struct phys_spectrum *spectrum,
                                    struct ad_error *error);
/* As phys_hessian_confirms. */
bool phys_newton_confirms(struct phys_newton *newton, const double *path, bool filled,
                          const struct phys_spectrum *spectrum, struct ad_error *error);

/* Distance of a stationary path [s*dof x slices], in the common unit (path_units.h), from that of a
   rule of higher order: its discretisation error; INFINITY: none nearby; NaN: too large for one.
   With `more`, there are half as many elements more, where their number is even: what the grid
   alone holds in place moves, and momenta count, by what they move in a step. `of` as in
   phys_newton_over; NULL: its own. Judges whether the path's `spectrum` is that of the other rule;
   may be NULL. AD_E_ACCURACY where it is interrupted. */
enum ad_status phys_path_discretisation(const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        struct phys_derivatives *of, const double *path, bool more,
                                        double *distance, struct phys_spectrum *spectrum,
                                        struct ad_error *error);

#endif
