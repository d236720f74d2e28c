/* Published systems: their motion from random starts, observed at equal intervals of time. */
#include "task.h"
#include "autodiff/sized.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct hnn_task *const hnn_tasks[] = {
    &hnn_task_spring,          &hnn_task_pendulum, &hnn_task_two_body, &hnn_task_three_body,
    &hnn_task_double_pendulum, &hnn_task_wave,     &hnn_task_string,   NULL};

/* Of a step of the integrator, relative; and absolute, small next to the smallest motion. */
static const double accuracy = 1e-10, smallest = 1e-12;

const struct hnn_task *hnn_task_find(const char *name, struct ad_error *error)
{
    const char *names[LENGTH(hnn_tasks)] = {0};
    size_t k = 0;
    for (; hnn_tasks[k]; k++)
        names[k] = hnn_tasks[k]->name;
    return hnn_find("task", name, names, &k, error) == AD_OK ? hnn_tasks[k] : NULL;
}

double hnn_task_strength(const struct hnn_task *task, double strength)
{
    return strength == 0 ? task->published.strength : strength;
}

enum ad_status hnn_task_ode(const struct hnn_task *task, double strength, struct phys_ode *ode,
                            struct ad_error *error)
{
    if (AD_LACKS(error, task, ode))
        return error->status;
    if (!(strength >= 0 && isfinite(strength)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "strength: expected more than 0, or 0 as published, got %g", strength);
    strength = hnn_task_strength(task, strength);
    enum ad_status status = task->H
                                ? phys_ode_hamiltonian(task->H, task->dof, &strength, ode, error)
                                : hnn_task_double_pendulum_ode(strength, ode, error);
    ode->name = task->name;
    return status;
}

void hnn_task_start(const struct hnn_task *task, double strength, uint64_t seed, double *y)
{
    if (!task || !y)
        return;
    struct hnn_sampling sampling = task->published;
    struct phys_random random;
    sampling.strength = hnn_task_strength(task, strength);
    phys_random_seed(&random, seed);
    task->start(&random, &sampling, y);
}

/* ---- shared by the tasks ---- */

void hnn_task_on_circle(struct phys_random *random, const struct hnn_sampling *s, double point[2])
{
    double x, y, r;
    do {
        x = hnn_between(random, -1, 1);
        y = hnn_between(random, -1, 1);
        r = hypot(x, y);
    } while (r == 0);
    double radius = hnn_between(random, s->radius_min, s->radius_max);
    point[0] = radius * x / r;
    point[1] = radius * y / r;
}

void hnn_task_off_axes(struct phys_random *random, const struct hnn_sampling *s, double point[2])
{
    (void)s;
    for (size_t k = 0; k < 2; k++) {
        double x = hnn_between(random, -0.8, 0.8);
        point[k] = x + copysign(0.2, x);
    }
}

ad_var hnn_task_gravity(ad_var q, ad_var p, ad_var t, const void *params)
{
    const double *strength = params;
    (void)t;
    uint32_t bodies = (uint32_t)ad_rows(q) / 2;
    ad_var energy = ad_mul(0.5, ad_sum_rows(ad_square(p)));
    for (uint32_t i = 0; i < bodies; i++)
        for (uint32_t j = i + 1; j < bodies; j++) {
            ad_var x = ad_sub(ad_row(q, i), ad_row(q, j));
            ad_var y = ad_sub(ad_row(q, bodies + i), ad_row(q, bodies + j));
            energy = ad_sub(energy, ad_mul(*strength, ad_recip(ad_hypot(x, y))));
        }
    return energy;
}

/* ---- observing ---- */

/* Where states are drawn freely one each is enough, and their velocities may be 0. */
static enum ad_status check_sampling(const struct hnn_task *task, const struct hnn_sampling *s,
                                     struct ad_error *error)
{
    bool single = !task->H;
    const struct {
        const char *name, *expected;
        double value;
        bool holds;
    } rule[] = {
        {"trials", "at least 1", (double)s->trials, s->trials >= 1},
        {"points", single ? "at least 1" : "at least 2", (double)s->points,
         s->points >= (single ? 1 : 2)},
        {"time", "more than 0", s->time, s->time > 0 && isfinite(s->time)},
        {"noise", "at least 0", s->noise, s->noise >= 0 && isfinite(s->noise)},
        {"smallest radius", "more than 0", s->radius_min, s->radius_min > 0 || single},
        {"largest radius", "at least the smallest", s->radius_max,
         s->radius_max >= s->radius_min && s->radius_max > 0 && isfinite(s->radius_max)},
        {"spread of speeds", "at least 0 and less than 1", s->spread,
         s->spread >= 0 && s->spread < 1},
        {"strength", "more than 0", s->strength, s->strength > 0 && isfinite(s->strength)},
    };
    for (size_t k = 0; k < LENGTH(rule); k++)
        if (!rule[k].holds)
            return ad_fail(error, AD_E_ARGUMENT, "%s: expected %s, got %g", rule[k].name,
                           rule[k].expected, rule[k].value);
    return AD_OK;
}

static char *join(const char *a, const char *b, const char *c)
{
    size_t size = strlen(a) + strlen(b) + strlen(c) + 1;
    char *text = malloc(size);
    if (text)
        snprintf(text, size, "%s%s%s", a, b, c);
    return text;
}

/* q1x ... p1x ... dq1xdt ... dp1xdt ... trial t; v1 for p1 where states have velocities */
static bool name_columns(const struct hnn_task *task, struct hnn_observations *o)
{
    const char *const part[4][2] = {
        {"q", ""}, {task->H ? "p" : "v", ""}, {"dq", "dt"}, {task->H ? "dp" : "dv", "dt"}};
    bool done = (o->names = calloc(o->cols, sizeof *o->names)) != NULL;
    for (size_t k = 0; done && k < 4 * task->dof; k++)
        done = (o->names[k] = join(part[k / task->dof][0], task->coordinates[k % task->dof],
                                   part[k / task->dof][1])) != NULL;
    return done && (o->names[o->cols - 2] = strdup("trial")) &&
           (o->names[o->cols - 1] = strdup("t"));
}

static enum ad_status prepare(const struct hnn_task *task, const struct hnn_sampling *s,
                              struct hnn_observations *o, struct ad_error *error)
{
    o->dof = task->dof;
    o->cols = 4 * task->dof + 2;
    if (s->trials <= SIZE_MAX / s->points / o->cols / sizeof *o->values) {
        o->rows = s->trials * s->points;
        o->values = malloc(o->rows * o->cols * sizeof *o->values);
    }
    if (!o->values || !name_columns(task, o))
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu x %zu observations", s->trials,
                       s->points);
    return AD_OK;
}

