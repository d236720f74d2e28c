/* A guess for a climb that found no path from the one given: a path that is found easily, followed
   to the time, then to the end, that are asked for (Allgower and Georg, Numerical Continuation
   Methods, 1990). First that of a short time, near the guess; then motions from the guess's start.
 */
#include "internal.h"
#include "autodiff/free.h"
#include "physics/path/ends.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ELEMENTS = 32, MOST_SOLVED = 200 };
static const double SHORTEST = 1.0 / 512, FIRST = 1.0 / 8, LONGER = 1.5; /* shares of the way */
/* Start velocities of motions, in units of the guess's mean velocity. */
static const double VELOCITY[] = {0, 1, -1, 2, -2, 4, -4};

struct walk {
    const struct phys_climb *c;
    struct phys_path_settings settings;
    double dt;
    size_t n, dof, slices, solved; /* solved: paths, found or not */
    double *path, *known;          /* [n] */
    double *way; /* [dof], if `ends`: what is left for the end to move, at the start */
    bool ends, stopped;
};

/* Moves the path from the share `at` of the way to `next`. */
static bool move(struct walk *w, double at, double next)
{
    const size_t degree = w->settings.rule->degree;
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    for (size_t k = 0; w->ends && k < w->n; k++) {
        const double node =
            (double)(k % w->slices) + (double)(k / w->slices / w->dof) / (double)degree;
        w->path[k] += (next - at) * w->way[k / w->slices % w->dof] * node / (double)(w->slices - 1);
    }
    w->settings.dt = w->ends ? w->dt : next * w->dt;
    phys_newton_over(w->c->system, &w->settings, w->c->to->of, false, w->path, &info, &lost);
    w->stopped = info.stop == PHYS_STOP_INTERRUPTED;
    return lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING;
}

/* Whether the path arrives. */
static bool follow(struct walk *w)
{
    double at = 0, step = FIRST;
    memcpy(w->known, w->path, w->n * sizeof *w->path);
    while (at < 1 && step >= SHORTEST && w->solved++ < MOST_SOLVED) {
        const double next = fmin(at + step, 1);
        const bool moved = move(w, at, next);
        if (w->stopped)
            return false;
        memcpy(moved ? w->known : w->path, moved ? w->path : w->known, w->n * sizeof *w->path);
        at = moved ? next : at;
        step *= moved ? LONGER : 0.5;
    }
    return at == 1;
}

static bool ends_move(const struct phys_ends *ends, size_t dof)
{
    bool moves = false;
    for (size_t k = 0; k < 2 * dof; k++)
        moves |= phys_end_moves(ends, k % 2, k / 2);
    return moves;
}

static bool follow_motion(struct walk *w, double velocity)
{
    const struct phys_grid *given = &w->c->given;
    const size_t last = w->slices - 1;
    struct ad_error lost = {0};
    for (size_t d = 0; d < w->dof; d++) {
        const double *q = w->c->guess + d * given->slices;
        w->path[d * w->slices] = q[0];
        w->path[d * w->slices + 1] = q[0] + velocity * (q[given->slices - 1] - q[0]) / (double)last;
    }
    w->ends = true;
    w->settings.dt = w->dt;
    if (phys_path_march(w->c->system, &w->settings, w->path, &lost) != AD_OK)
        return false;
    for (size_t d = 0; d < w->dof; d++)
        w->way[d] = w->c->guess[(d + 1) * given->slices - 1] - w->path[d * w->slices + last];
    return follow(w);
}

enum ad_status phys_climb_approach(struct phys_climb *c, const struct phys_rule *rule,
                                   struct ad_error *error)
{
    const struct phys_path_settings *settings = c->to->settings;
    const struct phys_grid grid = {rule, ELEMENTS + 1, c->time / ELEMENTS, NULL};
    struct walk w = {.c = c, .settings = *settings, .dt = grid.dt, .slices = grid.slices};
    w.dof = c->system->dof;
    w.n = rule->degree * w.dof * grid.slices;
    w.settings.rule = rule;
    w.settings.slices = grid.slices;
    w.settings.mesh = NULL;
    w.settings.adam_steps = 0;
    w.path = phys_path_resample(&c->given, c->guess, &grid, w.dof, error);
    w.known = malloc(w.n * sizeof *w.known);
    w.way = malloc(w.dof * sizeof *w.way);
    bool arrived = false;
    if (!w.path || !w.known || !w.way) {
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", grid.slices);
    } else {
        arrived = follow(&w);
        const char *from = "a path of a shorter time";
        for (size_t i = 0; i < sizeof VELOCITY / sizeof *VELOCITY; i++) {
            if (arrived || w.stopped || ends_move(settings->ends, w.dof))
                break;
            arrived = follow_motion(&w, VELOCITY[i]);
            from = "a motion from the same start";
        }
        c->to->approach = arrived ? from : NULL;
    }
    c->to->unsettled &= !w.stopped;
    if (w.stopped)
        ad_fail(error, AD_E_ACCURACY, "interrupted at %d elements of %s", ELEMENTS, rule->name);
    for (size_t k = 0; arrived && k < 2 * w.dof; k++) { /* without the rounding of the way */
        const size_t d = k / 2, end = k % 2;
        if (!phys_end_moves(settings->ends, end, d))
            w.path[d * w.slices + end * (w.slices - 1)] =
                c->guess[d * c->given.slices + end * (c->given.slices - 1)];
    }
    if (arrived) {
        c->guess = c->approach = w.path;
        c->given = grid;
        w.path = NULL;
    }
    AD_FREE(w.path, w.known, w.way);
    return error->status;
}
