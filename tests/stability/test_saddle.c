/* The true path is often a saddle of the action, which no descent can find. An oscillator, w = 1, x
   from 1 to 0 in a time T: a minimum up to half a period, a saddle beyond. (Its eigenvalues at T =
   3.1 and 3.2, and the Morse indices of pendulum, double pendulum, three bodies and Mercury are in
   tests/physics/path/test_newton.c.) */
#include "follow.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <string.h>

enum { SLICES = 100, LAST = SLICES - 1 };

/* Runs a solver on the straight line from 1 to 0. */
static struct phys_path_info solve(const char *solver, double T, size_t steps, double rate,
                                   double path[SLICES])
{
    struct phys_system spring;
    struct phys_path_info info = {0};
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = phys_rule_find("left", &error),
                                                .slices = SLICES,
                                                .steps = steps,
                                                .dt = T / LAST,
                                                .learning_rate = rate};
    for (size_t i = 0; i < SLICES; i++)
        path[i] = 1 - (double)i / LAST;
    phys_path_solve(phys_solver_find(solver, &error), &spring, &settings, path, &info, &error);
    assert_int_equal(error.status, AD_OK);
    phys_system_close(&spring);
    return info;
}

/* The stationary path of the rule: x_(i+1) - 2 x_i + x_(i-1) = -dt^2 x_i, a cosine whose step turns
   by 2 asin(dt / 2). */
static double stationary(double T, size_t i)
{
    double turn = 2 * asin(0.5 * T / LAST);
    return sin((LAST - (double)i) * turn) / sin(LAST * turn);
}

static double distance(double T, const double path[SLICES])
{
    double most = 0;
    for (size_t i = 0; i < SLICES; i++)
        most = fmax(most, fabs(path[i] - stationary(T, i)));
    return most;
}

/* Along mode k, sin(k pi i / LAST), a step of descent multiplies the distance by 1 - rate * (this):
   the eigenvalue of the objective, S / dt / slices. */
static double eigenvalue(double T, double k)
{
    double dt = T / LAST;
    return (2 * (1 - cos(k * M_PI / LAST)) / (dt * dt) - 1) / SLICES;
}

/* Where |distance| is after so many steps, along the first mode, which is what is left. */
static double predicted(double T, size_t steps, double rate)
{
    double mode = 0;
    for (size_t i = 0; i < SLICES; i++)
        mode += (1 - (double)i / LAST - stationary(T, i)) * sin(M_PI * (double)i / LAST);
    mode *= 2. / LAST;
    return fabs(mode) * pow(1 - rate * eigenvalue(T, 1), (double)steps);
}

/* rate of S itself: rate of the mean / (dt * slices) */
static double rate_of_mean(double T, double rate) { return rate * T / LAST * SLICES; }

static void a_descent_diverges_on_a_saddle(void **state)
{
    (void)state;
    const double T = 6, rate = rate_of_mean(T, 0.0268); /* just under the limit, dt / 2 */
    double path[SLICES];
    solve("sgd", T, 20000, rate, path);
    assert_close(distance(T, path), predicted(T, 20000, rate), 1e-3, 0);
    assert_close(distance(T, path), 1.5e10, 0.04, 0);
}

static void newton_needs_one_solve(void **state)
{
    (void)state;
    static const double times[] = {3.1, 3.2, 6};
    for (size_t k = 0; k < 3; k++) {
        double path[SLICES];
        solve("newton", times[k], 1, 1, path);
        assert_true(distance(times[k], path) < 1e-9);
        solve("newton", times[k], 2, 1, path);
        assert_true(distance(times[k], path) < 1e-12);
    }
}

/* Half a period is the border: a little before it descent arrives, slowly, a little after it
   leaves, slowly. */
static void descent_turns_round_at_half_a_period(void **state)
{
    (void)state;
    static const struct {
        double T;
        int sign; /* of the smallest eigenvalue */
    } cases[] = {{3.1, +1}, {3.2, -1}};
    for (size_t k = 0; k < 2; k++) {
        const double T = cases[k].T, rate = rate_of_mean(T, 0.0125);
        double early[SLICES], late[SLICES];
        solve("sgd", T, 20000, rate, early);
        solve("sgd", T, 40000, rate, late);
        assert_true((eigenvalue(T, 1) > 0) == (cases[k].sign > 0));
        assert_true((distance(T, late) < distance(T, early)) == (cases[k].sign > 0));
        assert_close(distance(T, late), predicted(T, 40000, rate), 1e-3, 0);
    }
}

static void the_command_says_what_to_try(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA path spring --slices 100 --dt 0.0606 --steps 5000 --solver sgd "
                           "--lr 0.15"),
                     0);
    assert_mentions(shell_err(), "sgd |gradient| 1 saddle --solver newton");
    assert_int_equal(shell("$LA path spring --slices 100 --dt 0.02 --steps 30 --solver sgd "
                           "--lr 2"),
                     0);
    assert_mentions(shell_err(), "sgd --lr 2");
    assert_int_equal(shell("$LA path spring --slices 100 --dt 0.02 --steps 500 --solver sgd "
                           "--lr 2"),
                     1);
    assert_mentions(shell_err(), "--lr 2 --solver newton step");
    assert_int_equal(shell("$LA path spring --slices 100 --dt 0.0606 --solver newton"), 0);
    assert_string_equal(shell_err(), "");
    assert_mentions(shell_out(), "Morse index 1 saddle conjugate");
    assert_int_equal(shell("$LA path spring --slices 100 --dt 0.03 --steps 500 --solver sgd "
                           "--lr 0.02"),
                     0);
    assert_string_equal(shell_err(), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_descent_diverges_on_a_saddle),
        cmocka_unit_test(newton_needs_one_solve),
        cmocka_unit_test(descent_turns_round_at_half_a_period),
        cmocka_unit_test(the_command_says_what_to_try),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
