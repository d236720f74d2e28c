/* Newton's method on one grid: action, gradient and Hessian are recorded once, for any number of
   paths and evaluations. */
#ifndef PHYSICS_PATH_NEWTON_H
#define PHYSICS_PATH_NEWTON_H

#include "newton_system.h"
#include "path_program.h"

struct phys_newton {
    struct phys_path_settings settings;
    struct phys_path_program path;
    struct phys_hessian hessian;
    struct phys_newton_system band;
    double *gradient, *before, *step; /* [n] each: gradient of the action */
    double unit;                      /* action in units of the objective */
    double damping;
    bool lengthened; /* the last step */
};

/* Of the settings `reference` is ignored. Ends with phys_newton_free, whatever it returned. */
enum ad_status phys_newton_new(struct phys_newton *newton, const struct phys_system *system,
                               const struct phys_path_settings *settings, struct ad_error *error);
void phys_newton_free(struct phys_newton *newton);
/* As phys_path_solve. */
enum ad_status phys_newton_solve(struct phys_newton *newton, double *path,
                                 struct phys_path_info *info, struct ad_error *error);
/* The same by Newton's steps alone, to rounding, unreported. Whether it arrived; the only error is
   AD_E_MEMORY. */
bool phys_newton_settle(struct phys_newton *newton, double *path, struct phys_path_info *info,
                        struct ad_error *error);
/* As phys_path_spectrum. */
enum ad_status phys_newton_spectrum(struct phys_newton *newton, const double *path,
                                    struct phys_spectrum *spectrum, struct ad_error *error);

#endif
