/* Stationary paths of one coordinate from the motions of all energies (multistart.h,
   energy_sweep.h). */
#include "energy_sweep.h"
#include "multistart.h"

#include <math.h>
#include <stdlib.h>

enum { NODES_OF_TURN = 12, MOST_TURNS = 100 }; /* fewer nodes do not show a turn */

/* All nodes of a path [degree x slices], in the order of time. */
static void place_nodes(const struct phys_multistart *s, const double *nodes)
{
    size_t degree = s->settings.rule->degree;
    for (size_t i = 0; i < s->slices; i++)
        for (size_t k = 0; k < degree; k++)
            s->path[k * s->slices + i] = nodes[i + 1 < s->slices ? i * degree + k : i * degree];
    s->path[0] = s->given[0];
    s->path[s->slices - 1] = s->given[s->slices - 1];
}

/* Makes the motion of a root stationary on the grid; counts those that the grid does not resolve.
 */
static enum ad_status take_root(struct phys_multistart *s, struct phys_energy_sweep *sweep,
                                const struct phys_energy_root *root, size_t m, double *nodes,
                                double *times, struct ad_error *error)
{
    if (s->free_time && phys_multistart_over(s, root->time, error) != AD_OK)
        return error->status;
    phys_rule_nodes(s->settings.rule, 1, s->slices, s->settings.dt, s->given, times + m, times);
    if (!phys_energy_sweep_path(sweep, root, m, times, nodes)) {
        s->solutions->unresolved++;
        return AD_OK;
    }
    place_nodes(s, nodes);
    if (phys_multistart_take(s, nodes + m, error) == AD_OK && !s->taken)
        s->solutions->unresolved++;
    return error->status;
}

static bool moves(const struct phys_multistart *s, const double *path)
{
    double most = 0;
    for (size_t i = 0; i < s->slices; i++)
        most = fmax(most, fabs(path[i] - path[0]));
    return most > 0.1 * s->span;
}

/* Counts motions that share a path of the grid with another. The first solutions were found before,
   from starts that are no motions, `had` times; one to which no motion led is one of those not
   found, unless it rests. */
static void count_lost(struct phys_multistart *s, size_t n_had, const size_t *had)
{
    struct phys_solutions *all = s->solutions;
    size_t lost = all->unresolved, found = 0;
    for (size_t k = 0; k < all->n; k++) {
        const struct phys_solution *a = &all->solution[k];
        size_t motions = a->hits - (k < n_had ? had[k] : 0);
        lost += motions > a->copies ? motions - a->copies : 0;
        found += motions == 0 && a->resolved && moves(s, a->path);
    }
    all->unresolved = lost > found ? lost - found : 0;
}

bool phys_multistart_energies(struct phys_multistart *s, struct ad_error *error)
{
    size_t degree = s->settings.rule->degree, m = degree * (s->slices - 1) + 1, n;
    const struct phys_energy_root *roots;
    struct phys_energy_sweep *sweep;
    double speed = s->speed, time = s->settings.dt * (double)(s->slices - 1);
    struct phys_energy_question ask = {.from = s->given[0],
                                       .to = s->given[s->slices - 1],
                                       .time = time,
                                       .of_energy = s->free_time,
                                       .energy = s->free_time ? s->settings.ends->energy : 0,
                                       .span = s->span,
                                       .speed = fmax(speed, s->span / time),
                                       .most_turns = m / NODES_OF_TURN + 2,
                                       .proceed = s->settings.proceed,
                                       .context = s->settings.context};
    if (ask.most_turns > MOST_TURNS)
        ask.most_turns = MOST_TURNS;
    if (phys_energy_sweep_new(s->system, &ask, &sweep, error) != AD_OK || !sweep)
        return false;
    double *nodes = malloc((3 * m + s->n) * sizeof *nodes),
           *times = nodes ? nodes + m + s->n : NULL;
    n = phys_energy_sweep_roots(sweep, &roots, &s->solutions->exhaustive, &s->solutions->limited);
    s->solutions->most_turns = ask.most_turns;
    s->solutions->fastest = PHYS_MULTISTART_RANGE * ask.speed;
    if (!nodes) {
        ad_fail(error, AD_E_MEMORY, "out of memory for another path");
    } else {
        enum { BEGUN = 2 }; /* the path given, and rest */
        size_t had[BEGUN], n_had = s->solutions->n;
        for (size_t k = 0; k < n_had && k < BEGUN; k++)
            had[k] = s->solutions->solution[k].hits;
        for (size_t k = 0; k < n && error->status == AD_OK && phys_multistart_goes_on(s); k++)
            take_root(s, sweep, &roots[k], m, nodes, times, error);
        count_lost(s, n_had, had);
        s->solutions->exhaustive = s->solutions->exhaustive && phys_multistart_goes_on(s);
    }
    free(nodes);
    phys_energy_sweep_free(sweep);
    return true;
}
