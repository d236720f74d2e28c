/* Optimisers against their published formulas written out one element at a time, and against
   numbers worked out by hand; both types, weight decay in both forms, checkpoints. */
#include "autodiff/optim.h"
#include "support.h"
#include "tests/mentions.h"

#include <string.h>

enum { N = 1003, STEPS = 40 };

/* ---- the published formulas, in f64 ---- */

struct reference {
    struct ad_optimiser_settings s;
    double x[N], m[N], v[N]; /* v: velocity for SGD */
};

static void sgd_reference(struct reference *o, const double *g)
{
    const struct ad_optimiser_settings *s = &o->s;
    for (size_t i = 0; i < N; i++) {
        double d = g[i];
        if (s->decoupled)
            o->x[i] -= s->learning_rate * s->weight_decay * o->x[i];
        else
            d += s->weight_decay * o->x[i];
        o->v[i] = s->momentum * o->v[i] + d;
        o->x[i] -= s->learning_rate * o->v[i];
    }
}

/* Kingma and Ba, algorithm 1, step t. */
static void adam_reference(struct reference *o, const double *g, int t)
{
    const struct ad_optimiser_settings *s = &o->s;
    for (size_t i = 0; i < N; i++) {
        double d = g[i];
        if (s->decoupled)
            o->x[i] -= s->learning_rate * s->weight_decay * o->x[i];
        else
            d += s->weight_decay * o->x[i];
        o->m[i] = s->beta1 * o->m[i] + (1 - s->beta1) * d;
        o->v[i] = s->beta2 * o->v[i] + (1 - s->beta2) * d * d;
        double m_hat = o->m[i] / (1 - pow(s->beta1, t)), v_hat = o->v[i] / (1 - pow(s->beta2, t));
        o->x[i] -= s->learning_rate * m_hat / (sqrt(v_hat) + s->epsilon);
    }
}

static void reference_step(struct reference *o, const double *g, int t)
{
    if (o->s.method == AD_SGD)
        sgd_reference(o, g);
    else
        adam_reference(o, g, t);
}

/* ---- settings to cross with types ---- */

static struct ad_optimiser_settings settings(size_t k)
{
    struct ad_optimiser_settings s = ad_optimiser_defaults(k < 4 ? AD_SGD : AD_ADAM);
    s.learning_rate = 0.013;
    s.momentum = k % 4 ? 0.87 : 0;
    if (k % 4 >= 2)
        s.weight_decay = 0.11;
    s.decoupled = k % 4 == 3;
    if (k == 5) {
        s.beta1 = 0.7;
        s.beta2 = 0.97;
        s.epsilon = 1e-3;
    }
    return s;
}
enum { N_SETTINGS = 8 };

/* Gradients of sizes from 1e-6 to 1e6, some exactly zero: the root and the floor epsilon both act.
 */
static void draw_gradient(uint64_t *state, double *g)
{
    for (size_t i = 0; i < N; i++) {
        double size = pow(10, (double)(i % 13) - 6);
        g[i] = i % 17 == 0 ? 0 : (float)(size * uniform(state, -1, 1));
    }
}

static void to_type(enum ad_type type, size_t n, void *to, const double *from)
{
    for (size_t i = 0; i < n; i++)
        if (type == AD_F32)
            ((float *)to)[i] = (float)from[i];
        else
            ((double *)to)[i] = from[i];
}

static double element(enum ad_type type, const void *x, size_t i)
{
    return type == AD_F32 ? (double)((const float *)x)[i] : ((const double *)x)[i];
}

/* Relative to the largest size an element has had on its way. */
static void compare(size_t k, enum ad_type type, double tolerance)
{
    static struct reference o;
    static double start[N], size[N], g[N];
    static union {
        float f[N];
        double d[N];
    } x, typed;
    uint64_t state = 40 + k;
    memset(&o, 0, sizeof o);
    o.s = settings(k);
    for (size_t i = 0; i < N; i++)
        o.x[i] = start[i] = size[i] = (float)uniform(&state, 0.1, 2);
    to_type(type, N, &x, start);
    ad_optimiser *optimiser = ad_optimiser_new(&o.s, type, N, NULL);
    assert_non_null(optimiser);
    for (int t = 1; t <= STEPS; t++) {
        draw_gradient(&state, g);
        to_type(type, N, &typed, g);
        ad_optimiser_step(optimiser, &x, &typed);
        reference_step(&o, g, t);
        for (size_t i = 0; i < N; i++) {
            double got = element(type, &x, i);
            size[i] = fmax(size[i], fabs(o.x[i]));
            if (!is_close(got, o.x[i], 0, tolerance * t * size[i]))
                fail_msg("settings %zu, step %d, element %zu: %.17g, not %.17g", k, t, i, got,
                         o.x[i]);
        }
    }
    ad_optimiser_free(optimiser);
}

static void published_formulas(void)
{
    for (size_t k = 0; k < N_SETTINGS; k++) {
        compare(k, AD_F64, 1e-15);
        compare(k, AD_F32, 4e-7);
    }
}

static void test_published_formulas(void **state)
{
    (void)state;
    for_each_isa(published_formulas);
}

