/* leastaction chart quantum: what a wave packet costs at which error, by the kernel under three
   rules, by Fourier transforms and by Crank-Nicolson; and what a slice costs beside the matrix
   product that it is. */
#include "chart_quantum.h"
#include "charts.h"
#include "apps/command.h"
#include "apps/output/json.h"
#include "timing.h"

#include <math.h>
#include <stdlib.h>

const struct quantum_problem quantum_problems[QUANTUM_PROBLEMS] = {
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

const struct quantum_way quantum_ways[QUANTUM_WAYS] = {
    {"kernel left", "left", &qm_method_kernel, QM_OPEN, 0, 0},
    {"kernel midpoint", "midpoint", &qm_method_kernel, QM_OPEN, 0, 0},
    {"kernel trapezoid", "trapezoid", &qm_method_kernel, QM_OPEN, 0, 0},
    {"fft", "trapezoid", &qm_method_fft, QM_OPEN, 0, 0},
    {"fft on a ring", "trapezoid", &qm_method_fft, QM_RING, 512, 0},
    {"crank-nicolson", "trapezoid", &qm_method_crank_nicolson, QM_REFLECT, 0, 16},
};

/* ---- error against seconds ---- */

/* How far a method is refined: points at most, seconds of a run at most. */
static const struct effort {
    size_t dense, sparse;
    double seconds;
} thorough = {2048, 65536, 2}, quick = {600, 4096, 0.2};

static enum ad_status open_problem(const struct quantum_problem *problem,
                                   struct phys_system *system, struct ad_error *error)
{
    if (phys_system_open(problem->scene, system, error) == AD_OK && !isnan(problem->g))
        phys_system_set(system, "g", problem->g, error);
    return error->status;
}

/* The coarsest grid that a sum over paths of this dt allows, where the way does not say. */
static enum ad_status choose_grid(const struct quantum_way *way, size_t steps,
                                  struct qm_slice *slice, struct ad_error *error)
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

static enum ad_status measure(const struct quantum_way *way, const struct qm_slice *slice,
                              const struct quantum_reference *reference, size_t steps,
                              struct quantum_point *point, struct ad_error *error)
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
        *point =
            (struct quantum_point){n, steps, built - start, processor_seconds() - start,
                                   quantum_reference_error(reference, &slice->grid, psi, psi + n)};
    }
    qm_propagator_free(propagator);
    free(psi);
    return error->status;
}

static enum ad_status sweep(const struct quantum_way *way, const struct phys_system *system,
                            const struct quantum_reference *reference, const struct effort *effort,
                            struct quantum_curve *curve, struct ad_error *error)
{
    const struct quantum_problem *problem = reference->problem;
    size_t most = way->method == &qm_method_kernel ? effort->dense : effort->sparse;
    for (size_t steps = 4; curve->n < QUANTUM_LEVELS; steps *= 2) {
        struct qm_slice slice = {.system = system,
                                 .rule = phys_rule_find(way->rule, error),
                                 .grid = {problem->low, problem->high, 0},
                                 .walls = way->walls,
                                 .dt = problem->time / (double)steps,
                                 .hbar = 1,
                                 .threads = 1};
        struct quantum_point *point = &curve->point[curve->n];
        struct ad_error too_long = {0};
        if (choose_grid(way, steps, &slice, &too_long) != AD_OK)
            continue; /* beyond a focus: finer slices are not */
        if (slice.grid.n > most || steps > effort->sparse)
            break;
        if (measure(way, &slice, reference, steps, point, error) != AD_OK)
            return error->status;
        if (isfinite(point->error))
            curve->n++;
        if (point->seconds > effort->seconds)
            break;
    }
    return AD_OK;
}

static enum ad_status one_problem(size_t number, const struct effort *effort,
                                  struct quantum_curve curves[QUANTUM_WAYS], struct ad_error *error)
{
    const struct quantum_problem *problem = &quantum_problems[number];
    struct phys_system system;
    struct quantum_reference reference = {0};
    if (open_problem(problem, &system, error) == AD_OK &&
        quantum_reference_new(problem, &system, effort == &quick, &reference, error) == AD_OK)
        for (size_t w = 0; w < QUANTUM_WAYS && error->status == AD_OK; w++)
            sweep(&quantum_ways[w], &system, &reference, effort, &curves[w], error);
    quantum_reference_free(&reference);
    phys_system_close(&system);
    return error->status;
}

