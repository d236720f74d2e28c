/* Models as scenes: L against a closed form, motions against rollouts of the same model, what is no
   scene. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/rollout/rollout.h"
#include "physics/physics.h"

#include <stdlib.h>
#include <string.h>

enum { TERMS = 4, COORDINATES = 5 };

/* A sum of cosines, weight cos(a q1 + b q2 + c p1 + d p2), as a network of sines, of states that
   are centre + scale x, in units of energy that hnn_model_normalise chooses. */
static hnn_model *cosines(size_t dof, const double factor[][5], bool normalised)
{
    const double centre[4] = {0.3, -0.2, 0.1, 0.05}, scale[4] = {2, 0.7, 1.3, 0.6},
                 rate[4] = {1.5, 3, 0.4, 2};
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, dof);
    struct ad_error error = {0};
    size_t m = 2 * dof;
    s.layers = 2;
    s.hidden[0] = TERMS;
    s.activation = "sine";
    s.precision = AD_F64;
    hnn_model *model = small_model(&s);
    double values[TERMS * 6], energy = 1;
    for (size_t k = 0; k < TERMS; k++) {
        values[TERMS * m + k] = M_PI / 2;
        values[TERMS * (m + 1) + k] = factor[k][0];
        for (size_t r = 0; r < m; r++) {
            double a = factor[k][1 + r];
            values[k * m + r] = normalised ? a * scale[r] : a;
            values[TERMS * m + k] += normalised ? a * centre[r] : 0;
        }
    }
    if (normalised) {
        assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
        for (size_t r = 0; r < m; r++)
            energy *= pow(rate[r] * scale[(r + dof) % m], 1 / (double)m);
        for (size_t k = 0; k < TERMS; k++)
            values[TERMS * (m + 1) + k] /= energy;
    }
    hnn_model_set_parameters(model, values);
    double *x = small_values(5, m, 50);
    assert_int_equal(hnn_model_see(model, 50, x, &error), AD_OK);
    free(x);
    return model;
}

static const double one[TERMS][5] = {{-1, 0, 1}, {-1, 1, 0}};
static const double two[TERMS][5] = {
    {-1, 0, 0, 1, 0}, {-1, 0, 0, 0, 1}, {-0.3, 0, 0.4, 1, 1}, {-1, 1, -0.6, 0, 0}};

/* H = sum of -cos p - .5 cos(q_next - q) - .3 cos q over sites. */
static hnn_model *ring(size_t sites)
{
    static const double values[] = {0, 1, 0,        0,        0,        1, 1,  0,    0,    0,
                                    0, 0, M_PI / 2, M_PI / 2, M_PI / 2, 0, -1, -0.5, -0.3, 0};
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, sites);
    struct ad_error error = {0};
    s.layers = 2;
    s.hidden[0] = TERMS;
    s.activation = "sine";
    s.precision = AD_F64;
    s.lattice = HNN_RING;
    hnn_model *model = small_model(&s);
    assert_int_equal(hnn_model_size(model), LENGTH(values));
    hnn_model_set_parameters(model, values);
    double *x = small_values(5, 2 * sites, 50);
    assert_int_equal(hnn_model_see(model, 50, x, &error), AD_OK);
    free(x);
    return model;
}

