/* Mass matrices that are nearly singular: run and reference round them alike, and the error that is
   claimed is no less than the true one. */
#include "physics/motion/solve.h"
#include "tests/close.h"

#include <math.h>
#include <string.h>

/* Oscillators x_j of masses m_j and frequencies w, x = W (q + bend sin q_0 e_1), W = rows of
   `modes`, orthogonal to each other. */
enum { MOST = 3 };
static const double modes[MOST][MOST][MOST] = {
    {{1}}, {{1, 1}, {1, -1}}, {{1, 2, 2}, {2, 1, -2}, {2, -2, 1}}};

struct numbers {
    double eps, bend;
    size_t n;
};

static const double frequency[MOST] = {0, 1, 1.7};

static double mass(const struct numbers *p, size_t mode) { return mode == 0 ? 1 : p->eps; }

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct numbers *p = params;
    ad_var L = ad_mul(0, t);
    for (size_t j = 0; j < p->n; j++) {
        ad_var x = ad_mul(p->bend * modes[p->n - 1][j][1], ad_sin(ad_row(q, 0)));
        ad_var u =
            ad_mul(p->bend * modes[p->n - 1][j][1], ad_mul(ad_cos(ad_row(q, 0)), ad_row(v, 0)));
        for (size_t k = 0; k < p->n; k++) {
            x = ad_add(x, ad_mul(modes[p->n - 1][j][k], ad_row(q, k)));
            u = ad_add(u, ad_mul(modes[p->n - 1][j][k], ad_row(v, k)));
        }
        L = ad_add(
            L, ad_mul(0.5 * mass(p, j), ad_sub(ad_square(u), ad_square(ad_mul(frequency[j], x)))));
    }
    return L;
}

/* Modes at t of the motion from x = 1, x' = 0. */
static void place(const struct numbers *p, double t, double *q)
{
    long double y[MOST] = {0}, size = 0;
    for (size_t k = 0; k < p->n; k++)
        size += modes[p->n - 1][0][k] * modes[p->n - 1][0][k];
    for (size_t j = 0; j < p->n; j++)
        for (size_t k = 0; k < p->n; k++)
            y[k] += modes[p->n - 1][j][k] * cosl((long double)frequency[j] * t) / size;
    y[1] -= p->bend * sinl(y[0]);
    for (size_t k = 0; k < p->n; k++)
        q[k] = (double)y[k];
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct numbers *p = params;
    (void)seed, (void)error;
    place(p, 0, q);
    for (size_t k = 0; k < p->n; k++)
        v[k] = 0;
    return AD_OK;
}

/* Claimed and true error of a run. */
static void follow(const struct numbers *p, double *claimed, double *worst)
{
    struct ad_error error = {0};
    struct phys_system system = {0};
    struct phys_motion_solution m;
    const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                     .size = sizeof scene,
                                     .name = "modes",
                                     .what = "oscillators",
                                     .dof = p->n,
                                     .dims = 1,
                                     .unit = "1",
                                     .time_unit = "1",
                                     .energy_unit = "1",
                                     .lagrangian = lagrangian,
                                     .params_bytes = sizeof *p,
                                     .start = start,
                                     .slices = 101,
                                     .dt = 0.1};
    const struct phys_motion_settings settings = {.size = sizeof settings,
                                                  .time = 10,

                                                  .integrator =
                                                      phys_integrator_find("dop853", &error),
                                                  .tolerance = 1e-13,

                                                  .n_samples = 20};
    if (phys_system_make(&scene, &system, &error) != AD_OK)
        fail_msg("%s", error.message);
    memcpy(system.params, p, sizeof *p);
    if (phys_motion_solve(&system, &settings, &m, &error) != AD_OK)
        fail_msg("%s", error.message);
    *worst = 0;
    *claimed = m.error;
    for (size_t i = 0; i < m.n; i++) {
        double distance = 0, at[MOST];
        place(p, m.t[i], at);
        for (size_t k = 0; k < p->n; k++)
            distance = hypot(distance, m.x[2 * p->n * i + k] - at[k]);
        *worst = fmax(*worst, distance);
    }
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

static void the_error_counts_the_rounding_of_the_masses(void **state)
{
    (void)state;
    for (size_t n = 2; n <= MOST; n++)
        for (int bent = 0; bent < 2; bent++)
            for (double eps = 0.1; eps > (bent ? 1e-5 : 2e-12); eps *= 1e-3) {
                double claimed, worst;
                follow(&(struct numbers){eps, bent ? 0.7 : 0, n}, &claimed, &worst);
                if (!(worst <= claimed && claimed < 1e-12 + 1e-14 / eps))
                    fail_msg("n = %zu, bent %d, eps = %g: claimed %g, true %g", n, bent, eps,
                             claimed, worst);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_error_counts_the_rounding_of_the_masses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
