/* The map of Wisdom and Holman (Astronomical Journal 102 (1991) 1528) in Jacobi's coordinates: the
   Kepler motion of each body about those within, exactly, and kicks by what it feels beside that,
   at the points of a rule (Laskar, Robutel, Celestial Mechanics 80 (2001) 39). The Kepler motion by
   Stumpff's functions (Danby, Fundamentals of Celestial Mechanics, section 6.9) and Laguerre's
   iteration (Conway, Celestial Mechanics 39 (1986) 199). */
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
    bool has;
};

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return 5 * n;
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

/* ---- the Kepler motion ---- */

/* G_k = X^k c_k(beta X^2), by quarters of the argument; the series of c_2 and c_3 in pairs of
   terms, which need not wait for each other. */
static void stumpff(double beta, double X, double G[4])
{
    const double small = 0.1;
    size_t quarters = 0;
    double z = beta * X * X;
    for (; fabs(z) > small && quarters < 512; quarters++)
        z *= 0.25;
    const double z2 = z * z;
    double c2 = (1.0 / 2 - z * (1.0 / 24)) + z2 * ((1.0 / 720 - z * (1.0 / 40320)) +
                                                   z2 * (1.0 / 3628800 - z * (1.0 / 479001600)));
    double c3 = (1.0 / 6 - z * (1.0 / 120)) + z2 * ((1.0 / 5040 - z * (1.0 / 362880)) +
                                                    z2 * (1.0 / 39916800 - z * (1.0 / 6227020800)));
    for (; quarters > 0; quarters--) {
        double c0 = 1 - z * c2, c1 = 1 - z * c3;
        c3 = 0.25 * (c2 + c0 * c3);
        c2 = 0.5 * c1 * c1;
        z *= 4;
    }
    G[0] = 1 - z * c2;
    G[1] = X * (1 - z * c3);
    G[2] = X * X * c2;
    G[3] = X * X * X * c3;
}

/* The same at X + d, for a small d. */
static void shift(double beta, double d, double G[4])
{
    const double half = d * (1.0 / 2), third = d * (1.0 / 3), quarter = d * (1.0 / 4), G0 = G[0],
                 G1 = G[1], turn = G0 - quarter * beta * G1;
    G[3] += d * (G[2] + half * (G1 + third * turn));
    G[2] += d * (G1 + half * (G0 - third * beta * (G1 + quarter * G0)));
    G[1] += d * (G0 - half * beta * (G1 + third * turn));
    G[0] = 1 - beta * G[2];
}

/* At the universal anomaly X after a time h, which grows with it: the root of r0 X + eta G_2 + zeta
   G_3 = h, between 0 and infinity at first. */
static void find_anomaly(double h, double r0, double eta, double beta, double zeta, double G[4])
{
    enum { MOST = 200 };
    const double close = 1e-3; /* the iteration is of third order: one more of the second is left */
    const double in_r0 = 1 / r0, s = h * in_r0, a = 0.5 * eta * in_r0 * s;
    double X = s * (1 - a + (2 * a * a - zeta * in_r0 * s * s * (1.0 / 6))), low = 0,
           high = copysign(INFINITY, h);
    if (!(X * h > 0))
        X = s;
    for (size_t i = 0; i < MOST; i++) {
        stumpff(beta, X, G);
        const double F = r0 * X + eta * G[2] + zeta * G[3] - h, r = r0 + eta * G[1] + zeta * G[2],
                     slope = eta * G[0] + zeta * G[1];
        double d = -5 * F / (r + sqrt(fabs(16 * r * r - 20 * F * slope)));
        if (fabs(d) <= close * fabs(X)) {
            shift(beta, d, G);
            d = (h - r0 * (X + d) - eta * G[2] - zeta * G[3]) / (r0 + eta * G[1] + zeta * G[2]);
            G[3] += d * G[2];
            G[2] += d * G[1];
            G[1] += d * G[0];
            return;
        }
        if (F * h <= 0)
            low = X;
        else
            high = X;
        double next = X + d;
        if (!((next - low) * h > 0 && (high - next) * h > 0))
            next = isinf(high) ? 2 * X : 0.5 * (low + high);
        X = next;
    }
}

static void add(double *x, double *cut, double increment)
{
    phys_add_with_cut(*x, increment, *cut, x, cut);
}

static void kepler(const struct map *m, size_t i, double h)
{
    double *q = m->q + i * m->dims, *v = m->v + i * m->dims, G[4];
    double *cut_q = m->cut_q + i * m->dims, *cut_v = m->cut_v + i * m->dims;
    const double mu = m->sum[i], r0 = phys_norm(m->dims, q), eta = phys_dot(m->dims, q, v),
                 beta = 2 * mu / r0 - phys_dot(m->dims, v, v), zeta = mu - beta * r0;
    if (beta > 0 && h * h * beta * beta * beta > M_PI * M_PI * mu * mu) /* half a period */
        h = remainder(h, 2 * M_PI * mu / (beta * sqrt(beta)));
    if (h == 0)
        return;
    find_anomaly(h, r0, eta, beta, zeta, G);
    const double in_r0 = mu / r0, in_r = 1 / (r0 + eta * G[1] + zeta * G[2]), f = -in_r0 * G[2],
                 g = h - mu * G[3], df = -in_r0 * G[1] * in_r, dg = -mu * G[2] * in_r;
    for (size_t d = 0; d < m->dims; d++) {
        const double x = q[d], u = v[d];
        add(&q[d], &cut_q[d], f * x + g * u);
        add(&v[d], &cut_v[d], df * x + dg * u);
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
        add(&m->v[k], &m->cut_v[k], h * m->a[k]);
}

static void drift(const struct map *m, double h)
{
    for (size_t d = 0; d < m->dims; d++)
        add(&m->q[d], &m->cut_q[d], h * m->v[d]);
    for (size_t i = 1; i < m->n; i++)
        kepler(m, i, h);
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const struct phys_kicks *c = s->integrator->coefficients;
    struct map *m = s->state;
    const size_t half = s->n / 2;
    double t = s->t;
    if (!m->has || memcmp(m->known, s->y, s->n * sizeof *s->y) != 0) {
        to_jacobi(m, s->y, m->q);
        to_jacobi(m, s->y + half, m->v);
        memset(m->cut_q, 0, s->n * sizeof *m->cut_q);
        memcpy(s->next, s->y, half * sizeof *s->y);
        if (find_kick(s, m, s->t, error) != AD_OK)
            return error->status;
    }
    m->has = false;
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
    m->has = true;
    return AD_OK;
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
    m->share = m->force + half;
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

static const struct phys_scheme scheme = {.work = work, .begin = begin, .end = end, .step = step};

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
