/* C14: an interruption is one status, AD_E_ACCURACY, and one word, wherever `proceed` returns
 * false. */
#include "physics/physics.h"
#include "physics/fit/fit.h"
#include "physics/modes/modes.h"
#include "physics/path/ranks/path_ranks.h"
#include "physics/stability/periodic.h"
#include "physics/stability/stability.h"
#include "tests/close.h"
#include "tests/mentions.h"

static struct phys_system pendulum;
static const double start[] = {1, 0};
static const double times[] = {0, 1, 2};

static bool proceed(void *calls) { return (*(int *)calls)-- > 0; }

static void measure_exponent(void *calls, struct ad_error *error)
{
    const struct phys_lyapunov_settings how = {.size = sizeof how,
                                               .t1 = 9,
                                               .known = 1e-10,
                                               .lost = 1,
                                               .proceed = proceed,
                                               .context = calls};
    struct phys_lyapunov result;
    struct phys_ode ode = {0};
    double y[2];
    phys_ode_lagrangian(&pendulum, &ode, error);
    phys_ode_enter(&ode, 0, start, start + 1, y, error);
    phys_lyapunov(&ode, y, &how, &result, error);
    phys_ode_free(&ode);
}

static const struct phys_lyapunov_settings *to_nine(void *calls)
{
    static struct phys_lyapunov_settings how;
    how = (struct phys_lyapunov_settings){
        .size = sizeof how, .t1 = 9, .proceed = proceed, .context = calls};
    return &how;
}

static void measure_spectrum(void *calls, struct ad_error *error)
{
    double exponents[2], spread[2];
    phys_lyapunov_spectrum(&pendulum, start, to_nine(calls), 2, exponents, spread, error);
}

static void find_transition(void *calls, struct ad_error *error)
{
    double matrix[4], uncertainty[4];
    phys_transition(&pendulum, start, to_nine(calls), matrix, uncertainty, error);
}

static void find_periodic(void *calls, struct ad_error *error)
{
    const struct phys_periodic_settings how = {
        .size = sizeof how, .x = start, .period = 90, .proceed = proceed, .context = calls};
    struct phys_periodic found = {0};
    phys_periodic_find(&pendulum, &how, &found, error);
    phys_periodic_free(&found);
}

static void fit(void *calls, struct ad_error *error)
{
    const double x[] = {1, 0, 1, -.05, .9, -.1};
    const struct phys_fit_data data = {.size = sizeof data, .n = 3, .t = times, .x = x};
    const struct phys_fit_settings how = {.size = sizeof how,
                                          .n_free = 1,
                                          .free = (const char *const[]){"l"},
                                          .proceed = proceed,
                                          .context = calls};
    struct phys_fit found = {0};
    phys_fit_solve(&pendulum, &data, &how, &found, error);
    phys_fit_free(&found);
}

static void find_equilibria(void *calls, struct ad_error *error)
{
    const struct phys_equilibria_settings how = {
        .size = sizeof how, .proceed = proceed, .context = calls};
    struct phys_equilibria found = {0};
    phys_equilibria_find(&pendulum, &how, &found, error);
    phys_equilibria_free(&found);
}

static void follow_reference(void *calls, struct ad_error *error)
{
    struct phys_reference reference = {0};
    phys_reference(&pendulum, start, start + 1, 3, times, .1, proceed, calls, &reference, error);
    phys_reference_free(&reference);
}

static void refine(void *calls, struct ad_error *error)
{
    struct phys_path_settings how = phys_path_defaults(&pendulum);
    struct phys_refined refined = {0};
    how.slices = 3;
    how.proceed = proceed;
    how.context = calls;
    phys_path_refine(&pendulum, &how, (const double[]){0, .1, .3}, 0, 1e-9, &refined, error);
    phys_refined_free(&refined);
}

static void continue_path(void *calls, struct ad_error *error)
{
    struct phys_path_settings how = phys_path_defaults(&pendulum);
    const struct phys_continuation g = {.size = sizeof g, .name = "g", .from = 9, .to = 10};
    struct phys_refined refined = {0};
    struct phys_continued continued = {0};
    how.slices = 3;
    how.proceed = proceed;
    how.context = calls;
    phys_path_continue(&pendulum, &how, (const double[]){0, .1, .3}, 0, 1e-9, &g, &refined,
                       &continued, error);
    phys_refined_free(&refined);
    phys_continued_free(&continued);
}

static void start_on_ranks(void *calls, struct ad_error *error)
{
    struct phys_path_settings how = phys_path_defaults(&pendulum);
    double path[9];
    how.slices = 9;
    how.proceed = proceed;
    how.context = calls;
    phys_path_ranks_start(NULL, &pendulum, &how, 1, false, NULL, path, error);
}

static void test_interrupted(void **state)
{
    static const struct {
        const char *name;
        void (*run)(void *calls, struct ad_error *error);
    } rows[] = {{"exponent", measure_exponent},
                {"spectrum", measure_spectrum},
                {"transition", find_transition},
                {"periodic", find_periodic},
                {"fit", fit},
                {"equilibria", find_equilibria},
                {"reference", follow_reference},
                {"refine", refine},
                {"continue", continue_path},
                {"start on ranks", start_on_ranks}};
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (int calls = 0; calls < 3; calls++) {
            struct ad_error error = {0};
            int left = calls;
            rows[k].run(&left, &error);
            if (error.status != AD_E_ACCURACY || !mentions(error.message, "interrupted"))
                fail_msg("%s after %d: %d, %s", rows[k].name, calls, error.status, error.message);
        }
}

int main(void)
{
    struct ad_error error = {0};
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_interrupted)};
    if (phys_system_open("pendulum", &pendulum, &error) != AD_OK)
        return 1;
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    phys_system_close(&pendulum);
    return failed;
}
