/* Boxes, advice and whole runs of packets. */
#include "quantum/run.h"
#include "waves.h"

#include <complex.h>

static void open_spring(struct phys_system *system)
{
    struct ad_error error = {0};
    phys_system_open("spring", system, &error);
    assert_no_error(&error);
}

/* The potential at the walls is above the energy of the packet's fastest part. */
static void box_holds_the_motion(void **state)
{
    (void)state;
    const struct qm_gaussian packet = {1.5, 0.5, 2};
    struct phys_system system;
    double low, high;
    open_spring(&system);
    qm_box(&system, 1, &packet, &low, &high);
    double speed = 2 + 1 / 0.5, energy = 2.5 * 2.5 / 2 + speed * speed / 2;
    assert_true(low < packet.x && packet.x < high);
    assert_true(low * low / 2 > energy && high * high / 2 > energy);
    assert_true(high - low < 40 * packet.sigma);
    struct qm_slice box = {.size = sizeof box, .grid = {low, high, 100}},
                    half = {.grid = {packet.x, high, 100}};
    assert_close(qm_inside(&box, &packet), 1, 0, 1e-9);
    assert_close(qm_inside(&half, &packet), 0.5, 0, 1e-9);
    half.walls = QM_RING;
    half.grid.high = packet.x + 4 * packet.sigma;
    assert_close(qm_inside(&half, &packet), erf(M_SQRT2), 1e-14, 0);
    assert_true(isnan(qm_inside(NULL, &packet)) && isnan(qm_aliasing_advice(NULL, NULL).dt));
    qm_box(NULL, 1, &packet, &low, &high);
    assert_true(isnan(low) && isnan(high));
    phys_system_close(&system);
}

/* A19: around a ring a packet is wound, wherever the ring is cut: at the cut or turns away it is
 * the same. */
static void rings_have_no_seam(void **state)
{
    (void)state;
    static const struct qm_gaussian packets[] = {
        {M_PI, 1.2, 0.5}, {-M_PI, 1.2, 0.5}, {7 * M_PI, 1.2, 0.5}};
    enum { N = 64 };
    struct phys_system system = system_with("pendulum", 1, (struct parameter[]){{"l", 1}});
    struct ad_error error = {0};
    const struct qm_slice slice = {.size = sizeof slice,
                                   .system = &system,
                                   .grid = {-M_PI, M_PI, N},
                                   .walls = QM_RING,
                                   .dt = 0.1,
                                   .hbar = 1};
    struct qm_run_settings run = {.size = sizeof run,
                                  .slice = &slice,
                                  .method = &qm_method_fft,
                                  .packet = packets,
                                  .packets = 3,
                                  .steps = 1,
                                  .every = 1,
                                  .reference = true};
    struct qm_run_result result;
    qm_run(&run, &result, &error);
    assert_no_error(&error);
    assert_true(result.error < 1e-3);
    for (size_t k = 0; k < 3; k++)
        assert_close(result.moments[k].norm, 1, 1e-12, 0);
    for (size_t a = 0; a < N; a++)
        for (size_t k = 1; k < 3; k++)
            assert_close(cabs(result.psi[3 * a + k] - result.psi[3 * a]), 0, 0, 1e-12);
    qm_run_free(&result);
    /* wide ones: a momentum that fits the ring is a wave of norm 1, others cancel */
    static const struct {
        struct qm_gaussian packet;
        enum ad_status status;
    } wide[] = {{{1, 20, 1}, AD_OK},
                {{1, 20, 0.5}, AD_E_ARGUMENT},
                {{1, 200, 1}, AD_E_ARGUMENT},
                {{1, 200, 0.5}, AD_E_ARGUMENT}};
    for (size_t k = 0; k < LENGTH(wide); k++) {
        struct qm_run_settings one = run;
        struct ad_error refused = {0};
        one.packet = &wide[k].packet;
        one.packets = 1;
        one.reference = false;
        assert_int_equal(qm_run(&one, &result, &refused), wide[k].status);
        if (wide[k].status == AD_OK)
            assert_close(result.moments[0].norm, 1, 1e-12, 0);
        qm_run_free(&result);
    }
    /* cut on the other side, the points are the same */
    struct qm_run_settings other = run;
    struct qm_run_result turned;
    struct qm_slice moved = slice;
    moved.grid = (struct qm_grid){0, 2 * M_PI, N};
    other.slice = &moved;
    qm_run(&run, &result, &error);
    qm_run(&other, &turned, &error);
    assert_no_error(&error);
    for (size_t a = 0; a < N; a++)
        assert_close(cabs(turned.psi[3 * a] - result.psi[3 * ((a + N / 2) % N)]), 0, 0, 1e-10);
    qm_run_free(&result);
    qm_run_free(&turned);
    phys_system_close(&system);
}

