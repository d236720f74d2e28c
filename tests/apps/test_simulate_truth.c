/* The error that leastaction simulate reports: measured by another method, never 0 by construction,
   unknown where it cannot be known, with exit status 1 where it exceeds what was asked. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool shell_flag(const char *key)
{
    char wanted[64];
    snprintf(wanted, sizeof wanted, "\"%s\": true", key);
    return strstr(shell_last_line(), wanted) != NULL;
}

/* Once for all tests, beside their folder. */
static void build(const char *scene)
{
    shell_works("test -e ../%s.so || "
                "$LA build $ROOT/tests/apps/scenes/%s.c --include $ROOT --out ../%s.so --quiet; "
                "ln -s ../%s.so .",
                scene, scene, scene, scene);
}

/* A13: the run is not its own reference, whatever method and tolerance it has. */
static void test_error_is_never_zero(void **state)
{
    (void)state;
    static const char *const runs[] = {"pendulum --integrator dop853 --tol 1e-13",
                                       "pendulum --integrator dop853 --tol 1e-15", "freebody",
                                       "spring --integrator gauss5 --dt 0.01",
                                       "figure8 --integrator dop853 --tol 1e-13"};
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA simulate %s --json", runs[k]);
        assert_true(shell_number("error") >= shell_number("reference_uncertainty"));
        assert_true(shell_number("reference_uncertainty") > 0);
        assert_true(shell_number("error") < 1e-9);
    }
}

/* A13: the reference is followed back to its start, on regular and chaotic motions, from an
   unstable place, with a close encounter, down a hillside and with friction, whose ways back are
   steep, and from its horizon. An error that is not a hundred times the reference's own is called a
   bound. */
static void test_the_reference_comes_back(void **state)
{
    (void)state;
    static const struct {
        const char *run;
        double reversal, uncertainty;
        int bound; /* -1: no error is given */
    } runs[] = {
        {"figure8 --time 63", 1e-11, 1e-11, 0},
        {"kepler --set e=0.99 --time 62.8", 1e-8, 1e-8, 0},
        {"dblpend --time 30", 1e-9, 1e-9, 0},
        {"dblpend --time 30 --integrator dop853 --tol 1e-14", 1e-9, 1e-9, 1},
        {"dblpend --time 200", 20, 1, -1} /* a tenth of angles that wind, by chance so far */,
        {"pendulum --set l=1 --set theta0=3.1415926 --time 30", 1e-3, 1e-3, 0},
        {"pendulum --integrator dop853 --tol 1e-15", 1e-13, 1e-13, 1},
        {"./damped.so --set k=-1 --time 15", 1e3, 1e-8, 0},
        {"./damped.so --set k=-1 --set q0=1e-9 --set v0=0 --time 40", 1e3, 1e-6, 0},
        {"./damped.so --set g=0.5 --time 40", 1e-4, 1e-13, 0}};
    build("damped");
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA simulate %s --json --quiet", runs[k].run);
        print_message("%-50s error %.1e, reference %.1e, back %.1e\n", runs[k].run,
                      shell_number("error"), shell_number("reference_uncertainty"),
                      shell_number("reference_reversal"));
        assert_true(shell_number("reference_reversal") <= runs[k].reversal);
        assert_true(shell_number("reference_uncertainty") <= runs[k].uncertainty);
        assert_int_equal(strstr(shell_last_line(), "\"error_is_bound\"") != NULL,
                         runs[k].bound >= 0);
        assert_int_equal(shell_flag("error_is_bound"), runs[k].bound == 1);
    }
}

/* Beyond the horizon of chaos no error is given; a shorter time has one. */
static void test_horizon(void **state)
{
    (void)state;
    shell_works("$LA simulate dblpend --time 200 --integrator dop853 --tol 1e-13 --json --quiet");
    double horizon = shell_number("reference_horizon");
    assert_true(isnan(shell_number("error")) && isnan(shell_number("error_end")));
    assert_true(horizon > 60 && horizon < 130);
    shell_works("$LA simulate dblpend --time %g --integrator dop853 --tol 1e-13 --json",
                0.5 * horizon);
    assert_true(shell_number("error") > 0 && shell_number("error") < 1e-4);
    assert_true(isnan(shell_number("reference_horizon")));
}

