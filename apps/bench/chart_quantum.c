/* leastaction chart quantum: cost of a wave packet against its error, by the kernel under three
   rules, by Fourier transforms and by Crank-Nicolson; and the cost of a slice relative to its
   matrix product. */
#include "chart.h"
#include "chart_quantum.h"
#include "apps/bench/measure/timing.h"

#include <math.h>
#include <stdlib.h>

static const struct quantum_problem problems[] = {
    {"free", "free packet", "freebody", 0, -13, 13, 1.5, {-2, 0.7, 2}, true, {1, 0, 0}},
    {"harmonic",
     "coherent state",
     "spring",
     (double)NAN,
     -7,
     7,
     3,
     {1.5, M_SQRT1_2, 0},
     true,
     {1, 1, 0}},
    {"double-well",
     "double well",
     "double-well",
     (double)NAN,
     -4.5,
     4.5,
     3,
     {-1.5, 0.4, 1},
     false,
     {0, 0, 0}},
};

/* A method with a rule and walls, and its grid: a number of points, or of points per slice; 0 and
   0: the fewest that the sum over paths allows at a dt. */
static const struct way {
    const char *name, *rule;
    const struct qm_method *method;
    enum qm_walls walls;
    size_t points, a_slice;
    const char *colour;
    int mark;
} ways[] = {
    {"kernel left", "left", &qm_method_kernel, QM_OPEN, 0, 0, "#8fc7e8", 6},
    {"kernel midpoint", "midpoint", &qm_method_kernel, QM_OPEN, 0, 0, "#c77dbb", 4},
    {"kernel trapezoid", "trapezoid", &qm_method_kernel, QM_OPEN, 0, 0, "#0b4f8a", 7},
    {"fft", "trapezoid", &qm_method_fft, QM_OPEN, 0, 0, "#d55e00", 4},
    {"fft on a ring", "trapezoid", &qm_method_fft, QM_RING, 512, 0, "#b8261b", 5},
    {"crank-nicolson", "trapezoid", &qm_method_crank_nicolson, QM_REFLECT, 0, 16, "#4e9a37", 9},
};

enum {
    LEVELS = 12,
    PROBLEMS = sizeof problems / sizeof *problems,
    WAYS = sizeof ways / sizeof *ways
};

static const struct column columns[] = {
    {.key = "problem"},       {.key = "method"},  {.key = "points"}, {.key = "steps"},
    {.key = "setup_seconds"}, {.key = "seconds"}, {.key = "error"},  {.key = NULL}};

/* ---- error against seconds ---- */

/* How far a method is refined: points at most, seconds of a run at most. */
static const struct effort {
    size_t dense, sparse;
    double seconds;
} thorough = {2048, 65536, 2}, quick = {600, 2048, 0.2};

static enum ad_status open_problem(const struct quantum_problem *problem,
                                   struct phys_system *system, struct ad_error *error)
{
    if (phys_system_open(problem->scene, system, error) == AD_OK && !isnan(problem->g))
        phys_system_set(system, "g", problem->g, error);
    return error->status;
}

/* The coarsest grid that a sum over paths of this dt allows, where the way does not say. */
static enum ad_status choose_grid(const struct way *way, size_t steps, struct qm_slice *slice,
                                  struct ad_error *error)
{
    struct qm_aliasing aliasing;
    slice->grid.n = way->points ? way->points : way->a_slice ? way->a_slice * steps : 64;
    if (way->points || way->a_slice)
        return AD_OK;
    for (int k = 0; k < 3; k++) { /* dx shifts the limit a little */
        if (qm_aliasing(slice, &aliasing, error) != AD_OK)
            return error->status;
        slice->grid.n =
            (size_t)ceil((slice->grid.high - slice->grid.low) / aliasing.dx_most * (1 + 1e-6));
        slice->grid.n = slice->grid.n < 64 ? 64 : slice->grid.n;
    }
    return AD_OK;
}

