/* phys_path_continue: branches with closed forms, folds and bifurcations at known values. */
#include "physics/path/internal.h"
#include "tests/close.h"

#include <math.h>
#include <string.h>

struct number {
    double p;
};

/* q = tanh(t / p) from 0 to 1. */
static ad_var layer(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct number *s = params;
    (void)t;
    ad_var apart = ad_sub(1.0, ad_square(q));
    return ad_mul(0.5, ad_add(ad_square(v), ad_mul(1 / s->p / s->p, ad_square(apart))));
}

/* Bratu's problem, q'' = -p exp q: two paths below p = 3.513830719, none above. */
static ad_var bratu(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct number *s = params;
    (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(s->p, ad_exp(q)));
}

/* q'' = -p sin q: q = 0 is a minimum of S until p = pi^2, where a pair of paths branches off. */
static ad_var column(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct number *s = params;
    (void)t;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(s->p, ad_cos(q)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.1;
    v[0] = 1;
    return AD_OK;
}

static const struct phys_param params[] = {{"p", "1", "a number", 1, offsetof(struct number, p)}};
static const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                        .size = sizeof(struct phys_scene),
                                        .name = "numbered",
                                        .what = "of a parameter",
                                        .dof = 1,
                                        .dims = 1,
                                        .unit = "1",
                                        .time_unit = "1",
                                        .energy_unit = "1",
                                        .params = params,
                                        .n_params = 1,
                                        .params_bytes = sizeof(struct number),
                                        .slices = 9,
                                        .dt = 0.125,
                                        .start = start};

struct followed {
    struct phys_system system;
    struct phys_scene scene;
    struct phys_refined refined;
    struct phys_continued continued;
    struct ad_error error;
};

/* Over a time of 1 from a line between 0 and `end`, or a half sine of the given height. */
static enum ad_status follow(phys_lagrangian *lagrangian, double end, double height, double from,
                             double to, double tolerance, struct followed *f)
{
    double guess[9];
    memset(f, 0, sizeof *f);
    f->scene = scene;
    f->scene.lagrangian = lagrangian;
    assert_int_equal(phys_system_make(&f->scene, &f->system, &f->error), AD_OK);
    for (size_t i = 0; i < 9; i++)
        guess[i] = end * (double)i / 8 + (i % 8 ? height * sin(M_PI * (double)i / 8) : 0);
    struct phys_path_settings settings = phys_path_defaults(&f->system);
    settings.rule = NULL;
    const struct phys_continuation of = {.size = sizeof of, "p", from, to};
    phys_path_continue(&f->system, &settings, guess, 0, tolerance, &of, &f->refined, &f->continued,
                       &f->error);
    assert_close(phys_system_get(&f->system, "p"), to, 0, 0);
    if (f->error.status != AD_OK)
        print_message("%s\n", f->error.message);
    print_message("%zu values\n", f->continued.n);
    return f->error.status;
}

static void end(struct followed *f)
{
    phys_continued_free(&f->continued);
    phys_refined_free(&f->refined);
    phys_system_close(&f->system);
}

static void a_layer(void **state)
{
    (void)state;
    struct followed f;
    assert_int_equal(follow(layer, 1, 0, 1, 1e-3, 1e-9, &f), AD_OK);
    const struct phys_grid grid = phys_grid_of(f.refined.settings);
    for (size_t i = 0; i < grid.slices; i++)
        assert_close(f.refined.path[i], tanh(phys_grid_time(&grid, i) / 1e-3), 0, 1e-9);
    assert_true(grid.slices < 600);
    const struct phys_continued_step *step = f.continued.step;
    assert_true(step[0].value == 1 && step[f.continued.n - 1].value == 1e-3);
    for (size_t k = 1; k < f.continued.n; k++)
        assert_true(step[k].value < step[k - 1].value && step[k].index == 0);
    end(&f);
}

/* q(1/2) of the path with the lower middle: p = 2 u^2 / cosh^2(u / 2) ... = 8 (u/4)^2 / cosh^2. */
static double bratu_middle(double p)
{
    double low = 0, high = 1.1996786402577338; /* u tanh u = 1: the fold */
    for (int k = 0; k < 200; k++) {
        double u = 0.5 * (low + high);
        *(8 * u * u / cosh(u) / cosh(u) < p ? &low : &high) = u;
    }
    return 2 * log(cosh(low));
}

static void a_fold(void **state)
{
    (void)state;
    struct followed f;
    assert_int_equal(follow(bratu, 0, 0.1, 1, 3.5, 1e-8, &f), AD_OK);
    size_t middle = (f.refined.settings->slices - 1) / 2;
    const struct phys_grid grid = phys_grid_of(f.refined.settings);
    if (phys_grid_time(&grid, middle) == 0.5)
        assert_close(f.refined.path[middle], bratu_middle(3.5), 0, 1e-8);
    for (size_t k = 0; k < f.continued.n; k++)
        assert_int_equal(f.continued.step[k].index, 0);
    end(&f);
    assert_int_equal(follow(bratu, 0, 0.1, 1, 4, 1e-8, &f), AD_E_ACCURACY);
    double reached = f.continued.step[f.continued.n - 1].value;
    assert_true(reached <= 3.513830720);
    assert_close(reached, 3.513830719, 1e-4, 0);
    assert_non_null(strstr(f.error.message, "p = 3.51"));
    end(&f);
}

/* The index changes at p = pi^2, and is told beside the values on both sides. */
static void a_bifurcation(void **state)
{
    (void)state;
    struct followed f;
    assert_int_equal(follow(column, 0, 0, 5, 15, 1e-8, &f), AD_OK);
    size_t changed = 0;
    for (size_t k = 1; k < f.continued.n; k++)
        if (f.continued.step[k].index != f.continued.step[k - 1].index) {
            changed++;
            assert_true(f.continued.step[k - 1].value < M_PI * M_PI &&
                        f.continued.step[k].value > M_PI * M_PI);
        }
    assert_int_equal(changed, 1);
    assert_int_equal(f.continued.step[f.continued.n - 1].index, 1);
    end(&f);
    /* the pair merges with q = 0 there, and no other path is near */
    assert_int_equal(follow(column, 0, 2, 15, 10.5, 1e-8, &f), AD_OK);
    assert_int_equal(f.continued.step[f.continued.n - 1].index, 0);
    double most = 0;
    for (size_t i = 0; i < f.refined.settings->slices; i++)
        most = fmax(most, f.refined.path[i]);
    assert_true(most > 0.4 && most < 1);
    end(&f);
}

static void refusals(void **state)
{
    (void)state;
    struct followed f;
    assert_int_equal(follow(layer, 1, 0, NAN, 1, 1e-6, &f), AD_E_ARGUMENT);
    end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_layer),
        cmocka_unit_test(a_fold),
        cmocka_unit_test(a_bifurcation),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
