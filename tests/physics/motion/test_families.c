/* Families of periodic motions: closed forms of their periods, folds and bifurcations; how they
   end; what is refused. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <string.h>

static struct phys_family family_of(const struct phys_system *system,
                                    struct phys_family_settings how, enum phys_family_end end)
{
    struct phys_family family;
    struct ad_error error = {0};
    how.size = sizeof how;
    phys_family_follow(system, &how, &family, &error);
    assert_string_equal(error.message, "");
    assert_int_equal(family.end, end);
    assert_true((end == PHYS_FAMILY_LOST) == (family.lost[0] != 0));
    return family;
}

struct expected {
    enum phys_family_mark mark;
    double value, known; /* better than that */
};

/* All marks, in order, as near as they are said to be known. */
static void has_marks(const struct phys_family *f, size_t n, const struct expected marks[])
{
    size_t met = 0;
    for (size_t k = 0; k < f->n; k++) {
        const struct phys_family_member *m = &f->member[k];
        if (m->mark == PHYS_MARK_NONE)
            continue;
        print_message("%s: %.16g +- %.2g, period %.16g +- %.2g\n", phys_family_mark_word(m->mark),
                      m->value, m->uncertainty, m->motion.period, m->motion.uncertainty);
        assert_true(met < n && m->mark == marks[met].mark);
        assert_true(m->uncertainty > 0 && m->uncertainty < marks[met].known);
        assert_close(m->value, marks[met].value, 0, m->uncertainty);
        met++;
    }
    assert_int_equal(met, n);
}

/* T = 4 K(k) sqrt(l/g), k^2 = E/2, by the arithmetic-geometric mean. */
static double elliptic(double E)
{
    double a = 1, b = sqrt(1 - E / 2);
    for (int k = 0; k < 8; k++) {
        const double mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
    }
    return 2 * M_PI / a;
}

static void the_pendulum_over_its_energy(void **state)
{
    const double x[] = {0.3, 0};
    const struct expected rest = {PHYS_MARK_REST, 0, 1e-7};
    (void)state;
    struct phys_system system = system_opened("pendulum");
    system_set(&system, "l", 1);
    struct phys_family_settings how = {.x = x, .period = 6.3, .along = "energy", .to = 1.9};
    struct phys_family f = family_of(&system, how, PHYS_FAMILY_REACHED);
    assert_close(f.member[f.n - 1].value, 1.9, 1e-14, 0);
    for (size_t k = 0; k < f.n; k++)
        assert_close(f.member[k].motion.period, elliptic(f.member[k].value), 1e-12, 0);
    has_marks(&f, 0, NULL);
    phys_family_free(&f);
    how.to = -1; /* there is none below the rest */
    f = family_of(&system, how, PHYS_FAMILY_ENDS);
    has_marks(&f, 1, &rest);
    const struct phys_periodic *last = &f.member[f.n - 1].motion;
    assert_close(last->period, 2 * M_PI, 0, last->uncertainty);
    assert_true(last->uncertainty < 1e-7);
    phys_family_free(&f);
    how.to = 2.5; /* nor beyond the separatrix: the period has no bound */
    f = family_of(&system, how, PHYS_FAMILY_LOST);
    has_marks(&f, 0, NULL);
    assert_true(f.member[f.n - 1].value < 2 && f.member[f.n - 1].motion.period > 40);
    assert_int_equal(f.member[f.n - 1].motion.kind, PHYS_PERIODIC_UNKNOWN);
    phys_family_free(&f);
    how.x = (const double[]){1e-3, 0}, how.period = 6.28; /* its start lingers near the saddle */
    f = family_of(&system, how, PHYS_FAMILY_LOST);
    has_marks(&f, 0, NULL);
    assert_true(f.member[f.n - 1].value < 2 && f.member[f.n - 1].motion.period > 40);
    phys_family_free(&f);
    how.x = x, how.period = 6.3;
    how.steps = 3;
    f = family_of(&system, how, PHYS_FAMILY_STEPS);
    assert_int_equal(f.n, 4);
    phys_family_free(&f);
    how = (struct phys_family_settings){.x = x, .period = 12.6, .along = "period", .to = 14};
    f = family_of(&system, how, PHYS_FAMILY_REACHED); /* gone round twice */
    assert_int_equal(f.member[f.n - 1].motion.turns, 2);
    assert_close(elliptic(f.member[f.n - 1].energy), 7, 1e-12, 0);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* ---- systems with one parameter ---- */

struct one {
    double p;
};

static const struct phys_param parameter[] = {{"p", "1", "parameter", 0, offsetof(struct one, p)}};

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    memset(q, 0, 3 * sizeof *q);
    memset(v, 0, 3 * sizeof *v);
    return AD_OK;
}

