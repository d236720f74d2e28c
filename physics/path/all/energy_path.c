/* The motion of a root of T(E) = time at given times (energy_sweep.h). */
#include "autodiff/free.h"
#include "energy_parts.h"
#include "physics/io/grow.h"

#include <math.h>

static const double FINE = 0.1; /* cells of integrals */

/* The motion as knots in time: it is followed from place to place. */
struct track {
    size_t n;
    struct knot {
        double t, q;
    } * knot;
};

static bool add_knot(struct track *track, double t, double q)
{
    if (!phys_grow(&track->knot, track->n, sizeof *track->knot))
        return false;
    track->knot[track->n++] = (struct knot){t, q};
    return true;
}

/* Whether knot k of the way is where the motion lingers: by a maximum at the level. */
static bool lingers(const struct phys_energy_sweep *s, const struct phys_energy_way *w, size_t k,
                    double level)
{
    double reach = 1e-3 * (w->knot[w->n - 1].q - w->knot[0].q);
    for (size_t i = 0; i < s->n_places; i++)
        if (s->place[i].bend < 0 &&
            fabs(s->place[i].U - level) <= 2 * PHYS_ENERGY_NEAREST * s->size &&
            fabs(s->place[i].q - w->knot[k].q) <= reach &&
            (k == 0 || k + 1 == w->n || s->place[i].q == w->knot[k].q))
            return true;
    return false;
}

/* Knots until the motion ends; `stay` at each place where it lingers, half of it where it begins or
   ends there. Returns how many stays there were. */
static double follow(const struct phys_energy_sweep *s, const struct phys_energy_root *r,
                     const struct phys_energy_way *w, double stay, struct track *track)
{
    size_t at = 0, goal = 0, made = 0;
    int direction = r->direction;
    double t = 0, visits = 0;
    while (w->knot[at].q != s->ask.from)
        at++;
    while (w->knot[goal].q != s->ask.to)
        goal++;
    track->n = 0;
    add_knot(track, 0, w->knot[at].q);
    if (lingers(s, w, at, r->level)) {
        visits = 0.5;
        if (stay > 0 && !add_knot(track, t = 0.5 * stay, w->knot[at].q))
            return visits;
    }
    for (;;) {
        if (made == r->turns && at == goal && (track->n > 1 || r->turns > 0))
            return visits;
        if (at == (direction > 0 ? w->n - 1 : 0)) {
            if (made++ == r->turns)
                return visits;
            direction = -direction;
            if (made == r->turns && at == goal)
                return visits;
        }
        size_t next = direction > 0 ? at + 1 : at - 1;
        t += direction > 0 ? w->knot[next].there - w->knot[at].there
                           : w->knot[at].back - w->knot[next].back;
        if (!add_knot(track, t, w->knot[next].q))
            return visits;
        if (lingers(s, w, next, r->level)) {
            double share = made == r->turns && next == goal ? 0.5 : 1;
            visits += share;
            if (stay > 0 && !add_knot(track, t += share * stay, w->knot[next].q))
                return visits;
        }
        at = next;
    }
}

bool phys_energy_sweep_path(struct phys_energy_sweep *s, const struct phys_energy_root *root,
                            size_t n, const double *times, double *q)
{
    struct phys_energy_way w = {0};
    struct track track = {0};
    double coarse = s->width;
    s->width = FINE;
    bool found = phys_energy_way_find(s, phys_energy_of(root), &w);
    s->width = coarse;
    if (found) {
        double visits = follow(s, root, &w, 0, &track);
        if (root->dwell > 0 && visits > 0)
            follow(s, root, &w, root->dwell / visits, &track);
        found = track.n > 0;
        const struct knot *at = track.knot, *last = at + track.n - 1;
        const double time = s->ask.of_energy ? root->time : s->ask.time;
        double scale = found && last->t > 0 ? time / last->t : 1;
        for (size_t i = 0; i < n && found; i++) {
            while (at + 1 < last && scale * at[1].t < times[i])
                at++;
            double width = scale * (at[1].t - at->t);
            double share = width > 0 ? (times[i] - scale * at->t) / width : 0;
            q[i] = at->q + fmin(1, fmax(0, share)) * (at[1].q - at->q);
        }
    }
    AD_FREE(w.knot, track.knot);
    return found;
}