/* A14: barriers and pulses that steps pass over, narrow and wide, at several places. Never a
   success with another motion; the wide ones are met. */
static void test_narrow_forces(void **state)
{
    (void)state;
    static const char *const places[] = {"--set x0=5 --set t0=5", "--set x0=4.987 --set t0=4.987",
                                         "--set x0=3.3333 --set t0=3.3333"};
    static const double widths[] = {1e-3, 3e-3, 0.02, 0.5};
    build("narrow");
    size_t missed = 0, met = 0;
    for (size_t i = 0; i < LENGTH(places); i++)
        for (size_t k = i % 2; k < LENGTH(widths); k += i == 0 && k > 0 ? 1 : 2)
            for (int pulse = i == 2; pulse < 2 - (i == 1); pulse++) {
                int status = shell("$LA simulate ./narrow.so --time 10 --tol 1e-9 --json %s "
                                   "--set s=%g --set w=%g --set %s=1",
                                   places[i], widths[k], widths[k], pulse ? "pulse" : "barrier");
                if (status == 1 && !*shell_out()) { /* no setting was found */
                    missed++;
                    continue;
                }
                double error = shell_number("error");
                if (status != !(error <= 1e-9))
                    print_error("%s width %g %s: exit %d, error %g\n", places[i], widths[k],
                                pulse ? "pulse" : "barrier", status, error);
                assert_int_equal(status, error <= 1e-9 ? 0 : 1);
                assert_true(status == 0 || error > 1 || isnan(error)); /* another motion */
                missed += status == 1;
                met += status == 0;
            }
    print_message("missed %zu, met %zu\n", missed, met);
    assert_true(missed > 0 && met >= 2 * LENGTH(places));
}

/* A14: pulses thinner than a step, centred where the reference lands (a row of the output, a part
   between two), are seen whole: x = 10 + 10 - t0 at the end. The run sees nothing, or, where its
   own steps end there, the force at the centre for as long as a step. */
static void test_pulses_where_steps_end(void **state)
{
    (void)state;
    static const double widths[] = {1e-4, 1e-5, 1e-6}, places[] = {5, 4.9, 7.35};
    build("narrow");
    for (size_t i = 0; i < LENGTH(places); i++)
        for (size_t k = i; k < LENGTH(widths); k += i == 0 ? 1 : LENGTH(widths))
            for (int fixed = 0; fixed < 2; fixed++) {
                int status =
                    shell("$LA simulate ./narrow.so --time 10 --json --quiet --set pulse=1 "
                          "--set barrier=0 --set t0=%g --set w=%g %s",
                          places[i], widths[k],
                          fixed ? "--integrator velocity-verlet --dt 0.01" : "--tol 1e-6");
                double moved = 10 - places[i], error = shell_number("error_end");
                double seen = fixed ? 0.01 / (widths[k] * sqrt(2 * M_PI)) : 0;
                if (status == 0 && !fixed)
                    assert_true(error <= 1e-6);
                else
                    assert_close(error, fabs(seen - 1) * moved, 1e-3, 0);
            }
}

/* Members of an ensemble whose pulses lie anywhere and last from 1e-4 to a twentieth of the time:
   x = t + p (t - t0). */
static void test_pulses_of_an_ensemble(void **state)
{
    static const char *const options[] = {"", "--tol 1e-6", "--integrator dop853 --threads 2"};
    (void)state;
    build("narrow");
    shell_works("printf 'w,pulse,t0\\n.1,0,5\\n1e-3,1,3.3\\n.1,1,2\\n.3,1,4\\n.5,1,4\\n.2,-1,7\\n' "
                ">rows.csv");
    for (size_t k = 0; k < LENGTH(options); k++) {
        shell_works("$LA simulate ./narrow.so --ensemble rows.csv --time 10 --samples 1 --quiet "
                    "--csv all.csv %s",
                    options[k]);
        shell_works("awk -F, 'FNR == NR { if (FNR > 1) ends[FNR - 1] = 10 + $2 * (10 - $3); next } "
                    "$2 == 10 { d = $3 - ends[$1]; n++; far += d > 1e-6 || d < -1e-6 } "
                    "END { exit !(n == 6 && far == 0) }' rows.csv all.csv");
    }
}