static struct phys_system made(struct phys_scene *scene, size_t dof, phys_lagrangian *L,
                               phys_lagrangian *forces, double p)
{
    struct phys_system system;
    struct ad_error error = {0};
    *scene = scene_of("one", dof, L, 100, 0.1, at_rest);
    scene->params = parameter;
    scene->n_params = 1;
    scene->params_bytes = sizeof(struct one);
    scene->forces = forces;
    assert_int_equal(phys_system_make(scene, &system, &error), AD_OK);
    system_set(&system, "p", p);
    return system;
}

/* x'' + x = v (p + R - R^2), R = x^2 + v^2: circles with R = (1 +- sqrt(1 + 4 p)) / 2. */
static ad_var spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), ad_sum_rows(ad_square(q))));
}

static ad_var bautin(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct one *s = params;
    (void)t;
    ad_var R = ad_add(ad_square(q), ad_square(v));
    return ad_mul(v, ad_add(PHYS_PARAM(s, p), ad_sub(R, ad_square(R))));
}

static void a_fold_of_limit_cycles(void **state)
{
    const double x[] = {1, 0}, outer[] = {0.85, 0};
    const struct expected marks[] = {{PHYS_MARK_FOLD, -0.25, 1e-13}, {PHYS_MARK_REST, 0, 1e-6}};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 1, spring, bautin, 0.1);
    struct phys_family_settings how = {.x = x, .period = 6.3, .along = "p", .to = -0.4};
    struct phys_family f = family_of(&system, how, PHYS_FAMILY_ENDS);
    has_marks(&f, 2, marks);
    for (size_t k = 0; k + 1 < f.n; k++) {
        const struct phys_periodic *m = &f.member[k].motion;
        const double R = 2 * f.member[k].energy, stays = exp(2 * M_PI * R * (1 - 2 * R));
        assert_close(R * R - R, f.member[k].value, 0, 1e-12);
        assert_close(m->period, 2 * M_PI, 1e-12, 0);
        assert_close(m->multiplier[0].re * m->multiplier[1].re, stays, 1e-9, 0);
    }
    phys_family_free(&f);
    system_set(&system, "p", -0.2);
    how.x = outer;
    how.to = -0.3; /* back around the fold, and by */
    f = family_of(&system, how, PHYS_FAMILY_RETURNED);
    has_marks(&f, 1, marks);
    assert_true(f.member[f.n - 1].energy < 0.25);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* Beside x = A cos t, y'' + (.49 + p x) y = 0: Mathieu's equation, whose a_1, a_1 and b_2
   are 1.96 at q = 2 A (scipy.special.mathieu_a, mathieu_b). */
static ad_var mathieu(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct one *s = params;
    (void)t;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1);
    ad_var V = ad_mul(
        0.5, ad_add(ad_square(x), ad_mul(ad_add(0.49, ad_mul(PHYS_PARAM(s, p), x)), ad_square(y))));
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), V);
}

static void doublings_and_branches(void **state)
{
    const double x[] = {0.5, 0, 0, 0};
    const struct expected marks[] = {{PHYS_MARK_DOUBLING, 0.16505492414444210, 1e-11},
                                     {PHYS_MARK_DOUBLING, 2.895871189043768, 1e-10},
                                     {PHYS_MARK_BRANCH, 3.375288912200823, 1e-10}};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 2, mathieu, NULL, 1);
    struct phys_family f = family_of(
        &system, (struct phys_family_settings){.x = x, .period = 6.3, .along = "energy", .to = 4},
        PHYS_FAMILY_REACHED);
    has_marks(&f, 3, marks);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* The same with y^4/4: from the first doubling a family of twice the period leads on. */
static ad_var doubled(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var y = ad_row(q, 1);
    return ad_sub(mathieu(q, v, t, params), ad_mul(0.25, ad_square(ad_square(y))));
}

