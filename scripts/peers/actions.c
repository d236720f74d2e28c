/* Sums of L over slices as a careful C programmer writes them, for gradients_enzyme.py: N slices,
   row k of the path at x[k * N], the last velocity twice, the sum times SCALE. Enzyme's compiler
   has no system headers. Sines and cosines in loops of their own (dblpend_arranged) are vectorised,
   where their arrays fit the stack. */
extern "C" double sqrt(double), sin(double), cos(double);

static double kinetic(int rows, double dt, const double *__restrict x)
{
    double T = 0;
    for (int k = 0; k < rows; k++) {
        const double *p = x + k * (long)N;
        for (int i = 0; i < N - 1; i++)
            T += (p[i + 1] - p[i]) * (p[i + 1] - p[i]);
        T += (p[N - 1] - p[N - 2]) * (p[N - 1] - p[N - 2]);
    }
    return 0.5 * T / (dt * dt);
}

static inline double attraction(double dx, double dy)
{
    return 1.3e-4 / (sqrt(dx * dx + dy * dy + 1e-6) + 1e-6);
}

static double threebody(const double *__restrict x)
{
    double S = 0;
    for (long i = 0; i < N; i++) {
        double ax = x[i], ay = x[N + i], bx = x[2l * N + i], by = x[3l * N + i], cx = x[4l * N + i],
               cy = x[5l * N + i];
        S += attraction(ax - bx, ay - by) + attraction(ax - cx, ay - cy) +
             attraction(bx - cx, by - cy);
    }
    return SCALE * (S + kinetic(6, 0.5, x));
}

static double dblpend(const double *__restrict x)
{
    const double *a = x, *b = x + N, dt = 0.06;
    double S = 0;
    for (int i = 0; i < N; i++) {
        int k = i < N - 1 ? i : N - 2;
        double u = (a[k + 1] - a[k]) / dt, v = (b[k + 1] - b[k]) / dt;
        S += u * u + 0.5 * v * v + u * v * cos(a[i] - b[i]) + 2 * cos(a[i]) + cos(b[i]);
    }
    return SCALE * S;
}

#if N <= 10000
static double dblpend_arranged(const double *__restrict x)
{
    const double *a = x, *b = x + N, dt = 0.06;
    double S = 0, u[N], v[N], s[2][N], c[2][N];
    for (int i = 0; i < N - 1; i++)
        u[i] = (a[i + 1] - a[i]) / dt;
    for (int i = 0; i < N - 1; i++)
        v[i] = (b[i + 1] - b[i]) / dt;
    u[N - 1] = u[N - 2];
    v[N - 1] = v[N - 2];
    for (int i = 0; i < N; i++)
        s[0][i] = sin(a[i]);
    for (int i = 0; i < N; i++)
        s[1][i] = sin(b[i]);
    for (int i = 0; i < N; i++)
        c[0][i] = cos(a[i]);
    for (int i = 0; i < N; i++)
        c[1][i] = cos(b[i]);
    for (int i = 0; i < N; i++)
        S += u[i] * u[i] + 0.5 * v[i] * v[i] +
             u[i] * v[i] * (c[0][i] * c[1][i] + s[0][i] * s[1][i]) + 2 * c[0][i] + c[1][i];
    return SCALE * S;
}
#endif

static double gas(const double *__restrict x)
{
    enum { BODIES = 50 };
    double V = 0;
    for (int i = 0; i < BODIES; i++)
        for (int j = i + 1; j < BODIES; j++)
            for (int t = 0; t < N; t++) {
                double dx = x[2l * i * N + t] - x[2l * j * N + t],
                       dy = x[(2l * i + 1) * N + t] - x[(2l * j + 1) * N + t];
                double u = 0.0016 / (dx * dx + dy * dy + 1e-6), u3 = u * u * u;
                V += u3 * u3 - u3;
            }
    return SCALE * (kinetic(2 * BODIES, 0.2, x) - 1e-4 * V);
}