/* C1: a tighter tolerance is tried as long as it helps, in no more evaluations than four runs of
   the answer. Motions of ten orbits and more. */
static void test_tolerance_is_reached(void **state)
{
    (void)state;
    static const char *const runs[] = {
        "kepler --time 62.83185307179586",     "kepler --set e=0.99 --time 62.83185307179586",
        "figure8 --time 63.259138908",         "dblpend --time 30",
        "arenstorf --time 17.065216560157963", "./outer.so --time 36525"};
    build("outer");
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA simulate %s --tol 1e-9 --json", runs[k]);
        double cost = shell_number("searched") / shell_number("evaluations");
        print_message("%-45s error %.1e, searched %.2f runs\n", runs[k], shell_number("error"),
                      cost);
        assert_true(shell_number("error") <= 1e-9);
        assert_true(cost <= 4);
    }
}

static size_t count_events(void)
{
    size_t n = 0;
    for (const char *at = shell_last_line(); (at = strstr(at, "{\"event\"")); at++)
        n++;
    return n;
}

/* A12: the turning point is just behind the value: two crossings, seconds apart, each period. */
static void test_every_crossing(void **state)
{
    (void)state;
    static const char *const runs[] = {
        "theta=1.57", "theta=1.57079", "theta=1.57 --integrator gauss5 --dt 5",
        "theta=1.57 --integrator verlet --dt 2", "theta=1.57 --integrator dopri5 --tol 1e-8"};
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA simulate pendulum --time 1000 --no-reference --json --event %s", runs[k]);
        assert_int_equal(count_events(), 21);
    }
}

/* Events of fixed steps are as accurate as the motion, also next to a turning point, where two
   crossings lie within a step: q = cos t passes q at acos(q) and 2 pi - acos(q). */
static void test_events_of_fixed_steps(void **state)
{
    (void)state;
    static const char *const methods[] = {
        "gauss5 --tol 1e-9",  "gauss3 --dt 0.1",    "rk4 --tol 1e-9",
        "verlet --dt 0.01",   "yoshida6 --dt 0.1",  "gauss4 --dt 0.25",
        "dopri5 --tol 1e-10", "dop853 --tol 1e-12", "variational-gauss4 --dt 0.2"};
    static const double values[] = {0.3, 0, -0.99999999, 0.99999999};
    for (size_t i = 0; i < LENGTH(methods); i++) {
        shell_works("$LA simulate spring --set m=1 --set k=1 --set q0=1 --set v0=0 --time 6.28 "
                    "--samples 500 --json --integrator %s --event q=%.17g --event q=%.17g "
                    "--event q=%.17g --event q=%.17g",
                    methods[i], values[0], values[1], values[2], values[3]);
        for (size_t k = 0; k < LENGTH(values); k++) {
            double error = shell_number("error"), root = acos(values[k]), speed = sin(root);
            const char *at = shell_last_line();
            char event[64];
            snprintf(event, sizeof event, "{\"event\": \"q=%.17g\"", values[k]);
            for (int n = 0; n < 2; n++) {
                double t = n == 0 ? root : 2 * M_PI - root, found;
                at = strstr(at, event);
                if (n == 1 && t > 6.28) { /* not in this time */
                    assert_null(at);
                    break;
                }
                assert_non_null(at);
                assert_int_equal(sscanf(strstr(at++, "\"t\": "), "\"t\": %lf", &found), 1);
                double allowed = 2 * error / speed + 1e-12 / speed, said;
                at = strstr(at, "\"t_uncertainty\": ");
                assert_int_equal(sscanf(at, "\"t_uncertainty\": %lf", &said), 1);
                assert_close(found, t, 0, fmin(said, allowed));
                assert_true(said <= 20 * (error + 1e-15) / speed);
            }
        }
    }
}

/* No more digits of a time are printed than its uncertainty leaves; six, where that is not known.
   What is conserved crosses nothing. */
