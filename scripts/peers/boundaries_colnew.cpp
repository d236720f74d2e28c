/* COLNEW (Bader and Ascher 1987), which Debian has as part of Scilab (scilab-cli), on the boundary problems of
   `leastaction chart paths`, in the columns of its boundaries.csv that compare.py needs. From a straight
   line, fields in C++ with exact Jacobians; seconds are CPU time of the solution alone.

       c++ -O2 boundaries_colnew.cpp $(ldd /usr/bin/scilab-cli-bin | grep -o '/[^ ]*libsci[^ ]*') */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

extern "C" {
void colnew_(int *ncomp, int *m, double *left, double *right, double *zeta, int *ipar, int *ltol, double *tol,
             double *fixed, int *ispace, double *fspace, int *iflag,
             void (*fsub)(double *, double *, double *), void (*dfsub)(double *, double *, double *),
             void (*gsub)(int *, double *, double *), void (*dgsub)(int *, double *, double *),
             void (*guess)(double *, double *, double *));
void appsln_(double *x, double *z, double *fspace, int *ispace);
}

enum { MOST = 6, POINTS = 101, ROUNDS = 21, STEPS = 2000 };

static int inputs; /* of the problem: q, v */

/* A number and its derivatives by q and v. */
struct Dual {
    double x, d[2 * MOST];
    Dual(double value = 0) : x(value) { std::fill(d, d + inputs, 0.0); }
};
#define BINARY(op, value, slope)                                                                     \
    static Dual operator op(const Dual &a, const Dual &b)                                            \
    {                                                                                                \
        Dual y(value);                                                                               \
        for (int k = 0; k < inputs; k++)                                                             \
            y.d[k] = slope;                                                                          \
        return y;                                                                                    \
    }
BINARY(+, a.x + b.x, a.d[k] + b.d[k])
BINARY(-, a.x - b.x, a.d[k] - b.d[k])
BINARY(*, a.x *b.x, a.d[k] * b.x + a.x * b.d[k])
BINARY(/, a.x / b.x, (a.d[k] - y.x * b.d[k]) / b.x)
static Dual chain(const Dual &a, double value, double slope)
{
    Dual y(value);
    for (int k = 0; k < inputs; k++)
        y.d[k] = slope * a.d[k];
    return y;
}
static Dual sin(const Dual &a) { return chain(a, std::sin(a.x), std::cos(a.x)); }
static Dual cos(const Dual &a) { return chain(a, std::cos(a.x), -std::sin(a.x)); }
static Dual sqrt(const Dual &a) { return chain(a, std::sqrt(a.x), 0.5 / std::sqrt(a.x)); }
using std::cos;
using std::sin;
using std::sqrt;

/* ---- problems: accelerations of the scenes of `leastaction` ---- */

template <class T> void pendulum(const T *q, const T *, T *a) { a[0] = -1.0 / 180 * sin(q[0]); }

template <class T> void dblpend(const T *q, const T *v, T *a)
{
    T c = cos(q[0] - q[1]), s = sin(q[0] - q[1]), det = 2.0 - c * c;
    T f = -1.0 * s * v[1] * v[1] - 2.0 * sin(q[0]), g = s * v[0] * v[0] - sin(q[1]);
    a[0] = (f - c * g) / det;
    a[1] = (2.0 * g - c * f) / det;
}

template <class T> void kepler(const T *q, const T *, T *a)
{
    T r2 = q[0] * q[0] + q[1] * q[1], w = -1.0 / (r2 * sqrt(r2));
    a[0] = w * q[0];
    a[1] = w * q[1];
}

/* -G m m' / (sqrt(r^2 + softening) + offset) */
template <class T> void bodies(const T *q, T *a, const double *m, double G, double softening, double offset)
{
    for (int k = 0; k < 6; k++)
        a[k] = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 3; j++) {
            T x = q[2 * j] - q[2 * i], y = q[2 * j + 1] - q[2 * i + 1];
            T r = sqrt(x * x + y * y + softening), s = r + offset, w = G / (s * s * r);
            a[2 * i] = a[2 * i] + m[j] * w * x;
            a[2 * i + 1] = a[2 * i + 1] + m[j] * w * y;
            a[2 * j] = a[2 * j] - m[i] * w * x;
            a[2 * j + 1] = a[2 * j + 1] - m[i] * w * y;
        }
}
static const double ones[] = {1, 1, 1}, pythagorean_masses[] = {3, 4, 5};
template <class T> void threebody(const T *q, const T *, T *a) { bodies(q, a, ones, 0.00013, 1e-6, 1e-6); }
template <class T> void figure8(const T *q, const T *, T *a) { bodies(q, a, ones, 1, 0, 0); }
template <class T> void pythagorean(const T *q, const T *, T *a) { bodies(q, a, pythagorean_masses, 1, 0, 0); }

struct Problem {
    const char *name;
    double time;
    int dof;
    void (*field)(const double *, const double *, double *);
    void (*slopes)(const Dual *, const Dual *, Dual *);
    double start[2 * MOST]; /* q, v */
};
#define FIELD(name) name<double>, name<Dual>
#define X8 0.97000436
#define Y8 -0.2430874784197
#define U8 -0.9324073307192
#define W8 -0.8647315139076
static const Problem problems[] = {
    {"pendulum", 40, 1, FIELD(pendulum), {M_PI / 2, 0}},
    {"dblpend", 2, 2, FIELD(dblpend), {3 * M_PI / 7, 3 * M_PI / 4, 0, 0}},
    {"kepler", 2.5, 2, FIELD(kepler), {0.4, 0, 0, 2}},
    {"threebody", 20, 6, FIELD(threebody), {.4, .3, .4, .7, .7, .5, .017, -.006, -.012, -.012, .002, .017}},
    {"figure8", 1, 6, FIELD(figure8), {X8, Y8, -X8, -(Y8), 0, 0, -U8 / 2, -W8 / 2, -U8 / 2, -W8 / 2, U8, W8}},
    {"pythagorean", 1.5, 6, FIELD(pythagorean), {1, 3, -2, -1, 1, -1}},
};

