/* Systems of textbooks against the numbers that are published of them, or closed forms. */
#include "constrained.h"
#include "textbook_kept.h"
#include "physics/modes/modes.h"
#include "physics/stability/periodic.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>

#define UNUSED (void)q, (void)v, (void)t, (void)p
#define LAGRANGIAN(name) static ad_var name(ad_var q, ad_var v, ad_var t, const void *p)

static ad_var kinetic(ad_var v) { return ad_mul(0.5, ad_sum_rows(ad_square(v))); }

/* The start of all scenes here: q, v of each coordinate. */
static double at[6];
static size_t dof;

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)p, (void)seed, (void)error;
    for (size_t k = 0; k < dof; k++) {
        q[k] = at[2 * k];
        v[k] = at[2 * k + 1];
    }
    return AD_OK;
}

static struct phys_system system_of(const struct phys_scene *scene)
{
    dof = scene->dof;
    return constrained_system(scene);
}

/* ---- x'' + (a - 2 charge cos 2t) x = 0: Paul's trap, and the shaken pendulum at its top ---- */

static double spring, charge;

LAGRANGIAN(mathieu)
{
    UNUSED;
    ad_var pull = ad_sub(spring, ad_mul(2 * charge, ad_cos(ad_mul(2.0, t))));
    return ad_sub(kinetic(v), ad_mul(0.5, ad_mul(pull, ad_square(q))));
}

/* The trace of the matrix of a period, less the value at which stability ends. */
static double trace_beyond(double q, double edge)
{
    const double x[] = {0, 0};
    const struct phys_scene scene = scene_of("mathieu", 1, mathieu, 100, 0.1, start);
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = M_PI};
    struct ad_error error = {0};
    double m[4], known[4];
    charge = q;
    struct phys_system system = system_of(&scene);
    assert_int_equal(phys_transition(&system, x, &how, m, known, &error), AD_OK);
    phys_system_close(&system);
    return m[0] + m[3] - edge;
}

static double edge_of(double a, double edge, double low, double high)
{
    spring = a;
    double before = trace_beyond(low, edge), here = trace_beyond(high, edge);
    for (int k = 0; k < 6 && fabs(high - low) > 1e-12; k++) {
        const double next = high - here * (high - low) / (here - before);
        low = high;
        before = here;
        high = next;
        here = trace_beyond(high, edge);
    }
    return high;
}

static double pauls_trap(void) { return edge_of(0, -2, 0.9, 0.91); }
/* Shaken pendulum of length 1 and amplitude q/2, 4 g/w^2 = 0.04; Kapitza's estimate is .2828. */
static double kapitza(void) { return edge_of(-0.04, 2, 0.28, 0.29); }

/* ---- Henon and Heiles, E = 1/12: the section x = 0 of the orbit along an axis of symmetry ---- */

LAGRANGIAN(henon_heiles)
{
    UNUSED;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), cubic = ad_mul(ad_square(x), y);
    ad_var V = ad_add(ad_mul(0.5, ad_sum_rows(ad_square(q))),
                      ad_sub(cubic, ad_div(ad_mul(y, ad_square(y)), 3.0)));
    return ad_sub(kinetic(v), V);
}

/* The first crossing of a value: its time, and the state there. */
static double crossing_of(const struct phys_scene *scene, const char *text, double time, double *x)
{
    struct phys_system system = system_of(scene);
    struct phys_crossing crossing;
    struct phys_motion_solution m;
    struct ad_error error = {0};
    assert_int_equal(phys_crossing_read(&system, text, &crossing, &error), AD_OK);
    const struct phys_motion_settings how = {.size = sizeof how,
                                             .time = time,
                                             .error = 1e-11,
                                             .n_samples = 10,
                                             .n_crossings = 1,
                                             .crossings = &crossing};
    phys_motion_solve(&system, &how, &m, &error);
    assert_string_equal(error.message, "");
    assert_int_equal(m.crossed.n, 1);
    const double t = m.crossed.t[0];
    for (size_t k = 0; k < 2 * system.dof; k++)
        x[k] = m.crossed.x[k];
    phys_motion_solution_free(&m);
    phys_system_close(&system);
    return t;
}

