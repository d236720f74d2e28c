/* The potential of one coordinate (potential.h). The energy grows with the speed where L_vv > 0,
   d(v L_v - L)/dv = v L_vv, so direction and energy determine the speed. */
#include "potential.h"

#include <math.h>
#include <string.h>

enum { LANES = PHYS_POTENTIAL_LANES, ITERATIONS = 80 };

enum ad_status phys_potential_new(struct phys_potential *p, const struct phys_system *system,
                                  struct ad_error *error)
{
    static const double zeros[LANES];
    *p = (struct phys_potential){.tape = ad_tape_new(AD_F64)};
    if (!p->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_var still = ad_const(p->tape, 1, LANES, zeros), by_v;
    p->q = ad_input(p->tape, 1, LANES, "q");
    p->v = ad_input(p->tape, 1, LANES, "v");
    p->place = ad_input(p->tape, 1, LANES, "place");
    ad_var L = phys_system_lagrangian(system, p->q, p->v, still);
    ad_var rest = phys_system_lagrangian(system, p->place, still, still);
    p->U = ad_neg(rest);
    if (ad_grad(L, 1, &p->v, &by_v) != AD_OK || ad_grad(by_v, 1, &p->v, &p->mass) != AD_OK ||
        ad_grad(p->U, 1, &p->place, &p->slope) != AD_OK ||
        ad_grad(p->slope, 1, &p->place, &p->bend) != AD_OK)
        return phys_tape_status(p->tape, error);
    p->energy = ad_sub(ad_mul(p->v, by_v), L);
    ad_compile(p->tape, 2, (ad_var[]){p->energy, p->mass}, &p->of_motion);
    ad_compile(p->tape, 3, (ad_var[]){p->U, p->slope, p->bend}, &p->of_place);
    p->quadratic = phys_is_independent(p->tape, p->mass, 1, &p->v, error);
    return phys_tape_status(p->tape, error);
}

void phys_potential_free(struct phys_potential *p)
{
    ad_program_free(p->of_motion);
    ad_program_free(p->of_place);
    ad_tape_free(p->tape);
}

static void set(ad_program *program, ad_var x, size_t n, const double *values)
{
    double lanes[LANES];
    for (size_t k = 0; k < LANES; k++)
        lanes[k] = values[k < n ? k : n - 1];
    ad_set(program, x, lanes);
}

static void run_places(struct phys_potential *p, size_t n, const double *q)
{
    set(p->of_place, p->place, n, q);
    ad_run(p->of_place);
}

void phys_potential_at(struct phys_potential *p, double q, double *U, double *slope, double *bend)
{
    run_places(p, 1, &q);
    *U = *(const double *)ad_data(p->of_place, p->U);
    *slope = *(const double *)ad_data(p->of_place, p->slope);
    *bend = *(const double *)ad_data(p->of_place, p->bend);
}

void phys_potential_values(struct phys_potential *p, size_t n, const double *q, double *U)
{
    for (size_t k = 0; k < n; k += LANES) {
        size_t m = n - k < LANES ? n - k : LANES;
        run_places(p, m, q + k);
        memcpy(U + k, ad_data(p->of_place, p->U), m * sizeof *U);
    }
}

static void run_motion(struct phys_potential *p, size_t n, const double *v)
{
    set(p->of_motion, p->v, n, v);
    ad_run(p->of_motion);
}

double phys_potential_energy(struct phys_potential *p, double q, double v)
{
    set(p->of_motion, p->q, 1, &q);
    run_motion(p, 1, &v);
    return *(const double *)ad_data(p->of_motion, p->energy);
}

/* Newton's method on the energy, kept between a speed too low and one too high. */
static void solve_speeds(struct phys_potential *p, int direction, size_t n, const double *rest,
                         const double *K, double *v)
{
    double low[LANES] = {0}, high[LANES];
    for (size_t k = 0; k < n; k++)
        high[k] = (double)INFINITY;
    for (int i = 0, moved = 1; i < ITERATIONS && moved; i++) {
        run_motion(p, n, v);
        const double *energy = ad_data(p->of_motion, p->energy);
        const double *mass = ad_data(p->of_motion, p->mass);
        moved = 0;
        for (size_t k = 0; k < n; k++) {
            double speed = direction * v[k], over = energy[k] - rest[k] - K[k];
            bool beyond = !(over <= 0); /* or no number */
            *(beyond ? &high[k] : &low[k]) = speed;
            double next = speed - over / (speed * mass[k]);
            if (!(next > low[k] && next < high[k]))
                next = isinf(high[k]) ? 2 * speed : 0.5 * (low[k] + high[k]);
            moved |= fabs(next - speed) > 1e-13 * speed;
            v[k] = direction * next;
        }
    }
}

static void find_speeds(struct phys_potential *p, int direction, size_t n, const double *q,
                        const double *K, double *speed)
{
    double v[LANES] = {0}, rest[LANES];
    set(p->of_motion, p->q, n, q);
    run_motion(p, n, v);
    memcpy(rest, ad_data(p->of_motion, p->energy), sizeof rest);
    const double *mass = ad_data(p->of_motion, p->mass);
    double most = 0;
    for (size_t k = 0; k < n; k++) {
        v[k] = direction * (mass[k] > 0 ? sqrt(2 * K[k] / mass[k]) : (double)NAN);
        most = fmax(most, K[k]);
    }
    if (!p->quadratic && most > 0)
        solve_speeds(p, direction, n, rest, K, v);
    for (size_t k = 0; k < n; k++)
        speed[k] = direction * v[k];
}

void phys_potential_speeds(struct phys_potential *p, int direction, size_t n, const double *q,
                           const double *K, double *speed)
{
    for (size_t k = 0; k < n; k += LANES)
        find_speeds(p, direction, n - k < LANES ? n - k : LANES, q + k, K + k, speed + k);
}
