/* The ephemeris kernel, included by hand_kernels.c only.

   Energies are in units of 1/G, where masses are GM. Square root and division of each pair take
   most of the time. Loops over coordinates and pairs must be unrolled before the one over slices
   can be vectorised. */
#define EPHEMERIS_DT 86400.0
#define EPHEMERIS_G 6.67430e-11

enum {
    EPHEMERIS_BODIES = 5,
    EPHEMERIS_DOF = 3 * EPHEMERIS_BODIES,
};

static const double ephemeris_gm[EPHEMERIS_BODIES] = {
    132712440041.93938e9, 22031.86855e9, 324858.592e9, 398600.435436e9, 42828.375214e9};

static const double ephemeris_unit = 1.0 / (EPHEMERIS_G * EPHEMERIS_BODIES * N);

static inline double ephemeris_inverse(double dx, double dy, double dz)
{
    return 1 / sqrt(dx * dx + dy * dy + dz * dz);
}

static double ephemeris_kinetic(const double *restrict x)
{
    double T = 0;
    for (int k = 0; k < EPHEMERIS_DOF; k++, x += N) {
        double last = x[N - 1] - x[N - 2], sum = last * last;
#pragma omp simd reduction(+ : sum)
        for (int s = 0; s < N - 1; s++)
            sum += (x[s + 1] - x[s]) * (x[s + 1] - x[s]);
        T += ephemeris_gm[k / 3] * sum;
    }
    return 0.5 / (EPHEMERIS_DT * EPHEMERIS_DT) * T;
}

static double ephemeris_primal(const double *x)
{
    double V = 0;
#pragma omp simd reduction(+ : V)
    for (int s = 0; s < N; s++) {
#pragma GCC unroll 8
        for (int i = 0; i < EPHEMERIS_BODIES; i++) {
#pragma GCC unroll 8
            for (int j = i + 1; j < EPHEMERIS_BODIES; j++) {
                const double *a = x + 3 * i * N + s, *b = x + 3 * j * N + s;
                V -= ephemeris_gm[i] * ephemeris_gm[j] *
                     ephemeris_inverse(a[0] - b[0], a[N] - b[N], a[2 * N] - b[2 * N]);
            }
        }
    }
    return ephemeris_unit * (ephemeris_kinetic(x) - V);
}

static double ephemeris_gradient(const double *restrict x, double *restrict g)
{
    const double rate = 1 / (EPHEMERIS_DT * EPHEMERIS_DT), inertia = rate * ephemeris_unit;
    ALIGNED double q[EPHEMERIS_DOF * M];
    double T = 0, V = 0;
    with_ghosts(EPHEMERIS_DOF, x, q);
#pragma omp simd reduction(+ : T, V)
    for (int s = 0; s < N; s++) {
        const double *p = q + s;
        double slope[EPHEMERIS_DOF];
#pragma GCC unroll 16
        for (int k = 0; k < EPHEMERIS_DOF; k++) {
            double before = p[k * M + 1] - p[k * M], after = p[k * M + 2] - p[k * M + 1];
            T += ephemeris_gm[k / 3] * (after * after);
            slope[k] = inertia * ephemeris_gm[k / 3] * (before - after);
        }
#pragma GCC unroll 8
        for (int i = 0; i < EPHEMERIS_BODIES; i++) {
#pragma GCC unroll 8
            for (int j = i + 1; j < EPHEMERIS_BODIES; j++) {
                const double *a = p + 3 * i * M + 1, *b = p + 3 * j * M + 1;
                double dx = a[0] - b[0], dy = a[M] - b[M], dz = a[2 * M] - b[2 * M];
                double inverse = ephemeris_inverse(dx, dy, dz);
                double u = ephemeris_gm[i] * ephemeris_gm[j] * inverse;
                double f = ephemeris_unit * u * inverse * inverse;
                V -= u;
                slope[3 * i] -= f * dx, slope[3 * j] += f * dx;
                slope[3 * i + 1] -= f * dy, slope[3 * j + 1] += f * dy;
                slope[3 * i + 2] -= f * dz, slope[3 * j + 2] += f * dz;
            }
        }
#pragma GCC unroll 16
        for (int k = 0; k < EPHEMERIS_DOF; k++)
            g[k * N + s] = slope[k];
    }
    for (int k = 0; k < EPHEMERIS_DOF; k++)
        g[k * N + N - 2] -= inertia * ephemeris_gm[k / 3] * (x[k * N + N - 1] - x[k * N + N - 2]);
    return ephemeris_unit * (0.5 * rate * T - V);
}