/* From the origin, 30 degrees below the axis of x: it is back there after a period. */
static double henon_heiles_section(void)
{
    const double speed = sqrt(2.0 / 12);
    const struct phys_scene scene = scene_of("heiles", 2, henon_heiles, 100, 0.1, start);
    double x[4];
    at[0] = at[2] = 0;
    at[1] = speed * sqrt(0.75);
    at[3] = -speed / 2;
    const double t = crossing_of(&scene, "x1>0", 7.5, x);
    assert_close(x[1], 0, 0, 1e-9);
    assert_close(x[3], at[3], 0, 1e-9);
    return t;
}

/* ---- Schwarzschild: p = 12, e = .3 in units of the mass, by proper time ---- */

LAGRANGIAN(schwarzschild)
{
    UNUSED;
    ad_var r = ad_row(q, 1), f = ad_sub(1.0, ad_div(2.0, r)), dt = ad_row(v, 0), dr = ad_row(v, 1);
    ad_var turn = ad_square(ad_mul(r, ad_row(v, 2)));
    return ad_mul(0.5, ad_add(ad_sub(ad_div(ad_square(dr), f), ad_mul(f, ad_square(dt))), turn));
}

static double perihelion_shift(void)
{
    const struct phys_scene scene = scene_of("hole", 3, schwarzschild, 100, 1, start);
    const double semilatus = 12, e = 0.3, far = semilatus / (1 - e), f = 1 - 2 / far;
    const double h = semilatus / sqrt(semilatus - 3 - e * e);
    double x[6];
    at[0] = at[3] = at[4] = 0;
    at[2] = far;
    at[5] = h / (far * far);
    at[1] = sqrt((1 + h * h / (far * far)) / f); /* v v = -1 */
    crossing_of(&scene, "v_x2>0", 300, x);       /* from aphelion to perihelion: half a turn */
    assert_close(x[1], semilatus / (1 + e), 1e-9, 0);
    return 2 * x[2] - 2 * M_PI;
}

/* ---- an elastic pendulum that swings up and down: 2 w = w_r, its length at rest is 1 ---- */

LAGRANGIAN(elastic)
{
    UNUSED;
    ad_var r = ad_sqrt(ad_sum_rows(ad_square(q)));
    return ad_sub(kinetic(v), ad_add(ad_mul(2.0, ad_square(ad_sub(r, 0.75))), ad_row(q, 1)));
}

/* By Landau, Lifshitz, Mechanics, section 27: x'' + w^2 (1 + 3 A cos 2wt) x = 0 grows at the rate
   3 A w/4 (g = 1, k = 4: w = 1). Of that. */
static double elastic_resonance(void)
{
    const double A = 1e-3, x[] = {0, -1 - A, 0, 0};
    const struct phys_scene scene = scene_of("elastic", 2, elastic, 100, 0.1, start);
    struct phys_system system = system_of(&scene);
    struct phys_periodic found;
    struct ad_error error = {0};
    const struct phys_periodic_settings how = {
        .size = sizeof how, .x = x, .period = M_PI, .hold_energy = true};
    assert_int_equal(phys_periodic_find(&system, &how, &found, &error), AD_OK);
    assert_int_equal(found.kind, PHYS_PERIODIC_UNSTABLE);
    const double rate = log(hypot(found.multiplier[0].re, found.multiplier[0].im)) / found.period;
    phys_periodic_free(&found);
    phys_system_close(&system);
    return rate / (0.75 * A);
}

/* ---- a relativistic oscillator of amplitude 1.5 ---- */

LAGRANGIAN(relativistic)
{
    UNUSED;
    return ad_neg(ad_add(ad_sqrt(ad_sub(1.0, ad_square(v))), ad_mul(0.5, ad_square(q))));
}

static double relativistic_period(void)
{
    const double x[] = {1.5, 0};
    const struct phys_scene scene = scene_of("fast", 1, relativistic, 100, 0.1, start);
    struct phys_system system = system_of(&scene);
    struct phys_periodic found;
    struct ad_error error = {0};
    const struct phys_periodic_settings how = {
        .size = sizeof how, .x = x, .period = 8.5, .hold_energy = true};
    assert_int_equal(phys_periodic_find(&system, &how, &found, &error), AD_OK);
    const double period = found.period;
    phys_periodic_free(&found);
    phys_system_close(&system);
    return period;
}

/* ---- three bodies: L4 of two on circles, in their frame ---- */

static double mass_ratio;

static ad_var inverse_distance(ad_var q, double x)
{
    ad_var dx = ad_sub(ad_row(q, 0), x), y = ad_row(q, 1);
    return ad_div(1.0, ad_sqrt(ad_add(ad_square(dx), ad_square(y))));
}