/* With n below, at and above the width of vectors every element moves, and no other. */
static void every_length(void)
{
    for (size_t n = 0; n < 40; n++)
        for (size_t k = 0; k < N_SETTINGS; k += 4) {
            double x[41], g[41];
            struct ad_optimiser_settings s = settings(k);
            ad_optimiser *o = ad_optimiser_new(&s, AD_F64, n, NULL);
            for (size_t i = 0; i < 41; i++) {
                x[i] = 1;
                g[i] = 0.5 + (double)i;
            }
            ad_optimiser_step(o, x, g);
            for (size_t i = 0; i < n; i++)
                assert_close(x[i], 1 - s.learning_rate * (k ? 1 : g[i]), 1e-7, 0);
            for (size_t i = n; i < 41; i++)
                assert_true(x[i] == 1);
            ad_optimiser_free(o);
        }
}

/* ---- by hand ---- */

/* The first two steps of Adam in exact terms: m1 = .1 g, v1 = .001 g^2, both corrected back to g
   and g^2, so x moves by rate g/(|g| + eps); with g then doubled, m2 = .29 g/.19 and v2 = .004999
   g^2/.001999. */
static void test_adam_by_hand(void **state)
{
    (void)state;
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    assert_close(s.learning_rate, 1e-3, 0, 0);
    assert_close(s.epsilon, 1e-8, 0, 0);
    double x[] = {1, -2}, g[] = {0.25, -4}, second[] = {0.5, -8};
    ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 2, NULL);
    ad_optimiser_step(o, x, g);
    assert_close(x[0], 1 - 1e-3 * 0.25 / (0.25 + 1e-8), 1e-15, 0);
    assert_close(x[1], -2 + 1e-3 * 4 / (4 + 1e-8), 1e-15, 0);
    ad_optimiser_step(o, x, second);
    double move = 1e-3 * (0.29 / 0.19) / (sqrt(0.004999 / 0.001999) + 1e-8 / 0.25);
    assert_close(x[0], 1 - 1e-3 * 0.25 / (0.25 + 1e-8) - move, 1e-14, 0);
    ad_optimiser_free(o);
}

/* A weight of 1 without gradient: PyTorch's Adam with weight decay moves by the full rate, AdamW by
   rate times decay. */
static void test_the_two_weight_decays(void **state)
{
    (void)state;
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    s.weight_decay = 0.01;
    for (int decoupled = 0; decoupled < 2; decoupled++) {
        double x = 1, g = 0;
        s.decoupled = decoupled;
        ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 1, NULL);
        ad_optimiser_step(o, &x, &g);
        assert_close(x, decoupled ? 1 - 1e-5 : 1 - 1e-3 * 0.01 / (0.01 + 1e-8), 1e-15, 0);
        ad_optimiser_free(o);
    }
}

static void test_sgd_by_hand(void **state)
{
    (void)state;
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_SGD);
    s.learning_rate = 0.125;
    s.momentum = 0.5;
    double x = 3, g = 2;
    ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 1, NULL);
    const double expected[] = {2.75, 2.375, 1.9375}; /* velocities 2, 3, 3.5 */
    for (int t = 0; t < 3; t++) {
        ad_optimiser_step(o, &x, &g);
        assert_true(x == expected[t]);
    }
    ad_optimiser_set_rate(o, 1);
    ad_optimiser_step(o, &x, &g);
    assert_true(x == 1.9375 - 3.75);
    ad_optimiser_free(o);
}

/* Sizes as in SI units, and so small that squares underflow: the step stays the rate. */
static void extreme_sizes(void)
{
    static const double sizes[] = {1e-160, 1e-100, 1e-30, 1, 1e33, 1e100, 1e150};
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        double x[16] = {0}, g[16];
        for (size_t i = 0; i < 16; i++)
            g[i] = sizes[k] * (1 + 0.01 * (double)i);
        s.epsilon = 1e-8 * sizes[k];
        if (sizes[k] < 1e-150) /* squares are subnormal or zero: only epsilon is left */
            s.epsilon = 1e-8;
        ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 16, NULL);
        ad_optimiser_step(o, x, g);
        for (size_t i = 0; i < 16; i++)
            assert_close(x[i], -1e-3 * g[i] / (g[i] + s.epsilon), 1e-12, 0);
        ad_optimiser_free(o);
    }
}

/* An element that is not finite, or whose square is not, leaves its neighbours alone. */
static void overflow_stays_in_its_element(void)
{
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    double x[16] = {0}, g[16];
    for (size_t i = 0; i < 16; i++)
        g[i] = 1;
    g[3] = NAN;
    g[5] = INFINITY;
    g[7] = 1e200;
    ad_optimiser *o = ad_optimiser_new(&s, AD_F64, 16, NULL);
    ad_optimiser_step(o, x, g);
    for (size_t i = 0; i < 16; i++)
        if (i == 3 || i == 5)
            assert_true(isnan(x[i]));
        else
            assert_close(x[i], i == 7 ? 0 : -1e-3 / (1 + 1e-8), 1e-15, 0);
    ad_optimiser_free(o);
}