static void a_doubled_family_ends_at_its_half(void **state)
{
    const double x[] = {0.6, 0.1, 0, 0};
    const struct expected end = {PHYS_MARK_HALVING, 0.16505492414444210, 1e-8};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 2, doubled, NULL, 1);
    struct phys_family f = family_of(
        &system,
        (struct phys_family_settings){.x = x, .period = 12.6, .along = "energy", .to = 0.1},
        PHYS_FAMILY_ENDS);
    has_marks(&f, 1, &end);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* Beside x, a charge on a hill, k = .09, in a field p. */
static ad_var hill(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct one *s = params;
    (void)t;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), z = ad_row(q, 2);
    ad_var turn = ad_mul(PHYS_PARAM(s, p),
                         ad_mul(0.5, ad_sub(ad_mul(y, ad_row(v, 2)), ad_mul(z, ad_row(v, 1)))));
    ad_var V = ad_sub(ad_mul(0.5, ad_square(x)), ad_mul(0.045, ad_add(ad_square(y), ad_square(z))));
    V = ad_add(V, ad_mul(0.1, ad_square(ad_square(x))));
    return ad_add(ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), V), turn);
}

/* The frequencies (p +- sqrt(p^2 - 4 k)) / 2 meet at p = 2 sqrt(k). */
static void frequencies_meet(void **state)
{
    const double x[] = {1, 0, 0, 0, 0, 0};
    const struct expected meet = {PHYS_MARK_TORUS, 0.6, 1e-12};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 3, hill, NULL, 0.8);
    struct phys_family f =
        family_of(&system,
                  (struct phys_family_settings){
                      .x = x, .period = 5.5, .along = "p", .to = 0.5, .hold = PHYS_HOLD_ENERGY},
                  PHYS_FAMILY_REACHED);
    has_marks(&f, 1, &meet);
    assert_close(f.member[f.n - 1].energy, f.member[0].energy, 1e-13, 0);
    assert_int_equal(f.member[0].motion.kind, PHYS_PERIODIC_NEUTRAL);
    assert_int_equal(f.member[f.n - 1].motion.kind, PHYS_PERIODIC_UNSTABLE);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* Beside the circle of unit radius y is damped for p < 0. */
static ad_var torus(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct one *s = params;
    (void)t;
    ad_var R = ad_add(ad_square(ad_row(q, 0)), ad_square(ad_row(v, 0)));
    return ad_concat_rows(2, (ad_var[]){ad_mul(ad_row(v, 0), ad_sub(1.0, R)),
                                        ad_add(ad_mul(0.4, ad_row(q, 1)),
                                               ad_mul(ad_mul(PHYS_PARAM(s, p), R), ad_row(v, 1)))});
}

static void a_torus_begins(void **state)
{
    const double x[] = {1, 0, 0, 0};
    const struct expected begins = {PHYS_MARK_TORUS, 0, 1e-13};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 2, spring, torus, -0.05);
    struct phys_family f = family_of(
        &system, (struct phys_family_settings){.x = x, .period = 6.3, .along = "p", .to = 0.1},
        PHYS_FAMILY_REACHED);
    has_marks(&f, 1, &begins);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* q'' + .2 q' + q = cos p t: of amplitude 1 / |1 - p^2 + .2 i p|, with the period of the drive. */
static ad_var driven(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct one *s = params;
    (void)q;
    return ad_sub(ad_cos(ad_mul(PHYS_PARAM(s, p), t)), ad_mul(0.2, v));
}

static void a_drive_over_its_frequency(void **state)
{
    const double x[] = {1, 0};
    (void)state;
    struct phys_scene scene;
    struct phys_system system = made(&scene, 1, spring, driven, 0.5);
    struct phys_family f =
        family_of(&system,
                  (struct phys_family_settings){
                      .x = x, .period = 4 * M_PI, .along = "p", .to = 2, .hold = PHYS_HOLD_PRODUCT},
                  PHYS_FAMILY_REACHED);
    has_marks(&f, 0, NULL);
    for (size_t k = 0; k < f.n; k++) {
        const double p = f.member[k].value, a = 1 - p * p, b = 0.2 * p;
        assert_close(f.member[k].motion.period, 2 * M_PI / p, 1e-12, 0);
        assert_close(f.member[k].motion.x[0], a / (a * a + b * b), 0, 1e-11);
    }
    phys_family_free(&f);
    phys_system_close(&system);
}

