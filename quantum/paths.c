/* The straight paths of one slice, recorded from the scene's Lagrangian: positions and velocities
   at the points of the rule, the action, and its mixed derivative. */
#include "internal.h"

#include <math.h>

const struct phys_rule *qm_rule(const struct qm_slice *slice, struct ad_error *error)
{
    return slice->rule ? slice->rule : phys_rule_find("trapezoid", error);
}

/* A rule of degree 1 evaluates straight paths, at points given by their ends. */
static bool ends_alone(const struct phys_rule_table *table)
{
    for (size_t j = 0; j < table->points; j++)
        if (table->time[j] != 0 && table->time[j] != 1)
            return false;
    return true;
}

static enum ad_status check_numbers(const struct qm_slice *slice, struct ad_error *error)
{
    const struct {
        const char *name;
        double value, example;
    } positive[] = {
        {"dt", slice->dt, 0.1},
        {"hbar", slice->hbar, 1},
        {"length of the box, upper less lower wall", slice->grid.high - slice->grid.low, 20}};
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++)
        if (!(positive[k].value > 0) || !isfinite(positive[k].value))
            return ad_fail(error, AD_E_ARGUMENT, "%s: expected more than 0, such as %g, got %g",
                           positive[k].name, positive[k].example, positive[k].value);
    if (slice->grid.n < 4)
        return ad_fail(error, AD_E_ARGUMENT, "points: expected at least 4, got %zu", slice->grid.n);
    if (!(slice->absorb >= 0) || 2 * slice->absorb > slice->grid.high - slice->grid.low)
        return ad_fail(error, AD_E_ARGUMENT,
                       "absorbing layers: expected 0 to half of the box, %g, got %g",
                       0.5 * (slice->grid.high - slice->grid.low), slice->absorb);
    return AD_OK;
}

enum ad_status qm_slice_check(const struct qm_slice *slice, struct ad_error *error)
{
    if (AD_LACKS(error, slice, slice->system, slice->system->scene))
        return error->status;
    if ((unsigned)slice->walls > QM_RING)
        return ad_fail(error, AD_E_ARGUMENT, "walls: expected QM_OPEN, QM_REFLECT or QM_RING");
    const char *scene = slice->system->scene->name;
    if (check_numbers(slice, error) != AD_OK)
        return error->status;
    if (slice->system->dof != 1)
        return ad_fail(error, AD_E_ARGUMENT, "%s has %zu coordinates; expected a scene of one",
                       scene, slice->system->dof);
    if (phys_system_has_forces(slice->system))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has forces that are not in L (dissipation, forces); expected L alone",
                       scene);
    if (slice->system->scene->constraint)
        return ad_fail(error, AD_E_ARGUMENT, "%s has constraints; expected L alone", scene);
    if (!phys_keeps_energy(slice->system, error))
        return ad_fail(error, AD_E_ARGUMENT, "L of %s depends on time; expected one that does not",
                       scene);
    return AD_OK;
}

static enum ad_status check_rule(const struct qm_slice *slice, const struct phys_rule *rule,
                                 struct phys_rule_table *table, struct ad_error *error)
{
    if (!rule)
        return error->status;
    rule->fill(rule, table);
    if (table->degree != 1 || rule->repeat)
        return ad_fail(error, AD_E_ARGUMENT,
                       "rule %s: paths of a slice are straight; expected left, midpoint or "
                       "trapezoid",
                       rule->name);
    if (slice->walls != QM_OPEN && !ends_alone(table))
        return ad_fail(
            error, AD_E_ARGUMENT,
            "rule %s evaluates L where mirrored paths are folded; expected left or trapezoid",
            rule->name);
    return slice->walls == QM_REFLECT ? qm_check_mirror(slice, error) : AD_OK;
}

/* Point j of the rule. A path from an image is folded back where it starts: position x_b, velocity
   s times that of the unfolded path. */
static ad_var lagrangian_at(const struct qm_slice *slice, const struct qm_paths *paths,
                            const struct phys_rule_table *table, size_t j)
{
    ad_var v = ad_mul(1 / slice->dt, paths->distance), q = paths->xa;
    if (table->time[j] == 0) {
        q = paths->xb;
        v = ad_mul(paths->s, v);
    } else if (table->time[j] != 1) {
        q = ad_add(ad_mul(table->q[j][0], paths->xb), ad_mul(table->q[j][1], paths->xa));
    }
    ad_var t = ad_broadcast(ad_scalar(paths->tape, table->time[j] * slice->dt), 1, ad_cols(q));
    return phys_system_lagrangian(slice->system, q, v, t);
}

static void record(const struct qm_slice *slice, const struct phys_rule_table *table, size_t n,
                   struct qm_paths *paths)
{
    ad_tape *tape = paths->tape;
    ad_var slope, mixed;
    paths->xa = ad_input(tape, 1, n, "end of a path");
    paths->xb = ad_input(tape, 1, n, "start of a path");
    paths->s = ad_input(tape, 1, 1, "side of an image");
    paths->c = ad_input(tape, 1, 1, "shift of an image");
    ad_var image = ad_add(ad_mul(paths->s, paths->xb), paths->c);
    paths->distance = ad_sub(paths->xa, image);
    paths->action = ad_mul(table->weight[0], lagrangian_at(slice, paths, table, 0));
    for (size_t j = 1; j < table->points; j++)
        paths->action =
            ad_add(paths->action, ad_mul(table->weight[j], lagrangian_at(slice, paths, table, j)));
    paths->action = ad_label(ad_mul(slice->dt, paths->action), "action");
    if (ad_grad(paths->action, 1, &paths->xa, &slope) != AD_OK ||
        ad_grad(slope, 1, &paths->xb, &mixed) != AD_OK)
        return;
    /* x_b is seen at s x_b: a mirrored path has its derivative with the other sign */
    paths->mixed = ad_label(ad_neg(ad_mul(paths->s, mixed)), "mixed derivative of the action");
}

enum ad_status qm_paths_record(const struct qm_slice *slice, size_t n, struct qm_paths *paths,
                               struct ad_error *error)
{
    struct phys_rule_table table;
    *paths = (struct qm_paths){0};
    if (check_rule(slice, qm_rule(slice, error), &table, error) != AD_OK)
        return error->status;
    paths->tape = ad_tape_new(AD_F64);
    if (!paths->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    record(slice, &table, n, paths);
    return phys_tape_status(paths->tape, error);
}

void qm_paths_free(struct qm_paths *paths)
{
    ad_tape_free(paths->tape);
    *paths = (struct qm_paths){0};
}

enum ad_status qm_actions(const struct qm_slice *slice, size_t n, const double *xa,
                          const double *xb, double *action, double *mixed, struct ad_error *error)
{
    struct qm_paths paths;
    ad_program *program = NULL;
    if (qm_paths_record(slice, n, &paths, error) == AD_OK) {
        ad_var out[] = {paths.action, ad_broadcast(paths.mixed, 1, n)};
        ad_compile(paths.tape, 2, out, &program);
        if (phys_tape_status(paths.tape, error) == AD_OK) {
            ad_set(program, paths.xa, xa);
            ad_set(program, paths.xb, xb);
            ad_set(program, paths.s, (double[]){1});
            if (ad_run_checked(program, error) == AD_OK) {
                ad_get(program, out[0], action);
                ad_get(program, out[1], mixed);
            }
        }
        ad_program_free(program);
    }
    qm_paths_free(&paths);
    return error->status;
}
