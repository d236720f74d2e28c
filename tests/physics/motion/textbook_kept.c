/* Systems of textbooks of which observables are known that do not change (textbook_kept.h). */
#include "textbook_kept.h"
#include "constrained.h"
#include "tests/close.h"

#include <math.h>

#define UNUSED (void)q, (void)v, (void)t, (void)p
#define LAGRANGIAN(name) static ad_var name(ad_var q, ad_var v, ad_var t, const void *p)
#define START(name)                                                                                \
    static enum ad_status name(const void *p, uint64_t seed, double *q, double *v,                 \
                               struct ad_error *error)
#define UNUSED_START (void)p, (void)seed, (void)error

static ad_var kinetic(ad_var v) { return ad_mul(0.5, ad_sum_rows(ad_square(v))); }

static ad_var turn(ad_var q, ad_var v) /* x v_y - y v_x */
{
    return ad_sub(ad_mul(ad_row(q, 0), ad_row(v, 1)), ad_mul(ad_row(q, 1), ad_row(v, 0)));
}

static ad_var radius(ad_var q) { return ad_sqrt(ad_sum_rows(ad_square(q))); }

/* ---- Toda's ring of three: Henon, Phys. Rev. B 9, 1921, 1974 ---- */

static ad_var bond(ad_var q, size_t i)
{
    return ad_exp(ad_sub(ad_row(q, i), ad_row(q, (i + 1) % 3)));
}

LAGRANGIAN(toda)
{
    UNUSED;
    return ad_sub(kinetic(v), ad_add(ad_add(bond(q, 0), bond(q, 1)), bond(q, 2)));
}

LAGRANGIAN(toda_sum)
{
    UNUSED;
    return ad_sum_rows(v);
}

LAGRANGIAN(toda_third)
{
    UNUSED;
    ad_var sum = ad_mul(ad_mul(ad_row(v, 0), ad_row(v, 1)), ad_row(v, 2));
    for (size_t i = 0; i < 3; i++)
        sum = ad_sub(sum, ad_mul(ad_row(v, i), bond(q, (i + 1) % 3)));
    return sum;
}

START(toda_start)
{
    UNUSED_START;
    const double x[] = {0.3, -0.7, 0.1}, rate[] = {0.9, -0.2, 0.4};
    for (size_t k = 0; k < 3; k++)
        q[k] = x[k], v[k] = rate[k];
    return AD_OK;
}

/* ---- Foucault: z = exp(-i W t) cos(w t), w^2 = 4 + W^2, W = 0.3 ---- */

LAGRANGIAN(foucault)
{
    UNUSED;
    return ad_sub(ad_add(kinetic(v), ad_mul(0.3, turn(q, v))),
                  ad_mul(2.0, ad_sum_rows(ad_square(q))));
}

static ad_var swing(ad_var t) { return ad_cos(ad_mul(sqrt(4.09), t)); }

LAGRANGIAN(foucault_x)
{
    UNUSED;
    return ad_sub(ad_row(q, 0), ad_mul(swing(t), ad_cos(ad_mul(0.3, t))));
}

LAGRANGIAN(foucault_y)
{
    UNUSED;
    return ad_add(ad_row(q, 1), ad_mul(swing(t), ad_sin(ad_mul(0.3, t))));
}

START(foucault_start)
{
    UNUSED_START;
    q[0] = 1;
    q[1] = v[0] = 0;
    v[1] = -0.3;
    return AD_OK;
}

/* ---- Stormer: a charge in a dipole's field keeps its speed and p_phi ---- */

static ad_var dipole(ad_var q)
{
    ad_var r = radius(q);
    return ad_div(1.0, ad_mul(r, ad_square(r)));
}

LAGRANGIAN(stormer)
{
    UNUSED;
    return ad_add(kinetic(v), ad_mul(turn(q, v), dipole(q)));
}

LAGRANGIAN(speed)
{
    UNUSED;
    return radius(v);
}

LAGRANGIAN(stormer_p)
{
    UNUSED;
    ad_var square = ad_add(ad_square(ad_row(q, 0)), ad_square(ad_row(q, 1)));
    return ad_add(turn(q, v), ad_mul(square, dipole(q)));
}

START(stormer_start)
{
    UNUSED_START;
    q[0] = 1.1;
    q[1] = v[0] = 0;
    q[2] = 0.2;
    v[1] = -0.3;
    v[2] = 0.4;
    return AD_OK;
}

/* ---- a top that precesses steadily at 0.4: I1 = 1, I3 = 0.5, m g l = 1, theta = 0.7 ---- */

