/* Isolates roots by subdivision (roots.h). On an interval f is interpolated at the eight Chebyshev
   points and compared with the polynomial where the interpolation error is extreme. In the
   Bernstein basis the coefficients bound the polynomial, and their differences its slope: an
   interval without a root or with a monotonic f is done, all others are halved. Brent's method then
   finds the root (Algorithms for Minimization without Derivatives, 1973, ch. 4). The proof is in
   docs/theory.md. */
#include "roots.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

enum { N = PHYS_ROOTS_N, CHECKS = N + 1, DEEPEST = 40, MOST_INTERVALS = 1000, BRENT_STEPS = 100 };

struct search {
    phys_root_function *f;
    void *context;
    struct phys_root *roots;
    size_t n, intervals;
    const struct phys_roots_table *table;
};

static double node(int i) { return 0.5 - 0.5 * cos((i + 0.5) * M_PI / N); }
static double extreme(int i) { return 0.5 - 0.5 * cos(i * M_PI / N); }

static void basis(double x, double *B)
{
    static const double binomial[N] = {1, 7, 21, 35, 35, 21, 7, 1};
    for (int j = 0; j < N; j++)
        B[j] = binomial[j] * pow(x, j) * pow(1 - x, N - 1 - j);
}

/* The coefficients come from the inverse of the matrix of basis functions at the nodes. */
void phys_roots_fill(struct phys_roots_table *table)
{
    double matrix[N * N], column[N];
    int pivots[N];
    for (int i = 0; i < N; i++)
        basis(node(i), matrix + i * N);
    phys_lapack_lu_factor(N, matrix, pivots);
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < N; i++)
            column[i] = i == j;
        phys_lapack_lu_solve(N, matrix, pivots, column);
        for (int i = 0; i < N; i++)
            table->coefficient[i][j] = column[i];
    }
    for (int i = 0; i < CHECKS; i++)
        basis(extreme(i), table->value[i]);
}

/* The root between a and b, where the values fa and fb differ in sign. */
static double brent(struct search *s, double a, double b, double fa, double fb)
{
    double c = a, fc = fa, d = b - a, e = d;
    for (int k = 0; k < BRENT_STEPS; k++) {
        if ((fb > 0) == (fc > 0)) {
            c = a, fc = fa;
            d = e = b - a;
        }
        if (fabs(fc) < fabs(fb)) {
            a = b, b = c, c = a;
            fa = fb, fb = fc, fc = fa;
        }
        double tolerance = 2 * DBL_EPSILON * fabs(b), m = 0.5 * (c - b);
        if (fabs(m) <= tolerance || fb == 0)
            break;
        if (fabs(e) < tolerance || fabs(fa) <= fabs(fb)) {
            d = e = m;
        } else {
            double t = fb / fa, p, q;
            if (a == c) { /* secant */
                p = 2 * m * t;
                q = 1 - t;
            } else { /* inverse quadratic */
                double r = fb / fc, u = fa / fc;
                p = t * (2 * m * u * (u - r) - (b - a) * (r - 1));
                q = (u - 1) * (r - 1) * (t - 1);
            }
            q = p > 0 ? -q : q;
            p = fabs(p);
            bool good = 2 * p < fmin(3 * m * q - fabs(tolerance * q), fabs(e * q));
            e = good ? d : m;
            d = good ? p / q : m;
        }
        a = b, fa = fb;
        b += fabs(d) > tolerance ? d : copysign(tolerance, m);
        fb = s->f(s->context, b);
    }
    return b;
}

/* f on an interval: Bernstein coefficients, and how far it may be from them. */
struct model {
    double coefficient[N], error, largest;
    double at_a, at_b, least_at; /* values at the ends; where |f| is least among those seen */
};

