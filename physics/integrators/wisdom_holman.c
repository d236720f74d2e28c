/* The map of Wisdom and Holman (Astronomical Journal 102 (1991) 1528) in Jacobi's coordinates: the
   Kepler motion of each body about those within it, exactly, and kicks by what it feels beside
   that: at the points of a rule (Laskar, Robutel, Celestial Mechanics 80 (2001) 39), or one a step,
   in coordinates of which a corrector gives the bodies (Wisdom, Holman, Touma, Fields Institute
   Communications 10 (1996) 217). */
#include "kepler_step.h"
#include "physics/linear/vectors.h"
#include "stepper.h"

#include <stdlib.h>
#include <string.h>

static const double dominates = 10; /* times all others together */

/* The bodies in the order of their distance from the heaviest one, which comes first. */
struct map {
    size_t n, dims;
    size_t *body;
    double *share, *sum; /* [n]; of the bodies up to this one */
    double *q, *v;       /* [n][dims] Jacobi's coordinates; the first are the centre of mass's */
    double *cut_q, *cut_v;
    double *a;     /* [n][dims] of the kick */
    double *force; /* [dof] */
    double *known; /* [2 dof] the state that they are of */
    double *kept;  /* [2][2 dof] q to cut_v */
    double h;      /* of the last step; 0: there was none */
};

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return 7 * n;
}

/* ---- Jacobi's coordinates ---- */

static void to_jacobi(const struct map *m, const double *x, double *to)
{
    for (size_t d = 0; d < m->dims; d++) {
        double centre = x[m->body[0] * m->dims + d];
        for (size_t i = 1; i < m->n; i++) {
            to[i * m->dims + d] = x[m->body[i] * m->dims + d] - centre;
            centre += m->share[i] * to[i * m->dims + d];
        }
        to[d] = centre;
    }
}

static void from_jacobi(const struct map *m, const double *x, double *to)
{
    for (size_t d = 0; d < m->dims; d++) {
        double centre = x[d];
        for (size_t i = m->n; i-- > 1;) {
            centre -= m->share[i] * x[i * m->dims + d];
            to[m->body[i] * m->dims + d] = centre + x[i * m->dims + d];
        }
        to[m->body[0] * m->dims + d] = centre;
    }
}

/* ---- the step ---- */

/* Accelerations beside those of the Kepler motions, at s->next. */
static enum ad_status find_kick(struct phys_stepper *s, struct map *m, double t,
                                struct ad_error *error)
{
    s->evaluations++;
    if (s->ode->kick(s->ode->context, t, s->next, m->force, error) != AD_OK)
        return error->status;
    to_jacobi(m, m->force, m->a);
    for (size_t i = 1; i < m->n; i++) {
        const double *q = m->q + i * m->dims, r2 = phys_dot(m->dims, q, q),
                     w = m->sum[i] / (r2 * sqrt(r2));
        for (size_t d = 0; d < m->dims; d++)
            m->a[i * m->dims + d] += w * q[d];
    }
    return AD_OK;
}

static void kick(const struct map *m, double h)
{
    for (size_t k = 0; k < m->n * m->dims; k++)
        phys_add_with_cut(m->v[k], h * m->a[k], m->cut_v[k], &m->v[k], &m->cut_v[k]);
}

static void drift(const struct map *m, double h)
{
    for (size_t d = 0; d < m->dims; d++)
        phys_add_with_cut(m->q[d], h * m->v[d], m->cut_q[d], &m->q[d], &m->cut_q[d]);
    for (size_t i = 1; i < m->n; i++) {
        const size_t at = i * m->dims;
        phys_kepler_step(m->dims, m->sum[i], h, m->q + at, m->v + at, m->cut_q + at, m->cut_v + at);
    }
}

/* Whether the last step led to s->y: the map goes on. */
static bool goes_on(const struct phys_stepper *s)
{
    const struct map *m = s->state;
    return m->h != 0 && memcmp(m->known, s->y, s->n * sizeof *s->y) == 0;
}