/* Ellipses of one energy have one period: the family goes the shortest way among them. */
static void symmetries_do_not_mislead(void **state)
{
    double x[4];
    (void)state;
    struct phys_system system = system_opened("kepler");
    system_start(&system, 0, x, x + 2);
    struct phys_family f = family_of(
        &system,
        (struct phys_family_settings){.x = x, .period = 6.3, .along = "energy", .to = -0.4},
        PHYS_FAMILY_REACHED);
    has_marks(&f, 0, NULL);
    for (size_t k = 0; k < f.n; k++) {
        const double *at = f.member[k].motion.x, r = hypot(at[0], at[1]),
                     E = 0.5 * (at[2] * at[2] + at[3] * at[3]) - 1 / r;
        assert_close(f.member[k].value, E, 0, 1e-11);
        assert_close(f.member[k].motion.period, 2 * M_PI * pow(-2 * E, -1.5), 1e-11, 0);
        assert_true(fabs(atan2(at[1], at[0])) < 0.1);
    }
    phys_family_free(&f);
    phys_system_close(&system);
}

/* ---- refused ---- */

static void refused(const struct phys_system *system, struct phys_family_settings how,
                    enum ad_status status, const char *says)
{
    struct phys_family family;
    struct ad_error error = {0};
    how.size = sizeof how;
    assert_int_equal(phys_family_follow(system, &how, &family, &error), status);
    assert_mentions(error.message, says);
    assert_int_equal(family.n, 0);
    phys_family_free(&family);
}

static void what_has_no_family_is_refused(void **state)
{
    const double x[] = {1, 0}, T = 6.3;
    (void)state;
    struct phys_scene scene, other;
    struct phys_system pendulum = system_opened("pendulum"),
                       cycle = made(&scene, 1, spring, bautin, 0.1),
                       drive = made(&other, 1, spring, driven, 0.5);
    system_set(&pendulum, "l", 1);
#define TRY(system, status, says, ...)                                                             \
    refused(&(system), (struct phys_family_settings){.x = x, .period = T, __VA_ARGS__}, status,    \
            says)
    TRY(pendulum, AD_E_ARGUMENT, "pendulum l holds energy period", .along = "l", .to = 2);
    TRY(pendulum, AD_E_ARGUMENT, "nothing held energy", .along = "energy", .to = 1,
        .hold = PHYS_HOLD_PERIOD);
    TRY(pendulum, AD_E_ARGUMENT, "ll l", .along = "ll", .to = 1, .hold = PHYS_HOLD_ENERGY);
    TRY(pendulum, AD_E_ARGUMENT, "l = 1 begins", .along = "l", .to = 1, .hold = PHYS_HOLD_ENERGY);
    TRY(pendulum, AD_E_ARGUMENT, "not depend theta0", .along = "theta0", .to = 2,
        .hold = PHYS_HOLD_ENERGY);
    TRY(pendulum, AD_E_ARGUMENT, "nan number", .along = "energy", .to = NAN);
    TRY(cycle, AD_E_ARGUMENT, "conserve energy parameter", .along = "energy", .to = 1);
    TRY(cycle, AD_E_ARGUMENT, "p holds nothing", .along = "p", .to = 1, .hold = PHYS_HOLD_PERIOD);
    TRY(drive, AD_E_ARGUMENT, "p holds period product", .along = "p", .to = 1);
    TRY(drive, AD_E_ACCURACY, "another period", .along = "p", .to = 1, .hold = PHYS_HOLD_PERIOD);
    phys_system_close(&pendulum);
    phys_system_close(&cycle);
    phys_system_close(&drive);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_pendulum_over_its_energy),
        cmocka_unit_test(a_fold_of_limit_cycles),
        cmocka_unit_test(doublings_and_branches),
        cmocka_unit_test(a_doubled_family_ends_at_its_half),
        cmocka_unit_test(frequencies_meet),
        cmocka_unit_test(a_torus_begins),
        cmocka_unit_test(a_drive_over_its_frequency),
        cmocka_unit_test(symmetries_do_not_mislead),
        cmocka_unit_test(what_has_no_family_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
