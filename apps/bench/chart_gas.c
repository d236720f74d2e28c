/* leastaction chart gas: what near pairs save against all pairs, and how order grows in a gas that
   cools. */
#include "charts.h"
#include "apps/command.h"
#include "apps/simulate/gas_order.h"
#include "apps/output/json.h"
#include "timing.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>

enum { SIZES = 12, STEPS = 60, ROUNDS = 5, COOLED = 200, SAMPLES = 150 };

/* Bodies, and seconds a step of Verlet with all and with near pairs; NaN: not measured. */
struct size {
    size_t bodies;
    double all, near;
};

/* kT in units of the well's depth; m v_x^2 is kT, too. */
struct cooling {
    size_t n;
    double temperature[SAMPLES + 1], neighbours[SAMPLES + 1], hexatic[SAMPLES + 1];
};

struct chart {
    bool quick;
    size_t n;
    struct size size[SIZES];
    double crossover; /* bodies from which on near pairs are faster */
    struct cooling cooling;
};

/* A gas with its start, ready to be followed. */
struct gas_motion {
    struct phys_system system;
    struct phys_ode ode;
    double *y;
};

static void motion_close(struct gas_motion *m)
{
    free(m->y);
    phys_ode_free(&m->ode);
    phys_system_close(&m->system);
}

