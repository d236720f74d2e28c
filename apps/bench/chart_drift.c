/* leastaction chart drift: energy error over many periods at equal work; bounded for symplectic
   methods, growing for the others. */
#include "chart.h"
#include "apps/bench/measure/motions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PER_PERIOD = 1200, /* evaluations of the field a period */
    TRIAL_PERIODS = 10,
    BISECTIONS = 16,
    PER_DECADE = 12, /* points of a curve a factor ten of time */
    MOST_BINS = 64,
    MOST_METHODS = 32
};

static const double period = 2 * M_PI;
static const double first_bin = 0.1; /* periods */

static const struct motion_problem problem = {.name = "drift",
                                              .scene = "kepler",
                                              .set = {{"e", 0.6}},
                                              .time = TRIAL_PERIODS * 2 * M_PI,
                                              .coarsest = 0.2,
                                              .exact = NULL};

/* Largest relative error of the energy in every bin of time. */
struct drift {
    const struct phys_integrator *integrator;
    const struct phys_ode *ode;
    double setting, energy;
    size_t evaluations;
    double worst[MOST_BINS];
};

static double bin_end(size_t bin) { return first_bin * pow(10, (double)(bin + 1) / PER_DECADE); }

static bool sample(void *context, double t, const double *y)
{
    struct drift *d = context;
    double E = d->ode->energy(d->ode->context, t, y), periods = t / period;
    if (t == 0)
        d->energy = E;
    double place = PER_DECADE * log10(fmax(periods / first_bin, 1));
    size_t bin = (size_t)place < MOST_BINS ? (size_t)place : MOST_BINS - 1;
    d->worst[bin] = fmax(d->worst[bin], fabs(E / d->energy - 1));
    return true;
}

static enum ad_status follow(const struct problem *motion, struct drift *d, double time,
                             struct phys_simulation_info *info, struct ad_error *error)
{
    double y[2 * 2]; /* a body in the plane */
    struct phys_simulation settings = phys_simulation_of(d->integrator, d->setting, time);
    struct ad_error lost = {0};
    if (phys_ode_enter(d->ode, 0, motion->q, motion->v, y, error) != AD_OK)
        return error->status;
    settings.every = 1;
    settings.sample = sample;
    settings.context = d;
    memset(d->worst, 0, sizeof d->worst);
    phys_simulate(&settings, d->ode, y, info, &lost);
    d->evaluations = info->evaluations;
    return lost.status;
}

/* The setting at which a trial costs the common amount of work. */
static void choose_setting(const struct problem *motion, struct drift *d, struct ad_error *error)
{
    double low = log(1e-15), high = log(d->integrator->adaptive ? 0.1 : 1.0);
    struct phys_simulation_info info;
    if (!d->integrator->adaptive)
        low = log(period / PER_PERIOD / 2);
    for (int k = 0; k < BISECTIONS && error->status == AD_OK; k++) {
        d->setting = exp(0.5 * (low + high));
        bool lost = follow(motion, d, problem.time, &info, error) != AD_OK;
        bool fine = !lost && info.evaluations > TRIAL_PERIODS * PER_PERIOD;
        *(fine ? &low : &high) = log(d->setting);
    }
}

static const struct column columns[] = {{.key = "method"},  {.key = "symplectic"},
                                        {.key = "setting"}, {.key = "periods"},
                                        {.key = "error"},   {.key = NULL}};

static void add_rows(const struct drift *d, double periods, struct sheet *sheet,
                     struct ad_error *error)
{
    for (size_t bin = 0; bin < MOST_BINS && bin_end(bin) < periods * 1.01; bin++)
        if (d->worst[bin] > 0)
            sheet_row(sheet,
                      ROW(NAME(d->integrator->name), NAME(d->integrator->symplectic ? "yes" : "no"),
                          NUMBER(d->setting), NUMBER(bin_end(bin)), NUMBER(d->worst[bin])),
                      error);
}

/* Labels beside the ends of the curves, moved apart where they would overlap, with a line to each.
 */