LAGRANGIAN(top)
{
    UNUSED;
    ad_var theta = ad_row(q, 0), spin = ad_add(ad_row(v, 2), ad_mul(ad_row(v, 1), ad_cos(theta))),
           tip = ad_square(ad_mul(ad_row(v, 1), ad_sin(theta)));
    ad_var T =
        ad_add(ad_mul(0.5, ad_add(ad_square(ad_row(v, 0)), tip)), ad_mul(0.25, ad_square(spin)));
    return ad_sub(T, ad_cos(theta));
}

LAGRANGIAN(tilt)
{
    UNUSED;
    return ad_row(q, 0);
}

LAGRANGIAN(precession)
{
    UNUSED;
    return ad_sub(ad_row(q, 1), ad_mul(0.4, t));
}

START(top_start)
{
    UNUSED_START;
    q[0] = 0.7;
    q[1] = q[2] = v[0] = 0;
    v[1] = 0.4;
    v[2] = (0.16 * cos(0.7) + 1) / (0.5 * 0.4) - 0.4 * cos(0.7);
    return AD_OK;
}

/* ---- a constant force in special relativity: q = sqrt(1 + t^2) - 1 ---- */

LAGRANGIAN(pushed)
{
    UNUSED;
    return ad_sub(q, ad_sqrt(ad_sub(1.0, ad_square(v))));
}

LAGRANGIAN(hyperbola)
{
    UNUSED;
    return ad_sub(q, ad_sqrt(ad_add(1.0, ad_square(t))));
}

START(at_rest)
{
    UNUSED_START;
    q[0] = v[0] = 0;
    return AD_OK;
}

/* ---- Kepler: the vector of Laplace, Runge and Lenz ---- */

LAGRANGIAN(kepler)
{
    UNUSED;
    return ad_add(kinetic(v), ad_div(1.0, radius(q)));
}

LAGRANGIAN(lenz_x)
{
    UNUSED;
    return ad_sub(ad_mul(ad_row(v, 1), turn(q, v)), ad_div(ad_row(q, 0), radius(q)));
}

LAGRANGIAN(lenz_y)
{
    UNUSED;
    return ad_add(ad_mul(ad_row(v, 0), turn(q, v)), ad_div(ad_row(q, 1), radius(q)));
}

START(kepler_start)
{
    UNUSED_START;
    q[0] = 1;
    q[1] = 0.2;
    v[0] = 0.1;
    v[1] = 0.8;
    return AD_OK;
}

/* ---- */

static const struct kept {
    const char *name;
    size_t dof;
    phys_lagrangian *L;
    scene_start *start;
    double time;
    phys_lagrangian *kept[2];
} toda_ring = {"toda", 3, toda, toda_start, 10, {toda_sum, toda_third}},
  plane = {"foucault", 2, foucault, foucault_start, 20, {foucault_x, foucault_y}},
  charge = {"stormer", 3, stormer, stormer_start, 10, {speed, stormer_p}},
  steady_top = {"top", 3, top, top_start, 5, {tilt, precession}},
  force = {"pushed", 1, pushed, at_rest, 4, {hyperbola, hyperbola}},
  ellipse = {"kepler", 2, kepler, kepler_start, 10, {lenz_x, lenz_y}};

/* How far the observables of a motion depart from what they are at the start. */
static double change(const struct kept *s)
{
    const struct phys_observable table[] = {{"first", "", s->kept[0]}, {"second", "", s->kept[1]}};
    struct phys_scene scene = scene_of(s->name, s->dof, s->L, 100, 0.01, s->start);
    double value[2 * (CONSTRAINED_SAMPLES + 1)], most = 0;
    struct ad_error error = {0};
    scene.observables = table;
    scene.n_observables = LENGTH(table);
    struct phys_system system = constrained_system(&scene);
    struct phys_motion_solution m = constrained_motion(&system, NULL, 0, 1e-10, s->time);
    assert_int_equal(phys_observe(&system, m.n, m.x, m.t, value, &error), AD_OK);
    for (size_t i = 0; i < 2 * m.n; i++) {
        assert_true(isfinite(value[i]));
        most = fmax(most, fabs(value[i] - value[i < m.n ? 0 : m.n]));
    }
    phys_motion_solution_free(&m);
    phys_system_close(&system);
    return most;
}

double textbook_toda(void) { return change(&toda_ring); }
double textbook_foucault(void) { return change(&plane); }
double textbook_stormer(void) { return change(&charge); }
double textbook_top(void) { return change(&steady_top); }
double textbook_pushed(void) { return change(&force); }
double textbook_kepler(void) { return change(&ellipse); }