static void enter(const struct phys_stepper *s, struct map *m)
{
    to_jacobi(m, s->y, m->q);
    to_jacobi(m, s->y + s->n / 2, m->v);
    memset(m->cut_q, 0, s->n * sizeof *m->cut_q);
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const struct phys_kicks *c = s->integrator->coefficients;
    struct map *m = s->state;
    const size_t half = s->n / 2;
    double t = s->t;
    if (!goes_on(s)) {
        enter(s, m);
        memcpy(s->next, s->y, half * sizeof *s->y);
        if (find_kick(s, m, s->t, error) != AD_OK)
            return error->status;
    }
    m->h = 0;
    for (size_t i = 0; i < c->n; i++) {
        if (i > 0) {
            drift(m, c->drift[i] * h);
            t += c->drift[i] * h;
            from_jacobi(m, m->q, s->next);
            if (find_kick(s, m, t, error) != AD_OK)
                return error->status;
        }
        kick(m, c->kick[i] * h);
    }
    from_jacobi(m, m->v, s->next + half);
    memset(s->next_cut, 0, s->n * sizeof *s->next_cut);
    memcpy(m->known, s->next, s->n * sizeof *s->next);
    m->h = h;
    return AD_OK;
}

/* ---- the step with a corrector ---- */

/* With D and K the generators of drifts and kicks and x = h [D, .], half a drift, a kick and half a
   drift are, to the first order in K, the motion of D + (x/2) / sinh(x/2) K. A pair of the
   corrector, drift a, kick b, drift -2 a, kick -b, drift a, adds 2 b sinh(a x) K to its generator;
   all together they leave x^10 of that. */
enum { PAIRS = 4 };
static const double reach[PAIRS] = {0.5, 1, 1.5, 2},
                    share[PAIRS] = {334303 / 3628800.0, -128953 / 3628800.0, 3203 / 403200.0,
                                    -5839 / 7257600.0};

static enum ad_status kick_here(struct phys_stepper *s, struct map *m, double t, double h,
                                struct ad_error *error)
{
    from_jacobi(m, m->q, s->next);
    if (find_kick(s, m, t, error) == AD_OK)
        kick(m, h);
    return error->status;
}

/* way 1: from the bodies to the coordinates of the map at t; -1: back. The sign of h is no matter,
   so that a step back leads back. */
static enum ad_status correct(struct phys_stepper *s, double t, double h, int way,
                              struct ad_error *error)
{
    struct map *m = s->state;
    double before = 0;
    h = fabs(h);
    for (size_t k = 0; k < PAIRS; k++) {
        const size_t i = way > 0 ? k : PAIRS - 1 - k;
        const double a = -way * reach[i] * h, b = share[i] * h;
        drift(m, before + a);
        if (kick_here(s, m, t + a, b, error) != AD_OK)
            return error->status;
        drift(m, -2 * a);
        if (kick_here(s, m, t - a, -b, error) != AD_OK)
            return error->status;
        before = a;
    }
    drift(m, before);
    return AD_OK;
}

/* From one kick to the next. */
static enum ad_status corrected_step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct map *m = s->state;
    if (!goes_on(s) || m->h != h) {
        enter(s, m);
        if (correct(s, s->t, h, 1, error) != AD_OK)
            return error->status;
        drift(m, 0.5 * h);
    }
    if (kick_here(s, m, s->t + 0.5 * h, h, error) != AD_OK)
        return error->status;
    drift(m, h);
    memcpy(m->known, s->next, s->n * sizeof *s->next);
    m->h = h;
    return AD_OK;
}

static enum ad_status observe(struct phys_stepper *s, double t, double *y, struct ad_error *error)
{
    struct map *m = s->state;
    const size_t state = 2 * s->n * sizeof *m->kept;
    memcpy(m->kept, m->q, state);
    drift(m, -0.5 * m->h);
    if (correct(s, t, m->h, -1, error) == AD_OK) {
        from_jacobi(m, m->q, y);
        from_jacobi(m, m->v, y + s->n / 2);
        memcpy(m->known, y, s->n * sizeof *y);
    }
    memcpy(m->q, m->kept, state);
    return error->status;
}

