/* A program as of the first headers of its soname (tests/abi/N.headers.tar.xz), run with the
   library of today: each struct that the library may read or write stands between guards. */
#include <hnn/hnn.h>
#include <math.h>
#include <physics/physics.h>
#include <quantum/quantum.h>
#include <stdio.h>

static int failures;

static void hold(int right, const char *what, const struct ad_error *error)
{
    if (!right) {
        printf("abi program: %s: %s\n", what, error->message);
        failures++;
    }
}

/* Not 0 beyond the end, where a newer library must not look. */
#define GUARDED(type, name)                                                                        \
    struct {                                                                                       \
        unsigned char before[256];                                                                 \
        struct type it;                                                                            \
        unsigned char behind[256];                                                                 \
    } name;                                                                                        \
    memset(&name, 0xa5, sizeof name)
#define INTACT(name) intact(name.before, name.behind, #name)

static void intact(const unsigned char *before, const unsigned char *behind, const char *name)
{
    for (int k = 0; k < 256; k++)
        if (before[k] != 0xa5 || behind[k] != 0xa5) {
            printf("abi program: the library wrote beside %s\n", name);
            failures++;
            return;
        }
}

int main(void)
{
    struct ad_error error = {0};
    struct phys_system system;
    hold(phys_system_open("spring", &system, &error) == AD_OK, "scene", &error);

    GUARDED(phys_path_settings, path);
    GUARDED(phys_path_info, found);
    path.it = phys_path_defaults(&system);
    path.it.rule = phys_rule_find("gauss3", &error);
    path.it.slices = 21;
    path.it.dt = 0.05;
    double q[3 * 21] = {0};
    q[20] = 1;
    for (int k = 0; k < 21; k++)
        q[k] = k / 20.;
    phys_rule_interpolate(path.it.rule, 1, 21, q);
    hold(phys_path_solve(phys_solver_find("newton", &error), &system, &path.it, q, &found.it,
                         &error) == AD_OK,
         "path", &error);
    hold(found.it.grad_norm < 1e-8, "gradient of the path", &error);
    INTACT(path);
    INTACT(found);

    GUARDED(phys_motion_settings, asked);
    GUARDED(phys_motion_solution, motion);
    asked.it = (struct phys_motion_settings){.size = sizeof asked.it, .time = 3, .error = 1e-9};
    hold(phys_motion_solve(&system, &asked.it, &motion.it, &error) == AD_OK &&
             motion.it.error < 1e-9,
         "motion", &error);
    INTACT(asked);
    INTACT(motion);
    phys_motion_solution_free(&motion.it);

    GUARDED(hnn_settings, kind);
    kind.it = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = NULL;
    double x[2] = {1, 0}, rate[2];
    hold(hnn_model_new(&kind.it, &model, &error) == AD_OK &&
             hnn_model_field(model, x, rate) == AD_OK && isfinite(rate[0]),
         "model", &error);
    INTACT(kind);
    hnn_model_free(model);

    GUARDED(qm_slice, slice);
    slice.it = (struct qm_slice){
        .size = sizeof slice.it, .system = &system, .grid = {-8, 8, 128}, .dt = 0.2, .hbar = 1};
    GUARDED(qm_aliasing, aliasing);
    hold(qm_aliasing(&slice.it, &aliasing.it, &error) == AD_OK && aliasing.it.ratio > 0, "slice",
         &error);
    INTACT(slice);
    INTACT(aliasing);

    slice.it.size = 0;
    hold(qm_aliasing(&slice.it, &aliasing.it, &error) == AD_E_ARGUMENT, "a slice without size",
         &error);
    phys_system_close(&system);
    return failures != 0;
}
