/* leastaction chart linear: time and memory of a gradient of the action against the number of
   slices and of pairs of bodies; the chart shows any departure from proportional growth. */
#include "chart.h"
#include "apps/bench/hand/hand.h"
#include "apps/bench/measure/sized_gradient.h"
#include "apps/bench/measure/timing.h"

#include <math.h>
#include <unistd.h>

enum { WAYS = 2, PAIR_SLICES = HAND_SLICES };

static const double budget_ns = 1e9; /* fewer rounds for slow measurements */

#define MS .shown = 3, .scale = 1e3
#define OF_UNIT(digits) .shown = digits, .fixed = true, .no_csv = true
static const struct column columns[] = {
    {.key = "over", .title = "over", .width = -6},
    {.key = "units", .title = "units", .width = 10, .shown = 9},
    {.key = "interpreted_seconds"},
    {.key = "compiled_seconds"},
    {.key = "record_seconds", .digits = 4, .title = "record (ms)", .width = 11, MS},
    {.key = "program_bytes", .digits = 15},
    {.key = "tape_bytes", .digits = 15},
    {.key = "resident_bytes", .digits = 15},
    {.key = "ns", .title = "interpreted (ns)", .width = 16, OF_UNIT(2)},
    {.key = "native_ns", .title = "compiled (ns)", .width = 13, OF_UNIT(2)},
    {.key = "unit_program", .title = "program (B)", .width = 11, OF_UNIT(1)},
    {.key = "unit_tape", .title = "tape (B)", .width = 10, OF_UNIT(1)},
    {.key = "unit_resident", .title = "resident (B)", .width = 12, OF_UNIT(1)},
    {.key = NULL},
};

/* Units below which the fixed cost of a run counts; slices that fill a line of the cache. */
enum { FEW = 1000, ALIGNED = 8 };

static const struct series {
    const char *name, *unit, *title;
} series[] = {
    {"slices", "slice", "three bodies over time slices"},
    {"pairs", "pair of bodies", "gas, 10 to 2000 bodies, 100 slices"},
};

enum { N_SERIES = sizeof series / sizeof *series };

static const struct way {
    const char *name, *seconds, *ns, *prefix, *colour;
} ways[WAYS] = {
    {"interpreted", "interpreted_seconds", "ns", "", "#0072b2"},
    {"compiled", "compiled_seconds", "native_ns", "native_", "#009e73"},
};

/* ---- one size ---- */

struct size {
    int scene; /* of hand.h */
    size_t bodies, slices;
};

struct subject {
    struct sized_gradient recorded;
    ad_program *program[WAYS];
};

static double resident(void)
{
    unsigned long pages = 0;
    FILE *statm = fopen("/proc/self/statm", "r");
    if (statm && fscanf(statm, "%*u %lu", &pages) != 1)
        pages = 0;
    if (statm)
        fclose(statm);
    return (double)pages * (double)sysconf(_SC_PAGESIZE);
}

static void subject_close(struct subject *s)
{
    for (int way = 0; way < WAYS; way++)
        ad_program_free(s->program[way]);
    sized_gradient_close(&s->recorded);
}

/* `record`: CPU seconds of recording, gradient and compiling. */
static enum ad_status subject_open(const struct size *size, struct subject *s, double *record,
                                   struct ad_error *error)
{
    struct sized_gradient *recorded = &s->recorded;
    *s = (struct subject){.program = {NULL}};
    double before = processor_seconds();
    if (sized_gradient_open(size->scene, size->bodies, size->slices, recorded, error) != AD_OK ||
        sized_gradient_compile(recorded, &s->program[0], error) != AD_OK)
        return error->status;
    *record = processor_seconds() - before;
    if (sized_gradient_compile(recorded, &s->program[1], error) != AD_OK)
        return error->status;
    ad_native(s->program[1], INFINITY, NULL);
    return sized_gradient_set(recorded, WAYS, s->program, error);
}