static void label_ends(size_t n, const struct drift *drifts, size_t last, FILE *out)
{
    double at[MOST_METHODS], above = INFINITY;
    bool done[MOST_METHODS] = {false};
    for (size_t k = 0; k < n; k++) { /* from the top */
        size_t next = n;
        for (size_t m = 0; m < n; m++)
            if (!done[m] && (next == n || drifts[m].worst[last] > drifts[next].worst[last]))
                next = m;
        done[next] = true;
        const char *colour = drifts[next].integrator->symplectic ? "#0072b2" : "#d55e00";
        double end = log10(fmax(drifts[next].worst[last], 1e-16));
        at[next] = fmin(end, above - 0.62);
        above = at[next];
        fprintf(out,
                "set label '%s' at graph 1.05, first 10**(%.3g) left font ',11' textcolor "
                "rgb '%s' noenhanced\nset arrow from graph 1, first 10**(%.3g) to graph 1.045, "
                "first 10**(%.3g) nohead lw 0.7 lc rgb '%s'\n",
                drifts[next].integrator->name, at[next], colour, end, at[next], colour);
    }
}

static double lowest(size_t n, const struct drift *drifts, size_t last)
{
    double low = 1;
    for (size_t m = 0; m < n; m++)
        for (size_t bin = 0; bin <= last; bin++)
            if (drifts[m].worst[bin] > 0)
                low = fmin(low, drifts[m].worst[bin]);
    return fmax(low, 1e-16);
}

static void draw(size_t n, const struct drift *drifts, double periods, size_t last,
                 const struct sheet *sheet, struct plot *plot)
{
    static const struct layout layout = {
        .width = 860, .height = 500, .room = {0.1, 0.8, 0.11, 0.92}};
    static const int marks[] = {1, 2, 7, 5, 9, 11, 13, 4, 6, 8, 10, 12, 3};
    char title[96], x[32], y[32];
    struct figure figure;
    snprintf(title, sizeof title,
             "Energy of a Kepler orbit (e = 0.6) at equal work: %d evaluations an orbit",
             PER_PERIOD);
    snprintf(x, sizeof x, "[%g:%g]", first_bin * 2, periods);
    snprintf(y, sizeof y, "[%g:100]", lowest(n, drifts, last) / 5);
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure, &(struct panel){.title = title,
                                          .x = "orbits",
                                          .y = "relative error of the energy",
                                          .log = "xy",
                                          .x_range = x,
                                          .y_range = y,
                                          .y_tics = "100",
                                          .key = "top center horizontal samplen 3 width 2"});
    label_ends(n, drifts, last, plot->script);
    for (size_t m = 0; m < n; m++)
        figure_curve(&figure, sheet, "periods", "error", NULL,
                     STYLE(drifts[m].integrator->symplectic ? "#0072b2" : "#d55e00",
                           marks[m % (sizeof marks / sizeof *marks)], 1.6, 0.5),
                     "method", drifts[m].integrator->name);
    figure_element(&figure, "NaN with lines lw 3 lc rgb '#0072b2' title 'symplectic'");
    figure_element(&figure, "NaN with lines lw 3 lc rgb '#d55e00' title 'not symplectic'");
    figure_end(&figure);
}

static enum ad_status measure(const struct problem *motion, double periods, struct drift *drifts,
                              size_t *n, struct sheet *sheet, struct ad_error *error)
{
    for (size_t k = 0; phys_integrators[k] && *n < MOST_METHODS; k++) {
        struct phys_ode ode = {0};
        struct drift *d = &drifts[*n];
        struct phys_simulation_info info;
        bool suits = false;
        *d = (struct drift){.integrator = phys_integrators[k], .ode = &ode};
        if (d->integrator->lagrangian) /* variational ones: their maps are among the others */
            continue;
        if (problem_field(motion, d->integrator, &ode, &suits, error) == AD_OK && suits) {
            choose_setting(motion, d, error);
            if (error->status == AD_OK &&
                follow(motion, d, periods * period, &info, error) == AD_OK) {
                add_rows(d, periods, sheet, error);
                ++*n;
            }
        }
        phys_ode_free(&ode);
        if (error->status != AD_OK)
            return error->status;
    }
    return AD_OK;
}

enum ad_status chart_drift(struct chart *chart, struct ad_error *error)
{
    double periods = chart->quick ? 24 : 1000;
    struct problem motion = {0};
    struct sheet *sheet = chart_sheet(chart, "drift", columns, error);
    struct plot *plot = chart_picture(chart, "drift", error);
    struct drift *drifts = calloc(MOST_METHODS, sizeof *drifts);
    size_t n = 0, last = 0;
    if (!drifts)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    while (bin_end(last + 1) < periods * 1.01)
        last++;
    if (error->status == AD_OK && problem_open(&problem, &motion, error) == AD_OK &&
        measure(&motion, periods, drifts, &n, sheet, error) == AD_OK)
        draw(n, drifts, periods, last, sheet, plot);
    problem_close(&motion);
    free(drifts);
    return error->status;
}