static void test_digits_of_events(void **state)
{
    (void)state;
    static const struct {
        const char *how;
        int fewest, most;
    } rows[] = {{"--integrator verlet --dt 0.01", 4, 6},
                {"--integrator taylor --tol 1e-13", 14, 16},
                {"--integrator euler --dt 0.01", 2, 4},
                {"--integrator dop853 --tol 1e-8", 7, 10},
                {"--no-reference", 5, 6}};
    static const char cosine[] = "spring --set m=1 --set k=1 --set q0=1 --set v0=0";
    for (size_t k = 0; k < LENGTH(rows); k++) {
        shell_works("$LA simulate %s --time 2 --event q=0.3 %s", cosine, rows[k].how);
        const char *t = strstr(shell_out(), "t = 1.") + 4;
        int digits = (int)strspn(t, "0123456789.") - 1;
        print_message("%s: %.*s\n", rows[k].how, digits + 1, t);
        assert_true(digits >= rows[k].fewest && digits <= rows[k].most);
        assert_close(strtod(t, NULL), acos(0.3), 0, 3 * pow(10, 1 - digits));
        shell_works("$LA simulate %s --time 20 --json --event energy=0.5 "
                    "--event energy=0.50000001 %s",
                    cosine, rows[k].how);
        assert_int_equal(count_events(), 0);
    }
    shell_works("$LA simulate freebody --set g=0 --set v0=0.7 --time 2 --json --event v_x=0.7");
    assert_int_equal(count_events(), 0);
    assert_int_equal(shell("$LA simulate spring --until energy=0.5"), 1);
    build("driven"); /* which does not conserve it */
    shell_works("$LA simulate ./driven.so --set drive=0.4 --time 5 --json");
    shell_works("$LA simulate ./driven.so --set drive=0.4 --time 5 --json --event energy=%.17g",
                shell_number("energy") + 0.5 * shell_number("energy_change"));
    assert_true(count_events() > 0);
}

/* Where the motion comes nearer to a value than it errs and turns, it is not known whether it
   crosses: that is said; not where it stays away, and not where it crosses. */
static void test_events_within_the_error(void **state)
{
    (void)state;
    static const struct {
        const char *run, *undecided;
    } rows[] = {
        {"kepler --time 20 --event distance:1=1.5999 --integrator implicit-midpoint --dt 0.01",
         "event distance:1=1.5999: "},
        {"spring --set m=1 --set k=1 --set q0=1 --set v0=0 --time 20 --event q=0.5 --event q=-1 "
         "--integrator verlet --dt 0.01",
         "event q=-1: "},
        {"spring --set m=1 --set k=1 --set q0=1 --set v0=0 --time 20 --event q=-1.01 "
         "--event q=-0.9 --integrator verlet --dt 0.01",
         NULL},
        {"kepler --time 20 --event distance:1=1.5999 --integrator gauss3 --dt 0.02", NULL}};
    for (size_t k = 0; k < LENGTH(rows); k++) {
        shell_works("$LA simulate %s --json", rows[k].run);
        assert_int_equal(strstr(shell_last_line(), "\"warnings\": [\"event ") != NULL,
                         rows[k].undecided != NULL);
        if (rows[k].undecided)
            assert_mentions(shell_last_line(), rows[k].undecided);
    }
}

