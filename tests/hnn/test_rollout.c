/* Rollouts: against the true motion, back to the start, along the gradient of the energy, and from
   files. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/rollout/rollout.h"
#include "tests/mentions.h"

enum { POINTS = 40 };

struct world {
    struct phys_ode ode;
    double t[POINTS];
    struct hnn_rollout_settings settings;
    struct hnn_path path;
    struct hnn_rollout_info info;
    struct ad_error error;
};

static void open_task(struct world *w, const char *name, double time)
{
    *w = (struct world){0};
    const struct hnn_task *task = hnn_task_find(name, &w->error);
    assert_non_null(task);
    assert_int_equal(hnn_task_ode(task, task->published.strength, &w->ode, &w->error), AD_OK);
    hnn_times(0, time, POINTS, w->t);
    w->settings = (struct hnn_rollout_settings){
        .size = sizeof(struct hnn_rollout_settings), .n = POINTS, .t = w->t, .rtol = 1e-9};
}

static void use(struct world *w, const char *integrator, double dt)
{
    w->settings.integrator = phys_integrator_find(integrator, &w->error);
    w->settings.dt = dt;
    assert_int_equal(w->error.status, AD_OK);
}

static void roll(struct world *w, const double *x0)
{
    hnn_path_free(&w->path);
    if (hnn_rollout(&w->ode, &w->settings, x0, &w->path, &w->info, &w->error) != AD_OK)
        fail_msg("%s", w->error.message);
}

static void close_world(struct world *w)
{
    hnn_path_free(&w->path);
    phys_ode_free(&w->ode);
}

/* H = p^2 + q^2 turns the plane twice in a time pi. */
static void assert_circle(const struct hnn_path *path, double radius, double tolerance)
{
    assert_int_equal(path->n, POINTS);
    for (size_t i = 0; i < path->n; i++) {
        assert_close(path->x[2 * i], radius * cos(2 * path->t[i]), 0, tolerance);
        assert_close(path->x[2 * i + 1], -radius * sin(2 * path->t[i]), 0, tolerance);
    }
}

static void test_outputs(void **state)
{
    (void)state;
    struct world w;
    open_task(&w, "spring", 7);
    const double x0[] = {0.8, 0};
    roll(&w, x0);
    assert_circle(&w.path, 0.8, 2e-8);
    use(&w, "gauss4", 0.1); /* order 8; outputs lie between steps of 0.1 */
    roll(&w, x0);
    assert_circle(&w.path, 0.8, 2e-10);
    use(&w, "yoshida6", 0.01);
    roll(&w, x0);
    assert_circle(&w.path, 0.8, 1e-9);
    close_world(&w);
}

/* From the end back to the start: to 1e-7 at a tolerance of 1e-9, to rounding by symmetric steps.
 */
static void test_reversal_of_model(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[1], 2, 3);
    hnn_model *model = small_model(&s);
    struct world w = {0};
    hnn_times(0, 20, POINTS, w.t);
    w.settings = (struct hnn_rollout_settings){
        .size = sizeof(struct hnn_rollout_settings), .n = POINTS, .t = w.t, .reverse = true};
    assert_int_equal(hnn_model_ode(model, &w.ode, &w.error), AD_OK);
    const double x0[] = {0.4, -0.3, 0.2, 0.5};
    roll(&w, x0);
    assert_true(w.info.reversal_error < 1e-7 && w.info.evaluations > 100);
    double adaptive = w.info.reversal_error;
    for (size_t k = 0; k < 2; k++) {
        use(&w, k ? "gauss3" : "implicit-midpoint", 0.07);
        roll(&w, x0);
        assert_true(w.info.reversal_error < 1e-13 && w.info.reversal_error < adaptive);
    }
    use(&w, "rk4", 0.2); /* not symmetric: the way back is another one */
    roll(&w, x0);
    assert_true(w.info.reversal_error > 1e-12);
    close_world(&w);
    hnn_model_free(model);
}

/* Up to a circle of twice the energy, straight outwards, and on from there. */
static void test_added_energy(void **state)
{
    (void)state;
    struct world w;
    open_task(&w, "spring", 3);
    const double x0[] = {0.6, 0};
    w.settings.add = 0.36;
    w.settings.add_at = 1.3;
    w.settings.reverse = true;
    roll(&w, x0);
    for (size_t i = 0; i < w.path.n; i++) {
        double r = w.path.t[i] <= 1.3 ? 0.6 : 0.6 * sqrt(2), angle = 2 * w.path.t[i];
        assert_close(w.path.x[2 * i], r * cos(angle), 0, 1e-8);
        assert_close(w.path.x[2 * i + 1], -r * sin(angle), 0, 1e-8);
    }
    assert_true(w.info.reversal_error < 1e-7);
    assert_true(hnn_energy_drift(&w.ode, &w.path, &w.settings) < 1e-8);
    w.settings.add = -0.36 * (1 - 1e-6); /* almost all of it: down to the rest, not beyond */
    roll(&w, x0);
    assert_close(hnn_path_energy(&w.ode, &w.path, POINTS - 1), 0.36e-6, 0, 1e-9);
    close_world(&w);
}

