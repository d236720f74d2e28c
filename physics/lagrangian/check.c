/* Checks of a scene's Lagrangian (check.h): finite values, correct gradient, independent slices. */
#include "internal.h"
#include "autodiff/sized.h"
#include "autodiff/series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* L recorded on a tape of its own, at n slices. */
struct probe {
    ad_tape *tape;
    ad_var q, v, t, L;
};

static enum ad_status probe_new(struct probe *probe, const struct phys_system *system, size_t n,
                                struct ad_error *error)
{
    ad_tape *tape = probe->tape = ad_tape_new(AD_F64);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    probe->q = ad_input(tape, system->dof, n, "q");
    probe->v = ad_input(tape, system->dof, n, "v");
    probe->t = ad_input(tape, 1, n, "t");
    probe->L = ad_label(phys_system_lagrangian(system, probe->q, probe->v, probe->t), "L");
    if (phys_tape_status(tape, error) != AD_OK)
        return error->status;
    if (ad_rows(probe->L) != 1 || ad_cols(probe->L) != n)
        return ad_fail(error, AD_E_SHAPE, "%s: the Lagrangian is %zu x %zu, expected 1 x %zu",
                       system->scene->name, ad_rows(probe->L), ad_cols(probe->L), n);
    return AD_OK;
}

/* L and, mixed, the constraints and forces beside it. */
static void probe_forces(struct probe *p, const struct phys_system *system)
{
    if (system->scene->constraint)
        p->L = ad_add(p->L, phys_mixed(phys_system_constraint(system, p->q, p->t), 0.5));
    if (phys_system_has_forces(system))
        p->L = ad_add(p->L, phys_mixed(phys_system_add_forces(system, p->q, p->q, p->v, p->t), 0));
}

static enum ad_status probe_compile(const struct probe *probe, size_t n_out, const ad_var out[],
                                    const struct phys_points *at, ad_program **program,
                                    struct ad_error *error)
{
    if (ad_compile(probe->tape, n_out, out, program) != AD_OK)
        return phys_tape_status(probe->tape, error);
    ad_set(*program, probe->q, at->q);
    ad_set(*program, probe->v, at->v);
    ad_set(*program, probe->t, at->t);
    return AD_OK;
}

/* ---- finite ---- */

enum ad_status phys_check_finite(const struct phys_system *system, const struct phys_points *at,
                                 struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, at, at->q, at->v, at->t))
        return error->status;
    AD_OWN(phys_points, at, t, error);
    struct probe probe;
    ad_program *program = NULL;
    if (probe_new(&probe, system, at->n, error) == AD_OK) {
        ad_var out[3] = {probe.L};
        if (ad_grad(probe.L, 2, (ad_var[]){probe.q, probe.v}, out + 1) != AD_OK)
            phys_tape_status(probe.tape, error);
        out[1] = phys_system_add_forces(system, out[1], probe.q, probe.v, probe.t);
        if (error->status == AD_OK && probe_compile(&probe, 3, out, at, &program, error) == AD_OK)
            ad_run_checked(program, error);
    }
    ad_program_free(program);
    ad_tape_free(probe.tape);
    return error->status;
}

/* ---- gradient ---- */

enum ad_status phys_check_gradient(const struct phys_system *system, const struct phys_points *at,
                                   int order, double tolerance, size_t entries,
                                   struct ad_check *report, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, at, at->q, at->v, at->t, report))
        return error->status;
    AD_OWN(phys_points, at, t, error);
    struct probe probe;
    *report = (struct ad_check){0};
    if (order != 1 && order != 2)
        return ad_fail(error, AD_E_ARGUMENT, "%s: check of order %d; expected 1 or 2",
                       system->scene->name, order);
    if (probe_new(&probe, system, at->n, error) == AD_OK) {
        ad_var total = ad_sum(probe.L);
        const ad_var x[] = {probe.q, probe.v, probe.t};
        const double *const values[] = {at->q, at->v, at->t};
        enum ad_status status = (order == 1 ? ad_check_gradient : ad_check_second)(
            total, 3, x, values, tolerance, entries, report);
        if (status != AD_OK && phys_tape_status(probe.tape, error) == AD_OK)
            ad_fail(error, status, "%s: the gradient could not be checked", system->scene->name);
    }
    ad_tape_free(probe.tape);
    return error->status;
}

/* ---- locality ---- */