/* Rounds that fit into the budget, measured by one of each. */
static size_t affordable(struct timed jobs[WAYS], bool quick)
{
    double rounds = quick ? 3 : TIMING_SOME;
    time_in_turn(WAYS, jobs, 1);
    double ns = jobs[0].nanoseconds + jobs[1].nanoseconds;
    return (size_t)fmax(1, fmin(rounds, budget_ns / ns));
}

static enum ad_status measure(struct sheet *sheet, const char *over, const struct size *size,
                              size_t units, bool quick, struct ad_error *error)
{
    struct subject s;
    double before = resident(), record = 0;
    if (subject_open(size, &s, &record, error) == AD_OK) {
        struct timed jobs[WAYS] = {
            {.run = time_program, .context = s.program[0], .processor = true},
            {.run = time_program, .context = s.program[1], .processor = true}};
        struct ad_program_info info = ad_program_info(s.program[0]);
        const size_t rounds = affordable(jobs, quick);
        time_in_turn(WAYS, jobs, rounds);
        double ns[WAYS] = {time_least(&jobs[0], rounds), time_least(&jobs[1], rounds)};
        double n = (double)units;
        double program = (double)(info.value_bytes + info.bytes);
        double tape = (double)ad_tape_bytes(s.recorded.tape), grown = fmax(resident() - before, 0);
        sheet_row(sheet,
                  ROW(NAME(over), NUMBER(units), NUMBER(1e-9 * ns[0]), NUMBER(1e-9 * ns[1]),
                      NUMBER(record), NUMBER(program), NUMBER(tape), NUMBER(grown),
                      NUMBER(ns[0] / n), NUMBER(ns[1] / n), NUMBER(program / n), NUMBER(tape / n),
                      NUMBER(grown / n)),
                  error);
    }
    subject_close(&s);
    return error->status;
}

/* ---- the two series ---- */

static enum ad_status over_slices(bool quick, struct sheet *sheet, struct ad_error *error)
{
    double most = quick ? 1e4 : 1e6;
    for (size_t k = 0; error->status == AD_OK; k++) {
        size_t slices = (size_t)lround(100 * pow(10, (double)k / (quick ? 1 : 2)));
        if ((double)slices > 1.01 * most)
            break;
        slices = slices < FEW ? slices : slices / ALIGNED * ALIGNED;
        struct size size = {.scene = HAND_THREEBODY, .slices = slices};
        measure(sheet, "slices", &size, slices, quick, error);
    }
    return error->status;
}

static enum ad_status over_pairs(bool quick, struct sheet *sheet, struct ad_error *error)
{
    static const size_t bodies[] = {10, 20, 50, 100, 200, 500, 1000, 2000};
    size_t n = quick ? 4 : sizeof bodies / sizeof *bodies;
    for (size_t k = 0; k < n && error->status == AD_OK; k++) {
        struct size size = {HAND_GAS, bodies[k], PAIR_SLICES};
        measure(sheet, "pairs", &size, bodies[k] * (bodies[k] - 1) / 2, quick, error);
    }
    return error->status;
}

/* ---- how they grow ---- */

static double most_units(const struct sheet *sheet, const char *over)
{
    double most = 0;
    for (size_t r = 0; r < sheet->rows; r++)
        if (sheet_is(sheet, r, "over", over))
            most = fmax(most, sheet_number(sheet, r, "units"));
    return most;
}

/* Exponent of seconds against units by least squares over the rows from `least` units on; 1 is
   linear. NaN with fewer than two rows. */
static double exponent(const struct sheet *sheet, const char *over, const char *seconds,
                       double least)
{
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (size_t r = 0; r < sheet->rows; r++)
        if (sheet_is(sheet, r, "over", over) && sheet_number(sheet, r, "units") >= least) {
            double u = log(sheet_number(sheet, r, "units")),
                   t = log(sheet_number(sheet, r, seconds));
            n++, x += u, y += t, xx += u * u, xy += u * t;
        }
    return n < 2 ? NAN : (n * xy - x * y) / (n * xx - x * x);
}

