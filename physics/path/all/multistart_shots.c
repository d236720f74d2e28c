/* Stationary paths of two and three coordinates from motions that begin with every velocity
   (multistart.h, covering.h). Two coverings with boxes in other places and directions tell how many
   motions both may have missed: with q1 motions found by one of them and q2 by both, about
   q1 (q1 - 1) / (4 (q2 + 1)) (A. Chao, Biometrics 43, 783, 1987: for unequal chances a lower
   bound). */
#include "covering.h"
#include "multistart.h"
#include "physics/linear/linear.h"
#include "physics/path/ends.h"
#include "physics/path/path_nodes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COVERINGS = 2, GROWTHS = 6 };

static const double FASTEST = 3;       /* of the natural speed, at first */
static const double NEGLIGIBLE = 1e-3; /* share of the velocities that may stay undecided */
static const double ROUNDING = 1e-13;  /* of the motions that become paths, per step */

/* Rest, and the path given, which counts as a third covering. */
static enum ad_status cover_given(struct phys_multistart *s, struct phys_end_map *map,
                                  struct phys_end_roots *roots, struct ad_error *error)
{
    struct phys_covering c = {
        .map = map, .outer = FASTEST * map->speed, .number = COVERINGS, .roots = roots};
    const struct phys_ends *ends = s->settings.ends;
    struct phys_path_nodes nodes = {0};
    const struct phys_grid grid = phys_grid_of(&s->settings);
    double q[PHYS_END_MAP_DOF], w[PHYS_END_MAP_DOF] = {0};
    double unit[PHYS_END_MAP_DOF * PHYS_END_MAP_DOF];
    size_t led = s->led, known = s->solutions->n;
    if (s->free_time)
        return AD_OK; /* neither has the energy */
    phys_cover_near(&c, w, error);
    if (ends && ends->free[0])
        return error->status;
    memcpy(s->path, s->given, s->n * sizeof *s->path);
    phys_rule_interpolate(s->settings.rule, s->dof, s->slices, s->path);
    if (error->status != AD_OK || phys_multistart_solve(s, error) != AD_OK || s->led == led)
        return error->status;
    if (phys_path_nodes_new(&nodes, s->dof, &grid, 3, s->path, error) == AD_OK) {
        phys_path_nodes_at(&nodes, 0, q, w);
        memcpy(unit, map->unit, s->dof * s->dof * sizeof *unit);
        phys_lapack_lu_solve_once(s->dof, unit, w);
        if (phys_cover_near(&c, w, error) < 0 && error->status == AD_OK &&
            phys_multistart_keep(s, error) == AD_OK && s->solutions->n > known)
            s->solutions->found_once += s->solutions->solution[known].resolved;
    }
    phys_path_nodes_free(&nodes);
    return error->status;
}

