/* Events of the driver: roots of functions of the state, in order, at the ends of steps, by
 * direction. */
#include "tests/close.h"
#include "tests/physics/motion.h"

struct roots {
    size_t n, stop_at;
    double t[64];
    size_t which[64];
};

static void two_functions(void *context, double t, const double *y, double *g)
{
    (void)context, (void)t;
    g[0] = y[0];       /* cos t */
    g[1] = y[1] + 0.5; /* 0.5 - sin t */
}

static bool keep_root(void *context, size_t k, double t, const double *y)
{
    struct roots *r = context;
    double g[2];
    two_functions(NULL, t, y, g);
    assert_close(g[k], 0, 0, 1e-9);
    r->t[r->n] = t;
    r->which[r->n++] = k;
    return r->n != r->stop_at;
}

/* All roots, in the order of time, by methods with long and with short steps. */
static void test_events(void **state)
{
    (void)state;
    static const double roots[] = {M_PI / 6, M_PI / 2, 5 * M_PI / 6, 3 * M_PI / 2};
    static const size_t which[] = {1, 0, 1, 0};
    static const struct {
        const char *name;
        double step, error;
    } methods[] = {{"dop853", 1e-12, 1e-10}, {"dopri5", 1e-11, 1e-9}, {"rk4", 0.01, 1e-8}};
    for (size_t k = 0; k < 3; k++) {
        struct roots found = {0};
        const struct phys_events events = {
            .n = 2, .values = two_functions, .found = keep_root, .context = &found};
        struct motion m;
        motion_open(&m, "spring", false, NULL);
        m.settings.events = &events;
        m.settings.n_events = 1;
        motion_run(&m, methods[k].name, methods[k].step, 4 * M_PI, AD_OK);
        assert_int_equal(found.n, 8);
        for (size_t i = 0; i < found.n; i++) {
            assert_close(found.t[i], roots[i % 4] + (i < 4 ? 0 : 2 * M_PI), 0, methods[k].error);
            assert_int_equal(found.which[i], which[i % 4]);
        }
        motion_close(&m);
    }
}

/* A ball that passes a height within a step and comes back to it exactly where the step ends, where
   the next step begins: x = -(t - 1)(t - 3)/2 in steps of 3, on which Verlet is exact. */
static void height(void *context, double t, const double *y, double *g)
{
    (void)context, (void)t;
    g[0] = y[0];
}

static bool keep_time(void *context, size_t k, double t, const double *y)
{
    struct roots *r = context;
    (void)y;
    r->which[r->n] = k;
    r->t[r->n++] = t;
    return true;
}

static void test_event_at_the_end_of_a_step(void **state)
{
    (void)state;
    static const struct phys_setting thrown[] = {{"x0", -1.5}, {"v0", 2}, {"g", 1}, {NULL, 0}};
    for (int direction = -1; direction <= 1; direction++) {
        struct roots found = {0};
        const struct phys_events events = {.n = 1,
                                           .values = height,
                                           .direction = direction,
                                           .found = keep_time,
                                           .context = &found};
        struct motion m;
        motion_open(&m, "freebody", false, thrown);
        m.settings.events = &events;
        m.settings.n_events = 1;
        motion_run(&m, "verlet", 3, 9, AD_OK);
        assert_true(m.info.steps == 3);
        size_t i = 0;
        if (direction >= 0)
            assert_close(found.t[i++], 1, 1e-14, 0);
        if (direction <= 0)
            assert_close(found.t[i++], 3, 1e-14, 0);
        assert_int_equal(found.n, i);
        motion_close(&m);
    }
}

/* Directions; backwards, what falls with time is met from the other side. */
static void test_event_directions(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2)
        for (int direction = -1; direction <= 1; direction += 2) {
            struct roots found = {0};
            const struct phys_events events = {.n = 2,
                                               .values = two_functions,
                                               .direction = direction,
                                               .found = keep_root,
                                               .context = &found};
            struct motion m;
            motion_open(&m, "spring", false, NULL);
            m.settings.events = &events;
            m.settings.n_events = 1;
            motion_run(&m, "dop853", 1e-12, sign * 2 * M_PI, AD_OK);
            assert_int_equal(found.n, 2);
            for (size_t i = 0; i < 2; i++) {
                double t = found.t[i], slope = found.which[i] == 0 ? -sin(t) : -cos(t);
                assert_true(slope * direction > 0);
            }
            motion_close(&m);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_events),
        cmocka_unit_test(test_event_directions),
        cmocka_unit_test(test_event_at_the_end_of_a_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
