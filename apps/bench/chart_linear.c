/* leastaction chart linear: time and memory of a gradient of the action over slices, and over pairs
   of bodies. Both grow in proportion, or the chart shows where they do not. */
#include "chart_linear.h"
#include "charts.h"
#include "apps/command.h"
#include "hand.h"
#include "apps/output/json.h"
#include "sized_gradient.h"
#include "timing.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum { PAIR_SLICES = HAND_SLICES };

const char *const linear_ways[LINEAR_WAYS] = {"interpreted", "compiled"};

static const double budget_ns = 1e9; /* of one size and way: fewer rounds of what takes long */

/* ---- one size ---- */

struct size {
    int scene; /* of hand.h */
    size_t bodies, slices;
};

struct subject {
    struct sized_gradient recorded;
    ad_program *program[LINEAR_WAYS];
};

static void run_program(void *program) { ad_run(program); }

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
    for (int way = 0; way < LINEAR_WAYS; way++)
        ad_program_free(s->program[way]);
    sized_gradient_close(&s->recorded);
}

static enum ad_status subject_open(const struct size *size, struct subject *s,
                                   struct linear_point *at, struct ad_error *error)
{
    struct sized_gradient *recorded = &s->recorded;
    *s = (struct subject){.program = {NULL}};
    double before = processor_seconds();
    if (sized_gradient_open(size->scene, size->bodies, size->slices, recorded, error) != AD_OK ||
        sized_gradient_compile(recorded, &s->program[0], error) != AD_OK)
        return error->status;
    at->record_seconds = processor_seconds() - before;
    if (sized_gradient_compile(recorded, &s->program[1], error) != AD_OK)
        return error->status;
    ad_native(s->program[1], INFINITY, NULL);
    return sized_gradient_set(recorded, LINEAR_WAYS, s->program, error);
}

/* Rounds that fit into the budget, measured by one of each. */
static size_t affordable(struct timed jobs[LINEAR_WAYS], bool quick)
{
    double rounds = quick ? 3 : TIMING_QUICK;
    time_in_turn(LINEAR_WAYS, jobs, 1);
    double ns = jobs[0].nanoseconds + jobs[1].nanoseconds;
    return (size_t)fmax(1, fmin(rounds, budget_ns / ns));
}

static enum ad_status measure(const struct size *size, size_t units, bool quick,
                              struct linear_point *at, struct ad_error *error)
{
    struct subject s;
    double before = resident();
    *at = (struct linear_point){.units = units};
    if (subject_open(size, &s, at, error) == AD_OK) {
        struct timed jobs[LINEAR_WAYS] = {
            {.run = run_program, .context = s.program[0], .processor = true},
            {.run = run_program, .context = s.program[1], .processor = true}};
        struct ad_program_info info = ad_program_info(s.program[0]);
        time_in_turn(LINEAR_WAYS, jobs, affordable(jobs, quick));
        for (int way = 0; way < LINEAR_WAYS; way++)
            at->seconds[way] = 1e-9 * jobs[way].nanoseconds;
        at->program_bytes = (double)(info.value_bytes + info.bytes);
        at->tape_bytes = (double)ad_tape_bytes(s.recorded.tape);
        at->resident_bytes = fmax(resident() - before, 0);
    }
    subject_close(&s);
    return error->status;
}

/* ---- the two series ---- */

static enum ad_status over_slices(bool quick, struct linear_curve *curve, struct ad_error *error)
{
    double most = quick ? 1e4 : 1e6;
    for (size_t k = 0; error->status == AD_OK; k++) {
        size_t slices = (size_t)lround(100 * pow(10, (double)k / (quick ? 1 : 2)));
        if ((double)slices > 1.01 * most)
            break;
        struct size size = {.scene = HAND_THREEBODY, .slices = slices};
        measure(&size, slices, quick, &curve->point[curve->n++], error);
    }
    return error->status;
}

static enum ad_status over_pairs(bool quick, struct linear_curve *curve, struct ad_error *error)
{
    static const size_t bodies[] = {10, 20, 50, 100, 200, 500, 1000, 2000};
    size_t n = quick ? 4 : sizeof bodies / sizeof *bodies;
    for (size_t k = 0; k < n && error->status == AD_OK; k++) {
        struct size size = {HAND_GAS, bodies[k], PAIR_SLICES};
        size_t pairs = bodies[k] * (bodies[k] - 1) / 2;
        measure(&size, pairs, quick, &curve->point[curve->n++], error);
    }
    return error->status;
}

