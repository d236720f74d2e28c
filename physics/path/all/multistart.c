/* Searches for several stationary paths between the same ends: a problem that does not fix the
   energy can have many solutions. With one coordinate and no explicit time all are found from times
   as functions of the energy (energy_sweep.h), with two or three from a covering of the initial
   velocities (multistart_shots.c). Otherwise starts are motions from the first end with many
   velocities, bent to meet the second end, and Newton's method makes each stationary. For one
   coordinate the initial velocity is swept and bisected wherever the miss of the second end changes
   sign; for many, and where coordinates of the ends move, velocities, and places that move, are
   drawn at random until another start is unlikely to find a new path: after N successful starts the
   probability of an unseen path is about the fraction of paths seen once (Good, Biometrika 40,
   1953). */
#include "physics/linear/vectors.h"
#include "autodiff/free.h"
#include "multistart.h"
#include "physics/path/ends.h"
#include "end_map.h"
#include "physics/io/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SUBSTEPS = 4, STEPS = 60, LEAST_STARTS = 30, AT_ONCE = 4 };

static const double ROUNDING = 1e-9;  /* of coordinates: ends so near are one place */
static const double MOST_DETOUR = 30; /* a start that ends this many spans away is rejected */
static const double NEAR = 0.1;       /* of a motion's extent: its path on the grid */
static const double OFF = 2e-3;       /* of the energies, with free end time */
static const double UNSEEN = 0.05;    /* a chance of finding more that is not worth a start */

bool phys_multistart_goes_on(struct phys_multistart *s)
{
    if (s->settings.proceed && !s->settings.proceed(s->settings.context))
        s->solutions->interrupted = true;
    return !s->solutions->interrupted;
}

bool phys_multistart_agree(struct phys_multistart *s, struct ad_error *error)
{
    double going = !s->asked || s->asked(s->settings.context);
    if (ad_ranks_least(s->ranks, 1, &going, error) != AD_OK || going == 0)
        s->solutions->interrupted = true;
    return phys_multistart_goes_on(s);
}

/* Newton from s->path; what does not converge is no solution, and no error: s->led counts what
 * does.
 */
enum ad_status phys_multistart_solve(struct phys_multistart *s, struct ad_error *error)
{
    if (phys_newton_settle(&s->newton, s->path, &s->info, error))
        s->led++;
    return error->status;
}

enum ad_status phys_multistart_settle(struct phys_multistart *s, struct ad_error *error)
{
    size_t led = s->led;
    phys_rule_interpolate(s->settings.rule, s->dof, s->slices, s->path);
    if (phys_multistart_solve(s, error) != AD_OK || s->led == led)
        return error->status;
    return phys_multistart_keep(s, error);
}

enum ad_status phys_multistart_over(struct phys_multistart *s, double time, struct ad_error *error)
{
    s->settings.dt = time / (double)(s->slices - 1);
    phys_newton_free(&s->newton);
    return phys_newton_new(&s->newton, s->system, &s->settings, &s->of, error);
}

/* Whether the grid has that path at the energy asked for, which its motion has. */
static bool has_energy(const struct phys_multistart *s)
{
    const double E = s->free_time ? s->settings.ends->energy : s->info.energy_mean;
    const double bodies = s->system->scene->per_body ? (double)s->system->bodies : 1;
    return fabs(s->info.energy_mean - E) <=
           OFF * (fabs(E) + bodies * (fabs(s->info.kinetic_mean) + fabs(s->info.potential_mean)));
}

enum ad_status phys_multistart_take(struct phys_multistart *s, double *begun,
                                    struct ad_error *error)
{
    size_t led = s->led, n = s->dof * s->slices;
    double extent = 0;
    memcpy(begun, s->path, n * sizeof *begun);
    if (phys_multistart_solve(s, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++)
        extent = fmax(extent, fabs(begun[k] - begun[k - k % s->slices]));
    s->taken = s->led > led && has_energy(s) &&
               phys_farthest(n, begun, s->path) <= NEAR * (extent + ROUNDING * s->span);
    return s->taken ? phys_multistart_keep(s, error) : AD_OK;
}

/* ---- starts ---- */

bool phys_multistart_shoot(struct phys_multistart *s)
{
    struct ad_error lost = {0};
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find("rk4", &lost),
                                        .t1 = s->settings.dt * (double)(s->slices - 1),
                                        .dt = s->settings.dt / SUBSTEPS,
                                        .n_samples = s->slices - 1};
    memcpy(s->y, s->q, s->dof * sizeof *s->y);
    memcpy(s->y + s->dof, s->v, s->dof * sizeof *s->y);
    return phys_trajectory(&how, &s->motion, s->y, s->dof, s->slices, s->path, NULL, &lost) ==
           AD_OK;
}