LAGRANGIAN(turning)
{
    UNUSED;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1);
    ad_var coriolis = ad_sub(ad_mul(x, ad_row(v, 1)), ad_mul(y, ad_row(v, 0)));
    ad_var pull = ad_add(ad_mul(1 - mass_ratio, inverse_distance(q, -mass_ratio)),
                         ad_mul(mass_ratio, inverse_distance(q, 1 - mass_ratio)));
    return ad_add(ad_add(kinetic(v), coriolis), ad_add(kinetic(q), pull));
}

static enum phys_equilibrium_kind triangle(double ratio)
{
    const struct phys_scene scene = scene_of("L4", 2, turning, 100, 0.1, start);
    struct phys_equilibria found;
    struct ad_error error = {0};
    mass_ratio = ratio;
    at[0] = 0.5 - ratio;
    at[2] = sqrt(0.75);
    at[1] = at[3] = 0;
    struct phys_system system = system_of(&scene);
    const double low[] = {0.4, 0.8}, high[] = {0.5, 0.9};
    const struct phys_equilibria_settings how = {
        .size = sizeof how, .starts = 2, .low = low, .high = high};
    assert_int_equal(phys_equilibria_find(&system, &how, &found, &error), AD_OK);
    assert_int_equal(found.n, 1);
    assert_close(found.one[0].q[1], at[2], 0, 1e-12);
    const enum phys_equilibrium_kind kind = found.one[0].kind;
    phys_equilibria_free(&found);
    phys_system_close(&system);
    return kind;
}

static double routh(void)
{
    double stable = 0.038, unstable = 0.039;
    assert_int_equal(triangle(stable), PHYS_EQUILIBRIUM_GYROSCOPIC);
    assert_int_equal(triangle(unstable), PHYS_EQUILIBRIUM_UNSTABLE);
    while (unstable - stable > 1e-9) {
        const double middle = 0.5 * (stable + unstable);
        *(triangle(middle) == PHYS_EQUILIBRIUM_UNSTABLE ? &unstable : &stable) = middle;
    }
    return stable;
}

/* ---- bifurcations of periodic motions ---- */

/* The value at the first mark of the family followed from x in the energy. */
static double first_branch(const struct phys_system *system, const double *x, double period,
                           double to)
{
    const struct phys_family_settings how = {
        .size = sizeof how, .x = x, .period = period, .along = "energy", .to = to};
    struct phys_family family;
    struct ad_error error = {0};
    double value = NAN;
    phys_family_follow(system, &how, &family, &error);
    assert_string_equal(error.message, "");
    for (size_t k = 0; k < family.n; k++)
        if (isnan(value) && family.member[k].mark == PHYS_MARK_BRANCH)
            value = family.member[k].value;
    phys_family_free(&family);
    return value;
}

static double halo_orbits(void)
{
    const double x[] = {0.84230, 0.05278, 0, 0.03453, -0.00248, 0};
    struct phys_system system = system_opened("cr3bp");
    const double found = first_branch(&system, x, 2.737, -1.5868);
    phys_system_close(&system);
    return found;
}

/* Of the motion along the axis of y from its upper turning point; energies in units of the
   saddle's. */
static double henon_heiles_branch(double top, double period, double energy)
{
    const struct phys_scene scene = scene_of("Henon-Heiles", 2, henon_heiles, 100, 0.1, start);
    struct phys_system system = system_of(&scene);
    const double x[] = {0, top, 0, 0}, found = first_branch(&system, x, period, energy);
    phys_system_close(&system);
    return 6 * found;
}

static double henon_heiles_pitchfork(void) { return henon_heiles_branch(0.88, 9.4, 0.163); }
static double henon_heiles_second(void) { return henon_heiles_branch(0.91, 9.87, 0.165); }

/* ---- the brachistochrone down a whole half turn of a circle of radius 1 ---- */