/* Of two bodies in the plane: along the gradient in all coordinates and momenta. */
static void test_energy_of_many_coordinates(void **state)
{
    (void)state;
    struct world w;
    double x0[16];
    open_task(&w, "twobody", 1);
    hnn_task_start(hnn_task_find("twobody", &w.error), 0, 3, x0);
    w.settings.add = 0.03;
    w.settings.add_at = 0.5;
    roll(&w, x0);
    for (size_t i = 0; i < POINTS; i++)
        assert_close(hnn_path_energy(&w.ode, &w.path, i) - hnn_path_energy(&w.ode, &w.path, 0),
                     w.path.t[i] <= 0.5 ? 0 : 0.03, 0, 1e-8);
    close_world(&w);
}

static void refused(struct world *w, const double *x0, const char *why)
{
    struct ad_error error = {0};
    assert_int_not_equal(hnn_rollout(&w->ode, &w->settings, x0, &w->path, &w->info, &error), AD_OK);
    assert_mentions(error.message, why);
    assert_null(w->path.x);
}

static void test_refusals(void **state)
{
    (void)state;
    struct world w;
    open_task(&w, "spring", 3);
    const double x0[] = {0.6, 0}, rest[] = {0, 0};
    use(&w, "variational-midpoint", 0.1);
    refused(&w, x0, "Lagrangian");
    w.settings.integrator = NULL;
    w.settings.add = 0.1;
    w.settings.add_at = 3.5;
    refused(&w, x0, "time 0 3");
    w.settings.add_at = 1;
    refused(&w, rest, "gradient");
    w.ode.canonical = false;
    refused(&w, x0, "symplectic");
    w.settings.add = 0;
    w.t[5] = w.t[4];
    refused(&w, x0, "increase");
    close_world(&w);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 2);
    hnn_model *model = small_model(&s);
    assert_int_equal(hnn_model_ode(model, &w.ode, &w.error), AD_OK);
    hnn_times(0, 1, POINTS, w.t);
    use(&w, "verlet", 0.1);
    refused(&w, x0, "gauss2");
    hnn_model_free(model);
}

/* A task is its own best model: no errors but those of its tolerance; and, for spring and pendulum,
   what the published way of computing them makes of a perfect model. */
static void test_trials(void **state)
{
    (void)state;
    static const char *const names[] = {"spring", "pendulum", "twobody"};
    for (size_t k = 0; k < 3; k++) {
        struct world w;
        struct hnn_score score;
        open_task(&w, names[k], 1);
        struct hnn_trials trials = {
            .size = sizeof trials, .starts = 3, .points = 30, .time = 0.9, .seed = 5};
        assert_int_equal(
            hnn_task_trials(&w.ode, hnn_task_find(names[k], &w.error), &trials, &score, &w.error),
            AD_OK);
        assert_true(score.energy_mse < 1e-14 && score.energy_mse_published < 1e-14);
        assert_true(score.coordinate_mse < 1e-14 && score.conserved_drift < 1e-7);
        assert_true(score.evaluations > 100 && score.seconds > 0);
        close_world(&w);
    }
}

/* Spirals outwards; `context` is its pace. */
static enum ad_status spiral(void *context, double t, const double *y, double *rate,
                             struct ad_error *error)
{
    double pace = *(const double *)context;
    (void)t, (void)error;
    rate[0] = pace * (0.05 * y[0] + y[1]);
    rate[1] = pace * (0.05 * y[1] - y[0]);
    return AD_OK;
}

