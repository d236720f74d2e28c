#include "constrained.h"
#include "tests/close.h"

#include <math.h>

const double constrained_g = 9.81;

ad_var constrained_falls(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))),
                  ad_mul(constrained_g, ad_row(q, ad_rows(q) - 1)));
}

ad_var constrained_coasts(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(0.5, ad_sum_rows(ad_square(v)));
}

ad_var constrained_sphere(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(q)), 1.0));
}

enum ad_status constrained_tilted(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = sin(2.0);
    q[1] = -cos(2.0);
    v[0] = -q[1] * 0.7;
    v[1] = q[0] * 0.7;
    return AD_OK;
}

/* A bead on a straight wire that turns at the rate 2 in a plane without gravity: r = cosh 2t. */
ad_var constrained_wire(ad_var q, ad_var t, const void *params)
{
    ad_var turn = ad_mul(2.0, t);
    (void)params;
    return ad_sub(ad_mul(ad_row(q, 1), ad_cos(turn)), ad_mul(ad_row(q, 0), ad_sin(turn)));
}

/* Bars of 1, 2.5 and 2 from (0, 0) by the joints A and B to (3, 0). */
ad_var constrained_bars(ad_var q, ad_var t, const void *params)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), u = ad_row(q, 2), w = ad_row(q, 3);
    (void)t, (void)params;
    return ad_concat_rows(
        3, (ad_var[]){
               ad_sub(ad_add(ad_square(x), ad_square(y)), 1.0),
               ad_sub(ad_add(ad_square(ad_sub(u, x)), ad_square(ad_sub(w, y))), 6.25),
               ad_sub(ad_add(ad_square(ad_sub(u, 3.0)), ad_square(w)), 4.0),
           });
}

/* B of an angle of the crank: the upper point where two circles meet. */
static void joint(double angle, double *B)
{
    const double ax = cos(angle), ay = sin(angle), dx = 3 - ax, dy = -ay, d = hypot(dx, dy),
                 along = (6.25 - 4 + d * d) / (2 * d), up = sqrt(6.25 - along * along);
    B[0] = ax + (along * dx - up * dy) / d;
    B[1] = ay + (along * dy + up * dx) / d;
}

/* B and its change with the angle. */
void constrained_joint(double angle, double *B, double *slope)
{
    const double ax = cos(angle), ay = sin(angle);
    joint(angle, B);
    const double a = B[0] - ax, b = B[1] - ay, c = B[0] - 3, e = B[1];
    const double right = -a * ay + b * ax; /* (B - A) A' = (B - A) B', (B - C) B' = 0 */
    slope[0] = right * e / (a * e - b * c);
    slope[1] = -right * c / (a * e - b * c);
}

enum ad_status constrained_cranked(const void *params, uint64_t seed, double *q, double *v,
                                   struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = cos(1.0);
    q[1] = sin(1.0);
    constrained_joint(1, q + 2, v + 2);
    v[0] = -3 * q[1];
    v[1] = 3 * q[0];
    v[2] *= 3;
    v[3] *= 3;
    return AD_OK;
}

struct phys_scene constrained_scene(const char *name, size_t dof, phys_lagrangian *L,
                                    scene_start *start, phys_constraint *g, size_t n,
                                    const char *const *names)
{
    struct phys_scene s = scene_of(name, dof, L, 100, 0.01, start);
    s.dims = dof == 4 ? 2 : dof;
    s.picture = PHYS_PICTURE_PLANE;
    s.constraint = g;
    s.constraints = names;
    s.n_constraints = n;
    return s;
}

struct phys_system constrained_system(const struct phys_scene *scene)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_make(scene, &system, &error);
    assert_string_equal(error.message, "");
    return system;
}

static struct phys_motion_settings settings(const char *method, double dt, double error,
                                            double time)
{
    struct ad_error unknown = {0};
    const struct phys_motion_settings how = {
        .size = sizeof how,
        .time = time,
        .dt = dt,
        .error = error,
        .n_samples = CONSTRAINED_SAMPLES,
        .integrator = method ? phys_integrator_find(method, &unknown) : NULL};
    return how;
}

struct phys_motion_solution constrained_motion(const struct phys_system *system, const char *method,
                                               double dt, double error, double time)
{
    struct phys_motion_solution m;
    struct ad_error e = {0};
    const struct phys_motion_settings how = settings(method, dt, error, time);
    phys_motion_solve(system, &how, &m, &e);
    assert_string_equal(e.message, "");
    return m;
}

enum ad_status constrained_refused(const struct phys_scene *scene, const char *method,
                                   struct ad_error *error)
{
    struct phys_system system = constrained_system(scene);
    struct phys_motion_solution m;
    const struct phys_motion_settings how = settings(method, 0, 0, 1);
    *error = (struct ad_error){0};
    phys_motion_solve(&system, &how, &m, error);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
    return error->status;
}