/* The change of one slice: far above rounding, small enough to stay in the domain, and irregular,
   so that two coordinates do not cancel. */
static double moved(double x, size_t k)
{
    return x + 1e-3 * (1 + 0.37 * sin(1.0 + 2.0 * (double)k)) * (x != 0 ? fabs(x) : 1);
}

/* L [n] with row k of q, v (k < dof, < 2 dof) or t moved at slice j; k = SIZE_MAX: all of them. */
static void run_moved(const struct probe *probe, ad_program *program, const struct phys_points *at,
                      size_t j, size_t k, double *L)
{
    size_t dof = ad_rows(probe->q), n = at->n;
    double *rows[] = {ad_data(program, probe->q), ad_data(program, probe->v),
                      ad_data(program, probe->t)};
    const double *from[] = {at->q, at->v, at->t};
    for (size_t r = 0; r < 2 * dof + 1; r++)
        if (k == SIZE_MAX || k == r) {
            size_t cell = r % dof * n + j;
            size_t which = r / dof;
            if (rows[which])
                rows[which][cell] = moved(from[which][cell], r);
        }
    ad_run(program);
    ad_get(program, probe->L, L);
    for (size_t r = 0; r < 2 * dof + 1; r++)
        if (rows[r / dof])
            rows[r / dof][r % dof * n + j] = from[r / dof][r % dof * n + j];
}

/* The slice other than j where L changed; n if there is none. NaN counts as equal to NaN. */
static size_t reacting(const double *base, const double *L, size_t n, size_t j)
{
    for (size_t i = 0; i < n; i++)
        if (i != j && memcmp(&base[i], &L[i], sizeof *L) != 0 && !(isnan(base[i]) && isnan(L[i])))
            return i;
    return n;
}

/* Names the first coordinate that alone makes slice i react to slice j. */
static void name_coordinate(const struct probe *probe, ad_program *program,
                            const struct phys_points *at, const double *base, double *L,
                            struct phys_locality *report)
{
    size_t rows = 2 * ad_rows(probe->q) + 1;
    for (report->row = 0; report->row < rows; report->row++) {
        run_moved(probe, program, at, report->moved, report->row, L);
        if (reacting(base, L, at->n, report->moved) < at->n)
            return;
    }
    report->row = SIZE_MAX;
}

enum ad_status phys_check_locality(const struct phys_system *system, const struct phys_points *at,
                                   struct phys_locality *report, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, at, at->q, at->v, at->t, report))
        return error->status;
    AD_OWN(phys_points, at, t, error);
    struct probe probe;
    ad_program *program = NULL;
    size_t n = at->n;
    *report = (struct phys_locality){0};
    if (n < 2)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: check of locality at %zu slices; expected 2 or more",
                       system->scene->name, n);
    double *base = malloc(2 * n * sizeof *base), *L = base ? base + n : NULL;
    report->passed = true;
    if (!base)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (probe_new(&probe, system, n, error) == AD_OK)
        probe_forces(&probe, system);
    if (error->status == AD_OK &&
        probe_compile(&probe, 1, &probe.L, at, &program, error) == AD_OK) {
        ad_run(program);
        ad_get(program, probe.L, base);
        for (size_t j = 0; j < n && report->passed; j++) {
            run_moved(&probe, program, at, j, SIZE_MAX, L);
            size_t i = reacting(base, L, n, j);
            if (i < n) {
                *report = (struct phys_locality){.slice = i, .moved = j};
                name_coordinate(&probe, program, at, base, L, report);
            }
        }
    }
    report->passed &= error->status == AD_OK;
    ad_program_free(program);
    ad_tape_free(probe.tape);
    free(base);
    return error->status;
}

/* ---- kinks ---- */

const char *phys_check_kinks(const struct phys_system *system)
{
    const size_t most = 64;
    struct ad_error none = {0};
    struct probe probe = {0};
    ad_series *series = NULL;
    if (!AD_LACKS(&none, system, system->scene) && system->dof <= most &&
        probe_new(&probe, system, 1, &none) == AD_OK) {
        probe_forces(&probe, system);
        ad_series_new(1, &probe.L, 3, (ad_var[]){probe.q, probe.v, probe.t}, 1, &series);
    }
    const char *kink = ad_series_kink(series);
    ad_series_free(series);
    ad_tape_free(probe.tape);
    return kink;
}