static double quickest_descent(void)
{
    enum { SLICES = 11 };
    struct phys_system system = system_opened("brachistochrone");
    struct ad_error error = {0};
    struct phys_path_info info;
    system_set(&system, "x1", M_PI);
    system_set(&system, "y1", 0);
    system_set(&system, "y0", 2);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss6", &error),
                                          .slices = SLICES,
                                          .steps = 60,
                                          .dt = 0.12};
    double path[6 * 2 * SLICES], ends[2 * SLICES];
    system.scene->between(system.params, SLICES, ends, &error);
    phys_path_line(2, SLICES, ends, path);
    phys_rule_interpolate(settings.rule, 2, SLICES, path);
    assert_int_equal(phys_path_free_time(&system, &settings, 0, path, &info, &error), AD_OK);
    double q[2], v[2]; /* a motion begins on the cycloid, along it */
    system_start(&system, 1, q, v);
    double angle = 2 * asin(q[0] / sqrt(2));
    assert_close(q[0] * q[1], angle - sin(angle), 1e-12, 0);
    assert_close((v[0] * q[1] + q[0] * v[1]) / (2 * q[0] * v[0]), tan(angle / 2), 1e-12, 0);
    phys_system_close(&system);
    return settings.dt * (SLICES - 1);
}

/* ---- */

static const struct {
    const char *name, *source;
    double value, error; /* relative, but of 0 */
    double (*measure)(void);
} systems[] = {
    {"Toda's ring of three, change of its second and third integral", "Henon, Phys. Rev. B 9, 1974",
     0, 1e-8, textbook_toda},
    {"Stormer's charge, change of speed and p_phi", "both are kept", 0, 1e-8, textbook_stormer},
    {"Foucault's pendulum, distance from its turning plane", "exp(-i W t) cos(w t), w^2 = 4 + W^2",
     0, 1e-8, textbook_foucault},
    {"heavy top, departure from steady precession at .4", "I3 w3 n = m g l + I1 n^2 cos(theta)", 0,
     1e-8, textbook_top},
    {"Paul's trap, edge of stability", "b_1(q) = 0, DLMF 28.2; scipy.special.mathieu_b",
     0.9080463337345775, 1e-11, pauls_trap},
    {"Kapitza's pendulum, edge of stability", "a_0(q) = -.04; scipy.special.mathieu_a",
     0.2840763335852879, 1e-11, kapitza},
    {"Henon and Heiles, period of a fixed point of the section",
     "4 sqrt(3/2) K/sqrt(y1 - y3), y the roots of y^3/3 - y^2/2 + E", 6.901643615335926, 1e-10,
     henon_heiles_section},
    {"Schwarzschild, shift of the perihelion",
     "4 sqrt(p/(p - 6 + 2e)) K - 2 pi, Darwin, Proc. R. Soc. A 249, 1959", 2.6193331251832590, 1e-9,
     perihelion_shift},
    {"elastic pendulum, growth at resonance", "1 to second order in the amplitude", 1, 1e-6,
     elastic_resonance},
    {"relativistic oscillator, period", "4 (c E - 2 K/c), c^2 = 4 + A^2, k = A/c",
     8.578421775156834, 1e-11, relativistic_period},
    {"L4, largest stable ratio of masses", "(1 - sqrt(69)/9)/2, Routh 1875", 0.0385208965045514,
     1e-7, routh},
    {"Earth and Moon, energy where halo orbits leave Lyapunov's",
     "heyoka, Taylor series of 80 bits", -1.587175977039039, 2e-12, halo_orbits},
    /* x(0) = 0, x(T/2) = 0, and x'(0) = 0, x'(T/2) = 0 of x'' = -(1 + 2 y) x along y'' = y^2 - y,
       by Taylor series of 30 digits and T from K; known since Brack, nlin/0006034 */
    {"Henon and Heiles, first pitchfork of the straight orbit A", "x(T/2) = 0, 30 digits",
     0.9693090906648817, 1e-11, henon_heiles_pitchfork},
    {"Henon and Heiles, its second one", "x'(T/2) = 0, 30 digits", 0.9867092353181612, 1e-11,
     henon_heiles_second},
    {"constant force in relativity, distance from a hyperbola", "sqrt(1 + t^2)", 0, 1e-8,
     textbook_pushed},
    {"Kepler, change of the vector of Laplace, Runge and Lenz", "it is kept", 0, 1e-8,
     textbook_kepler},
    {"brachistochrone, time of descent", "pi sqrt(R/g)", 1.0032046462945202, 1e-9,
     quickest_descent},
};

static void what_is_published_is_found(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(systems); k++) {
        const double found = systems[k].measure();
        print_message("%-58s %.15g (%s)\n", systems[k].name, found, systems[k].source);
        assert_close(found, systems[k].value, systems[k].error,
                     systems[k].value == 0 ? systems[k].error : 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_published_is_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