/* The path of the motion that begins at s->q with s->v, or its energy where this grid has none. */
static enum ad_status take(struct phys_multistart *s, size_t dimension, double *nodes,
                           const double *times, size_t m, struct ad_error *error)
{
    const struct phys_ends *ends = s->settings.ends;
    size_t degree = s->settings.rule->degree, paths = 0, now = 0, listed = s->solutions->n;
    struct ad_error lost = {0};
    const struct phys_simulation how = {
        .size = sizeof how,
        .integrator = phys_integrator_find(s->motion.series ? "taylor" : "dop853", &lost),
        .t1 = times[m - 1],
        .rtol = ROUNDING,
        .n_samples = m - 1,
        .times = times + 1,
        .max_steps = PHYS_MOTION_STEPS,
        .proceed = s->settings.proceed,
        .context = s->settings.context};
    memcpy(s->y, s->q, s->dof * sizeof *s->y);
    memcpy(s->y + s->dof, s->v, s->dof * sizeof *s->y);
    if (phys_trajectory(&how, &s->motion, s->y, s->dof, m, nodes, NULL, &lost) != AD_OK)
        return phys_multistart_unresolved(s, error);
    for (size_t i = 0; i < s->slices; i++)
        for (size_t k = 0; k < degree; k++)
            for (size_t j = 0; j < s->dof; j++)
                s->path[(k * s->dof + j) * s->slices + i] =
                    nodes[j * m + i * degree + (i + 1 < s->slices ? k : 0)];
    for (size_t j = 0; j < s->dof; j++)
        if (!phys_end_moves(ends, 1, j))
            s->path[(j + 1) * s->slices - 1] = s->given[(j + 1) * s->slices - 1];
    for (size_t k = 0; k < s->solutions->n; k++)
        paths += s->solutions->solution[k].copies;
    if (phys_multistart_take(s, nodes, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < s->solutions->n; k++)
        now += s->solutions->solution[k].copies;
    if (now == paths) /* none, one of the grid alone, or another motion has the same */
        return phys_multistart_unresolved(s, error);
    if (s->solutions->n > listed) {
        struct phys_solution *found = &s->solutions->solution[listed];
        found->family = dimension;
        found->resolved |= dimension > 0; /* by the motion: from it shooting may go along others */
    }
    return AD_OK;
}

struct taking {
    struct phys_multistart *s;
    struct phys_end_map *map;
    const struct phys_end_roots *roots;
    double *nodes, *times, *x; /* [dof][m], [m], [m] */
    size_t m, taken;           /* nodes; roots so far */
};

static void find_times(const struct taking *now)
{
    const struct phys_multistart *s = now->s;
    phys_rule_nodes(s->settings.rule, s->dof, s->slices, s->settings.dt, s->given, now->x,
                    now->times);
}

static enum ad_status take_root(const struct taking *now, const struct phys_end_root *root,
                                struct ad_error *error)
{
    struct phys_multistart *s = now->s;
    double time;
    phys_end_map_start(now->map, root->w, s->q, s->v, &time, NULL);
    if (s->free_time && phys_multistart_over(s, time, error) != AD_OK)
        return error->status;
    if (s->free_time)
        find_times(now);
    return take(s, root->dimension, now->nodes, now->times, now->m, error);
}

/* Those found so far that are no families, so that an interrupted search lists them. */
static enum ad_status take_new(void *context, struct ad_error *error)
{
    struct taking *now = context;
    for (; now->taken < now->roots->n && error->status == AD_OK && phys_multistart_goes_on(now->s);
         now->taken++)
        if (now->roots->root[now->taken].dimension == 0)
            take_root(now, &now->roots->root[now->taken], error);
    return error->status;
}

static enum ad_status take_families(const struct taking *now, struct ad_error *error)
{
    const struct phys_end_roots *roots = now->roots;
    for (size_t k = 0; k < roots->n && error->status == AD_OK && phys_multistart_goes_on(now->s);
         k++)
        if (roots->root[k].dimension > 0 && roots->root[k].family == k)
            take_root(now, &roots->root[k], error);
    return error->status;
}

static enum ad_status taking_new(struct taking *now, struct ad_error *error)
{
    const struct phys_multistart *s = now->s;
    now->m = s->settings.rule->degree * (s->slices - 1) + 1;
    now->nodes = malloc((2 * s->dof + 1) * now->m * sizeof *now->nodes);
    if (!now->nodes)
        return ad_fail(error, AD_E_MEMORY, "out of memory for another path");
    now->times = now->nodes + s->dof * now->m;
    now->x = now->times + now->m;
    find_times(now);
    return AD_OK;
}

static bool agree(void *context, struct ad_error *error)
{
    return phys_multistart_agree(((const struct taking *)context)->s, error);
}

/* The first covering grows in shells, while motions that are no family begin in the outer half of
   the speeds, or none is found. */
static enum ad_status cover_all(struct phys_end_map *map, struct phys_end_roots *roots,
                                struct taking *now, uint64_t seed, struct ad_error *error)
{
    struct phys_solutions *all = now->s->solutions;
    struct phys_covering c = {.map = map,
                              .outer = (now->s->free_time ? 1 : FASTEST) * map->speed,
                              .bounded = now->s->free_time,
                              .steps = PHYS_ALL_STEPS / 3 * 2,
                              .roots = roots,
                              .found = take_new,
                              .agree = now->s->ranks ? agree : NULL,
                              .context = now,
                              .ranks = now->s->ranks};
    for (int growth = 0; growth <= GROWTHS; growth++) {
        double fastest = 0;
        c.seed = 2 * seed;
        if (phys_cover(&c, error) != AD_OK)
            return error->status;
        all->undecided = fmax(all->undecided, c.undecided);
        all->exhausted = all->exhausted || c.exhausted;
        for (size_t k = 0; k < roots->n; k++)
            fastest = roots->root[k].dimension > 0
                          ? fastest
                          : fmax(fastest, phys_end_norm(map->dof, roots->root[k].w));
        if (c.bounded || c.exhausted || all->interrupted || growth == GROWTHS ||
            (fastest > 0 && fastest < 0.5 * c.outer))
            break;
        c.inner = c.outer;
        c.outer *= 2;
    }
    all->fastest = now->s->free_time ? 0 : c.outer;
    if (now->s->settings.ends && now->s->settings.ends->free[0])
        all->farthest = c.outer / map->speed * map->reach;
    c.inner = 0;
    c.number = 1;
    c.seed = 2 * seed + 1;
    c.steps = PHYS_ALL_STEPS;
    if (all->interrupted || phys_cover(&c, error) != AD_OK)
        return error->status;
    all->undecided = fmax(all->undecided, c.undecided);
    all->exhausted = all->exhausted || c.exhausted;
    return error->status;
}

/* Motions that both coverings may have missed; the limit, where each found all of them, has 3 in
   place of q1: what a Poisson number that is seen as 0 is under, at 95 %. */
static void estimate(const struct phys_end_roots *roots, struct phys_solutions *all)
{
    double once = (double)all->found_once, twice = 0;
    for (size_t k = 0; k < roots->n; k++)
        if (roots->root[k].family == k)
            *((roots->root[k].coverings & 3) == 3 ? &twice : &once) += 1;
    all->found_once = (size_t)once;
    all->unseen_paths = once > 0 && !all->interrupted ? once * (once - 1) / (4 * (twice + 1)) : 0;
    all->saturated = /* where none was found there is nothing to tell from */
        once == 0 && twice > 0 && !all->exhausted && !all->interrupted &&
        all->undecided <= NEGLIGIBLE;
    all->unseen_paths_limit = all->saturated ? ceil(3 * 3 / (4 * twice)) : (double)INFINITY;
}

static bool goes_on(void *context) { return phys_multistart_goes_on(context); }

enum ad_status phys_multistart_shots(struct phys_multistart *s, uint64_t seed,
                                     struct ad_error *error)
{
    struct phys_end_map map;
    struct phys_end_roots roots = {0};
    double end[PHYS_END_MAP_DOF], time = s->settings.dt * (double)(s->slices - 1);
    for (size_t k = 0; k < s->dof; k++)
        end[k] = s->given[(k + 1) * s->slices - 1];
    if (phys_end_map_new(&map, s->system, s->settings.ends, s->q, end, time, s->span, error) ==
        AD_OK) {
        struct taking now = {.s = s, .map = &map, .roots = &roots};
        map.proceed = goes_on;
        map.context = s;
        if (taking_new(&now, error) == AD_OK && cover_given(s, &map, &roots, error) == AD_OK &&
            take_new(&now, error) == AD_OK && cover_all(&map, &roots, &now, seed, error) == AD_OK)
            take_families(&now, error);
        estimate(&roots, s->solutions);
        free(now.nodes);
    }
    free(roots.root);
    phys_end_map_free(&map);
    return error->status;
}
