/* Second derivatives of the actions of hand_kernels.c times a vector: the derivative of each
   gradient along u. Included by hand_kernels.c only. Except for the double pendulum the kinetic
   part is linear in x and its own derivative. */

/* The part of a pair in the derivative of its force f d, f = k w^2 / r, w = 1 / (r + eps):
   df = -f (2 w + 1/r) dr, dr = d . u / r. Leaves it in place of u. */
static inline void threebody_turn(double dx, double dy, double *ux, double *uy)
{
    const double strength = THREEBODY_WEIGHT * THREEBODY_K;
    double r = distance(dx, dy), inv = 1 / r, w = 1 / (r + THREEBODY_EPS),
           f = strength * w * w * inv;
    double turn = f * (2 * w + inv) * inv * (dx * *ux + dy * *uy);
    *ux = f * *ux - turn * dx;
    *uy = f * *uy - turn * dy;
}

static void threebody_product(const double *restrict x, const double *restrict u,
                              double *restrict h)
{
    for (int k = 0; k < 6; k += 2)
        kinetic_gradient(u + k * N, THREEBODY_DT, THREEBODY_WEIGHT, h + k * N);
#pragma omp simd
    for (int i = 0; i < N; i++) {
        double d[3][2], v[3][2]; /* of the pairs ab, ac, bc */
        for (int c = 0; c < 2; c++) {
            double xa = x[c * N + i], xb = x[(2 + c) * N + i], xc = x[(4 + c) * N + i];
            double ua = u[c * N + i], ub = u[(2 + c) * N + i], uc = u[(4 + c) * N + i];
            d[0][c] = xa - xb, d[1][c] = xa - xc, d[2][c] = xb - xc;
            v[0][c] = ua - ub, v[1][c] = ua - uc, v[2][c] = ub - uc;
        }
        for (int k = 0; k < 3; k++)
            threebody_turn(d[k][0], d[k][1], &v[k][0], &v[k][1]);
        for (int c = 0; c < 2; c++) {
            h[c * N + i] -= v[0][c] + v[1][c];
            h[(2 + c) * N + i] += v[0][c] - v[2][c];
            h[(4 + c) * N + i] += v[1][c] + v[2][c];
        }
    }
}

static void dblpend_product(const double *restrict x, const double *restrict along,
                            double *restrict h)
{
    const double w = DBLPEND_WEIGHT, w_dt = DBLPEND_WEIGHT / DBLPEND_DT;
    ALIGNED double va[N], vb[N], ua[N], ub[N], pa[N], pb[N], s[2 * N], c[2 * N];
    velocities(x, va);
    velocities(x + N, vb);
    velocities(along, ua);
    velocities(along + N, ub);
    sines(x, s);
    cosines(x, c);
#pragma omp simd
    for (int i = 0; i < N; i++) {
        double sa = s[i], sb = s[N + i], ca = c[i], cb = c[N + i], u = va[i], v = vb[i];
        double cross = ca * cb + sa * sb, sine = sa * cb - ca * sb;
        double da = along[i], db = along[N + i], turn = da - db, bend = sine * turn;
        double force = (ua[i] * v + u * ub[i]) * sine + u * v * cross * turn;
        pa[i] = w_dt * (2 * ua[i] + ub[i] * cross - v * bend);
        pb[i] = w_dt * (ub[i] + ua[i] * cross - u * bend);
        h[i] = w * (-force - 2 * ca * da);
        h[N + i] = w * (force - cb * db);
    }
    add_momenta(pa, h);
    add_momenta(pb, h + N);
}

static void ephemeris_product(const double *restrict x, const double *restrict along,
                              double *restrict h)
{
    const double rate = 1 / (EPHEMERIS_DT * EPHEMERIS_DT), inertia = rate * ephemeris_unit;
    ALIGNED double u[EPHEMERIS_DOF * M];
    with_ghosts(EPHEMERIS_DOF, along, u);
#pragma omp simd
    for (int s = 0; s < N; s++) {
        const double *p = u + s;
        double slope[EPHEMERIS_DOF];
#pragma GCC unroll 16
        for (int k = 0; k < EPHEMERIS_DOF; k++)
            slope[k] = inertia * ephemeris_gm[k / 3] *
                       (p[k * M + 1] - p[k * M] - (p[k * M + 2] - p[k * M + 1]));
#pragma GCC unroll 8
        for (int i = 0; i < EPHEMERIS_BODIES; i++) {
#pragma GCC unroll 8
            for (int j = i + 1; j < EPHEMERIS_BODIES; j++) {
                const double *a = x + 3 * i * N + s, *b = x + 3 * j * N + s;
                const double *ua = p + 3 * i * M + 1, *ub = p + 3 * j * M + 1;
                double dx = a[0] - b[0], dy = a[N] - b[N], dz = a[2 * N] - b[2 * N];
                double ux = ua[0] - ub[0], uy = ua[M] - ub[M], uz = ua[2 * M] - ub[2 * M];
                double inverse = ephemeris_inverse(dx, dy, dz), inverse2 = inverse * inverse;
                double f = ephemeris_unit * ephemeris_gm[i] * ephemeris_gm[j] * inverse * inverse2;
                double turn = 3 * f * inverse2 * (dx * ux + dy * uy + dz * uz);
                double hx = f * ux - turn * dx, hy = f * uy - turn * dy, hz = f * uz - turn * dz;
                slope[3 * i] -= hx, slope[3 * j] += hx;
                slope[3 * i + 1] -= hy, slope[3 * j + 1] += hy;
                slope[3 * i + 2] -= hz, slope[3 * j + 2] += hz;
            }
        }
#pragma GCC unroll 16
        for (int k = 0; k < EPHEMERIS_DOF; k++)
            h[k * N + s] = slope[k];
    }
    for (int k = 0; k < EPHEMERIS_DOF; k++)
        h[k * N + N - 2] -=
            inertia * ephemeris_gm[k / 3] * (along[k * N + N - 1] - along[k * N + N - 2]);
}

static void gas_product(const double *x, const double *u, double *h)
{
    for (int k = 0; k < DOF; k += 2)
        kinetic_gradient(u + k * N, GAS_DT, GAS_WEIGHT, h + k * N);
    for (int i = 0; i < EIGHTS; i += 8)
        gas_product_8(x + i, u + i, h + i);
    for (int i = EIGHTS; i < N; i += 4)
        gas_product_4(x + i, u + i, h + i);
}