static void make_model(struct search *s, double a, double b, struct model *m)
{
    double value[N], least = INFINITY;
    *m = (struct model){.least_at = a};
    for (int i = 0; i < N; i++)
        value[i] = s->f(s->context, a + (b - a) * node(i));
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++)
            m->coefficient[i] += s->table->coefficient[i][j] * value[j];
        m->largest = fmax(m->largest, fabs(m->coefficient[i]));
    }
    for (int i = 0; i < CHECKS; i++) {
        double x = i == CHECKS - 1 ? b : a + (b - a) * extreme(i), f = s->f(s->context, x), p = 0;
        for (int j = 0; j < N; j++)
            p += s->table->value[i][j] * m->coefficient[j];
        m->error = fabs(f - p) <= m->error ? m->error : fabs(f - p); /* NaN stays */
        if (i == 0)
            m->at_a = f;
        m->at_b = f;
        if (fabs(f) < least) {
            least = fabs(f);
            m->least_at = x;
        }
    }
    m->error = 2 * m->error + 16 * DBL_EPSILON * m->largest; /* its 8th derivative may double */
}

static bool of_one_sign(const struct model *m)
{
    double low = INFINITY, high = -INFINITY;
    for (int i = 0; i < N; i++) {
        low = fmin(low, m->coefficient[i]);
        high = fmax(high, m->coefficient[i]);
    }
    return low > m->error || high < -m->error;
}

/* Slopes of the error are at most 2 (N - 1)^2 + ... times it (Markov), rounded up. */
static bool is_monotonic(const struct model *m)
{
    double low = INFINITY, high = -INFINITY, error = 4 * N * N * m->error;
    for (int i = 1; i < N; i++) {
        double slope = (N - 1) * (m->coefficient[i] - m->coefficient[i - 1]);
        low = fmin(low, slope);
        high = fmax(high, slope);
    }
    return low > error || high < -error;
}

static void add(struct search *s, double x, int kind)
{
    if (s->n < PHYS_ROOTS_MOST)
        s->roots[s->n++] = (struct phys_root){x, kind};
}

static void settle(struct search *s, double a, double b, const struct model *m)
{
    if ((m->at_a < 0 && m->at_b > 0) || (m->at_a > 0 && m->at_b < 0))
        add(s, brent(s, a, b, m->at_a, m->at_b), m->at_b > 0 ? 1 : -1);
}

static void isolate(struct search *s, double a, double b, int depth)
{
    struct model m;
    make_model(s, a, b, &m);
    if (!isfinite(m.error) || of_one_sign(&m))
        return;
    if (is_monotonic(&m)) {
        settle(s, a, b, &m);
        return;
    }
    /* the rest is noise, or a root of even order */
    bool spent = ++s->intervals > MOST_INTERVALS || depth == DEEPEST || s->n == PHYS_ROOTS_MOST;
    if (spent || (m.error >= 0.1 * m.largest && depth >= DEEPEST / 4)) {
        settle(s, a, b, &m);
        if (m.at_a != 0 && m.at_b != 0 && (m.at_a > 0) == (m.at_b > 0))
            add(s, m.least_at, 0);
        return;
    }
    double middle = 0.5 * (a + b);
    if (s->f(s->context, middle) == 0) /* a root must not fall between two intervals */
        middle = a + 0.5123456789 * (b - a);
    isolate(s, a, middle, depth + 1);
    isolate(s, middle, b, depth + 1);
}

/* Next to each other in the noise around one place: one touch. */
static void merge(struct search *s, double width)
{
    size_t n = 0;
    for (size_t i = 0; i < s->n; i++) {
        bool again = n > 0 && s->roots[i].kind == 0 && s->roots[i].x - s->roots[n - 1].x < width;
        if (!again)
            s->roots[n++] = s->roots[i];
    }
    s->n = n;
}

size_t phys_roots(const struct phys_roots_table *table, phys_root_function *f, void *context,
                  double a, double b, struct phys_root roots[])
{
    struct search s = {.f = f, .context = context, .roots = roots, .table = table};
    isolate(&s, a, b, 0);
    merge(&s, 1e-5 * (b - a));
    return s.n;
}
