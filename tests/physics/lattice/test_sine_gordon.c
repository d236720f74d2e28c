/* Kinks and breathers on lattices against their closed forms: errors are of order h^2. */
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/legendre.h"
#include "physics/motion/motion.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>

struct soliton {
    double speed, frequency, ring, time, energy, momentum;
};

static const double g = 1.1547005383792515; /* 1/sqrt(1 - 1/4) */

static double closed_form(const struct soliton *s, double x, double t)
{
    const double w = s->frequency, k = sqrt(1 - w * w);
    return w > 0 ? 4 * atan(k / w * sin(w * t) / cosh(k * x))
                 : 4 * atan(exp(g * (x - s->speed * t)));
}

enum { SLICES = 5, COARSE = 80, LENGTH_OF = 20 };

/* Largest error of the field, and those of energy and momentum at the last slice, and what the
   scene's own observable makes of the former. */
static void errors(const struct soliton *s, size_t n, double error[3])
{
    struct phys_system system = system_opened("sine-gordon");
    struct ad_error e = {0};
    phys_legendre *legendre;
    system_set(&system, "sites", (double)n);
    system_set(&system, "speed", s->speed);
    system_set(&system, "frequency", s->frequency);
    system_set(&system, "ring", s->ring);
    double *path = malloc(n * SLICES * sizeof *path), *q = malloc(4 * n * sizeof *q), seen[2];
    const double dt = s->time / (SLICES - 1), t = s->time, h = (double)LENGTH_OF / (double)n;
    assert_int_equal(phys_scene_path(&system, 0, NULL, SLICES, dt, path, &e), AD_OK);
    double most = 0, square = 0;
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < SLICES; i++) {
            double x = h * ((double)k + 0.5) - LENGTH_OF / 2;
            double off = path[k * SLICES + i] - closed_form(s, x, (double)i * dt);
            most = fmax(most, fabs(off));
            square += i == SLICES - 1 ? h * off * off : 0;
        }
    /* the last state, with velocities by its neighbours in time */
    double *fine = malloc(3 * n * sizeof *fine);
    system_start(&system, 0, q, q + n);
    assert_int_equal(phys_motion_path(&system, NULL, q, q + n, 2, t, path, &e), AD_OK);
    assert_int_equal(phys_motion_path(&system, NULL, q, q + n, 2, t + 1e-5, fine, &e), AD_OK);
    for (size_t k = 0; k < n; k++) {
        q[2 * n + k] = path[2 * k + 1];
        q[3 * n + k] = (fine[2 * k + 1] - path[2 * k + 1]) / 1e-5;
    }
    assert_int_equal(phys_observe(&system, 1, q + 2 * n, &t, seen, &e), AD_OK);
    assert_close(seen[1], sqrt(square), 1e-6, 0);
    assert_int_equal(phys_legendre_new(&system, &legendre, &e), AD_OK);
    error[0] = most;
    error[1] = fabs(phys_legendre_energy(legendre, q, q + n, 0) - s->energy);
    error[2] = fabs(seen[0] - s->momentum);
    phys_legendre_free(legendre);
    free(fine);
    free(path);
    free(q);
    phys_system_close(&system);
}

static void solitons_follow_their_closed_forms(void **state)
{
    const struct soliton cases[] = {{0.5, 0, 0, 4, 8 * g, 4 * g},
                                    {0.5, 0, 1, 4, 8 * g, 4 * g},
                                    {-0.5, 0, 1, 4, 8 * g, -4 * g},
                                    {0, 0.6, 0, 12, 12.8, 0},
                                    {0, 0.6, 1, 12, 12.8, 0}};
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double coarse[3], fine[3];
        errors(&cases[k], COARSE, coarse);
        errors(&cases[k], 2 * COARSE, fine);
        assert_in_range((int)(1000 * coarse[0]), 1, 150);
        assert_close(coarse[0] / fine[0], 4, 0.1, 0);
        for (int j = 1; j < 3; j++)
            if (cases[k].momentum != 0 || j == 1)
                assert_true(coarse[j] < 0.05 && (coarse[j] / fine[j] > 3.5 || fine[j] < 2e-4));
        assert_true(cases[k].momentum != 0 || fine[2] < 1e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(solitons_follow_their_closed_forms)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