/* States, and their rates, of one trial; the observations behind it are not there yet. */
static enum ad_status follow_trial(const struct hnn_sampling *s, const struct phys_ode *ode,
                                   size_t trial, double *y, struct hnn_observations *o,
                                   struct ad_error *error)
{
    double ones[HNN_TASK_STATES_MOST]; /* the published tolerance is absolute */
    for (size_t k = 0; k < HNN_TASK_STATES_MOST; k++)
        ones[k] = 1;
    const struct phys_simulation simulation = {.size = sizeof simulation,
                                               .integrator = phys_integrator_find("dop853", error),
                                               .t1 = s->time,
                                               .rtol = accuracy,
                                               .atol = smallest,
                                               .scale = ones,
                                               .n_samples = s->points - 1};
    size_t states = 2 * o->dof, first = trial * s->points;
    double rate[HNN_TASK_STATES_MOST], *at = o->values + first;
    for (size_t k = 0; k < states; k++)
        at[k * o->rows] = y[k];
    if (s->points > 1)
        phys_trajectory(&simulation, ode, y, states, o->rows, at, NULL, error);
    for (size_t i = 0; i < s->points && error->status == AD_OK; i++, at++) {
        double t = i == 0              ? 0
                   : i + 1 < s->points ? s->time * (double)i / (double)(s->points - 1)
                                       : s->time;
        for (size_t k = 0; k < states; k++)
            y[k] = at[k * o->rows];
        ode->field(ode->context, t, y, rate, error);
        for (size_t k = 0; k < states; k++)
            at[(states + k) * o->rows] = rate[k];
        at[(o->cols - 2) * o->rows] = (double)trial;
        at[(o->cols - 1) * o->rows] = t;
    }
    return error->status;
}

static void add_noise(struct hnn_observations *o, double noise, struct phys_random *random,
                      size_t first, size_t end)
{
    for (size_t k = 0; k < 2 * o->dof; k++)
        for (size_t i = first; noise > 0 && i < end; i++)
            o->values[k * o->rows + i] += noise * phys_random_normal(random);
}

enum ad_status hnn_task_observe(const struct hnn_task *task, const struct hnn_sampling *sampling,
                                uint64_t seed, struct hnn_observations *observations,
                                struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct phys_random random;
    double y[HNN_TASK_STATES_MOST];
    if (AD_LACKS_RESULT(error, observations) || AD_LACKS(error, task, sampling))
        return error->status;
    AD_OWN(hnn_sampling, sampling, strength, error);
    size_t points = sampling->points;
    phys_random_seed(&random, seed);
    if (check_sampling(task, sampling, error) == AD_OK &&
        prepare(task, sampling, observations, error) == AD_OK)
        hnn_task_ode(task, sampling->strength, &ode, error);
    for (size_t trial = 0; trial < sampling->trials && error->status == AD_OK; trial++) {
        task->start(&random, sampling, y);
        if (follow_trial(sampling, &ode, trial, y, observations, error) == AD_OK)
            add_noise(observations, sampling->noise, &random, trial * points, (trial + 1) * points);
    }
    phys_ode_free(&ode);
    return error->status;
}

void hnn_observations_free(struct hnn_observations *o)
{
    if (!o)
        return;
    for (size_t k = 0; o->names && k < o->cols; k++)
        free(o->names[k]);
    AD_FREE(o->names, o->values);
    *o = (struct hnn_observations){0};
}
