/* The longest stable step of a method on an oscillation. A step from (1, 0) and one from (0, 1) of
   q'' = -q are the columns of its matrix, whose eigenvalues give growth and phase per step (Hairer,
   Lubich, Wanner, Geometric Numerical Integration, section I.5.2, example of Verlet). */
#include "stability.h"

#include <math.h>
#include <stdio.h>

static const double shortest = 0.01, longest = 50, ratio = 1.01; /* steps looked at */
static const double rounding = 1e-9;                             /* growth that is none */
static const double third = 2 * M_PI / 3;

/* A method at the oscillator. */
struct probe {
    const struct phys_integrator *integrator;
    struct phys_system oscillator;
    struct phys_ode ode;
};

/* The effect of a step on amplitude and phase. */
struct turn {
    double growth, angle;
};

static enum ad_status begin(struct probe *p, const struct phys_integrator *integrator,
                            struct ad_error *error)
{
    *p = (struct probe){.integrator = integrator};
    if (phys_system_open("spring", &p->oscillator, error) != AD_OK ||
        phys_system_set(&p->oscillator, "m", 1, error) != AD_OK ||
        phys_system_set(&p->oscillator, "k", 1, error) != AD_OK)
        return error->status;
    return integrator->lagrangian ? phys_ode_canonical(&p->oscillator, &p->ode, error)
                                  : phys_ode_lagrangian(&p->oscillator, &p->ode, error);
}

static void end(struct probe *p)
{
    phys_ode_free(&p->ode);
    phys_system_close(&p->oscillator);
}

static enum ad_status turn(struct probe *p, double h, struct turn *turn, struct ad_error *error)
{
    const struct phys_simulation step = {
        .size = sizeof step, .integrator = p->integrator, .t1 = h, .dt = h};
    struct phys_simulation_info info;
    double a[2] = {1, 0}, b[2] = {0, 1}; /* columns */
    if (phys_simulate(&step, &p->ode, a, &info, error) != AD_OK ||
        phys_simulate(&step, &p->ode, b, &info, error) != AD_OK)
        return error->status;
    double half = 0.5 * (a[0] + b[1]), det = a[0] * b[1] - a[1] * b[0];
    double apart = half * half - det; /* eigenvalues: half +- sqrt(apart) */
    turn->growth = apart > 0 ? fabs(half) + sqrt(apart) : sqrt(det);
    turn->angle = atan2(sqrt(fmax(-apart, 0)), half);
    return AD_OK;
}

static bool grows(const struct turn *turn) { return turn->growth > 1 + rounding; }
static bool turns_far(const struct turn *turn) { return turn->angle >= third; }

/* The shortest step of which `holds` is true: stepped over, then halved down to. */
static enum ad_status first(struct probe *p, bool (*holds)(const struct turn *turn), double *step,
                            struct ad_error *error)
{
    struct turn now;
    double low = 0, high = shortest;
    for (;; low = high, high *= ratio) {
        if (turn(p, high, &now, error) != AD_OK)
            return error->status;
        if (holds(&now))
            break;
        if (high > longest) {
            *step = INFINITY;
            return AD_OK;
        }
    }
    while (low > 0 && high - low > 1e-15 * high) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high)
            break;
        if (turn(p, middle, &now, error) != AD_OK)
            return error->status;
        *(holds(&now) ? &high : &low) = middle;
    }
    *step = low;
    return AD_OK;
}

enum ad_status phys_step_limits(const struct phys_integrator *integrator,
                                struct phys_step_limits *limits, struct ad_error *error)
{
    struct probe p;
    if (AD_LACKS(error, limits))
        return error->status;
    *limits = (struct phys_step_limits){INFINITY, INFINITY};
    if (AD_LACKS(error, integrator))
        return error->status;
    if (integrator->adaptive)
        return ad_fail(error, AD_E_ARGUMENT, "%s chooses its steps: no limit is asked of them",
                       integrator->name);
    if (begin(&p, integrator, error) == AD_OK &&
        first(&p, grows, &limits->stability, error) == AD_OK && integrator->symplectic)
        first(&p, turns_far, &limits->resonance, error);
    end(&p);
    return error->status;
}

/* ---- in words ---- */

static void describe(const struct phys_integrator *integrator, const struct phys_system *system,
                     double dt, struct phys_step_advice *a)
{
    char name[64], motion[160];
    double w = a->motion.frequency, good = 0.3 / w; /* 20 steps a period */
    phys_coordinate_name(system, a->motion.coordinate, name, sizeof name);
    snprintf(motion, sizeof motion, "the fastest oscillation (period %.4g at t = %.4g, mostly %s)",
             2 * M_PI / w, a->motion.t, name);
    if (a->limit == 0)
        snprintf(a->text, sizeof a->text,
                 "%s makes every oscillation grow, however short its steps: %s grows %.3g times in "
                 "each period with steps of %.4g; try verlet, rk4 or dop853",
                 integrator->name, motion, exp(M_PI * w * dt), dt);
    else if (a->verdict == PHYS_STEP_UNSTABLE)
        snprintf(a->text, sizeof a->text,
                 "steps of %.6g are too long for %s: beyond %.6g %s makes it grow without bound; "
                 "try steps of %.2g, implicit-midpoint or dop853",
                 dt, motion, a->limit, integrator->name, good);
    else if (a->verdict == PHYS_STEP_RESONANT)
        snprintf(a->text, sizeof a->text,
                 "steps of %.6g turn %s by more than a third of a circle: at %.6g %s is in "
                 "resonance with it and nonlinear forces throw it out; try steps of %.2g or dop853",
                 dt, motion, a->resonance, integrator->name, good);
}

enum ad_status phys_step_advise(const struct phys_integrator *integrator,
                                const struct phys_system *system, size_t n, const double *x,
                                const double *t, double dt, struct phys_step_advice *advice,
                                struct ad_error *error)
{
    struct phys_step_limits limits;
    if (AD_LACKS(error, advice))
        return error->status;
    *advice = (struct phys_step_advice){.limit = INFINITY, .resonance = INFINITY};
    if (AD_LACKS(error, system, system->scene) ||
        phys_step_limits(integrator, &limits, error) != AD_OK ||
        phys_normal_modes(system, n, x, t, &advice->motion, error) != AD_OK)
        return error->status;
    double w = advice->motion.frequency;
    if (w == 0)
        return AD_OK;
    advice->limit = limits.stability / w;
    advice->resonance = limits.resonance / w;
    const bool damped = system->scene->dissipation != NULL; /* it ends what resonance begins */
    advice->verdict = dt > advice->limit                  ? PHYS_STEP_UNSTABLE
                      : dt > advice->resonance && !damped ? PHYS_STEP_RESONANT
                                                          : PHYS_STEP_GOOD;
    describe(integrator, system, dt, advice);
    return AD_OK;
}
