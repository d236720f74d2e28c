/* The pair loop of the gas for LANES slices; included once for each width. */
#define GAS_JOIN(a, b) a##_##b
#define GAS_NAME(a, b) GAS_JOIN(a, b)
#define lanes GAS_NAME(lanes, LANES)
#define load GAS_NAME(load, LANES)
#define total GAS_NAME(total, LANES)

typedef double lanes __attribute__((vector_size(8 * LANES)));

static inline void load(lanes *to, const double *from) { memcpy(to, from, sizeof *to); }

static inline double total(const lanes *x)
{
    double sum = 0;
    for (int l = 0; l < LANES; l++)
        sum += (*x)[l];
    return sum;
}

/* Potential energy of LANES slices; x points at the first of them in row 0. */
static double GAS_NAME(gas_potential, LANES)(const double *x)
{
    lanes q[DOF], sum = {0};
    for (int k = 0; k < DOF; k++)
        load(&q[k], x + k * N);
    for (int i = 0; i < BODIES; i++) {
        for (int j = i + 1; j < BODIES; j++) {
            lanes dx = q[2 * i] - q[2 * j], dy = q[2 * i + 1] - q[2 * j + 1];
            lanes u = GAS_S2 / (dx * dx + dy * dy + GAS_SOFT), u3 = u * u * u;
            sum += u3 * u3 - u3;
        }
    }
    return GAS_K * total(&sum);
}

/* The same, and adds -dV/dx times GAS_WEIGHT to g: with u = (s/r)^2,
   -dV/dx = k (12 u^6 - 6 u^3) / r^2 dx. */
static double GAS_NAME(gas_force, LANES)(const double *x, double *g)
{
    const double f0 = GAS_WEIGHT * GAS_K * 6;
    lanes q[DOF], force[DOF], sum = {0};
    for (int k = 0; k < DOF; k++) {
        load(&q[k], x + k * N);
        load(&force[k], g + k * N);
    }
    for (int i = 0; i < BODIES; i++) {
        lanes fx = force[2 * i], fy = force[2 * i + 1];
        for (int j = i + 1; j < BODIES; j++) {
            lanes dx = q[2 * i] - q[2 * j], dy = q[2 * i + 1] - q[2 * j + 1];
            lanes inv = 1 / (dx * dx + dy * dy + GAS_SOFT), u = GAS_S2 * inv, u3 = u * u * u;
            lanes u6 = u3 * u3, v = u6 - u3, f = f0 * inv * (u6 + v);
            sum += v;
            fx += f * dx;
            fy += f * dy;
            force[2 * j] -= f * dx;
            force[2 * j + 1] -= f * dy;
        }
        force[2 * i] = fx;
        force[2 * i + 1] = fy;
    }
    for (int k = 0; k < DOF; k++)
        memcpy(g + k * N, &force[k], sizeof force[k]);
    return GAS_K * total(&sum);
}

/* Adds the derivative of that along du to h: with f(r^2) dx the force,
   f du + 2 f' (d . du) d,   2 f' = -(20 u6 + 8 v) f0 / r^4. */
static void GAS_NAME(gas_product, LANES)(const double *x, const double *along, double *h)
{
    const double f0 = GAS_WEIGHT * GAS_K * 6;
    lanes q[DOF], p[DOF], force[DOF];
    for (int k = 0; k < DOF; k++) {
        load(&q[k], x + k * N);
        load(&p[k], along + k * N);
        load(&force[k], h + k * N);
    }
    for (int i = 0; i < BODIES; i++) {
        lanes fx = force[2 * i], fy = force[2 * i + 1];
        for (int j = i + 1; j < BODIES; j++) {
            lanes dx = q[2 * i] - q[2 * j], dy = q[2 * i + 1] - q[2 * j + 1];
            lanes ux = p[2 * i] - p[2 * j], uy = p[2 * i + 1] - p[2 * j + 1];
            lanes inv = 1 / (dx * dx + dy * dy + GAS_SOFT), u = GAS_S2 * inv, u3 = u * u * u;
            lanes u6 = u3 * u3, v = u6 - u3, f = f0 * inv * (u6 + v);
            lanes turn = f0 * inv * inv * (20 * u6 + 8 * v) * (dx * ux + dy * uy);
            lanes hx = f * ux - turn * dx, hy = f * uy - turn * dy;
            fx += hx;
            fy += hy;
            force[2 * j] -= hx;
            force[2 * j + 1] -= hy;
        }
        force[2 * i] = fx;
        force[2 * i + 1] = fy;
    }
    for (int k = 0; k < DOF; k++)
        memcpy(h + k * N, &force[k], sizeof force[k]);
}

#undef lanes
#undef load
#undef total
#undef GAS_NAME
#undef GAS_JOIN