/* The scene of a model, which is saved and freed. */
static struct phys_system as_scene(hnn_model *model)
{
    struct path file = files_temporary("model.h5");
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
    hnn_model_free(model);
    if (hnn_system_open(file.text, &system, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_non_null(hnn_system_model(&system));
    return system;
}

/* ---- the Legendre transform ---- */

/* H = -cos p - cos q: v = sin p, L = v asin v + sqrt(1 - v^2) + cos q, a = -sin q sqrt(1 - v^2). */
static void test_closed_form(void **state)
{
    (void)state;
    enum { N = 9 };
    for (int normalised = 0; normalised < 2; normalised++) {
        struct phys_system system = as_scene(cosines(1, one, normalised));
        struct ad_error error = {0};
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var in[3] = {ad_input(tape, 1, N, "q"), ad_input(tape, 1, N, "v"),
                        ad_input(tape, 1, N, "t")};
        ad_var L = phys_system_lagrangian(&system, in[0], in[1], in[2]), g[2], second, third;
        ad_grad(L, 2, in, g);
        ad_grad(g[1], 1, &in[1], &second);
        ad_grad(second, 1, &in[1], &third);
        double q[N], v[N], t[N] = {0}, y[N];
        for (int k = 0; k < N; k++) {
            q[k] = 1.7 * sin(1 + 2.3 * k);
            v[k] = 0.8 * sin(2 + 1.9 * k);
        }
        const double *const at[] = {q, v, t};
        const ad_var out[] = {L, g[0], g[1], second, third};
        for (size_t d = 0; d < LENGTH(out); d++) {
            assert_int_equal(ad_evaluate(3, in, at, out[d], y, &error), AD_OK);
            for (int k = 0; k < N; k++) {
                double c = 1 - v[k] * v[k];
                const double is[] = {v[k] * asin(v[k]) + sqrt(c) + cos(q[k]), -sin(q[k]),
                                     asin(v[k]), 1 / sqrt(c), v[k] / (c * sqrt(c))};
                assert_close(y[k], is[d], 1e-10, 1e-11);
            }
        }
        phys_motion *motion;
        double a;
        assert_int_equal(phys_motion_new(&system, &motion, &error), AD_OK);
        assert_int_equal(
            phys_motion_acceleration(motion, (double[]){0.9}, (double[]){0.7}, 0, &a, &error),
            AD_OK);
        assert_close(a, -sin(0.9) * sqrt(1 - 0.49), 1e-12, 0);
        /* no p has that velocity */
        assert_int_equal(
            phys_motion_acceleration(motion, (double[]){0.9}, (double[]){1.2}, 0, &a, &error),
            AD_E_NONFINITE);
        phys_motion_free(motion);
        ad_tape_free(tape);
        phys_system_close(&system);
    }
}

/* ---- motions ---- */

/* Time, a parameter, a control; the last two are constant. */
static const double given[] = {0.7, -0.4};

static enum ad_status drive(void *context, double t, double *u, struct ad_error *error)
{
    (void)context;
    u[0] = t;
    memcpy(u + 1, given, sizeof given);
    return error->status;
}

static void give_inputs(struct phys_system *system)
{
    struct ad_error error = {0};
    if (!hnn_model_settings(hnn_system_model(system))->inputs)
        return;
    assert_int_equal(phys_system_set(system, "u2", given[0], &error), AD_OK);
    assert_int_equal(phys_system_set(system, "u3", given[1], &error), AD_OK);
}

/* The scene in (q, p) has the model's own rates, and leads to its velocities and back. */
static void compare_momenta(const struct phys_system *system, struct hnn_path *path,
                            double velocity[][COORDINATES])
{
    const size_t n = system->dof;
    struct ad_error error = {0};
    struct phys_ode canonical;
    double rate[2 * COORDINATES], own[2 * COORDINATES], q[COORDINATES], v[COORDINATES],
        y[2 * COORDINATES];
    assert_int_equal(phys_ode_canonical(system, &canonical, &error), AD_OK);
    for (size_t i = 0; i < path->n; i++) {
        const double *x = path->x + 2 * n * i;
        struct phys_ode ode;
        assert_int_equal(hnn_model_ode(hnn_system_model(system), &ode, &error), AD_OK);
        assert_int_equal(ode.field(ode.context, path->t[i], x, own, &error), AD_OK);
        assert_int_equal(canonical.field(canonical.context, path->t[i], x, rate, &error), AD_OK);
        assert_int_equal(phys_ode_leave(&canonical, path->t[i], x, q, v, &error), AD_OK);
        assert_int_equal(phys_ode_enter(&canonical, path->t[i], q, v, y, &error), AD_OK);
        for (size_t k = 0; k < 2 * n; k++) {
            assert_close(rate[k], own[k], 1e-12, 1e-12);
            assert_close(y[k], x[k], 1e-9, 1e-9);
        }
        for (size_t k = 0; k < n; k++)
            assert_close(v[k], velocity[i][k], 1e-9, 1e-9);
        phys_ode_free(&ode);
    }
    phys_ode_free(&canonical);
}

/* By Hamilton's equations, or the model's own accelerations, against those of its L. */
static void compare_motions(hnn_model *model, const double *x0)
{
    enum { N = 5 };
    struct ad_error error = {0};
    struct phys_ode own, scene;
    struct hnn_path a, b;
    double t[N], rate[2 * COORDINATES], start[2 * COORDINATES], x[2 * COORDINATES];
    size_t n = hnn_model_settings(model)->dof;
    bool momenta = hnn_model_settings(model)->kind == HNN_HAMILTONIAN;
    hnn_times(0, 2, N, t);
    const struct hnn_rollout_settings how = {.size = sizeof how, .rtol = 1e-13, .n = N, .t = t};
    hnn_model_drive(model, &(struct hnn_drive){drive, NULL, true, NULL});
    assert_int_equal(hnn_model_ode(model, &own, &error), AD_OK);
    assert_int_equal(hnn_rollout(&own, &how, x0, &a, NULL, &error), AD_OK);
    double velocity[N][COORDINATES];
    for (size_t i = 0; i < N; i++) {
        assert_int_equal(own.field(own.context, t[i], a.x + 2 * n * i, rate, &error), AD_OK);
        memcpy(velocity[i], rate, n * sizeof *rate);
    }
    struct phys_system system = as_scene(model);
    give_inputs(&system);
    assert_int_equal(phys_ode_lagrangian(&system, &scene, &error), AD_OK);
    memcpy(start, x0, n * sizeof *x0);
    memcpy(start + n, velocity[0], n * sizeof *x0);
    if (hnn_rollout(&scene, &how, start, &b, NULL, &error) != AD_OK)
        fail_msg("%s", error.message);
    for (size_t i = 0; i < N; i++) {
        memcpy(x, b.x + 2 * n * i, 2 * n * sizeof *x);
        for (size_t k = 0; k < n; k++) {
            assert_close(x[k], a.x[2 * n * i + k], 1e-9, 1e-9);
            assert_close(x[n + k], velocity[i][k], 1e-9, 1e-9);
        }
    }
    if (momenta) { /* L_v is p */
        phys_legendre *legendre;
        double p[COORDINATES];
        assert_int_equal(phys_legendre_new(&system, &legendre, &error), AD_OK);
        phys_legendre_momentum(legendre, x, x + n, t[N - 1], p, NULL);
        for (size_t k = 0; k < n; k++)
            assert_close(p[k], a.x[2 * n * (N - 1) + n + k], 1e-9, 1e-9);
        phys_legendre_free(legendre);
        compare_momenta(&system, &a, velocity);
    }
    hnn_path_free(&a);
    hnn_path_free(&b);
    phys_ode_free(&own);
    phys_ode_free(&scene);
    phys_system_close(&system);
}

static void test_motions(void **state)
{
    (void)state;
    static const double x0[] = {0.6, -0.4, 0.3, 0.2};
    compare_motions(cosines(1, one, true), (double[]){0.6, 0.3});
    compare_motions(cosines(2, two, true), x0);
    compare_motions(ring(COORDINATES),
                    (double[]){0.6, -0.4, 0.3, 0.2, 0.5, 0.1, 0.4, -0.3, 0.2, -0.2});
    for (size_t k = 0; k < small_n_kinds; k++) {
        if (small_kinds[k].kind != HNN_LAGRANGIAN)
            continue;
        struct hnn_settings s = small_settings(&small_kinds[k], 2, 3);
        hnn_model *model = small_model(&s);
        struct ad_error error = {0};
        assert_int_equal(hnn_model_normalise(model, (double[]){0.1, 0.2, 0.1, -0.1},
                                             (double[]){1.2, 0.8, 1.1, 0.9}, (double[]){1, 2, 1, 1},
                                             &error),
                         AD_OK);
        compare_motions(model, x0);
    }
}

/* H = -cos p - .3 cos(q + t/2) + .2 sin(q + g), and a force .3 u; and Lagrangian networks. */
static void test_inputs(void **state)
{
    (void)state;
    enum { ROWS = 5 };
    struct ad_error error = {0};
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    s.layers = 2;
    s.hidden[0] = 3;
    s.activation = "sine";
    s.precision = AD_F64;
    s.inputs = 3;
    s.controls = 1;
    s.time = true;
    hnn_model *model = small_model(&s);
    const double turn = -M_PI / 2;
    const double values[] = {0,    0,    0, 1, 1,   0.5, 0,
                             0,    1,    0, 1, 0, /* of q, t, g, p */
                             turn, turn, 0, 1, 0.3, 0.2, /* G */ 0.3};
    assert_int_equal(hnn_model_size(model), LENGTH(values));
    hnn_model_set_parameters(model, values);
    double *x = small_values(5, ROWS, 50);
    assert_int_equal(hnn_model_see(model, 50, x, &error), AD_OK);
    compare_motions(model, (double[]){0.6, 0.3});
    for (size_t k = 0; k < small_n_kinds; k++) {
        if (small_kinds[k].kind != HNN_LAGRANGIAN)
            continue;
        s = small_settings(&small_kinds[k], 1, 3);
        s.inputs = 3;
        s.controls = 1;
        s.time = true;
        s.control_network = k % 2;
        model = small_model(&s);
        assert_int_equal(hnn_model_normalise(model, (double[]){0.1, 0.2, 0.1, -0.1, 2},
                                             (double[]){1.2, 0.8, 1.1, 0.9, 3}, (double[]){1, 2},
                                             &error),
                         AD_OK);
        compare_motions(model, (double[]){0.6, 0.3});
    }
    free(x);
}

/* A control by a table, linear or held: accelerations of the scene are the model's own; none
 * beyond. */
static void test_table(void **state)
{
    (void)state;
    static double t[] = {0, 0.4, 0.5, 1.3}, u[] = {0.7, -0.4, 1.1, 0.2};
    const struct hnn_path table = {.n = 4, .t = t, .inputs = 1, .u = u};
    struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, 1);
    s.hidden[0] = s.hidden[1] = 5;
    s.precision = AD_F64;
    s.inputs = 3;
    s.controls = 1;
    s.time = true;
    for (int hold = 0; hold < 2; hold++) {
        struct ad_error error = {0};
        struct hnn_inputs inputs = {
            .n = 3,
            .table = &table,
            .hold = hold,
            .input = {{HNN_INPUT_TIME, 0, 0}, {HNN_INPUT_VALUE, 0.7, 0}, {HNN_INPUT_COLUMN, 0, 0}}};
        const struct hnn_drive by = {hnn_inputs_at, &inputs, false, hnn_inputs_record};
        hnn_model *model = small_model(&s), *same = small_model(&s);
        struct phys_ode own, scene;
        struct phys_system system = as_scene(model);
        hnn_model_drive(same, &by);
        assert_int_equal(phys_system_set(&system, "u2", 0.7, &error), AD_OK);
        assert_int_equal(hnn_system_drive(&system, &by, &error), AD_OK);
        assert_int_equal(hnn_model_ode(same, &own, &error), AD_OK);
        assert_int_equal(phys_ode_lagrangian(&system, &scene, &error), AD_OK);
        for (size_t k = 0; k < 14; k++) {
            double at = k < 4 ? t[k] : 0.13 * (double)(k - 4), y[] = {0.3, -0.6}, a[2], b[2];
            assert_int_equal(own.field(own.context, at, y, a, &error), AD_OK);
            assert_int_equal(scene.field(scene.context, at, y, b, &error), AD_OK);
            assert_close(b[1], a[1], 1e-12, 1e-12);
        }
        assert_true(scene.field(scene.context, 1.31, (double[]){0.3, -0.6}, (double[2]){0},
                                &error) == AD_E_NONFINITE);
        error = (struct ad_error){0};
        assert_null(hnn_inputs_record(&inputs, 1, (ad_var){0}).tape);
        phys_ode_free(&own);
        phys_ode_free(&scene);
        phys_system_close(&system);
        hnn_model_free(same);
        assert_int_equal(phys_system_open("spring", &system, &error), AD_OK);
        assert_int_equal(hnn_system_drive(&system, &by, &error), AD_E_ARGUMENT);
        phys_system_close(&system);
    }
}

/* Variations need third derivatives of L: against two motions that start apart. */
static void test_variations(void **state)
{
    (void)state;
    enum { N = 2 };
    static const double d = 1e-5;
    struct ad_error error = {0};
    struct phys_ode variations, ode;
    struct hnn_path path, side[2];
    double t[N] = {0, 1.5}, start[6] = {0.6, 0.3, 1, 0, 0, 1};
    const struct hnn_rollout_settings how = {.size = sizeof how, .rtol = 1e-12, .n = N, .t = t};
    struct phys_system system = as_scene(cosines(1, one, true));
    if (phys_ode_variations(&system, 2, &variations, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    struct hnn_rollout_settings by_series = how;
    by_series.integrator = phys_integrator_find("taylor", &error);
    assert_int_equal(hnn_rollout(&variations, &by_series, start, &path, NULL, &error), AD_OK);
    for (size_t k = 0; k < 2; k++) {
        for (size_t s = 0; s < 2; s++) {
            double x0[2] = {start[0], start[1]};
            x0[k] += s ? d : -d;
            assert_int_equal(hnn_rollout(&ode, &how, x0, &side[s], NULL, &error), AD_OK);
        }
        for (size_t r = 0; r < 2; r++)
            assert_close(path.x[6 + 2 + 2 * k + r], (side[1].x[2 + r] - side[0].x[2 + r]) / (2 * d),
                         1e-7, 1e-7);
        hnn_path_free(&side[0]);
        hnn_path_free(&side[1]);
    }
    hnn_path_free(&path);
    phys_ode_free(&variations);
    phys_ode_free(&ode);
    phys_system_close(&system);
}

/* ---- what is no scene ---- */

static void refused(const struct hnn_settings *s, const char *names)
{
    struct path file = files_temporary("model.h5");
    struct phys_system system;
    struct ad_error error = {0};
    hnn_model *model = small_model(s);
    assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
    assert_int_equal(hnn_system_open(file.text, &system, &error), AD_E_INPUT);
    assert_mentions(error.message, names);
    assert_null(hnn_system_model(&system));
    phys_system_close(&system);
    hnn_model_free(model);
}

static void test_refusals(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system system;
    for (size_t k = 0; k < small_n_kinds; k++) {
        struct hnn_settings s = small_settings(&small_kinds[k], 1, 2);
        if (s.kind == HNN_BASELINE || s.dissipation || s.field != HNN_SYMPLECTIC)
            refused(&s, "model.h5 rollout");
    }
    struct hnn_settings relu = hnn_defaults(HNN_HAMILTONIAN, 1);
    relu.activation = "relu";
    refused(&relu, "relu");
    struct hnn_settings pixels = hnn_pixel_defaults(HNN_HAMILTONIAN, 8);
    refused(&pixels, "pixels");
    struct path none = files_write_text("none.h5", "none");
    assert_int_equal(hnn_system_open(none.text, &system, &error), AD_E_INPUT);
    assert_mentions(error.message, "none.h5");
    error = (struct ad_error){0};
    assert_int_equal(hnn_system_open("sprin", &system, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "spring");
    error = (struct ad_error){0};
    assert_int_equal(hnn_system_open("spring", &system, &error), AD_OK);
    assert_null(hnn_system_model(&system));
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_form), cmocka_unit_test(test_motions),
        cmocka_unit_test(test_inputs),      cmocka_unit_test(test_table),
        cmocka_unit_test(test_variations),  cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
