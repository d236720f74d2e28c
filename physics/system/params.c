/* Parameters of a scene as variables of a tape (PHYS_PARAM). Callbacks get a params struct and no
   tape: while one records, its thread keeps which tape that is, and which parameters are variables
   there, known by their addresses. */
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PARAMS = 64 };

static _Thread_local struct {
    ad_tape *tape; /* of the callback that records; NULL: none does */
    const struct phys_system *system;
} now;

static _Thread_local struct phys_variables bound;

/* The parameter of the bound ones whose double is at `at`. */
static ad_var variable(const struct phys_system *system, const double *at)
{
    const uintptr_t begin = (uintptr_t)system->params, place = (uintptr_t)at;
    if (place < begin || place >= begin + system->scene->params_bytes)
        return ad_refuse(now.tape, AD_E_ARGUMENT,
                         "%s: PHYS_PARAM of a copy of the parameters; expected the callback's own",
                         system->scene->name);
    for (size_t k = 0; k < bound.n; k++)
        if (system->scene->params[bound.which[k]].offset == place - begin) {
            bound.taken[k] = true;
            return bound.vars[k];
        }
    return ad_scalar(now.tape, *at);
}

ad_var phys_param(const double *at)
{
    if (!now.tape || !at)
        return (ad_var){0};
    return bound.n && bound.system->scene == now.system->scene ? variable(now.system, at)
                                                               : ad_scalar(now.tape, *at);
}

struct phys_variables phys_variables_bind(struct phys_variables variables)
{
    struct phys_variables before = bound;
    bound = variables;
    return before;
}

void phys_recording_begin(const struct phys_system *system, ad_tape *tape)
{
    now.tape = tape;
    now.system = system;
}

void phys_recording_end(void) { now.tape = NULL; }

size_t phys_param_find(const struct phys_system *system, const char *name, struct ad_error *error)
{
    const char *names[MOST_PARAMS];
    const struct phys_scene *scene = system->scene;
    const size_t n = scene->n_params < MOST_PARAMS ? scene->n_params : MOST_PARAMS;
    char what[80];
    for (size_t k = 0; k < n; k++)
        names[k] = scene->params[k].name;
    snprintf(what, sizeof what, "parameter of %s", scene->name);
    const size_t k = phys_find(what, name, n, names, error);
    return k == n ? SIZE_MAX : k;
}

double *phys_param_value(const struct phys_system *system, size_t k)
{
    return (double *)((char *)system->params + system->scene->params[k].offset);
}

/* ---- plain numbers ---- */

/* L with n parameters as variables. */
static ad_tape *record(const struct phys_system *system, size_t n, const size_t which[],
                       bool taken[], struct ad_error *error)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var p[MOST_PARAMS];
    if (!tape)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_var q = ad_input(tape, system->dof, 2, "q"), v = ad_input(tape, system->dof, 2, "v"),
           t = ad_input(tape, 1, 2, "t");
    for (size_t k = 0; k < n; k++) {
        p[k] = ad_input(tape, 1, 1, "parameter");
        taken[k] = false;
    }
    const struct phys_variables old = phys_variables_bind((struct phys_variables){
        .system = system, .n = n, .which = which, .vars = p, .taken = taken});
    phys_system_lagrangian(system, q, v, t);
    phys_system_add_forces(system, q, q, v, t);
    phys_system_constraint(system, q, t);
    phys_variables_bind(old);
    return tape;
}

/* The same with `shift` added to the plain number of the only one. */
static ad_tape *record_shifted(const struct phys_system *system, size_t which, double shift,
                               bool *taken, struct ad_error *error)
{
    double *at = phys_param_value(system, which), before = *at;
    *at += shift;
    ad_tape *tape = record(system, 1, &which, taken, error);
    *at = before;
    return tape;
}

bool phys_params_keep_form(const struct phys_system *a, const struct phys_system *b, size_t n,
                           const char *const names[], struct ad_error *error)
{
    size_t which[MOST_PARAMS];
    bool taken[MOST_PARAMS];
    for (size_t k = 0; k < n && k < MOST_PARAMS; k++)
        if ((which[k] = phys_param_find(a, names[k], error)) == SIZE_MAX)
            return false;
    ad_tape *first = record(a, n, which, taken, error), *second = record(b, n, which, taken, error);
    const bool same = ad_tape_same(first, second);
    phys_keep_memory(ad_tape_error(first), error);
    phys_keep_memory(ad_tape_error(second), error);
    ad_tape_free(first);
    ad_tape_free(second);
    return same;
}