static enum ad_status motion_open(struct gas_motion *m, enum phys_gas_pairs pairs, size_t bodies,
                                  double friction, struct ad_error *error)
{
    const struct phys_setting set[] = {{"bodies", (double)bodies},
                                       {"cutoff", 3},
                                       {"spacing", 0.06},
                                       {"speed", 8e-3},
                                       {"walls", 0.01},
                                       {"friction", friction}};
    *m = (struct gas_motion){0};
    if (phys_system_open("gas", &m->system, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < sizeof set / sizeof *set; k++)
        if (phys_system_set(&m->system, set[k].name, set[k].value, error) != AD_OK)
            return error->status;
    if (phys_ode_gas(&m->system, pairs, &m->ode, error) != AD_OK)
        return error->status;
    if (!(m->y = malloc(m->ode.n * sizeof *m->y)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    return m->system.scene->start(m->system.params, 1, m->y, m->y + m->system.dof, error);
}

/* ---- seconds a step ---- */

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double seconds_a_step(struct gas_motion *m, size_t steps, struct ad_error *error)
{
    const double dt = 0.1;
    struct phys_simulation s = {.integrator = phys_integrator_find("verlet", error), .dt = dt};
    struct phys_simulation_info info = {0};
    s.t1 = dt * (double)steps;
    double start = processor_seconds();
    phys_simulate(&s, &m->ode, m->y, &info, error);
    return (processor_seconds() - start) / (double)steps;
}

/* Medians over rounds in turn; the first round, which records and allocates, is not counted. Every
   round goes on where the one before ended, so that pairs are listed as often as in a long run. */
static enum ad_status measure_size(struct size *size, bool with_all, size_t steps,
                                   struct ad_error *error)
{
    struct gas_motion all = {0}, near = {0};
    double t[2][ROUNDS];
    if (motion_open(&near, PHYS_GAS_NEAR, size->bodies, 0, error) == AD_OK && with_all)
        motion_open(&all, PHYS_GAS_ALL, size->bodies, 0, error);
    for (size_t r = 0; r <= ROUNDS && error->status == AD_OK; r++) {
        size_t at = r > 0 ? r - 1 : 0;
        t[0][at] = seconds_a_step(&near, steps, error);
        if (with_all)
            t[1][at] = seconds_a_step(&all, steps, error);
    }
    if (error->status == AD_OK) {
        qsort(t[0], ROUNDS, sizeof t[0][0], ascending);
        if (with_all)
            qsort(t[1], ROUNDS, sizeof t[1][0], ascending);
        size->near = t[0][ROUNDS / 2];
        size->all = with_all ? t[1][ROUNDS / 2] : (double)NAN;
    }
    motion_close(&all);
    motion_close(&near);
    return error->status;
}

/* Where log(all / near) goes through zero. */
static double crossover(size_t n, const struct size sizes[])
{
    for (size_t k = 1; k < n; k++) {
        double before = log(sizes[k - 1].all / sizes[k - 1].near);
        double after = log(sizes[k].all / sizes[k].near);
        if (before < 0 && after >= 0) {
            double low = (double)sizes[k - 1].bodies, high = (double)sizes[k].bodies;
            return low * pow(high / low, before / (before - after));
        }
    }
    return (double)NAN;
}

static enum ad_status measure_sizes(struct chart *chart, struct ad_error *error)
{
    static const size_t bodies[SIZES] = {10,  20,  30,   50,   80,   150,
                                         300, 500, 1000, 2000, 5000, 10000};
    size_t most = chart->quick ? 300 : 10000, most_all = chart->quick ? 150 : 2000;
    for (size_t k = 0; k < SIZES && bodies[k] <= most && error->status == AD_OK; k++) {
        size_t steps = bodies[k] > 300 ? STEPS / 3 : STEPS;
        chart->size[chart->n].bodies = bodies[k];
        measure_size(&chart->size[chart->n++], bodies[k] <= most_all, steps, error);
    }
    chart->crossover = crossover(chart->n, chart->size);
    return error->status;
}

/* ---- order of a gas that cools ---- */

static double temperature(const struct gas_motion *m)
{
    double sum = 0, depth = phys_system_get(&m->system, "strength") / 4;
    for (size_t k = 0; k < m->system.dof; k++)
        sum += m->y[m->system.dof + k] * m->y[m->system.dof + k];
    return phys_system_get(&m->system, "m") * sum / (double)m->system.dof / depth;
}

static enum ad_status measure_cooling(struct chart *chart, struct ad_error *error)
{
    const double friction = chart->quick ? 0.01 : 0.002, time = 6 / friction;
    struct cooling *c = &chart->cooling;
    struct gas_motion m;
    struct phys_simulation s = {.integrator = phys_integrator_find("verlet", error), .dt = 0.1};
    struct phys_simulation_info info;
    struct phys_order order;
    motion_open(&m, PHYS_GAS_AUTO, COOLED, friction, error);
    for (size_t k = 0; k <= SAMPLES && error->status == AD_OK; k++) {
        s.t0 = time * (double)k / (SAMPLES + 1);
        s.t1 = time * (double)(k + 1) / (SAMPLES + 1);
        if (phys_simulate(&s, &m.ode, m.y, &info, error) != AD_OK ||
            phys_order(m.system.bodies, m.y, gas_shell(&m.system), NULL, NULL, &order, error) !=
                AD_OK)
            break;
        c->temperature[k] = temperature(&m);
        c->neighbours[k] = order.neighbours;
        c->hexatic[k] = order.hexatic;
        c->n = k + 1;
    }
    motion_close(&m);
    return error->status;
}

/* ---- output ---- */

static void write_csv(const struct chart *chart, FILE *sizes, FILE *cooling)
{
    const struct cooling *c = &chart->cooling;
    fputs("bodies,all_pairs_s,near_pairs_s\n", sizes);
    for (size_t k = 0; k < chart->n; k++)
        fprintf(sizes, "%zu,%.4g,%.4g\n", chart->size[k].bodies, chart->size[k].all,
                chart->size[k].near);
    fputs("temperature,neighbours,hexatic\n", cooling);
    for (size_t k = 0; k < c->n; k++)
        fprintf(cooling, "%.5g,%.5g,%.5g\n", c->temperature[k], c->neighbours[k], c->hexatic[k]);
}

static void draw(const struct chart *chart, struct plot *plot)
{
    FILE *out = plot->script;
    write_csv(chart, plot->data, plot->data);
    plot->height = 400;
    fprintf(out,
            "set datafile separator ','\nset border 3 lc rgb '#606060'\nset tics nomirror\n"
            "set grid lt 1 lc rgb '#e6e6e6'\nset multiplot layout 1,2\n"
            "set title 'A step of Verlet, cutoff 3 {/Symbol s}'\nset logscale xy\n"
            "set format y '10^{%%T}'\nset xlabel 'bodies'\nset ylabel 'seconds of the processor'\n"
            "set key top left\n"
            "plot data every ::1::%zu using 1:2 with linespoints pt 7 ps 0.6 lw 2 "
            "lc rgb '#e8a33d' title 'all pairs', \\\n"
            "    data every ::1::%zu using 1:3 with linespoints pt 7 ps 0.6 lw 2 "
            "lc rgb '#1f4e79' title 'near pairs'\n",
            chart->n, chart->n);
    fprintf(out,
            "set title 'Order of %d bodies that cool'\nunset logscale y\nset xrange [0.02:3]\nset "
            "format y '%%g'\n"
            "set xlabel 'kT / depth of the well'\nset ylabel 'neighbours'\nset yrange [0:6.3]\n"
            "set ytics 0,1,6\nset y2range [0:1.05]\nset y2tics 0,0.2,1\nset border 11\n"
            "set y2label 'hexatic order'\nset key top right\n"
            "plot data every ::%zu using 1:2 with points pt 7 ps 0.7 lc rgb '#1f4e79' title "
            "'neighbours', "
            "\\\n    data every ::%zu using 1:3 axes x1y2 with points pt 7 ps 0.7 lc rgb '#c0392b' "
            "title 'hexatic order'\nunset multiplot\n",
            COOLED, chart->n + 2, chart->n + 2);
}

static void print(const struct chart *chart)
{
    puts("    bodies   all pairs, s   near pairs, s   of a step");
    for (size_t k = 0; k < chart->n; k++)
        printf("%10zu %14.3g %15.3g\n", chart->size[k].bodies, chart->size[k].all,
               chart->size[k].near);
    if (!isnan(chart->crossover))
        printf("near pairs are faster from %.0f bodies on\n", chart->crossover);
}

static void print_json(const struct chart *chart)
{
    struct json json;
    json_open(&json, stdout);
    json_number(&json, "crossover", chart->crossover);
    json_array(&json, "sizes");
    for (size_t k = 0; k < chart->n; k++) {
        json_object(&json, NULL);
        json_count(&json, "bodies", chart->size[k].bodies);
        json_number(&json, "all_pairs_seconds", chart->size[k].all);
        json_number(&json, "near_pairs_seconds", chart->size[k].near);
        json_end_object(&json);
    }
    json_end_array(&json);
    json_close(&json);
}

int chart_gas(const struct chart_settings *settings, struct ad_error *error)
{
    struct chart chart = {.quick = settings->quick};
    struct result sizes = {0}, cooling = {0};
    struct plot plot = {0};
    if (chart_csv(settings, "gas", &sizes, error) == AD_OK &&
        chart_csv(settings, "gas-order", &cooling, error) == AD_OK &&
        chart_picture(settings, "gas", &plot, error) == AD_OK &&
        measure_sizes(&chart, error) == AD_OK && measure_cooling(&chart, error) == AD_OK) {
        write_csv(&chart, sizes.out, cooling.out);
        draw(&chart, &plot);
        if (plot_commit(&plot, error) == AD_OK && result_commit(&sizes, error) == AD_OK)
            result_commit(&cooling, error);
    }
    plot_abandon(&plot);
    result_abandon(&sizes);
    result_abandon(&cooling);
    if (error->status != AD_OK)
        return command_status(error);
    if (!settings->quiet)
        print(&chart);
    if (settings->json)
        print_json(&chart);
    return DONE;
}
