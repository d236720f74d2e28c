/* Finds jumps of the forces along a motion (check.h): kinks of L by whatever name. Between two
   neighbouring points the step with the largest change is divided again and again: a smooth change
   falls with the step, a jump stays. */
#include "check.h"
#include "internal.h"

#include <math.h>
#include <stdlib.h>

enum { PARTS = 256, ZOOMS = 3, MOST_STEPS = 1024 };

static const double STAYS = 0.5;    /* of a change, over PARTS^2 times shorter steps */
static const double ROUGHLY = 1e-9; /* of the largest force: less is rounding */

struct section {
    ad_tape *tape;
    ad_program *program;
    ad_var q, v, t, force;
    double *x;            /* [2 dof + 1][PARTS + 1] */
    double at[PARTS + 1]; /* shares of the step */
    double value[PARTS + 1];
};

static enum ad_status record(struct section *s, const struct phys_system *system,
                             struct ad_error *error)
{
    ad_var g[2];
    s->tape = ad_tape_new(AD_F64);
    s->x = malloc((2 * system->dof + 1) * (PARTS + 1) * sizeof *s->x);
    if (!s->tape || !s->x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->q = ad_input(s->tape, system->dof, PARTS + 1, "q");
    s->v = ad_input(s->tape, system->dof, PARTS + 1, "v");
    s->t = ad_input(s->tape, 1, PARTS + 1, "t");
    ad_grad(ad_sum(phys_system_lagrangian(system, s->q, s->v, s->t)), 2, (ad_var[]){s->q, s->v}, g);
    g[0] = phys_system_add_forces(system, g[0], s->q, s->v, s->t);
    s->force = ad_add(phys_mixed(g[0], 0.3), phys_mixed(g[1], 0.7));
    ad_compile(s->tape, 1, &s->force, &s->program);
    return phys_tape_status(s->tape, error);
}

/* Row k of q, v and t at point i. */
static double entry(const struct phys_points *at, size_t dof, size_t k, size_t i)
{
    return k < dof ? at->q[k * at->n + i] : k < 2 * dof ? at->v[(k - dof) * at->n + i] : at->t[i];
}

/* The forces at equal parts of a share of the way from point i to point `next`; returns the part
   with the largest change, and the change. */
static size_t divide(struct section *s, const struct phys_points *at, size_t dof, size_t i,
                     size_t next, const double share[2], double *change, double *largest)
{
    size_t most = 0;
    for (size_t j = 0; j <= PARTS; j++)
        s->at[j] = share[0] + (share[1] - share[0]) * (double)j / PARTS;
    for (size_t k = 0; k <= 2 * dof; k++) {
        double from = entry(at, dof, k, i), to = entry(at, dof, k, next);
        for (size_t j = 0; j <= PARTS; j++)
            s->x[k * (PARTS + 1) + j] = from + (to - from) * s->at[j];
    }
    ad_set(s->program, s->q, s->x);
    ad_set(s->program, s->v, s->x + dof * (PARTS + 1));
    ad_set(s->program, s->t, s->x + 2 * dof * (PARTS + 1));
    ad_run(s->program);
    ad_get(s->program, s->force, s->value);
    *change = 0;
    for (size_t j = 0; j < PARTS; j++) {
        double here = fabs(s->value[j + 1] - s->value[j]);
        *largest = fmax(*largest, fabs(s->value[j]));
        if (here > *change) {
            *change = here;
            most = j;
        }
    }
    return most;
}

bool phys_check_jumps(const struct phys_system *system, const struct phys_points *at)
{
    struct section s = {0};
    struct ad_error error = {0};
    if (AD_LACKS(&error, system, system->scene, at, at->q, at->v, at->t))
        return false;
    size_t stride = (at->n + MOST_STEPS - 1) / MOST_STEPS;
    bool found = false;
    double largest = 0;
    if (record(&s, system, &error) == AD_OK)
        for (size_t i = 0; i + 1 < at->n && !found; i += stride) {
            size_t next = i + stride < at->n ? i + stride : at->n - 1;
            double share[2] = {0, 1}, change[ZOOMS];
            for (int z = 0; z < ZOOMS; z++) {
                size_t most = divide(&s, at, system->dof, i, next, share, &change[z], &largest);
                share[0] = s.at[most];
                share[1] = s.at[most + 1];
            }
            found = change[0] > ROUGHLY * largest && change[ZOOMS - 1] >= STAYS * change[0];
        }
    ad_program_free(s.program);
    ad_tape_free(s.tape);
    free(s.x);
    return found;
}
