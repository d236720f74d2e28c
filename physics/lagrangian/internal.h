/* For physics/ only: further properties of a Lagrangian. */
#ifndef PHYSICS_LAGRANGIAN_INTERNAL_H
#define PHYSICS_LAGRANGIAN_INTERNAL_H

#include "autodiff/series.h"
#include "check.h"
#include "conserved.h"
#include "euler_lagrange.h"
#include "legendre.h"
#include "physics/linear/pattern.h"
#include "physics/system/internal.h"

/* The system that a motion was made of. */
const struct phys_system *phys_motion_system(const phys_motion *motion);
/* phys_motion_new with n parameters as variables, by their places in the scene's table: their
   values are read from the system whenever something is evaluated. */
enum ad_status phys_motion_new_of(const struct phys_system *system, size_t n, const size_t which[],
                                  phys_motion **motion, struct ad_error *error);
/* Their number, and parameter k as recorded [1 x 1]. */
size_t phys_motion_parameters(const phys_motion *motion);
ad_var phys_motion_parameter(const phys_motion *motion, size_t k, double *value);
/* The masses are constant and the accelerations depend on q and t alone. Of errors, AD_E_MEMORY. */
bool phys_motion_separates(phys_motion *motion, struct ad_error *error);
/* L_v is M v, M constant, up to a constant: no L_vq or L_vt. Of errors, AD_E_MEMORY. */
bool phys_motion_has_plain_momenta(phys_motion *motion, struct ad_error *error);
/* Changes the entries of mass matrices that are not diagonal by relative amounts between share and
   twice share: what rounding makes of M^-1. 0: exact again. */
void phys_motion_round_mass(phys_motion *motion, double share);
/* v L_v - L, from the same recording; NaN when out of memory. */
double phys_motion_energy(phys_motion *motion, const double *q, const double *v, double t);
/* Makes that ready. A recording that has no series is refused for good once it was asked for one.
 */
void phys_motion_record_energy(phys_motion *motion);
/* Why its forces are interpreted (ad_native_note). */
const char *phys_motion_interpreted(const phys_motion *motion);
/* M at a state, to be solved with; and the acceleration without constraints. */
enum ad_status phys_motion_mass(phys_motion *motion, const double *q, const double *v, double t,
                                struct ad_error *error);
enum ad_status phys_motion_free_acceleration(phys_motion *motion, const double *q, const double *v,
                                             double t, double *a, struct ad_error *error);
/* Whether the mass matrix has no element off its diagonal, by its values at irregular states. */
bool phys_motion_is_diagonal(phys_motion *motion);
/* Its recording: x = q, v [dof x 1 each], t; y = the force [dof x 1], the mass matrix [dof x
   colours]. True where it is constant and solved with in place. */
bool phys_motion_recorded(const phys_motion *motion, ad_var x[3], ad_var y[2]);
/* The element of that mass matrix that is its entry (i, j); SIZE_MAX: the entry is 0. */
size_t phys_motion_mass_place(const phys_motion *motion, size_t i, size_t j);
void phys_motion_solve_constant(const phys_motion *motion, double *b);
bool phys_motion_is_singular(const phys_motion *motion); /* the mass matrix used last */

/* Taylor coefficients of the motion (motion_series.c), which must outlive this: c [order + 1][n] of
   (q, v), of `columns` variations (dq, dv) of them, and of one by each of the motion's parameters,
   about t, the first row given, and in cut, or NULL, what rounding cut off it, up to
   `order`, which is at most that of _new. What has no series, or kinks, is refused: AD_E_ARGUMENT;
   AD_E_NONFINITE as for accelerations. */
struct phys_motion_series;
enum ad_status phys_motion_series_new(phys_motion *motion, size_t order, size_t columns,
                                      struct phys_motion_series **series, struct ad_error *error);
void phys_motion_series_free(struct phys_motion_series *series); /* takes NULL */
enum ad_status phys_motion_series(struct phys_motion_series *series, size_t order, double t,
                                  double *c, const double *cut, struct ad_error *error);
/* What rounding cut off the first coefficients, rest [n], where it cut `cut` off y
   (ad_series_rates_cut); 0 where the mass matrix is not eliminated in the recording. */
void phys_motion_series_rest(struct phys_motion_series *series, double t, const double *y,
                             const double *cut, double *rest);
/* Whether it runs as machine code now. */
bool phys_motion_series_compiled(const struct phys_motion_series *series);
/* Many at once (autodiff/series.h) of series that are alike but for parameters; the first must
   outlive the points, and has been evaluated. NULL: not as machine code. _times: [AD_SERIES_POINTS]
   to be set before a flow. _end after it: lost [AD_SERIES_POINTS] is not 0 where the mass matrix
   has no inverse by that flow. */
ad_points *phys_motion_points(struct phys_motion_series *series, bool build);
bool phys_motion_points_put(ad_points *points, size_t p, const struct phys_motion_series *series);
double *phys_motion_points_times(ad_points *points, const struct phys_motion_series *model);
void phys_motion_points_end(const ad_points *points, const struct phys_motion_series *model,
                            double *lost);
/* The solution a of M a = f [n x 1] on a tape, and D of M = L D L^T, which varies, of up to so many
   coordinates; beyond, M is diagonal. constant: D is M, whose values the motion has. */
enum { PHYS_ELIMINATED_MOST = 6 };
ad_var phys_record_solution(phys_motion *motion, size_t n, bool constant, ad_var mass, ad_var force,
                            ad_var *D);
/* The unit matrix [n x n] as a constant: the seed of lanes. */
ad_var phys_unit_matrix(ad_tape *tape, size_t n);
/* L_vv [dof x dof] at q, v [dof x 1] and t, where p [dof x 1] is L_v; or the sums of its columns of
   each colour [dof x colours]. */
ad_var phys_record_mass(const struct phys_system *system, ad_var q, ad_var v, ad_var t, ad_var p);
ad_var phys_record_colours(const struct phys_system *system, ad_var q, ad_var v, ad_var t, ad_var p,
                           const struct phys_pattern *pattern);

/* Observable k at x = (q, v); NaN where it is not defined. It is recorded each time. */
double phys_observe_state(const struct phys_system *system, size_t k, const double *x, double t);

/* A constant [rows x cols] of irregular numbers from 2/3 to 4/3: nothing cancels against them. */
ad_var phys_irregular(ad_tape *tape, size_t rows, size_t cols, double phase);
/* The sum of the rows of x, times such numbers. */
ad_var phys_mixed(ad_var x, double phase);
/* Whether y depends on none of x[0..n-1], whatever their values: its derivatives, looked at through
   fixed irregular weights, fold to zero when compiled. False where that cannot be found out; only
   want of memory is an error. */
bool phys_is_independent(ad_tape *tape, ad_var y, size_t n, const ad_var x[],
                         struct ad_error *error);

#endif