static struct hnn_score score_of(const char *task, double pace)
{
    struct phys_ode model = {.name = "a spiral", .n = 2, .field = spiral, .context = &pace};
    struct hnn_trials trials = {
        .size = sizeof trials, .starts = 4, .time = 5, .seed = 1, .rtol = 1e-11};
    struct hnn_score score;
    struct ad_error error = {0};
    if (hnn_task_trials(&model, hnn_task_find(task, &error), &trials, &score, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_true(isnan(score.conserved_drift));
    return score;
}

/* The published figure of a spring is the true one of a model that runs faster by 1.09, that of a
   pendulum is of another energy. */
static void test_true_and_published(void **state)
{
    (void)state;
    struct hnn_score one = score_of("spring", 1), fast = score_of("spring", 1.09);
    assert_true(one.energy_mse > 1e-3);
    assert_close(one.energy_mse_published, fast.energy_mse, 1e-7, 0);
    assert_true(fast.energy_mse > 1.05 * one.energy_mse);
    one = score_of("pendulum", 1);
    assert_true(fabs(one.energy_mse - one.energy_mse_published) > 0.01);
}

static void test_trajectory_from_file(void **state)
{
    (void)state;
    struct path file = files_write_text("trajectory.csv", "trial,t,q,p\n"
                                                          "1,0,1,2\n1,0.5,1.5,2.5\n1,1,3,4\n"
                                                          "2,0.2,5,6\n2,0.7,7,8\n");
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .state = "q,p", .time = "t"};
    struct hnn_path path;
    struct ad_error error = {0};
    /* A22: a time beyond the trajectory's end is refused, not filled with the next one */
    assert_int_equal(hnn_path_read(&s, 0.4, 4.6, &path, &error), AD_E_INPUT);
    assert_mentions(error.message, "t 1");
    error = (struct ad_error){0};
    assert_int_equal(hnn_path_read(&s, 0.4, INFINITY, &path, &error), AD_OK);
    assert_int_equal(path.n, 2);
    assert_int_equal(path.states, 2);
    assert_true(path.t[0] == 0.5 && path.x[0] == 1.5 && path.x[1] == 2.5);
    assert_true(path.t[1] == 1 && path.x[2] == 3 && path.x[3] == 4);
    hnn_path_free(&path);
    assert_int_equal(hnn_path_read(&s, -INFINITY, 0.6, &path, &error), AD_OK);
    assert_int_equal(path.n, 2);
    assert_true(path.t[0] == 0 && path.t[1] == 0.5);
    hnn_path_free(&path);
    assert_int_equal(hnn_path_read(&s, 3, 2, &path, &error), AD_E_INPUT);
    assert_mentions(error.message, "rows trajectory 3 5");
    error = (struct ad_error){0};
    s.time = NULL;
    assert_int_equal(hnn_path_read(&s, 0, 1, &path, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "time column");
}

/* What a model has seen goes with it into its file; a path beyond it is found. */
static void test_range(void **state)
{
    (void)state;
    struct hnn_settings settings = small_settings(&small_kinds[1], 1, 3);
    struct ad_error error = {0};
    hnn_model *model = small_model(&settings), *loaded = NULL;
    const double x[] = {-0.5, 0.25, 0.75, /* q */ 1.5, -2, 0.125 /* p */};
    struct path file = files_temporary("seen.h5");
    assert_null(hnn_model_range(model).low);
    assert_int_equal(hnn_model_see(model, 3, x, &error), AD_OK);
    assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
    assert_int_equal(hnn_model_load(file.text, &loaded, &error), AD_OK);
    struct hnn_range seen = hnn_model_range(loaded);
    assert_true(seen.low[0] == -0.5 && seen.high[0] == 0.75);
    assert_true(seen.low[1] == -2 && seen.high[1] == 1.5);
    for (size_t k = 0; k < 3; k++) {
        double H = hnn_model_energy(model, (double[]){x[k], x[3 + k]});
        double rounding = 1e-14 * (1 + fabs(H)); /* sums of one state and of three at once */
        assert_true(H >= seen.low[2] - rounding && H <= seen.high[2] + rounding);
    }
    double t[] = {0, 1}, inside[] = {0.25, -2, 0.25, -2}, away[] = {0.25, -2, 0.25, 40};
    char what[120] = "";
    struct hnn_path path = {.states = 2, .n = 2, .t = t, .x = inside};
    assert_int_equal(hnn_path_outside(loaded, &path, what, sizeof what), 2);
    path.x = away;
    assert_int_equal(hnn_path_outside(loaded, &path, what, sizeof what), 1);
    assert_mentions(what, "training");
    hnn_model_free(model);
    hnn_model_free(loaded);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_outputs),
        cmocka_unit_test(test_reversal_of_model),
        cmocka_unit_test(test_added_energy),
        cmocka_unit_test(test_energy_of_many_coordinates),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_trials),
        cmocka_unit_test(test_true_and_published),
        cmocka_unit_test(test_trajectory_from_file),
        cmocka_unit_test(test_range),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