double phys_multistart_miss(const struct phys_multistart *s, size_t k)
{
    size_t last = k * s->slices + s->slices - 1;
    return s->path[last] - s->given[last];
}

bool phys_multistart_begin(struct phys_multistart *s)
{
    const struct phys_ends *ends = s->settings.ends;
    if (!phys_multistart_shoot(s))
        return false;
    for (size_t k = 0; k < s->dof; k++) {
        const size_t last = (k + 1) * s->slices - 1;
        if (!(fabs(phys_multistart_miss(s, k)) <= MOST_DETOUR * s->span))
            return false;
        s->between[k * s->slices] = s->q[k];
        s->between[last] = phys_end_moves(ends, 1, k) ? s->path[last] : s->given[last];
    }
    phys_end_space_meet_path(&s->newton.path.ends, s->slices, s->between);
    phys_path_bend(s->dof, s->slices, s->between, s->path);
    return true;
}

static double unseen(const struct phys_multistart *s, size_t led, double *limit)
{
    size_t once = 0;
    for (size_t k = 0; k < s->solutions->n; k++)
        once += s->solutions->solution[k].hits == 1;
    return phys_random_unseen(once, led, limit);
}

/* What a start leads to, and the path [n] behind it. */
struct attempt {
    struct phys_path_info info;
    bool led;
};

struct drawing {
    struct phys_multistart *s;
    const double *v; /* [starts][2 dof], and places */
};

static enum ad_status attempt(void *context, size_t k, void *result, struct ad_error *error)
{
    struct drawing *d = context;
    struct phys_multistart *s = d->s;
    struct attempt *a = result;
    memcpy(s->v, d->v + 2 * k * s->dof, s->dof * sizeof *s->v);
    memcpy(s->q, d->v + (2 * k + 1) * s->dof, s->dof * sizeof *s->q);
    if (!phys_multistart_turn(s, s->v) || !phys_multistart_begin(s))
        return error->status;
    phys_rule_interpolate(s->settings.rule, s->dof, s->slices, s->path);
    a->led = phys_newton_settle(&s->newton, s->path, &a->info, error);
    memcpy(a + 1, s->path, s->n * sizeof *s->path);
    return error->status;
}

static enum ad_status take_attempt(struct phys_multistart *s, const struct attempt *a,
                                   struct ad_error *error)
{
    if (!a->led)
        return AD_OK;
    s->led++;
    s->info = a->info;
    memcpy(s->path, a + 1, s->n * sizeof *s->path);
    return phys_multistart_keep(s, error);
}

/* Starts from `from` on, at most `most`, dealt out; `enough`: no more are needed. */
static enum ad_status draw_some(struct phys_multistart *s, const struct drawing *d, size_t from,
                                size_t most, size_t led, char *results, bool *enough,
                                struct ad_error *error)
{
    const size_t bytes = sizeof(struct attempt) + s->n * sizeof *s->path;
    struct drawing drawing = *d;
    ad_ranks_deal(s->ranks, most, bytes, attempt, &drawing, results, error);
    for (size_t k = 0; k < most && error->status == AD_OK && !*enough; k++) {
        s->solutions->starts = from + k + 1;
        take_attempt(s, (const struct attempt *)(void *)(results + k * bytes), error);
        *enough = s->led - led >= LEAST_STARTS &&
                  unseen(s, s->led - led, &s->solutions->unseen_limit) <= UNSEEN;
    }
    return error->status;
}

/* Velocities, and places, given ones where they do not move. */
static void draw_start(const struct phys_multistart *s, struct phys_random *random, double *v)
{
    const double size = pow(10, 2 * phys_random_uniform(random) - 1);
    for (size_t k = 0; k < s->dof; k++)
        v[k] = s->speed * size * phys_random_normal(random);
    for (size_t k = 0; k < s->dof; k++) {
        v[s->dof + k] = s->given[k * s->slices];
        if (phys_end_moves(s->settings.ends, 0, k))
            v[s->dof + k] += s->span * phys_random_normal(random);
    }
}