static enum ad_status measure(const struct way *way, const struct qm_slice *slice,
                              const struct quantum_reference *reference, size_t steps,
                              struct sheet *sheet, double *seconds, struct ad_error *error)
{
    size_t n = slice->grid.n;
    qm_propagator *propagator = NULL;
    qm_complex *psi = malloc(2 * n * sizeof *psi);
    if (!psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    qm_packet(&slice->grid, 1, &reference->problem->packet, 1, 0, psi);
    double start = processor_seconds();
    if (qm_propagator_new(way->method, slice, &propagator, error) == AD_OK) {
        double built = processor_seconds();
        for (size_t k = 0; k < steps; k++)
            qm_propagate(propagator, 1, psi, error);
        *seconds = processor_seconds() - start;
        double away = quantum_reference_error(reference, &slice->grid, psi, psi + n);
        if (isfinite(away))
            sheet_row(sheet,
                      ROW(NAME(reference->problem->name), NAME(way->name), NUMBER(n), NUMBER(steps),
                          NUMBER(built - start), NUMBER(*seconds), NUMBER(away)),
                      error);
    }
    qm_propagator_free(propagator);
    free(psi);
    return error->status;
}

static enum ad_status sweep(const struct way *way, const struct phys_system *system,
                            const struct quantum_reference *reference, const struct effort *effort,
                            struct sheet *sheet, struct ad_error *error)
{
    const struct quantum_problem *problem = reference->problem;
    size_t most = way->method == &qm_method_kernel ? effort->dense : effort->sparse;
    double seconds = 0;
    for (size_t steps = 4; steps < 4 << LEVELS && seconds <= effort->seconds; steps *= 2) {
        struct qm_slice slice = {.size = sizeof slice,
                                 .system = system,
                                 .rule = phys_rule_find(way->rule, error),
                                 .grid = {problem->low, problem->high, 0},
                                 .walls = way->walls,
                                 .dt = problem->time / (double)steps,
                                 .hbar = 1,
                                 .threads = 1};
        struct ad_error too_long = {0};
        if (choose_grid(way, steps, &slice, &too_long) != AD_OK)
            continue; /* too crude; finer slices are not */
        if (slice.grid.n > most || steps > effort->sparse)
            break;
        if (measure(way, &slice, reference, steps, sheet, &seconds, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

static enum ad_status one_problem(const struct quantum_problem *problem,
                                  const struct effort *effort, struct sheet *sheet,
                                  struct ad_error *error)
{
    struct phys_system system;
    struct quantum_reference reference = {0};
    if (open_problem(problem, &system, error) == AD_OK &&
        quantum_reference_new(problem, &system, effort == &quick, &reference, error) == AD_OK)
        for (size_t w = 0; w < WAYS && error->status == AD_OK; w++)
            sweep(&ways[w], &system, &reference, effort, sheet, error);
    quantum_reference_free(&reference);
    phys_system_close(&system);
    return error->status;
}

/* ---- a slice beside its product ---- */

struct slices {
    size_t n, packets;
    qm_complex *K, *psi, *out;
    qm_propagator *kernel, *fft;
    double build;
};

static void product(void *context)
{
    struct slices *s = context;
    qm_kernel_apply(s->n, s->K, s->packets, s->psi, s->out);
}

static void by_kernel(void *context)
{
    struct slices *s = context;
    struct ad_error error = {0};
    qm_propagate(s->kernel, s->packets, s->psi, &error);
}

static void by_fft(void *context)
{
    struct slices *s = context;
    struct ad_error error = {0};
    qm_propagate(s->fft, s->packets, s->psi, &error);
}

static void slices_free(struct slices *s)
{
    qm_propagator_free(s->kernel);
    qm_propagator_free(s->fft);
    free(s->K);
}

/* Between slices a packet in the harmonic well, whose kernel is unitary at this dt: the numbers
   neither grow nor fade. */
static enum ad_status slices_new(const struct phys_system *system, size_t n, size_t packets,
                                 struct slices *s, struct ad_error *error)
{
    struct qm_slice slice = {.size = sizeof slice,
                             .system = system,
                             .grid = {-10, 10, n},
                             .dt = 20 * 20 / (2 * M_PI * (double)n),
                             .hbar = 1,
                             .threads = 2};
    *s = (struct slices){.n = n, .packets = packets};
    s->K = malloc((n * n + 2 * n * packets) * sizeof *s->K);
    if (!s->K)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->psi = s->K + n * n;
    s->out = s->psi + n * packets;
    for (size_t p = 0; p < packets; p++)
        qm_packet(&slice.grid, 1, &(struct qm_gaussian){(double)p / 10, 0.7, 0}, packets, p,
                  s->psi);
    double start = processor_seconds();
    if (qm_kernel(&slice, s->K, error) != AD_OK)
        return error->status;
    s->build = processor_seconds() - start;
    if (qm_propagator_new(&qm_method_kernel, &slice, &s->kernel, error) == AD_OK)
        qm_propagator_new(&qm_method_fft, &slice, &s->fft, error);
    return error->status;
}

static const struct column slice_columns[] = {
    {.key = "points", .title = "points", .width = 8, .shown = 6},
    {.key = "packets", .title = "packets", .width = 8, .shown = 6},
    {.key = "build_seconds", .title = "build (s)", .width = 10, .shown = 3},
    {.key = "product_seconds", .title = "product (s)", .width = 12, .shown = 3},
    {.key = "kernel_seconds", .title = "kernel (s)", .width = 12, .shown = 3},
    {.key = "ratio", .title = "ratio", .width = 8, .shown = 3, .fixed = true, .no_csv = true},
    {.key = "fft_seconds", .title = "fft (s)", .width = 12, .shown = 3},
    {.key = NULL},
};

static enum ad_status time_slices(const struct phys_system *system, size_t n, size_t packets,
                                  bool brief, struct sheet *sheet, struct ad_error *error)
{
    struct slices s;
    if (slices_new(system, n, packets, &s, error) == AD_OK) {
        struct timed jobs[] = {{.run = product, .context = &s, .processor = true},
                               {.run = by_kernel, .context = &s, .processor = true},
                               {.run = by_fft, .context = &s, .processor = true}};
        time_in_turn(3, jobs, brief ? 3 : TIMING_SOME);
        sheet_row(sheet,
                  ROW(NUMBER(n), NUMBER(packets), NUMBER(s.build),
                      NUMBER(1e-9 * jobs[0].nanoseconds), NUMBER(1e-9 * jobs[1].nanoseconds),
                      NUMBER(jobs[1].nanoseconds / jobs[0].nanoseconds),
                      NUMBER(1e-9 * jobs[2].nanoseconds)),
                  error);
    }
    slices_free(&s);
    return error->status;
}

static enum ad_status all_slices(struct chart *chart, struct ad_error *error)
{
    static const size_t sizes[][2] = {{256, 1}, {1000, 1}, {2000, 1}, {256, 32}, {1000, 32}};
    struct phys_system system;
    struct sheet *sheet = chart_sheet(chart, "quantum-slices", slice_columns, error);
    if (phys_system_open("spring", &system, error) == AD_OK)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes && error->status == AD_OK; k++)
            if (!chart->quick || sizes[k][0] * sizes[k][1] < 2000)
                time_slices(&system, sizes[k][0], sizes[k][1], chart->quick, sheet, error);
    phys_system_close(&system);
    return error->status;
}

/* ---- results ---- */

/* The least CPU time to err by `error` at most; NaN: never. */
static double seconds_to(const struct sheet *sheet, const char *problem, const char *way,
                         double error)
{
    double best = NAN;
    for (size_t r = 0; r < sheet->rows; r++)
        if (sheet_is(sheet, r, "problem", problem) && sheet_is(sheet, r, "method", way) &&
            sheet_number(sheet, r, "error") <= error)
            best = fmin(best, sheet_number(sheet, r, "seconds"));
    return best;
}

static void report(struct chart *chart, const struct sheet *sheet, const char *problem)
{
    json_object(&chart->json, problem);
    for (const struct way *way = ways; way < ways + WAYS; way++) {
        json_number(&chart->json, way->name, seconds_to(sheet, problem, way->name, 1e-2));
        if (chart->quiet)
            continue;
        printf("  %-11s %-16s", way == ways ? problem : "", way->name);
        for (int digits = 2; digits <= 4; digits++) {
            double seconds = seconds_to(sheet, problem, way->name, pow(10, -digits));
            printf(isnan(seconds) ? "            -" : " %12.3g", seconds);
        }
        putchar('\n');
    }
    json_end_object(&chart->json);
}

/* One panel per problem: CPU time against error. */
static void draw(const struct sheet *sheet, struct plot *plot)
{
    static const struct layout layout = {.width = 1040,
                                         .height = 480,
                                         .title = "Wave packets: CPU time to reach an error",
                                         .columns = PROBLEMS,
                                         .room = {0.07, 0.985, 0.14, 0.85},
                                         .gap = {0.045, 0}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t p = 0; p < PROBLEMS; p++) {
        figure_panel(
            &figure,
            &(struct panel){.title = problems[p].title,
                            .x = "relative error",
                            .y = p ? NULL : "CPU time, building included (s)",
                            .log = "xy",
                            .x_range = "[2:1e-14] noextend",
                            .x_tics = "('1' 1, '10^{-4}' 1e-4, '10^{-8}' 1e-8, '10^{-12}' 1e-12)",
                            .y_range = "[1e-4:10]",
                            .key = p == 1 ? "bottom right samplen 1.5" : NULL});
        for (const struct way *w = ways; w < ways + WAYS; w++)
            figure_curve(&figure, sheet, "error", "seconds", w->name,
                         STYLE(w->colour, w->mark, 1.8, 0.8), "problem", problems[p].name, "method",
                         w->name);
    }
    figure_end(&figure);
}

enum ad_status chart_quantum(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "quantum", columns, error);
    struct plot *plot = chart_picture(chart, "quantum", error);
    for (size_t p = 0; p < PROBLEMS && error->status == AD_OK; p++)
        one_problem(&problems[p], chart->quick ? &quick : &thorough, sheet, error);
    if (error->status != AD_OK)
        return error->status;
    if (!chart->quiet)
        puts("CPU time (s) to an error of    1e-2         1e-3         1e-4");
    for (size_t p = 0; p < PROBLEMS; p++)
        report(chart, sheet, problems[p].name);
    draw(sheet, plot);
    return all_slices(chart, error);
}