static void write_curves(const struct quantum_curves *curves, FILE *out)
{
    fputs("problem,method,points,steps,setup_seconds,seconds,error\n", out);
    for (size_t p = 0; p < QUANTUM_PROBLEMS; p++)
        for (size_t w = 0; w < QUANTUM_WAYS; w++)
            for (size_t k = 0; k < curves->at[p][w].n; k++) {
                const struct quantum_point *at = &curves->at[p][w].point[k];
                fprintf(out, "%s,%s,%zu,%zu,%.6g,%.6g,%.6g\n", quantum_problems[p].name,
                        quantum_ways[w].name, at->points, at->steps, at->setup, at->seconds,
                        at->error);
            }
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
    struct qm_slice slice = {.system = system,
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

static enum ad_status race(const struct phys_system *system, size_t n, size_t packets, bool brief,
                           FILE *csv, bool print, struct ad_error *error)
{
    struct slices s;
    if (slices_new(system, n, packets, &s, error) == AD_OK) {
        struct timed jobs[] = {{.run = product, .context = &s, .processor = true},
                               {.run = by_kernel, .context = &s, .processor = true},
                               {.run = by_fft, .context = &s, .processor = true}};
        time_in_turn(3, jobs, brief ? 3 : TIMING_QUICK);
        fprintf(csv, "%zu,%zu,%.6g,%.6g,%.6g,%.6g\n", n, packets, s.build,
                1e-9 * jobs[0].nanoseconds, 1e-9 * jobs[1].nanoseconds, 1e-9 * jobs[2].nanoseconds);
        if (print)
            printf("  %6zu %8zu %10.3g %14.3g %14.3g %8.3f %14.3g\n", n, packets, s.build,
                   1e-9 * jobs[0].nanoseconds, 1e-9 * jobs[1].nanoseconds,
                   jobs[1].nanoseconds / jobs[0].nanoseconds, 1e-9 * jobs[2].nanoseconds);
    }
    slices_free(&s);
    return error->status;
}

static enum ad_status all_races(const struct chart_settings *settings, struct ad_error *error)
{
    static const size_t sizes[][2] = {{256, 1}, {1000, 1}, {2000, 1}, {256, 32}, {1000, 32}};
    struct phys_system system;
    struct result csv;
    if (chart_csv(settings, "quantum-slices", &csv, error) != AD_OK)
        return error->status;
    fputs("points,packets,build_seconds,product_seconds,kernel_seconds,fft_seconds\n", csv.out);
    if (!settings->quiet)
        puts("\na slice, seconds\n  points  packets      build   product alone         kernel    "
             "ratio            fft");
    if (phys_system_open("spring", &system, error) == AD_OK)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes && error->status == AD_OK; k++)
            if (!settings->quick || sizes[k][0] * sizes[k][1] < 2000)
                race(&system, sizes[k][0], sizes[k][1], settings->quick, csv.out, !settings->quiet,
                     error);
    phys_system_close(&system);
    if (error->status == AD_OK)
        result_commit(&csv, error);
    else
        result_abandon(&csv);
    return error->status;
}

/* ---- results ---- */

/* Seconds to err by `error` at most: the first run that does. */
static const struct quantum_point *within(const struct quantum_curve *curve, double error)
{
    const struct quantum_point *best = NULL;
    for (size_t k = 0; k < curve->n; k++)
        if (curve->point[k].error <= error && (!best || curve->point[k].seconds < best->seconds))
            best = &curve->point[k];
    return best;
}

static void print_table(const struct quantum_curves *curves)
{
    puts("seconds to an error of         1e-2         1e-3         1e-4");
    for (size_t p = 0; p < QUANTUM_PROBLEMS; p++)
        for (size_t w = 0; w < QUANTUM_WAYS; w++) {
            printf("  %-11s %-16s", w ? "" : quantum_problems[p].name, quantum_ways[w].name);
            for (int digits = 2; digits <= 4; digits++) {
                const struct quantum_point *at = within(&curves->at[p][w], pow(10, -digits));
                printf(at ? " %12.3g" : "            -", at ? at->seconds : 0.0);
            }
            putchar('\n');
        }
}

static void print_json(const struct quantum_curves *curves)
{
    struct json json;
    json_open(&json, stdout);
    for (size_t p = 0; p < QUANTUM_PROBLEMS; p++) {
        json_object(&json, quantum_problems[p].name);
        for (size_t w = 0; w < QUANTUM_WAYS; w++) {
            const struct quantum_point *at = within(&curves->at[p][w], 1e-2);
            json_number(&json, quantum_ways[w].name, at ? at->seconds : (double)NAN);
        }
        json_end_object(&json);
    }
    json_close(&json);
}

int chart_quantum(const struct chart_settings *settings, struct ad_error *error)
{
    struct result csv;
    struct plot plot = {0};
    struct quantum_curves *curves = calloc(1, sizeof *curves);
    if (!curves)
        return ad_fail(error, AD_E_MEMORY, "out of memory"), command_status(error);
    if (chart_csv(settings, "quantum", &csv, error) == AD_OK &&
        chart_picture(settings, "quantum", &plot, error) == AD_OK) {
        for (size_t p = 0; p < QUANTUM_PROBLEMS && error->status == AD_OK; p++)
            one_problem(p, settings->quick ? &quick : &thorough, curves->at[p], error);
        if (error->status == AD_OK) {
            write_curves(curves, csv.out);
            chart_quantum_draw(curves, &plot);
            if (!settings->quiet)
                print_table(curves);
            if (result_commit(&csv, error) == AD_OK && plot_commit(&plot, error) == AD_OK &&
                all_races(settings, error) == AD_OK && settings->json)
                print_json(curves);
        }
    }
    result_abandon(&csv);
    plot_abandon(&plot);
    free(curves);
    return error->status == AD_OK ? DONE : command_status(error);
}