static void report(struct chart *chart, const struct sheet *sheet, const struct series *s)
{
    double most = most_units(sheet, s->name);
    json_object(&chart->json, s->name);
    for (const struct way *w = ways; w < ways + WAYS; w++) {
        char key[32];
        double all = exponent(sheet, s->name, w->seconds, FEW);
        double end = exponent(sheet, s->name, w->seconds, 0.099 * most);
        snprintf(key, sizeof key, "%sexponent", w->prefix);
        json_number(&chart->json, key, all);
        snprintf(key, sizeof key, "%send_exponent", w->prefix);
        json_number(&chart->json, key, end);
        if (!chart->quiet)
            printf("%s: CPU time grows as %s^%.2f from %d on, over the last decade as ^%.2f\n",
                   w->name, s->name, all, FEW, end);
    }
    for (size_t r = 0; r < sheet->rows; r++)
        if (sheet_is(sheet, r, "over", s->name) && sheet_number(sheet, r, "units") == most) {
            json_number(&chart->json, "most", most);
            json_number(&chart->json, "ns", sheet_number(sheet, r, "ns"));
            json_number(&chart->json, "native_ns", sheet_number(sheet, r, "native_ns"));
            json_number(&chart->json, "program_bytes", sheet_number(sheet, r, "unit_program"));
            json_number(&chart->json, "tape_bytes", sheet_number(sheet, r, "unit_tape"));
        }
    json_end_object(&chart->json);
}

/* ---- the picture: time per unit above, memory per unit below; level means linear ---- */

static void draw_times(struct figure *figure, const struct sheet *sheet, const struct series *s)
{
    char title[96], y[48];
    snprintf(y, sizeof y, "CPU time per %s (ns)", s->unit);
    figure_panel(figure, &(struct panel){.title = s->title,
                                         .y = y,
                                         .log = "x",
                                         .y_range = "[0:*]",
                                         .key = "top right samplen 2",
                                         .more = "set offsets 0,0,graph 0.35,0\n"});
    for (const struct way *w = ways; w < ways + WAYS; w++) {
        snprintf(title, sizeof title, "%s: %s^%.2f, at the end ^%.2f", w->name, s->name,
                 exponent(sheet, s->name, w->seconds, FEW),
                 exponent(sheet, s->name, w->seconds, 0.099 * most_units(sheet, s->name)));
        figure_curve(figure, sheet, "units", w->ns, title, STYLE(w->colour, 7, 2, 0.6), "over",
                     s->name);
    }
}

static void draw_memory(struct figure *figure, const struct sheet *sheet, const struct series *s)
{
    char y[48];
    snprintf(y, sizeof y, "memory per %s (B)", s->unit);
    figure_panel(figure, &(struct panel){.x = s->name,
                                         .y = y,
                                         .log = "xy",
                                         .y_range = "[10:1e4]",
                                         .key = "top right samplen 2"});
    figure_curve(figure, sheet, "units", "unit_program", "program", STYLE("#b8261b", 7, 2, 0.6),
                 "over", s->name);
    figure_curve(figure, sheet, "units", "unit_tape", "tape", STYLE("#f2b134", 7, 2, 0.6), "over",
                 s->name);
}

static void draw(const struct sheet *sheet, struct plot *plot)
{
    static const struct layout layout = {.width = 960,
                                         .height = 640,
                                         .title = "Gradients of the action: cost over size",
                                         .rows = 2,
                                         .columns = 2,
                                         .room = {0.08, 0.985, 0.115, 0.88},
                                         .gap = {0.1, 0.09}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t s = 0; s < N_SERIES; s++)
        draw_times(&figure, sheet, &series[s]);
    for (size_t s = 0; s < N_SERIES; s++)
        draw_memory(&figure, sheet, &series[s]);
    figure_end(&figure);
}

enum ad_status chart_linear(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "linear", columns, error);
    struct plot *plot = chart_picture(chart, "linear", error);
    if (error->status != AD_OK || over_slices(chart->quick, sheet, error) != AD_OK ||
        over_pairs(chart->quick, sheet, error) != AD_OK)
        return error->status;
    for (size_t s = 0; s < N_SERIES; s++)
        report(chart, sheet, &series[s]);
    draw(sheet, plot);
    return chart_threads(chart, error);
}