static enum ad_status draw(struct phys_multistart *s, size_t starts, uint64_t seed,
                           struct ad_error *error)
{
    const size_t led = s->led, most = s->ranks ? AT_ONCE * s->ranks->count : 1;
    struct phys_random random;
    bool enough = false;
    double *v = malloc(2 * most * s->dof * sizeof *v);
    char *results = malloc(most * (sizeof(struct attempt) + s->n * sizeof *s->path));
    struct drawing drawing = {s, v};
    if (!v || !results)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu starts", most);
    ad_ranks_agree(s->ranks, error);
    phys_random_seed(&random, seed);
    for (size_t from = 0, n;
         from < starts && error->status == AD_OK && !enough && phys_multistart_agree(s, error);
         from += n) {
        n = starts - from < most ? starts - from : most;
        for (size_t j = 0; j < n; j++)
            draw_start(s, &random, v + 2 * j * s->dof);
        draw_some(s, &drawing, from, n, led, results, &enough, error);
    }
    AD_FREE(v, results);
    s->solutions->led = s->led - led;
    s->solutions->unseen = unseen(s, s->led - led, &s->solutions->unseen_limit);
    return error->status;
}

/* Paths known before the first start is drawn are not among those that starts have found once. */
static enum ad_status search(struct phys_multistart *s, size_t starts, uint64_t seed,
                             struct ad_error *error)
{
    for (size_t k = 0; k < s->solutions->n; k++)
        s->solutions->solution[k].hits++;
    return draw(s, starts, seed, error);
}

/* ---- the search ---- */

/* Speed and span of the given path, at least one unit, or the size of its coordinates, per its
   time: a path at rest says nothing about the speed of others. */
static void find_scales(struct phys_multistart *s)
{
    double speed = 0, span = 0, unit = 1, dt = s->settings.dt;
    for (size_t k = 0; k < s->dof; k++) {
        const double *x = s->given + k * s->slices;
        for (size_t i = 0; i + 1 < s->slices; i++) {
            speed = fmax(speed, fabs(x[i + 1] - x[i]) / dt);
            span = fmax(span, fabs(x[i + 1] - x[0]));
            unit = fmax(unit, fabs(x[i]));
        }
    }
    s->span = span > ROUNDING * unit ? span : 1;
    s->speed = fmax(speed, unit / (dt * (double)(s->slices - 1)));
}

/* Where both ends are one place the motion may rest. */
static enum ad_status begin_at_rest(struct phys_multistart *s, struct ad_error *error)
{
    for (size_t k = 0; k < s->dof; k++) {
        const double *x = s->given + k * s->slices;
        if (fabs(x[s->slices - 1] - x[0]) > ROUNDING * fmax(fabs(x[0]), s->span))
            return AD_OK;
    }
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i + 1 < s->slices; i++)
            s->path[k * s->slices + i] = s->given[k * s->slices];
    return phys_multistart_settle(s, error);
}

static enum ad_status sweep(struct phys_multistart *s, struct ad_error *error)
{
    if (!s->free_time)
        return phys_multistart_sweep(s, error);
    return phys_multistart_goes_on(s)
               ? ad_fail(error, AD_E_ACCURACY,
                         "all paths of free end time: expected a potential that is finite between "
                         "the ends, and L_vv > 0")
               : AD_OK;
}