/* A15: a mass matrix that is singular but for rounding is refused, by simulate and by check. */
static void test_degenerate_masses(void **state)
{
    (void)state;
    build("degenerate");
    for (double eps = 1; eps > 1e-17; eps *= 1e-2) {
        int status = shell("$LA simulate ./degenerate.so --set eps=%g --json", eps);
        int check = shell("$LA check ./degenerate.so --set eps=%g", eps);
        assert_int_equal(status, eps < 1e-13 ? 2 : eps > 1e-11 ? 0 : status);
        assert_int_equal(check != 0, status != 0);
        if (status != 0)
            continue;
        shell_works("$LA check ./degenerate.so --set eps=%g --json", eps);
        double condition = shell_number("mass_condition");
        assert_true(condition > 0.1 / eps && condition < 10 / eps);
        shell_works("$LA simulate ./degenerate.so --set eps=%g --json", eps);
        assert_close(shell_number("mass_condition"), condition, 1e-3, 0);
        char number[40];
        snprintf(number, sizeof number, "%.2g", shell_number("mass_condition"));
        assert_int_equal(strstr(shell_err(), number) != NULL, condition > 1e8);
        /* an error that rounding of the masses may exceed is not promised */
        status = shell("$LA simulate ./degenerate.so --set eps=%g --tol 1e-9 --json", eps);
        assert_int_equal(status, shell_number("reference_uncertainty") > 1e-9);
        assert_int_equal(status, eps < 1e-6 ? 1 : eps > 1e-5 ? 0 : status);
    }
    assert_int_equal(shell("$LA simulate ./degenerate.so --set eps=1e-16 --integrator "
                           "variational-midpoint"),
                     2); /* in (q, p) */
    static const struct {
        const char *run, *parameter;
    } wrong[] = {{"pendulum --set m=0", "m=0"},
                 {"pendulum --set theta0=1 --set l=0 --tol 1e-6", "l=0"},
                 {"dblpend --set l2=0 --integrator gauss3", "l2=0"},
                 {"spring --set m=0 --set k=2 --integrator verlet", "m=0"},
                 {"spring --set m=0 --integrator variational-gauss2", "m=0"},
                 {"spring --set k=1e308 --set q0=1e10", "coordinate q"}, /* either would do */
                 {"./degenerate.so --set eps=0", "eps=0"}};
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        assert_int_equal(shell("$LA simulate %s", wrong[k].run), 2);
        assert_mentions(shell_err(), wrong[k].parameter);
    }
}

/* A16: energy and momenta are said to be conserved where L keeps them, and nowhere else; where it
   does, they change by errors alone. */
static void test_conserved(void **state)
{
    (void)state;
    static const struct {
        const char *forces;
        bool energy, momentum, angular;
    } rows[] = {
        {"field=0", true, true, true},      {"field=0.5", true, false, false},
        {"centre=0.3", true, false, true},  {"drive=0.4", false, true, true},
        {"wind=0.2", false, false, false},  {"centre=1e-4", true, false, true},
        {"field=1e-6", true, false, false}, {"drive=1e-12", false, true, true},
    };
    build("driven");
    for (size_t k = 0; k < LENGTH(rows); k++) {
        shell_works("$LA simulate ./driven.so --integrator gauss4 --dt 0.02 --no-reference --json "
                    "--set %s",
                    rows[k].forces);
        assert_int_equal(shell_flag("energy_conserved"), rows[k].energy);
        assert_int_equal(shell_flag("momentum_conserved"), rows[k].momentum);
        assert_int_equal(shell_flag("angular_momentum_conserved"), rows[k].angular);
        assert_int_equal(isnan(shell_number("energy_drift")), !rows[k].energy);
        assert_int_equal(shell_number("momentum_change") < 1e-12, rows[k].momentum);
        assert_int_equal(shell_number("angular_momentum_change") < 1e-12, rows[k].angular);
        if (rows[k].energy)
            assert_true(shell_number("energy_drift") < 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_error_is_never_zero, shell_empty),
        cmocka_unit_test_setup(test_the_reference_comes_back, shell_empty),
        cmocka_unit_test_setup(test_horizon, shell_empty),
        cmocka_unit_test_setup(test_narrow_forces, shell_empty),
        cmocka_unit_test_setup(test_pulses_of_an_ensemble, shell_empty),
        cmocka_unit_test_setup(test_pulses_where_steps_end, shell_empty),
        cmocka_unit_test_setup(test_tolerance_is_reached, shell_empty),
        cmocka_unit_test_setup(test_every_crossing, shell_empty),
        cmocka_unit_test_setup(test_events_of_fixed_steps, shell_empty),
        cmocka_unit_test_setup(test_digits_of_events, shell_empty),
        cmocka_unit_test_setup(test_events_within_the_error, shell_empty),
        cmocka_unit_test_setup(test_degenerate_masses, shell_empty),
        cmocka_unit_test_setup(test_conserved, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
