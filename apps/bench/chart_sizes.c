/* leastaction chart gradients: those of long paths, by the tape and at the limit of AVX-512
   (hand_limit.c): gradients-sizes.csv. */
#include "chart.h"
#include "apps/bench/hand/hand.h"
#include "apps/bench/measure/gradient_benchmark.h"
#include "apps/bench/measure/sized_gradient.h"
#include "apps/bench/measure/timing.h"

#include <math.h>
#include <stdlib.h>

enum { TAPE, NATIVE, LIMIT, JOBS, ROUNDS = 31 };

static const double tolerance = 1e-12;

struct subject {
    struct sized_gradient recorded;
    ad_program *program[LIMIT];
    hand_long_gradient *limit; /* NULL: there is none */
    double *g;
    double action;
};

#define PER_SLICE .digits = 4, .shown = 2, .fixed = true
static const struct column columns[] = {
    {.key = "scene", .title = "ns per slice", .width = -13},
    {.key = "slices", .title = "slices", .width = 8, .shown = 9},
    {.key = "tape_ns", .title = "gradient", .width = 9, PER_SLICE},
    {.key = "native_ns", .title = "compiled", .width = 9, PER_SLICE},
    {.key = "limit_ns", .title = "limit", .width = 7, PER_SLICE},
    {.key = "tape_ratio", .title = "ratio", .width = 7, PER_SLICE},
    {.key = "native_ratio", .title = "compiled", .width = 9, PER_SLICE},
    {.key = "memory_ratio", .title = "memory beyond path and gradient", .width = 33, PER_SLICE},
    {.key = "disagreement", .digits = 3},
    {.key = NULL},
};

static void run_limit(void *context)
{
    struct subject *s = context;
    const double *x = ad_data(s->program[NATIVE], s->recorded.path);
    s->action = s->limit((int)s->recorded.slices, x, s->g);
}

static enum ad_status subject_open(struct subject *s, int scene, size_t slices,
                                   struct ad_error *error)
{
    struct sized_gradient *r = &s->recorded;
    *s = (struct subject){.limit = hand_long_limit(scene)};
    if (sized_gradient_open(scene, 0, slices, r, error) != AD_OK)
        return error->status;
    s->g = race_rows(r->system.dof * slices);
    if (!s->g)
        return ad_fail(error, AD_E_MEMORY, "no memory for %zu slices", slices);
    for (int k = TAPE; k < LIMIT; k++)
        if (ad_compile(r->tape, 2, (ad_var[]){r->objective, r->gradient}, &s->program[k]) != AD_OK)
            return ad_fail(error, ad_tape_error(r->tape)->status, "%s",
                           ad_tape_error(r->tape)->message);
    ad_native(s->program[NATIVE], INFINITY, NULL);
    return sized_gradient_set(r, LIMIT, s->program, error);
}

static void subject_close(struct subject *s)
{
    for (int k = TAPE; k < LIMIT; k++)
        ad_program_free(s->program[k]);
    sized_gradient_close(&s->recorded);
    free(s->g);
}

/* The largest difference of two ways, relative. */
static double disagreement(struct subject *s, size_t n)
{
    const double *g[LIMIT], *action[LIMIT];
    for (int k = TAPE; k < LIMIT; k++) {
        ad_run(s->program[k]);
        g[k] = ad_data(s->program[k], s->recorded.gradient);
        action[k] = ad_data(s->program[k], s->recorded.objective);
    }
    double most = race_disagreement(n, g[TAPE], g[NATIVE]);
    most = fmax(most, fabs(*action[NATIVE] / *action[TAPE] - 1));
    if (!s->limit)
        return most;
    run_limit(s);
    return fmax(fmax(most, race_disagreement(n, g[TAPE], s->g)),
                fabs(s->action / *action[TAPE] - 1));
}

static enum ad_status measure(struct chart *chart, struct sheet *sheet, int scene, size_t slices,
                              struct ad_error *error)
{
    struct subject s;
    const size_t rounds = chart->quick ? TIMING_QUICK : ROUNDS;
    if (subject_open(&s, scene, slices, error) == AD_OK) {
        const size_t n = s.recorded.system.dof * slices;
        struct timed jobs[JOBS] = {{.run = time_program, .context = s.program[TAPE]},
                                   {.run = time_program, .context = s.program[NATIVE]},
                                   {.run = run_limit, .context = &s}};
        for (int k = 0; k < JOBS; k++)
            jobs[k].processor = true;
        const struct ad_program_info info = ad_program_info(s.program[NATIVE]);
        const double apart = disagreement(&s, n), own = 2 * (double)n * sizeof(double);
        const double bytes = (double)(info.value_bytes + info.bytes), per = (double)slices;
        if (!(apart < tolerance))
            chart->missed = "gradients of long paths by the tape and by hand differ";
        time_in_turn(s.limit ? JOBS : LIMIT, jobs, rounds);
#define TO_LIMIT(k) NUMBER(s.limit ? time_ratio(&jobs[k], &jobs[LIMIT], rounds) : NAN)
        sheet_row(sheet,
                  ROW(NAME(hand_build(0)[scene].scene), NUMBER(slices),
                      NUMBER(jobs[TAPE].nanoseconds / per), NUMBER(jobs[NATIVE].nanoseconds / per),
                      NUMBER(s.limit ? jobs[LIMIT].nanoseconds / per : NAN), TO_LIMIT(TAPE),
                      TO_LIMIT(NATIVE), NUMBER(bytes / own - 1), NUMBER(apart)),
                  error);
    }
    subject_close(&s);
    return error->status;
}

enum ad_status chart_sizes(struct chart *chart, struct ad_error *error)
{
    static const int scenes[] = {HAND_THREEBODY, HAND_DBLPEND};
    struct sheet *sheet = chart_sheet(chart, "gradients-sizes", columns, error);
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++)
        for (size_t slices = 10000; slices <= (chart->quick ? 10000 : 1000000); slices *= 100)
            if (error->status == AD_OK)
                measure(chart, sheet, scenes[k], slices, error);
    sheet_json(sheet, "sizes", &chart->json);
    return error->status;
}
