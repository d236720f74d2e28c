/* leastaction chart integrators: error against work, every method on every problem. */
#include "chart.h"
#include "apps/bench/measure/motions.h"
#include "apps/bench/measure/timing.h"
#include "apps/bench/measure/work_precision.h"

#include <math.h>
#include <stdlib.h>

enum { ROUNDS = 3, MOST_METHODS = WORK_CURVES };

/* How far a method is refined. */
static const struct effort {
    double evaluations, seconds, refinement; /* of a run; factor from step to step */
    size_t rounds;                           /* 0: the time of the run that gave the error */
} thorough = {3e5, 0.1, 1.4142135623730951, ROUNDS}, quick = {1e4, 0.015, 2, 0};

static const double short_run = 5e-4; /* seconds that are long enough for the clock ... */
static const double long_run = 0.01;  /* ... and for what disturbs them to even out */

struct entrant {
    const struct phys_integrator *integrator;
    struct phys_ode ode;
    struct work_curve *curve;
    double samples[WORK_POINTS][ROUNDS]; /* seconds */
};

struct contest {
    struct problem motion;
    size_t n;
    struct work_curve curve[MOST_METHODS];
    struct entrant entrant[MOST_METHODS];
};

/* ---- accuracy: coarse to fine, once ---- */

static double setting_of(const struct contest *contest, const struct phys_integrator *integrator,
                         const struct effort *effort, size_t level)
{
    const struct motion_problem *problem = contest->motion.problem;
    if (integrator->adaptive)
        return 0.1 / pow(effort->refinement, 2 * (double)level);
    /* an integer number of steps fills the time */
    double steps = ceil(problem->time / problem->coarsest);
    return problem->time / floor(steps * pow(effort->refinement, (double)level) + 0.5);
}

/* Finer runs of a method that is at rounding already are no better; those of one whose error
   depends on chance are, after some. */
static bool exhausted(const struct work_curve *curve)
{
    enum { LAST = 5 };
    double before = INFINITY, since = INFINITY;
    for (size_t k = 0; k < curve->n; k++) {
        double *least = k + LAST < curve->n ? &before : &since;
        *least = fmin(*least, curve->point[k].error);
    }
    return before < 1e-9 && since > 0.5 * before;
}

static enum ad_status sweep(struct contest *contest, struct entrant *entrant,
                            const struct effort *effort, struct ad_error *error)
{
    struct work_curve *curve = entrant->curve;
    const struct phys_integrator *method = entrant->integrator;
    *curve = (struct work_curve){.name = method->name, .knob = method->adaptive ? "tol" : "dt"};
    for (size_t level = 0; level < WORK_POINTS && !exhausted(curve); level++) {
        double setting = setting_of(contest, method, effort, level);
        struct problem_cost cost;
        if (method->adaptive && setting < 1e-15)
            break;
        if (problem_run(&contest->motion, method, &entrant->ode, setting, &cost, error) != AD_OK)
            return error->status;
        if (cost.complete && cost.error < 1)
            curve->point[curve->n++] = (struct work_point){
                setting, (double)cost.steps, (double)cost.evaluations, cost.seconds, cost.error};
        if ((double)cost.evaluations > effort->evaluations || cost.seconds > effort->seconds)
            break;
    }
    return AD_OK;
}

/* ---- time: every run of every method, then all of them again ---- */

static enum ad_status time_run(struct contest *contest, struct entrant *entrant, size_t level,
                               double *seconds, struct ad_error *error)
{
    const struct work_point *point = &entrant->curve->point[level];
    struct problem_cost cost;
    double sum = 0;
    size_t runs = 0;
    do {
        if (problem_run(&contest->motion, entrant->integrator, &entrant->ode, point->setting, &cost,
                        error) != AD_OK)
            return error->status;
        sum += cost.seconds;
        runs++;
    } while (sum < short_run);
    *seconds = sum / (double)runs;
    return AD_OK;
}

/* Long runs repeat themselves to a few per cent: once is enough. */
static size_t rounds_of(const struct work_point *point, size_t rounds)
{
    return point->seconds > long_run ? 1 : rounds;
}

static enum ad_status measure(struct contest *contest, size_t rounds, struct ad_error *error)
{
    for (size_t round = 0; round < rounds; round++)
        for (size_t m = 0; m < contest->n; m++)
            for (size_t k = 0; k < contest->curve[m].n; k++)
                if (round < rounds_of(&contest->curve[m].point[k], rounds) &&
                    time_run(contest, &contest->entrant[m], k,
                             &contest->entrant[m].samples[k][round], error) != AD_OK)
                    return error->status;
    for (size_t m = 0; rounds && m < contest->n; m++)
        for (size_t k = 0; k < contest->curve[m].n; k++) {
            struct work_point *point = &contest->curve[m].point[k];
            const double *samples = contest->entrant[m].samples[k];
            size_t n = rounds_of(point, rounds);
            point->seconds = time_median(n, samples);
        }
    return AD_OK;
}