/* What is advised does not alias, each alone. */
static void advice_does(void **state)
{
    (void)state;
    struct phys_system system;
    struct qm_aliasing aliasing;
    struct ad_error error = {0};
    open_spring(&system);
    const struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-6, 6, 100}, .dt = 0.05, .hbar = 1};
    struct qm_slice with[3] = {slice, slice, slice};
    qm_aliasing(&slice, &aliasing, &error);
    assert_no_error(&error);
    assert_true(aliasing.ratio > 1.5);
    struct qm_advice advice = qm_aliasing_advice(&slice, &aliasing);
    with[0].dt = advice.dt;
    with[1].grid.n = (size_t)advice.points;
    with[2].grid = (struct qm_grid){-advice.box / 2, advice.box / 2, 0};
    with[2].grid.n = (size_t)(advice.box / qm_dx(&slice.grid));
    for (size_t k = 0; k < 3; k++) {
        qm_aliasing(&with[k], &aliasing, &error);
        assert_no_error(&error);
        assert_true(aliasing.ratio <= 1.02);
    }
    phys_system_close(&system);
}

static bool count(void *context, size_t slice)
{
    size_t *last = context;
    *last = slice;
    return slice < 5;
}

static const struct qm_gaussian packets[2] = {{1, 0.7, 0}, {-1, 0.7, 1}};

static struct qm_run_settings run_of(const struct phys_system *system, struct qm_slice *slice)
{
    *slice = (struct qm_slice){
        .size = sizeof *slice, .system = system, .grid = {-7, 7, 400}, .dt = 0.2, .hbar = 1};
    return (struct qm_run_settings){.size = sizeof(struct qm_run_settings),
                                    .slice = slice,
                                    .method = &qm_method_kernel,
                                    .steps = 8,
                                    .every = 3,
                                    .packets = 2,
                                    .packet = packets,
                                    .reference = true};
}

static void samples_and_error(void **state)
{
    (void)state;
    struct phys_system system;
    struct qm_run_result result, leapt;
    struct ad_error error = {0};
    open_spring(&system);
    struct qm_slice slice;
    struct qm_run_settings run = run_of(&system, &slice);
    qm_run(&run, &result, &error);
    assert_no_error(&error);
    assert_int_equal(result.n, 4); /* 0, 3, 6, 8 */
    assert_close(result.t[3], 1.6, 1e-14, 0);
    assert_close(result.moments[0].norm, 1, 0, 1e-9);
    assert_close(result.classical[3], cos(1.6), 1e-6, 0);
    assert_close(result.moments[6].mean_x, cos(1.6), 0, 5e-3);
    assert_close(result.moments[7].mean_x, -cos(1.6) + sin(1.6), 0, 1e-2);
    assert_true(result.error > 0 && result.error < 0.02);
    run.leap = true; /* one slice of eight */
    run.power = 3;
    qm_run(&run, &leapt, &error);
    assert_no_error(&error);
    assert_int_equal(leapt.n, 2);
    for (size_t k = 0; k < 2 * 400; k++)
        assert_true(cabs(leapt.psi[k] - result.psi[k]) < 1e-9);
    qm_run_free(&leapt);
    qm_run_free(&result);
    phys_system_close(&system);
}

static void stopped_on_the_way(void **state)
{
    (void)state;
    struct phys_system system;
    struct qm_run_result result;
    struct ad_error error = {0};
    size_t last = 0;
    open_spring(&system);
    struct qm_slice slice;
    struct qm_run_settings run = run_of(&system, &slice);
    run.progress = count;
    run.context = &last;
    qm_run(&run, &result, &error);
    assert_no_error(&error);
    assert_int_equal(last, 5);
    assert_true(result.stopped && isnan(result.error));
    assert_int_equal(result.n, 3); /* 0, 3, 5 */
    assert_close(result.t[2], 1, 1e-14, 0);
    qm_run_free(&result);
    qm_run_free(&result);
    const struct qm_gaussian flat[] = {run.packet[0], {.sigma = 0}};
    run.packets = 2;
    run.packet = flat;
    assert_int_equal(qm_run(&run, &result, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "packet 2"));
    error = (struct ad_error){0};
    run.packets = 0;
    assert_int_equal(qm_run(&run, &result, &error), AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(qm_run(NULL, &result, &error), AD_E_ARGUMENT);
    qm_run_free(&result);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_holds_the_motion), cmocka_unit_test(rings_have_no_seam),
        cmocka_unit_test(advice_does),          cmocka_unit_test(samples_and_error),
        cmocka_unit_test(stopped_on_the_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
