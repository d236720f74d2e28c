/* leastaction simulate --section: points by closed forms, counted exactly; those that are not of
   their start are told. */
#include "tests/close.h"
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { MOST = 400, COLUMNS = 8 };

struct points {
    size_t n;
    double of[MOST][COLUMNS]; /* NaN: an empty cell */
};

static void read_points(const char *name, const char *header, struct points *p)
{
    char line[512];
    FILE *in = fopen(shell_path(name), "r");
    assert_non_null(in);
    assert_non_null(fgets(line, sizeof line, in));
    assert_string_equal(line, header);
    for (p->n = 0; fgets(line, sizeof line, in); p->n++) {
        assert_true(p->n < MOST);
        char *at = line, *end;
        for (size_t k = 0; k < COLUMNS; k++, at = end + (*end == ',')) {
            p->of[p->n][k] = strtod(at, &end);
            if (end == at)
                p->of[p->n][k] = (double)NAN;
        }
    }
    fclose(in);
}

static const char header[] = "t,x,y,v_x,v_y,error\n";

static void build(void)
{
    shell_works("$LA build $ROOT/tests/apps/scenes/sections.c --include $ROOT --out s.so --quiet");
}

/* x = sin t, y = cos b t from the surface: every crossing, in its direction, on an ellipse. */
static void test_two_oscillators(void **state)
{
    static const struct {
        const char *section;
        double first, apart;
        size_t n;
    } rows[] = {{"x>0", 2 * PI, 2 * PI, 7},   {"x<0", PI, 2 * PI, 8},
                {"x=0", PI, PI, 15},          {"x>0.5", PI / 6, 2 * PI, 8},
                {"v_x<0", PI / 2, 2 * PI, 8}, {"x>0.9999999", 0, 0, 8},
                {"x=0.9999999", 0, 0, 16},    {"x<0.9999999", 0, 0, 8}};
    static const char *const how[] = {"--tol 1e-11", "--integrator gauss5 --tol 1e-10"};
    const double b = sqrt(2);
    struct points p;
    (void)state;
    build();
    for (size_t k = 0; k < 2 * LENGTH(rows); k++) {
        const size_t r = k / 2;
        shell_works("$LA simulate ./s.so --set b=%.17g --time 50 %s --section '%s' --json --csv "
                    "s.csv --samples %d",
                    b, how[k % 2], rows[r].section, k % 3 ? 1000 : 50);
        assert_true(shell_number("section_points") == (double)rows[r].n);
        assert_true(shell_number("section_known") == (double)rows[r].n);
        assert_true(isnan(shell_number("section_lost")));
        read_points("s.csv", header, &p);
        assert_int_equal(p.n, rows[r].n);
        for (size_t i = 0; i < p.n; i++) {
            const double *at = p.of[i], t = rows[r].first + (double)i * rows[r].apart;
            assert_close(at[2] * at[2] + at[4] * at[4] / 2, 1, 0, 1e-9);
            assert_true(at[5] > 0 && at[5] <= shell_number("section_accuracy"));
            if (rows[r].apart > 0) {
                assert_close(at[0], t, 0, 1e-9);
                assert_close(at[2], cos(b * t), 0, 1e-9);
            }
        }
    }
    /* The largest x: touches are no points, and what they become by the error is told. */
    shell("$LA simulate ./s.so --set b=%.17g --time 100 --tol 1e-10 --section x=1 --json", b);
    assert_true(shell_number("section_touches") > 0 || strstr(shell_err(), "warning"));
    shell_works("$LA simulate pendulum --section theta=0 --json"); /* one coordinate, which is 0 */
    assert_true(shell_number("section_points") == 2 && shell_number("section_known") == 2);
    assert_close(shell_number("section_accuracy"), 1e-3 * acos(-1), 0, 0.2);
    assert_int_equal(shell("$LA simulate ./s.so --section x=2 --csv s.csv --quiet"), 1);
    assert_int_equal(shell("$LA simulate ./s.so --section energy=1 --quiet"), 1);
}

/* In the sea of Henon and Heiles: points that are said to be known are those of a tighter run, each
   has the energy, and the others are told. */
static void test_points_of_chaos(void **state)
{
    static const char sea[] = "./s.so --set c=1 --set y0=-0.25 --set vx0=0.42 --time 600";
    static struct points p, tight;
    (void)state;
    build();
    shell_works("$LA simulate %s --section 'x>0' --csv tight.csv --quiet --no-reference "
                "--integrator taylor --tol 1e-15; $LA simulate %s --section 'x>0' --json --csv "
                "s.csv",
                sea, sea);
    const size_t known = (size_t)shell_number("section_known");
    const double accuracy = shell_number("section_accuracy"), lost = shell_number("section_lost");
    const double E = shell_number("energy"), drift = shell_number("energy_change");
    assert_non_null(strstr(shell_err(), "not known"));
    read_points("s.csv", header, &p);
    read_points("tight.csv", header, &tight);
    assert_true(known > 20 && known < p.n);
    for (size_t i = 0; i < p.n; i++) {
        const double *a = p.of[i], *b = tight.of[i], y = a[2];
        double is = (a[3] * a[3] + a[4] * a[4] + y * y) / 2 - y * y * y / 3;
        assert_close(is, E, 0, 2 * drift);
        assert_true((a[0] < lost) == (i < known) && (a[5] <= accuracy) == (i < known));
        assert_true(i >= tight.n || isnan(b[5]));
        for (size_t k = 0; k < 5 && i < known; k++)
            assert_close(a[k], b[k], 0, (k ? 3 : 10) * accuracy);
    }
    shell_works("$LA simulate %s --section 'x>0' --json --no-reference", sea);
    assert_true(shell_number("section_known") == 0);
    shell_works("$LA simulate %s --section 'x>0' --json --integrator taylor --tol 1e-13", sea);
    assert_true((size_t)shell_number("section_known") > known);
}

/* Members have the points of runs of their own. */
static void test_members(void **state)
{
    static struct points one, all;
    (void)state;
    build();
    shell_works("printf 'y0,vx0\\n0.55,0.2417\\n-0.25,0.42\\n0.2,0.3\\n' > e.csv; $LA simulate "
                "./s.so --set c=1 --ensemble e.csv --time 150 --section 'x>0' --event y=0 --csv "
                "all.csv --out e.h5 --json");
    assert_true(shell_number("section_known") == shell_number("section_points"));
    read_points("all.csv", "row,t,x,y,v_x,v_y,error\n", &all);
    assert_true(shell_number("section_points") == (double)all.n);
    shell_works("$LA simulate ./s.so --set c=1 --set y0=0.2 --set vx0=0.3 --time 150 --section "
                "'x>0' --event y=0 --csv s.csv --tol 1e-10 --quiet");
    read_points("s.csv", header, &one);
    assert_true(one.n > 15 && one.n < all.n);
    for (size_t i = 0; i < one.n; i++) {
        assert_true(all.of[all.n - one.n + i][0] == 3);
        for (size_t k = 0; k < 5; k++)
            assert_close(all.of[all.n - one.n + i][k + 1], one.of[i][k], 0, 1e-6);
    }
    assert_true(all.of[all.n - one.n - 1][0] == 2);
    shell_works("$LA dump e.h5 --dataset section --csv - | wc -l");
    assert_true(atoi(shell_out()) >= (int)all.n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_two_oscillators, shell_empty),
        cmocka_unit_test_teardown(test_points_of_chaos, shell_empty),
        cmocka_unit_test_teardown(test_members, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