double linear_exponent(const struct linear_curve *curve, int way, double least)
{
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const struct linear_point *p = curve->point; p < curve->point + curve->n; p++)
        if ((double)p->units >= least) {
            double u = log((double)p->units), t = log(p->seconds[way]);
            n++, x += u, y += t, xx += u * u, xy += u * t;
        }
    return n < 2 ? NAN : (n * xy - x * y) / (n * xx - x * x);
}

double linear_end(const struct linear_curve *curve)
{
    return 0.099 * (double)curve->point[curve->n - 1].units;
}

/* ---- what is told ---- */

static void write_rows(const struct linear_curve *curve, FILE *csv)
{
    for (const struct linear_point *p = curve->point; p < curve->point + curve->n; p++)
        fprintf(csv, "%s,%zu,%.6g,%.6g,%.4g,%.0f,%.0f,%.0f\n", curve->name, p->units, p->seconds[0],
                p->seconds[1], p->record_seconds, p->program_bytes, p->tape_bytes,
                p->resident_bytes);
}

static void print_curve(const struct linear_curve *curve)
{
    printf("%s\n%10s %12s %12s %12s %12s %12s %12s\n", curve->title, curve->axis, "interpreted",
           "compiled", "recording", "program", "tape", "resident");
    for (const struct linear_point *p = curve->point; p < curve->point + curve->n; p++) {
        double units = (double)p->units;
        printf("%10zu %9.2f ns %9.2f ns %9.2f ms %10.1f B %10.1f B %10.1f B\n", p->units,
               1e9 * p->seconds[0] / units, 1e9 * p->seconds[1] / units, 1e3 * p->record_seconds,
               p->program_bytes / units, p->tape_bytes / units, p->resident_bytes / units);
    }
    for (int way = 0; way < LINEAR_WAYS; way++)
        printf("%s: seconds grow as %s^%.2f, over the last decade as ^%.2f\n", linear_ways[way],
               curve->axis, linear_exponent(curve, way, 0),
               linear_exponent(curve, way, linear_end(curve)));
    printf("ns and bytes are for one %s\n\n", curve->unit);
}

static void print_json(const struct linear_curve curves[LINEAR_CURVES], FILE *out)
{
    struct json json;
    json_open(&json, out);
    for (int c = 0; c < LINEAR_CURVES; c++) {
        const struct linear_curve *curve = &curves[c];
        const struct linear_point *last = &curve->point[curve->n - 1];
        double units = (double)last->units;
        json_object(&json, curve->name);
        json_number(&json, "exponent", linear_exponent(curve, 0, 0));
        json_number(&json, "end_exponent", linear_exponent(curve, 0, linear_end(curve)));
        json_number(&json, "native_exponent", linear_exponent(curve, 1, 0));
        json_number(&json, "native_end_exponent", linear_exponent(curve, 1, linear_end(curve)));
        json_count(&json, "most", last->units);
        json_number(&json, "ns", 1e9 * last->seconds[0] / units);
        json_number(&json, "native_ns", 1e9 * last->seconds[1] / units);
        json_number(&json, "program_bytes", last->program_bytes / units);
        json_number(&json, "tape_bytes", last->tape_bytes / units);
        json_end_object(&json);
    }
    json_close(&json);
}

int chart_linear(const struct chart_settings *settings, struct ad_error *error)
{
    struct linear_curve curves[LINEAR_CURVES] = {
        [LINEAR_SLICES] = {.name = "slices",
                           .unit = "slice",
                           .title = "three bodies over time slices",
                           .axis = "slices"},
        [LINEAR_PAIRS] = {.name = "pairs",
                          .unit = "pair of bodies",
                          .title = "gas, 10 to 2000 bodies, 100 slices",
                          .axis = "pairs"},
    };
    struct result csv = {0};
    struct plot plot = {0};
    if (chart_csv(settings, "linear", &csv, error) == AD_OK &&
        chart_picture(settings, "linear", &plot, error) == AD_OK &&
        over_slices(settings->quick, &curves[LINEAR_SLICES], error) == AD_OK &&
        over_pairs(settings->quick, &curves[LINEAR_PAIRS], error) == AD_OK) {
        fputs("over,units,interpreted_seconds,compiled_seconds,record_seconds,program_bytes,"
              "tape_bytes,resident_bytes\n",
              csv.out);
        for (int c = 0; c < LINEAR_CURVES; c++)
            write_rows(&curves[c], csv.out);
        linear_draw(curves, &plot);
    }
    if (chart_end(&plot, &csv, error) != AD_OK)
        return command_status(error);
    for (int c = 0; c < LINEAR_CURVES && !settings->quiet; c++)
        print_curve(&curves[c]);
    bool same = false;
    if (chart_threads(settings, &same, error) != AD_OK)
        return command_status(error);
    if (settings->json)
        print_json(curves, stdout);
    return same ? DONE : NOT_REACHED;
}