static void test_in_every_isa(void **state)
{
    (void)state;
    for_each_isa(every_length);
    for_each_isa(extreme_sizes);
    for_each_isa(overflow_stays_in_its_element);
}

/* ---- checkpoints ---- */

static void run(ad_optimiser *o, double *x, int from, int to)
{
    static double g[N];
    for (int t = from; t < to; t++) {
        uint64_t state = 70 + (uint64_t)t;
        draw_gradient(&state, g);
        ad_optimiser_step(o, x, g);
    }
}

static void test_resuming_is_bitwise(void **state)
{
    (void)state;
    static double whole[N], half[N];
    for (size_t k = 0; k < N_SETTINGS; k++) {
        struct ad_optimiser_settings s = settings(k);
        memset(whole, 0, sizeof whole);
        ad_optimiser *a = ad_optimiser_new(&s, AD_F64, N, NULL);
        run(a, whole, 0, 13);
        memcpy(half, whole, sizeof half);
        ad_optimiser *b = ad_optimiser_new(&s, AD_F64, N, NULL);
        size_t bytes, again;
        const void *saved = ad_optimiser_state(a, &bytes);
        void *restored = ad_optimiser_state(b, &again);
        assert_int_equal(bytes, (s.method == AD_ADAM ? 2u : 1u) * N * sizeof(double));
        assert_int_equal(again, bytes);
        memcpy(restored, saved, bytes);
        *ad_optimiser_steps(b) = *ad_optimiser_steps(a);
        assert_int_equal(*ad_optimiser_steps(b), 13);
        run(a, whole, 13, 1029);
        run(b, half, 13, 1029);
        assert_memory_equal(whole, half, sizeof whole);
        ad_optimiser_free(a);
        ad_optimiser_free(b);
    }
}

/* m, then v. */
static void test_order_of_the_state(void **state)
{
    (void)state;
    struct ad_optimiser_settings s = ad_optimiser_defaults(AD_ADAM);
    float x[3] = {0}, g[] = {2, 3, 4};
    ad_optimiser *o = ad_optimiser_new(&s, AD_F32, 3, NULL);
    ad_optimiser_step(o, x, g);
    size_t bytes;
    const float *moments = ad_optimiser_state(o, &bytes);
    assert_int_equal(bytes, 6 * sizeof(float));
    for (int i = 0; i < 3; i++) {
        assert_close(moments[i], 0.1 * g[i], 1e-6, 0);
        assert_close(moments[3 + i], 0.001 * g[i] * g[i], 1e-6, 0);
    }
    ad_optimiser_free(o);
}

/* ---- what only decays ---- */

/* One gradient, then none; a factor of 3/4 a step on x, `beta1` on the mean. Leaves the least
   nonzero size of x and of the first moment. */
static void decay(enum ad_type type, enum ad_optimiser_method method, double least, double size[2])
{
    static union {
        float f[N];
        double d[N];
    } x, typed;
    double at[N], g[N];
    struct ad_optimiser_settings s = ad_optimiser_defaults(method);
    s.learning_rate = 0.5;
    s.weight_decay = 0.5;
    s.decoupled = true;
    s.momentum = 0.7;
    s.least = least;
    for (size_t i = 0; i < N; i++) {
        at[i] = 1e-2 * (double)(i + 1);
        g[i] = 1e-3 * (double)(i + 2);
    }
    to_type(type, N, &x, at);
    to_type(type, N, &typed, g);
    ad_optimiser *o = ad_optimiser_new(&s, type, N, NULL);
    assert_non_null(o);
    ad_optimiser_step(o, &x, &typed);
    memset(&typed, 0, sizeof typed);
    for (int t = 0; t < 280; t++)
        ad_optimiser_step(o, &x, &typed);
    size_t bytes;
    const void *state = ad_optimiser_state(o, &bytes);
    size[0] = size[1] = INFINITY;
    for (size_t i = 0; i < N; i++)
        for (int k = 0; k < 2; k++) {
            double a = fabs(element(type, k ? state : &x, i));
            size[k] = a > 0 && a < size[k] ? a : size[k];
        }
    ad_optimiser_free(o);
}

static void decays_to_zero(void)
{
    for (int type = AD_F32; type <= AD_F64; type++)
        for (int method = AD_SGD; method <= AD_ADAM; method++) {
            double size[2];
            decay((enum ad_type)type, (enum ad_optimiser_method)method, 0, size);
            assert_true(size[1] < 1e-12);
            decay((enum ad_type)type, (enum ad_optimiser_method)method, 1e-8, size);
            assert_true(size[0] >= 1e-8 && size[1] >= 1e-8);
        }
}

static void test_what_only_decays(void **state)
{
    (void)state;
    for_each_isa(decays_to_zero);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_published_formulas),    cmocka_unit_test(test_adam_by_hand),
        cmocka_unit_test(test_the_two_weight_decays), cmocka_unit_test(test_sgd_by_hand),
        cmocka_unit_test(test_in_every_isa),          cmocka_unit_test(test_resuming_is_bitwise),
        cmocka_unit_test(test_order_of_the_state),    cmocka_unit_test(test_what_only_decays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
