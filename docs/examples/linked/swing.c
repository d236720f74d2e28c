/* The Lagrangian of ../elastic.c linked to a program:

       cc swing.c ../elastic.c $(pkg-config --cflags --libs leastaction) -lm -o swing

   It follows the motion, finds the stationary path between its ends, and prints the distance
   between the two. */
#include <physics/physics.h>
#include <math.h>
#include <stdio.h>

extern const struct phys_scene leastaction_scene;

enum { DOF = 2, SLICES = 100 };

/* The motion from rest, [DOF x SLICES]. */
static void follow(const struct phys_system *system, double dt, double *path,
                   struct ad_error *error)
{
    double y[2 * DOF] = {1.2, 0.5, 0, 0};
    struct phys_ode ode;
    struct phys_simulation_info info;
    if (phys_ode_lagrangian(system, &ode, error) != AD_OK)
        return;
    for (size_t i = 0; i < SLICES && error->status == AD_OK; i++) {
        const struct phys_simulation s = {.size = sizeof s,
                                          .integrator = phys_integrator_find("dop853", error),
                                          .t0 = ((double)i - 1) * dt,
                                          .t1 = (double)i * dt,
                                          .rtol = 1e-12,
                                          .atol = 1e-12};
        if (i > 0)
            phys_simulate(&s, &ode, y, &info, error);
        for (size_t k = 0; k < DOF; k++)
            path[k * SLICES + i] = y[k];
    }
    phys_ode_free(&ode);
}

int main(void)
{
    struct ad_error error = {0};
    struct phys_system system;
    double motion[DOF * SLICES], path[3 * DOF * SLICES] = {0}, apart = 0;
    struct phys_path_info info;
    if (phys_system_make(&leastaction_scene, &system, &error) != AD_OK)
        return fprintf(stderr, "swing: %s\n", error.message), 1;
    struct phys_path_settings settings = phys_path_defaults(&system);
    settings.rule = phys_rule_find("gauss3", &error);
    settings.slices = SLICES;
    follow(&system, settings.dt, motion, &error);
    for (size_t k = 0; k < DOF * SLICES; k++)
        path[k] = motion[k];
    phys_rule_interpolate(settings.rule, DOF, SLICES, path);
    if (error.status == AD_OK)
        phys_path_solve(phys_solver_find("newton", &error), &system, &settings, path, &info,
                        &error);
    for (size_t k = 0; k < DOF * SLICES; k++)
        apart = fmax(apart, fabs(path[k] - motion[k]));
    phys_system_close(&system);
    if (error.status != AD_OK)
        return fprintf(stderr, "swing: %s\n", error.message), 1;
    printf("%.1e\n", apart);
    return 0;
}
