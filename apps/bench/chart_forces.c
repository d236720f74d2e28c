/* Part of leastaction chart gradients: the accelerations of one state, each depending on those
   before as in a motion, beside hand-written C; and what a run of a program takes beyond its
   operations. CPU time. */
#include "physics/linear/vectors.h"
#include "chart.h"
#include "apps/bench/hand/hand.h"
#include "apps/bench/measure/timing.h"
#include "physics/physics.h"

#include <math.h>
#include <string.h>

enum { CHAIN = 1000, MOST = 2 * HAND_FORCE_DOF, LENGTH_OF_PROGRAM = 8 };

static const double tolerance = 1e-12, step = 1e-4;
static const double patience = 1; /* s, until forces run as machine code */

/* ---- chains of evaluations ---- */

struct chain {
    const struct hand_force *hand;
    struct phys_ode ode;
    double p[HAND_FORCE_PARAMS], start[MOST], y[MOST];
    struct ad_error error;
};

static void advance(struct chain *c, const double *rate)
{
    for (size_t k = 0; k < 2 * (size_t)c->hand->dof; k++)
        c->y[k] += step * rate[k];
}

static void run_ours(void *context)
{
    struct chain *c = context;
    double rate[MOST];
    memcpy(c->y, c->start, sizeof c->y);
    for (size_t k = 0; k < CHAIN; k++) {
        c->ode.field(c->ode.context, 0, c->y, rate, &c->error);
        advance(c, rate);
    }
}

static void run_hand(void *context)
{
    struct chain *c = context;
    const size_t dof = (size_t)c->hand->dof;
    double rate[MOST];
    memcpy(c->y, c->start, sizeof c->y);
    for (size_t k = 0; k < CHAIN; k++) {
        memcpy(rate, c->y + dof, dof * sizeof *rate);
        c->hand->acceleration(c->p, c->y, c->y + dof, rate + dof);
        advance(c, rate);
    }
}

static enum ad_status open_chain(const struct hand_force *hand, struct phys_system *system,
                                 struct chain *c, struct ad_error *error)
{
    const size_t dof = (size_t)hand->dof;
    *c = (struct chain){.hand = hand};
    if (phys_system_open(hand->scene, system, error) != AD_OK ||
        system->scene->start(system->params, 0, c->start, c->start + dof, error) != AD_OK ||
        phys_ode_for(system, phys_integrator_find("velocity-verlet", error), &c->ode, error) !=
            AD_OK)
        return error->status;
    for (size_t k = 0; k < HAND_FORCE_PARAMS && hand->params[k]; k++)
        c->p[k] = phys_system_get(system, hand->params[k]);
    return AD_OK;
}

static enum ad_status add_force(struct chart *chart, struct sheet *sheet,
                                const struct hand_force *hand, struct ad_error *error)
{
    struct phys_system system = {0};
    struct chain c;
    double ours[MOST];
    if (open_chain(hand, &system, &c, error) == AD_OK) {
        const size_t rounds = chart->quick ? TIMING_QUICK : TIMING_ROUNDS;
        struct timed jobs[] = {{.run = run_ours, .context = &c, .processor = true},
                               {.run = run_hand, .context = &c, .processor = true}};
        for (double begun = processor_seconds();
             *c.ode.interpreted(c.ode.context) && processor_seconds() < begun + patience;)
            run_ours(&c);
        time_in_turn(2, jobs, rounds);
        run_ours(&c);
        memcpy(ours, c.y, sizeof ours);
        run_hand(&c);
        const size_t n = 2 * (size_t)hand->dof;
        const double disagreement = phys_farthest(n, ours, c.y) / phys_largest(n, c.y);
        if (c.error.status != AD_OK || !(disagreement < tolerance))
            chart->missed = "accelerations by the tape and by hand differ";
        sheet_row(sheet,
                  ROW(NAME(hand->scene), NUMBER(jobs[0].nanoseconds / CHAIN),
                      NUMBER(jobs[1].nanoseconds / CHAIN),
                      NUMBER(time_ratio(jobs, jobs + 1, rounds)), NUMBER(disagreement)),
                  error);
    }
    phys_ode_free(&c.ode);
    phys_system_close(&system);
    return error->status;
}

/* ---- a program ---- */

/* y = x^2 + x, n times over. */
static ad_program *compile(size_t n, struct ad_error *error)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_program *program = NULL;
    ad_var x = ad_input(tape, 1, 1, "x"), y = x;
    for (size_t k = 0; k < n; k++)
        y = ad_add(ad_mul(y, y), x);
    if (ad_compile(tape, 1, &y, &program) == AD_OK) {
        ad_native(program, INFINITY, NULL);
        const double at = 0.1;
        ad_set(program, x, &at);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    ad_tape_free(tape);
    return program;
}

/* What a run takes beyond its operations: twice the time of some, less that of twice as many. */
static enum ad_status add_program(struct chart *chart, struct sheet *sheet, struct ad_error *error)
{
    const size_t rounds = chart->quick ? TIMING_QUICK : TIMING_ROUNDS;
    ad_program *some = compile(LENGTH_OF_PROGRAM, error);
    ad_program *twice = compile(2 * LENGTH_OF_PROGRAM, error);
    if (error->status == AD_OK) {
        struct timed jobs[] = {{.run = time_program, .context = some, .processor = true},
                               {.run = time_program, .context = twice, .processor = true}};
        time_in_turn(2, jobs, rounds);
        sheet_row(sheet,
                  ROW(NAME("program"), NUMBER(2 * jobs[0].nanoseconds - jobs[1].nanoseconds),
                      NUMBER(NAN), NUMBER(NAN), NUMBER(NAN)),
                  error);
    }
    ad_program_free(some);
    ad_program_free(twice);
    return error->status;
}

static const struct column columns[] = {
    {.key = "force", .title = "ns per evaluation", .width = -17},
    {.key = "force_ns", .title = "compiled", .width = 9, .shown = 1, .fixed = true},
    {.key = "hand_force_ns", .title = "hand", .width = 8, .shown = 1, .fixed = true},
    {.key = "force_ratio", .title = "ratio", .width = 6, .shown = 2, .fixed = true},
    {.key = "force_disagreement", .digits = 3},
    {.key = NULL},
};

enum ad_status chart_forces(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "forces", columns, error);
    for (size_t k = 0; k < HAND_FORCES && error->status == AD_OK; k++)
        add_force(chart, sheet, hand_forces() + k, error);
    if (error->status == AD_OK && add_program(chart, sheet, error) == AD_OK)
        sheet_json(sheet, "forces", &chart->json);
    return error->status;
}
