/* leastaction path --ends periodic: from rough starts to published orbits and closed periods. */
#include "tests/close.h"
#include "tests/apps/shell.h"
#include "physics/io/csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SLICES = 41, BODIES = 3 };

/* A curve of Lissajous over a third of the period, with the bodies on it in the order given. */
static void write_curve(const size_t order[BODIES])
{
    FILE *out = fopen(shell_path("rough.csv"), "w");
    assert_non_null(out);
    for (size_t i = 0; i < SLICES; i++)
        for (size_t b = 0; b < BODIES; b++) {
            const double at = 2 * M_PI / BODIES * ((double)i / (SLICES - 1) + (double)order[b]);
            fprintf(out, "%.17g,%.17g%c", sin(at), 0.3 * sin(2 * at), b + 1 < BODIES ? ',' : '\n');
        }
    fclose(out);
}

/* Simo, Contemporary Mathematics 292 (2002): where one of them is at the centre the others are at
   +-(0.97000436, -0.24308753), or turned. The start has its symmetry, whichever way the bodies go;
   each then ends where another one begins. */
static void the_figure_eight_from_a_rough_curve(void **state)
{
    static const size_t orders[][BODIES] = {{0, 1, 2}, {0, 2, 1}};
    const double far = hypot(0.97000436, 0.24308753);
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        size_t rows, columns;
        double *x;
        struct ad_error error = {0};
        write_curve(orders[k]);
        shell_works("$LA path figure8 --ends periodic --choreography --time 6.32591398 --init "
                    "rough.csv --slices %d --csv found.csv --json",
                    SLICES);
        assert_close(shell_number("period"), 6.32591398, 1e-14, 0);
        assert_true(shell_number("discretisation_error") < 1e-8);
        assert_true(shell_number("closure") < 1e-11);
        assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &x, &error),
                         AD_OK);
        assert_true(rows == SLICES && columns == 1 + 2 * BODIES);
        const double *end = x + (rows - 1) * columns;
        assert_close(end[0], 6.32591398 / 3, 1e-14, 0);
        for (size_t b = 0; b < BODIES; b++) {
            const size_t next = orders[k][b] == 0   ? orders[k][1]
                                : orders[k][b] == 1 ? orders[k][2]
                                                    : 0;
            assert_close(end[1 + 2 * b], x[1 + 2 * next], 0, 1e-14);
            assert_close(end[2 + 2 * b], x[2 + 2 * next], 0, 1e-14);
            assert_close(hypot(x[1 + 2 * b], x[2 + 2 * b]), orders[k][b] == 0 ? 0 : far, 0, 1e-8);
        }
        free(x);
    }
}

/* K(m) by the arithmetic-geometric mean. */
static double elliptic(double m)
{
    double a = 1, b = sqrt(1 - m);
    for (int k = 0; k < 8; k++) {
        const double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return M_PI / (2 * a);
}

/* 4 K(E / 2); near the energy of the start, and far from it. */
static void the_period_of_a_pendulum(void **state)
{
    static const double energies[] = {0.3, 1, 1.9};
    (void)state;
    for (size_t k = 0; k < sizeof energies / sizeof *energies; k++) {
        shell_works("$LA path pendulum --set l=1 --ends periodic --time 7.3 --energy %g --tol 1e-9 "
                    "--out run.h5 --json",
                    energies[k]);
        assert_close(shell_number("period"), 4 * elliptic(energies[k] / 2), 0, 1e-12);
        assert_true(shell_number("max_error") < 1e-9);
        assert_close(shell_number("energy"), energies[k], 0, 1e-9);
    }
    assert_int_equal(shell("$LA path pendulum --set l=1 --ends periodic --time 7.3 --energy 2.5"),
                     1); /* over the top it does not come back */
    assert_int_equal(shell("$LA path pendulum --set l=1 --ends periodic --time 6"),
                     1); /* none is so quick: it rests */
}

/* Of energy -1.5, and its period, by SciPy: DOP853 to 1e-13 and the symmetry about y = 0. */
static void an_orbit_of_lyapunov(void **state)
{
    (void)state;
    shell_works("$LA path cr3bp --ends periodic --time 2.743 --energy -1.5 --json");
    assert_close(shell_number("period"), 4.335079646730793, 0, 1e-12);
    assert_true(shell_number("max_error") < 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(the_figure_eight_from_a_rough_curve, shell_empty),
        cmocka_unit_test_setup(the_period_of_a_pendulum, shell_empty),
        cmocka_unit_test_setup(an_orbit_of_lyapunov, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
