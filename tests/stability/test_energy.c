/* The ends do not determine the energy: a pendulum, g = l = 1, from theta = 0 to theta = 0 in t =
   10, may rest or swing with any of three energies. (All four, with digits:
   tests/physics/path/test_path_all.c.) A descent that starts on one swing ends on another. */
#include "physics/physics.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>

enum { SLICES = 101 };

/* The swings: energy, largest angle, Morse index. */
static const struct {
    double energy, largest;
    size_t index;
} swings[] = {
    {0.42766904, 0.96145072, 2}, {1.76375516, 2.43990697, 1}, {1.99854509, 3.08764330, 0}};

struct question {
    struct phys_system system;
    struct phys_path_settings settings;
    struct ad_error error;
};

static void question_open(struct question *c)
{
    *c = (struct question){0};
    phys_system_open("pendulum", &c->system, &c->error);
    phys_system_set(&c->system, "l", 1, &c->error);
    c->settings = (struct phys_path_settings){.size = sizeof(struct phys_path_settings),
                                              .rule = phys_rule_find("midpoint", &c->error),
                                              .slices = SLICES,
                                              .steps = 5000,
                                              .dt = 10. / (SLICES - 1),
                                              .learning_rate = 0.01};
    assert_int_equal(c->error.status, AD_OK);
}

/* The swing of this energy, as the motion has it, with a little noise between its ends. */
static void begin_on_swing(struct question *c, double energy, double path[SLICES])
{
    double q = 0, v = sqrt(2 * energy);
    phys_motion_path(&c->system, NULL, &q, &v, SLICES, c->settings.dt, path, &c->error);
    assert_int_equal(c->error.status, AD_OK);
    path[SLICES - 1] = 0;
    phys_noise_add(&(struct phys_noise){.sigma = 0.01}, &c->system, SLICES, 3, path);
}

static double largest(const double path[SLICES])
{
    double most = 0;
    for (size_t i = 0; i < SLICES; i++)
        most = fmax(most, fabs(path[i]));
    return most;
}

static size_t solve(struct question *c, const char *solver, double path[SLICES])
{
    struct phys_path_info info;
    struct phys_spectrum spectrum;
    phys_path_solve(phys_solver_find(solver, &c->error), &c->system, &c->settings, path, &info,
                    &c->error);
    phys_path_spectrum(&c->system, &c->settings, path, &spectrum, &c->error);
    assert_int_equal(c->error.status, AD_OK);
    size_t index = spectrum.index;
    phys_spectrum_free(&spectrum);
    return index;
}

static void newton_stays_on_each_swing(void **state)
{
    (void)state;
    for (size_t k = 0; k < 3; k++) {
        struct question c;
        double path[SLICES];
        question_open(&c);
        begin_on_swing(&c, swings[k].energy, path);
        assert_int_equal(solve(&c, "newton", path), swings[k].index);
        assert_close(largest(path), swings[k].largest, 0, 0.005); /* of dt^2, and between slices */
        phys_system_close(&c.system);
    }
}

/* Two of the three swings are lost to the one that is a minimum, at another energy. */
static void descents_end_on_the_minimum(void **state)
{
    (void)state;
    static const char *const descents[] = {"lbfgs", "adam"};
    for (size_t s = 0; s < 2; s++)
        for (size_t k = 0; k < 3; k++) {
            struct question c;
            double path[SLICES];
            question_open(&c);
            begin_on_swing(&c, swings[k].energy, path);
            assert_int_equal(solve(&c, descents[s], path), 0);
            assert_close(largest(path), swings[2].largest, 0, 0.01);
            phys_system_close(&c.system);
        }
}

/* --all lists them, --energy picks one. */
static void the_command_lists_the_answers(void **state)
{
    (void)state;
    static const char common[] = "$LA path pendulum --set l=1 --set theta0=0 --slices 101 --dt 0.1 "
                                 "--rule gauss4 --solver newton";
    assert_int_equal(shell("%s --all", common), 0);
    assert_mentions(shell_out(),
                    "4 0.4276690* 0.9614507* 1.7637551* 2.4399069* 1.9985450* 3.087643*");
    assert_int_equal(shell("%s --energy 1.7637 --json", common), 0);
    assert_true(shell_number("morse_index") == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(newton_stays_on_each_swing),
        cmocka_unit_test(descents_end_on_the_minimum),
        cmocka_unit_test(the_command_lists_the_answers),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