/* Whether the parameter's neighbours are values of it, too, that do not change the coordinates. */
static bool moves(const struct phys_system *system, size_t which, double shift)
{
    const struct phys_scene *scene = system->scene;
    double *at = phys_param_value(system, which), before = *at;
    *at += shift;
    const bool same = (scene->dof ? scene->dof : scene->dof_of(system->params)) == system->dof &&
                      (scene->dims ? scene->dims : scene->dims_of(system->params)) == system->dims;
    *at = before;
    return same;
}

/* By constants and operations that change with the plain number, in a copy of the parameters. */
enum phys_param_use phys_param_use(const struct phys_system *system, const char *name,
                                   struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, name))
        return PHYS_PARAM_FIXED;
    const size_t which = phys_param_find(system, name, error);
    struct phys_system copy = *system;
    enum phys_param_use use = PHYS_PARAM_VARIABLE;
    if (which == SIZE_MAX)
        return PHYS_PARAM_FIXED;
    if (!(copy.params = malloc(system->scene->params_bytes + 1))) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return PHYS_PARAM_FIXED;
    }
    memcpy(copy.params, system->params, system->scene->params_bytes);
    const double value = *phys_param_value(system, which),
                 shift = 1e-3 * (value == 0 ? 1 : fabs(value));
    bool taken = false, other;
    ad_tape *tape = record_shifted(&copy, which, 0, &taken, error);
    phys_tape_status(tape, error);
    for (int sign = -1; sign <= 1; sign += 2) {
        if (!moves(&copy, which, sign * shift)) {
            use = PHYS_PARAM_FIXED;
            break;
        }
        ad_tape *shifted = record_shifted(&copy, which, sign * shift, &other, error);
        if (!ad_tape_same(tape, shifted))
            use = taken ? PHYS_PARAM_MIXED : PHYS_PARAM_PLAIN;
        phys_keep_memory(ad_tape_error(shifted), error);
        ad_tape_free(shifted);
    }
    ad_tape_free(tape);
    free(copy.params);
    return use;
}

enum ad_status phys_param_refuse(const struct phys_system *system, const char *name,
                                 struct ad_error *error)
{
    static const char *const why[] = {
        [PHYS_PARAM_PLAIN] = "L has it as a plain number",
        [PHYS_PARAM_MIXED] = "L has it as a plain number beside PHYS_PARAM",
    };
    const enum phys_param_use use = phys_param_use(system, name, error);
    if (error->status != AD_OK || use == PHYS_PARAM_VARIABLE)
        return error->status;
    if (use == PHYS_PARAM_FIXED)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: no derivative by %s: numbers next to %g are no values of it",
                       system->scene->name, name, phys_system_get(system, name));
    return ad_fail(error, AD_E_ARGUMENT,
                   "%s: no derivative by %s: %s, or in a condition; expected PHYS_PARAM(params, "
                   "%s) wherever the callbacks use it",
                   system->scene->name, name, why[use], name);
}

ad_var phys_system_lagrangian_of(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                                 size_t n, const char *const names[], const ad_var p[])
{
    struct ad_error error = {0};
    size_t which[MOST_PARAMS];
    bool taken[MOST_PARAMS];
    if (AD_LACKS(&error, system, system->scene) || (n && AD_LACKS(&error, names, p)))
        return ad_refuse(q.tape, error.status, "%s", error.message);
    if (n > MOST_PARAMS)
        return ad_refuse(q.tape, AD_E_ARGUMENT, "%zu parameters; expected at most %d", n,
                         MOST_PARAMS);
    for (size_t k = 0; k < n; k++)
        if (phys_param_refuse(system, names[k], &error) != AD_OK)
            return ad_refuse(q.tape, error.status, "%s", error.message);
        else
            which[k] = phys_param_find(system, names[k], &error);
    const struct phys_variables old = phys_variables_bind((struct phys_variables){
        .system = system, .n = n, .which = which, .vars = p, .taken = taken});
    ad_var L = phys_system_lagrangian(system, q, v, t);
    phys_variables_bind(old);
    return L;
}