static enum ad_status find_all(struct phys_multistart *s, size_t starts, uint64_t seed,
                               struct ad_error *error)
{
    for (size_t k = 0; k < s->dof; k++)
        s->q[k] = s->given[k * s->slices];
    find_scales(s);
    memcpy(s->path, s->given, s->n * sizeof *s->path);
    s->solutions->unseen = s->solutions->unseen_limit = (double)NAN;
    s->solutions->unseen_paths = s->solutions->unseen_paths_limit = (double)NAN;
    const bool whole = s->left == s->dof;
    const struct phys_ends *ends = s->settings.ends;
    bool shots = whole && s->dof > 1 && s->dof <= PHYS_END_MAP_DOF && !(ends && ends->n_relations);
    s->along[0] = s->along[s->dof] = 1;
    if (!shots && !s->free_time &&
        (phys_multistart_settle(s, error) != AD_OK || begin_at_rest(s, error) != AD_OK))
        return error->status;
    if (!phys_multistart_goes_on(s))
        ; /* those so far */
    else if (shots)
        phys_multistart_shots(s, seed, error);
    else if (s->left > 1 || (s->free && !s->legendre))
        search(s, starts, seed, error);
    else if (!whole    ? phys_multistart_directions(s)
             : s->free ? true
                       : !phys_multistart_energies(s, error) && error->status == AD_OK)
        sweep(s, error);
    if (error->status != AD_OK)
        return error->status;
    phys_multistart_sort(s);
    return AD_OK;
}

enum ad_status phys_path_all(const struct phys_system *system,
                             const struct phys_path_settings *settings, const double *path,
                             size_t starts, uint64_t seed, struct phys_solutions *solutions,
                             struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, solutions) ||
        AD_LACKS(error, system, system->scene, settings, settings->rule, path))
        return error->status;
    if (phys_refuse_forces(system, "paths", error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (settings->mesh)
        return ad_fail(error, AD_E_ARGUMENT,
                       "mesh: expected even slices in a search for all paths");
    const struct phys_ends *ends = settings->ends;
    const bool free_time = ends && ends->free_time;
    if (free_time &&
        (phys_free_ends(settings) || system->scene->constraint || system->dof > PHYS_END_MAP_DOF))
        return ad_fail(error, AD_E_ARGUMENT,
                       "all paths of free end time: expected both ends given, no constraints and "
                       "at most %d coordinates%s",
                       PHYS_END_MAP_DOF, system->dof > PHYS_END_MAP_DOF ? ", got more" : "");
    if (free_time && phys_lacks_energy(system, error))
        return error->status;
    if (system->scene->constraint && phys_free_ends(settings))
        return ad_fail(error, AD_E_ARGUMENT,
                       "all paths: expected both ends given beside constraints, got free ones");
    struct phys_path_info unused;
    if (phys_ends_check(system, settings->ends, settings->slices, path, error) != AD_OK ||
        (system->scene->constraint &&
         phys_path_check(&phys_solver_newton, system, settings, path, &unused, error) != AD_OK))
        return error->status;
    struct phys_multistart s = {.system = system,
                                .settings = *settings,
                                .given = path,
                                .dof = system->dof,
                                .left = system->dof - system->scene->n_constraints,
                                .slices = settings->slices,
                                .n = settings->rule->degree * system->dof * settings->slices,
                                .ranks = settings->ranks,
                                .asked = settings->proceed,
                                .free = phys_free_ends(settings),
                                .free_time = free_time,
                                .longest = settings->dt * (double)(settings->slices - 1),
                                .solutions = solutions};
    if (s.ranks && ad_ranks_check(s.ranks, error) != AD_OK)
        return error->status;
    if (s.ranks)
        s.settings.proceed = NULL;
    s.settings.energy_weight = 0;
    s.settings.steps = STEPS;
    s.q = calloc(6 * s.dof + s.n + s.dof * s.slices, sizeof *s.q);
    if (!s.q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s.v = s.q + s.dof;
    s.y = s.v + s.dof;
    s.along = s.y + 2 * s.dof;
    s.path = s.along + 2 * s.dof;
    s.between = s.path + s.n;
    if (free_time)
        phys_derivatives_new(&s.of, system, PHYS_LADDER_COLUMNS, NULL, error);
    if (s.free && s.dof == 1 && !phys_end_moves(ends, 0, 0) && !ends->n_relations)
        phys_legendre_new(system, &s.legendre, error);
    if (error->status == AD_OK &&
        phys_newton_new(&s.newton, system, &s.settings, NULL, error) == AD_OK &&
        phys_ode_lagrangian(system, &s.motion, error) == AD_OK)
        find_all(&s, starts, seed, error);
    phys_legendre_free(s.legendre);
    phys_ode_free(&s.motion);
    phys_newton_free(&s.newton);
    phys_derivatives_free(&s.of);
    free(s.q);
    if (error->status != AD_OK)
        phys_solutions_free(solutions);
    return error->status;
}