static const Problem *problem;
static double truth[POINTS][2 * MOST]; /* q, v of the motion, by Runge and Kutta's method of order 4 */

static void follow()
{
    int n = problem->dof;
    double h = problem->time / ((POINTS - 1) * STEPS), y[2 * MOST];
    auto rate = [n](const double *at, double *f) {
        for (int k = 0; k < n; k++)
            f[k] = at[n + k];
        problem->field(at, at + n, f + n);
    };
    std::copy(problem->start, problem->start + 2 * n, y);
    for (int p = 0;; p++) {
        std::copy(y, y + 2 * n, truth[p]);
        if (p == POINTS - 1)
            return;
        for (int s = 0; s < STEPS; s++) {
            double f[4][2 * MOST], at[2 * MOST];
            for (int stage = 0; stage < 4; stage++) {
                double share = stage == 3 ? h : stage ? h / 2 : 0;
                for (int k = 0; k < 2 * n; k++)
                    at[k] = y[k] + (stage ? share * f[stage - 1][k] : 0);
                rate(at, f[stage]);
            }
            for (int k = 0; k < 2 * n; k++)
                y[k] += h / 6 * (f[0][k] + 2 * f[1][k] + 2 * f[2][k] + f[3][k]);
        }
    }
}

/* ---- what COLNEW calls; z is u1, u1', u2, u2' ... ---- */

static void fsub(double *, double *z, double *f)
{
    double q[MOST], v[MOST];
    for (int k = 0; k < problem->dof; k++) {
        q[k] = z[2 * k];
        v[k] = z[2 * k + 1];
    }
    problem->field(q, v, f);
}

static void dfsub(double *, double *z, double *df)
{
    int n = problem->dof;
    Dual q[MOST], v[MOST], a[MOST];
    for (int k = 0; k < n; k++) {
        q[k].x = z[2 * k];
        q[k].d[2 * k] = 1;
        v[k].x = z[2 * k + 1];
        v[k].d[2 * k + 1] = 1;
    }
    problem->slopes(q, v, a);
    for (int j = 0; j < 2 * n; j++)
        for (int i = 0; i < n; i++)
            df[j * n + i] = a[i].d[j];
}

static void gsub(int *i, double *z, double *g)
{
    int k = *i - 1, n = problem->dof;
    *g = z[2 * (k % n)] - truth[k < n ? 0 : POINTS - 1][k % n];
}

static void dgsub(int *i, double *, double *dg)
{
    std::fill(dg, dg + 2 * problem->dof, 0.0);
    dg[2 * ((*i - 1) % problem->dof)] = 1;
}

static void guess(double *t, double *z, double *dmval)
{
    for (int k = 0; k < problem->dof; k++) {
        double slope = (truth[POINTS - 1][k] - truth[0][k]) / problem->time;
        z[2 * k] = truth[0][k] + *t * slope;
        z[2 * k + 1] = slope;
        dmval[k] = 0;
    }
}

/* ---- runs ---- */

/* Room for a hundred elements: where that is not enough it does not converge from the line. */
static std::vector<double> fspace(200000);
static std::vector<int> ispace(20000);

/* Seconds; negative: not solved. Tolerances are of positions, relative to 1 + |u|, as COLNEW's are. */
static double solve(int k, double tol)
{
    int n = problem->dof, m[MOST], ltol[MOST], iflag = 0;
    int ipar[11] = {1, k, 5, n, (int)fspace.size(), (int)ispace.size(), 1, 0, 1, 0, 0};
    double zeta[2 * MOST], tols[MOST], fixed = 0, left = 0, right = problem->time;
    for (int j = 0; j < n; j++) {
        m[j] = 2;
        ltol[j] = 2 * j + 1;
        tols[j] = tol;
        zeta[j] = left;
        zeta[n + j] = right;
    }
    clock_t began = clock();
    colnew_(&n, m, &left, &right, zeta, ipar, ltol, tols, &fixed, ispace.data(), fspace.data(), &iflag, fsub,
            dfsub, gsub, dgsub, guess);
    return iflag == 1 ? double(clock() - began) / CLOCKS_PER_SEC : -1;
}

static double error()
{
    double sum = 0, all = 0;
    for (int p = 0; p < POINTS; p++) {
        double t = problem->time * p / (POINTS - 1), z[2 * MOST];
        appsln_(&t, z, fspace.data(), ispace.data());
        for (int k = 0; k < problem->dof; k++) {
            sum += std::pow(z[2 * k] - truth[p][k], 2);
            all += truth[p][k] * truth[p][k];
        }
    }
    return std::sqrt(sum / all);
}

int main()
{
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::puts("problem,method,tol,seconds,error");
    for (const Problem &p : problems) {
        problem = &p;
        inputs = 2 * p.dof;
        follow();
        for (int k = 3; k <= 7; k += 2)
            for (double tol = 1e-2; tol > 2e-12; tol /= 10) {
                std::vector<double> seconds(ROUNDS);
                if (solve(k, tol) < 0 || error() > 0.1) /* no path, or another */
                    break;
                for (double &s : seconds)
                    s = solve(k, tol);
                std::sort(seconds.begin(), seconds.end());
                std::printf("%s,colnew %d points,%.0e,%.4g,%.4g\n", p.name, k, tol, seconds[ROUNDS / 2],
                            error());
            }
    }
}