/* ---- which scenes ---- */

static double separation(const struct map *m, const double *y, size_t a, size_t b)
{
    double sum = 0;
    for (size_t d = 0; d < m->dims; d++)
        sum = hypot(sum, y[a * m->dims + d] - y[b * m->dims + d]);
    return sum;
}

/* The heaviest first, then by distance from it. */
static void sort(struct map *m, const double *y, double *gm)
{
    for (size_t i = 0; i < m->n; i++)
        m->body[i] = i;
    for (size_t i = 1; i < m->n; i++)
        if (gm[m->body[i]] > gm[m->body[0]]) {
            m->body[i] = m->body[0];
            m->body[0] = i;
        }
    for (size_t i = 2; i < m->n; i++)
        for (size_t j = i; j > 1 && separation(m, y, m->body[0], m->body[j]) <
                                        separation(m, y, m->body[0], m->body[j - 1]);
             j--) {
            const size_t other = m->body[j];
            m->body[j] = m->body[j - 1];
            m->body[j - 1] = other;
        }
    for (size_t i = 0; i < m->n; i++) {
        m->sum[i] = gm[m->body[i]] + (i > 0 ? m->sum[i - 1] : 0);
        m->share[i] = gm[m->body[i]] / m->sum[i];
    }
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    const struct phys_system *system = s->ode->system;
    const size_t half = s->n / 2;
    const char *name = s->ode->name ? s->ode->name : "the motion";
    if (!system || !system->scene->gm || system->bodies < 2 || s->ode->friction != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s needs a scene that names the masses of its bodies (gm), one of which "
                       "dominates; %s does not: take taylor or dop853",
                       s->integrator->name, name);
    struct map *m = s->state = calloc(1, sizeof *m);
    if (!m || !(m->body = calloc(system->bodies, sizeof *m->body)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    m->n = system->bodies;
    m->dims = system->dims;
    m->q = s->work;
    m->v = m->q + half;
    m->cut_q = m->v + half;
    m->cut_v = m->cut_q + half;
    m->known = m->cut_v + half;
    m->a = m->known + s->n;
    m->force = m->a + half;
    m->kept = m->force + half;
    m->share = m->kept + 2 * s->n;
    m->sum = m->share + half;
    system->scene->gm(system->params, m->force);
    sort(m, s->y, m->force);
    const double most = m->sum[0];
    if (!(most > 0 && most >= dominates * (m->sum[m->n - 1] - most)))
        ad_fail(error, AD_E_ARGUMENT,
                "%s needs a body of %g times the mass of all others together; %s has none: take "
                "taylor or dop853",
                s->integrator->name, dominates, name);
    return error->status;
}

static void end(struct phys_stepper *s)
{
    struct map *m = s->state;
    if (m)
        free(m->body);
    free(m);
}

static const struct phys_scheme scheme = {.work = work, .begin = begin, .end = end, .step = step},
                                corrected = {.work = work,
                                             .begin = begin,
                                             .end = end,
                                             .step = corrected_step,
                                             .observe = observe};

/* At the points of Simpson's rule: with kicks of strength e beside the Kepler motion, errors are of
   e h^4 and e^2 h^2 (SBAB2). */
static const double drifts[] = {0, 0.5, 0.5}, weights[] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
static const struct phys_kicks kicks = {3, drifts, weights};

const struct phys_integrator phys_wisdom_holman = {
    .name = "wisdom-holman",
    .what = "Kepler motions exactly, kicks beside them, for planets",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .dominated = true,
    .scheme = &scheme,
    .coefficients = &kicks,
};

const struct phys_integrator phys_wisdom_holman_corrected = {
    .name = "wisdom-holman-corrected",
    .what = "one kick a step for planets, and a corrector where samples are",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .dominated = true,
    .scheme = &corrected,
};
