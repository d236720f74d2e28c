/* The solutions of a search, without duplicates (multistart.h). */
#include "physics/linear/vectors.h"
#include "autodiff/free.h"
#include "physics/io/grow.h"
#include "physics/path/verify/grid_independence.h"
#include "multistart.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double ALIKE = 1e-9; /* relative difference of energies and actions of images */
static const double SAME = 1e-6;  /* relative difference of two solutions that are one */
static const double ZERO = 1e-9;  /* of the span: smaller coordinates may be rounding */

static bool close_to(double a, double b, double scale) { return fabs(a - b) <= ALIKE * scale; }

/* Counts a path that is like one already found (its mirror image, say), unless it is that one. */
static bool is_known(struct phys_multistart *s, double energy, double action)
{
    double time = s->settings.dt * (double)(s->slices - 1);
    for (size_t k = 0; k < s->solutions->n; k++) {
        struct phys_solution *a = &s->solutions->solution[k];
        double scale = fabs(a->energy) + fabs(a->action) / time;
        if (fabs(time - a->time) > SAME * time)
            continue;
        if (phys_farthest(s->dof * s->slices, a->path, s->path) <= SAME * s->span) {
            a->hits++;
            return true;
        }
        if (close_to(energy, a->energy, scale) && close_to(action, a->action, scale * time)) {
            if (a->copies == 1 ||
                phys_farthest(s->dof * s->slices, a->copy, s->path) > SAME * s->span) {
                memcpy(a->copy, s->path, s->n * sizeof *a->copy);
                a->copies++;
            }
            a->hits++;
            return true;
        }
    }
    return false;
}

static void solution_free(struct phys_solution *solution)
{
    free(solution->path);
    phys_spectrum_free(&solution->spectrum);
}

/* Newton's method leaves rest at 0 an extent, of rounding alone. False: zero leads nowhere. */
static bool settle_zero(struct phys_multistart *s, struct ad_error *error)
{
    const double largest = phys_largest(s->dof * s->slices, s->path);
    if (largest == 0 || largest > ZERO * s->span)
        return true;
    memset(s->path, 0, s->n * sizeof *s->path);
    return phys_newton_settle(&s->newton, s->path, &s->info, error);
}

enum ad_status phys_multistart_keep(struct phys_multistart *s, struct ad_error *error)
{
    const struct phys_path_info *info = &s->info;
    if (!settle_zero(s, error))
        return error->status;
    const double energy = info->energy_mean;
    if (is_known(s, energy, info->action))
        return AD_OK;
    struct phys_solutions *all = s->solutions;
    double *path = malloc(2 * s->n * sizeof *path);
    if (!path || !phys_grow(&all->solution, all->n, sizeof *all->solution)) {
        free(path);
        return ad_fail(error, AD_E_MEMORY, "out of memory for another path");
    }
    struct phys_solution *a = &all->solution[all->n];
    *a = (struct phys_solution){.path = path,
                                .copy = path + s->n,
                                .time = s->settings.dt * (double)(s->slices - 1),
                                .energy = energy,
                                .action = info->action,
                                .copies = 1,
                                .hits = 1};
    memcpy(a->path, s->path, s->n * sizeof *path);
    all->n++;
    for (size_t k = 0; k < s->dof * s->slices; k++)
        a->largest = fmax(a->largest, fabs(path[k]));
    struct ad_error lost = {0};
    if (phys_newton_spectrum(&s->newton, PHYS_KIND, path, &a->spectrum, &lost) == AD_OK)
        phys_path_grid_independent(s->system, &s->settings, path, &a->resolved, error);
    if (lost.status == AD_E_ACCURACY) { /* a path of no known kind is none to list */
        solution_free(a);
        all->n--;
        phys_multistart_goes_on(s);
        return AD_OK;
    }
    return lost.status == AD_OK ? error->status : ad_fail(error, lost.status, "%s", lost.message);
}

enum ad_status phys_multistart_unresolved(struct phys_multistart *s, struct ad_error *error)
{
    struct phys_solutions *all = s->solutions;
    double *grown = realloc(all->motion_energy, (all->n_motions + 1) * sizeof *grown), y[6];
    if (!grown)
        return ad_fail(error, AD_E_MEMORY, "out of memory for another path");
    all->motion_energy = grown;
    if (!phys_multistart_goes_on(s))
        return AD_OK; /* it may be one, with more time */
    memcpy(y, s->q, s->dof * sizeof *y);
    memcpy(y + s->dof, s->v, s->dof * sizeof *y);
    double energy = s->motion.energy ? s->motion.energy(s->motion.context, 0, y) : (double)NAN;
    size_t k = all->n_motions++;
    for (; k > 0 && grown[k - 1] > energy; k--)
        grown[k] = grown[k - 1];
    grown[k] = energy;
    all->unresolved++;
    return AD_OK;
}

static int by_energy(const void *a, const void *b)
{
    const struct phys_solution *x = a, *y = b;
    return (x->energy > y->energy) - (x->energy < y->energy);
}

static int by_time(const void *a, const void *b)
{
    const struct phys_solution *x = a, *y = b;
    return (x->time > y->time) - (x->time < y->time);
}

/* With many coordinates spurious paths of the grid cannot be detected with certainty. */
void phys_multistart_sort(struct phys_multistart *s)
{
    struct phys_solutions *all = s->solutions;
    size_t kept = 0;
    for (size_t k = 0; k < all->n; k++)
        if (all->solution[k].resolved || s->dof > PHYS_SHOOTING_DOF) {
            all->solution[kept++] = all->solution[k];
        } else {
            all->unresolved += all->solution[k].copies;
            solution_free(&all->solution[k]);
        }
    all->n = kept;
    if (kept)
        qsort(all->solution, kept, sizeof *all->solution, s->free_time ? by_time : by_energy);
}

void phys_solutions_free(struct phys_solutions *solutions)
{
    if (!solutions)
        return;
    for (size_t k = 0; k < solutions->n; k++)
        solution_free(&solutions->solution[k]);
    AD_FREE(solutions->solution, solutions->motion_energy);
    *solutions = (struct phys_solutions){0};
}