/* ---- a problem ---- */

static enum ad_status enter_all(struct contest *contest, struct ad_error *error)
{
    for (size_t k = 0; phys_integrators[k] && contest->n < MOST_METHODS; k++) {
        struct entrant *entrant = &contest->entrant[contest->n];
        bool suits = false;
        entrant->integrator = phys_integrators[k];
        entrant->curve = &contest->curve[contest->n];
        if (problem_field(&contest->motion, phys_integrators[k], &entrant->ode, &suits, error) !=
                AD_OK ||
            !suits)
            phys_ode_free(&entrant->ode);
        else
            contest->n++;
        if (error->status != AD_OK)
            return error->status;
    }
    return AD_OK;
}

static enum ad_status hold_contest(struct contest *contest, const struct motion_problem *problem,
                                   const struct effort *effort, struct ad_error *error)
{
    if (problem_open(problem, &contest->motion, error) != AD_OK ||
        enter_all(contest, error) != AD_OK)
        return error->status;
    for (size_t m = 0; m < contest->n; m++)
        if (sweep(contest, &contest->entrant[m], effort, error) != AD_OK)
            return error->status;
    return measure(contest, effort->rounds, error);
}

static void contest_free(struct contest *contest)
{
    for (size_t m = 0; contest && m < contest->n; m++)
        phys_ode_free(&contest->entrant[m].ode);
    if (contest)
        problem_close(&contest->motion);
    free(contest);
}

static const struct column columns[] = {{.key = "problem"},
                                        {.key = "method"},
                                        {.key = "knob"},
                                        {.key = "setting", .digits = 9},
                                        {.key = "steps", .digits = 15},
                                        {.key = "evaluations", .digits = 15},
                                        {.key = "seconds"},
                                        {.key = "error"},
                                        {.key = NULL}};

static void add_rows(const struct contest *contest, struct sheet *sheet, struct ad_error *error)
{
    const char *problem = contest->motion.problem->name;
    if (contest->motion.doubt > 0)
        fprintf(sheet->csv, "# %s: the reference is good to %.1g\n", problem,
                contest->motion.doubt);
    for (size_t m = 0; m < contest->n; m++)
        for (size_t k = 0; k < contest->curve[m].n; k++) {
            const struct work_point *p = &contest->curve[m].point[k];
            sheet_row(sheet,
                      ROW(NAME(problem), NAME(contest->curve[m].name), NAME(contest->curve[m].knob),
                          NUMBER(p->setting), NUMBER(p->steps), NUMBER(p->evaluations),
                          NUMBER(p->seconds), NUMBER(p->error)),
                      error);
        }
}

static void json_rows(const struct contest *contest, struct json *json)
{
    json_object(json, contest->motion.problem->name);
    for (int digits = 3; digits <= 12; digits += 3) {
        struct work_point at;
        char key[16];
        size_t best = work_best(contest->n, contest->curve, pow(10, -digits), &at);
        snprintf(key, sizeof key, "1e-%d", digits);
        if (best == contest->n) {
            json_null(json, key);
            continue;
        }
        json_object(json, key);
        json_text(json, "method", contest->curve[best].name);
        json_number(json, contest->curve[best].knob, at.setting);
        json_number(json, "steps", at.steps);
        json_number(json, "evaluations", at.evaluations);
        json_number(json, "seconds", at.seconds);
        json_end_object(json);
    }
    json_end_object(json);
}

static enum ad_status one_problem(struct chart *chart, const struct motion_problem *problem,
                                  struct sheet *sheet, struct ad_error *error)
{
    char name[64];
    struct contest *contest = calloc(1, sizeof *contest);
    snprintf(name, sizeof name, "integrators-%s", problem->name);
    if (!contest)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct plot *plot = chart_picture(chart, name, error);
    if (error->status == AD_OK &&
        hold_contest(contest, problem, chart->quick ? &quick : &thorough, error) == AD_OK) {
        add_rows(contest, sheet, error);
        work_draw(problem->title, contest->n, contest->curve, contest->motion.doubt, plot);
        if (!chart->quiet)
            work_print(stdout, problem->title, contest->n, contest->curve);
        json_rows(contest, &chart->json);
    }
    contest_free(contest);
    return error->status;
}

enum ad_status chart_integrators(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "integrators", columns, error);
    for (size_t k = 0; k < MOTION_PROBLEMS && error->status == AD_OK; k++)
        one_problem(chart, &motion_problems[k], sheet, error);
    if (error->status == AD_OK && chart_ensembles(chart, error) == AD_OK)
        chart_drift(chart, error);
    return error->status;
}
