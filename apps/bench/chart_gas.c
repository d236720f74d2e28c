/* leastaction chart gas: the time saved by lists of near pairs, and the growth of order in a
   cooling gas. */
#include "chart.h"
#include "apps/bench/measure/timing.h"
#include "physics/gas/order.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>

enum { SIZES = 12, STEPS = 60, ROUNDS = 5, COOLED = 200, SAMPLES = 150 };

/* CPU time of a step of Verlet with all and with near pairs. */
static const struct column size_columns[] = {
    {.key = "bodies", .title = "bodies", .width = 10, .shown = 6},
    {.key = "all_pairs_s", .digits = 4, .title = "all pairs (s)", .width = 14, .shown = 3},
    {.key = "near_pairs_s", .digits = 4, .title = "near pairs (s)", .width = 15, .shown = 3},
    {.key = NULL},
};

/* kT in units of the well's depth; m v_x^2 is kT, too. */
static const struct column order_columns[] = {{.key = "temperature", .digits = 5},
                                              {.key = "neighbours", .digits = 5},
                                              {.key = "hexatic", .digits = 5},
                                              {.key = NULL}};

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

static double seconds_a_step(struct gas_motion *m, size_t steps, struct ad_error *error)
{
    const double dt = 0.1;
    struct phys_simulation s = {
        .size = sizeof s, .integrator = phys_integrator_find("verlet", error), .dt = dt};
    struct phys_simulation_info info = {0};
    s.t1 = dt * (double)steps;
    double start = processor_seconds();
    phys_simulate(&s, &m->ode, m->y, &info, error);
    return (processor_seconds() - start) / (double)steps;
}

/* Medians over alternating rounds, without the first, which records and allocates. Every round
   continues the previous one, so that pairs are listed as often as in a long run. */
static enum ad_status measure_size(struct sheet *sheet, size_t bodies, bool with_all, size_t steps,
                                   struct ad_error *error)
{
    struct gas_motion all = {0}, near = {0};
    double t[2][ROUNDS];
    if (motion_open(&near, PHYS_GAS_NEAR, bodies, 0, error) == AD_OK && with_all)
        motion_open(&all, PHYS_GAS_ALL, bodies, 0, error);
    for (size_t r = 0; r <= ROUNDS && error->status == AD_OK; r++) {
        size_t at = r > 0 ? r - 1 : 0;
        t[0][at] = seconds_a_step(&near, steps, error);
        if (with_all)
            t[1][at] = seconds_a_step(&all, steps, error);
    }
    sheet_row(sheet,
              ROW(NUMBER(bodies), NUMBER(with_all ? time_median(ROUNDS, t[1]) : (double)NAN),
                  NUMBER(time_median(ROUNDS, t[0]))),
              error);
    motion_close(&all);
    motion_close(&near);
    return error->status;
}

/* The number of bodies at which log(all / near) goes through zero; NaN: nowhere. */
static double crossover(const struct sheet *sheet)
{
    double before = NAN, low = 0;
    for (size_t r = 0; r < sheet->rows; r++) {
        double high = sheet_number(sheet, r, "bodies");
        double now =
            log(sheet_number(sheet, r, "all_pairs_s") / sheet_number(sheet, r, "near_pairs_s"));
        if (before < 0 && now >= 0)
            return low * pow(high / low, before / (before - now));
        before = now, low = high;
    }
    return (double)NAN;
}

static enum ad_status measure_sizes(struct sheet *sheet, bool brief, struct ad_error *error)
{
    static const size_t bodies[SIZES] = {10,  20,  30,   50,   80,   150,
                                         300, 500, 1000, 2000, 5000, 10000};
    size_t most = brief ? 300 : 10000, most_all = brief ? 150 : 2000;
    for (size_t k = 0; k < SIZES && bodies[k] <= most && error->status == AD_OK; k++)
        measure_size(sheet, bodies[k], bodies[k] <= most_all, bodies[k] > 300 ? STEPS / 3 : STEPS,
                     error);
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

static enum ad_status measure_cooling(struct sheet *sheet, bool brief, struct ad_error *error)
{
    const double friction = brief ? 0.01 : 0.002, time = 6 / friction;
    struct gas_motion m;
    struct phys_simulation s = {
        .size = sizeof s, .integrator = phys_integrator_find("verlet", error), .dt = 0.1};
    struct phys_simulation_info info;
    struct phys_order order;
    motion_open(&m, PHYS_GAS_AUTO, COOLED, friction, error);
    for (size_t k = 0; k <= SAMPLES && error->status == AD_OK; k++) {
        s.t0 = time * (double)k / (SAMPLES + 1);
        s.t1 = time * (double)(k + 1) / (SAMPLES + 1);
        if (phys_simulate(&s, &m.ode, m.y, &info, error) != AD_OK ||
            phys_order(m.system.bodies, m.y, phys_gas_shell(&m.system), NULL, NULL, &order,
                       error) != AD_OK)
            break;
        sheet_row(sheet,
                  ROW(NUMBER(temperature(&m)), NUMBER(order.neighbours), NUMBER(order.hexatic)),
                  error);
    }
    motion_close(&m);
    return error->status;
}

/* ---- output ---- */

static void draw(const struct sheet *sizes, const struct sheet *cooling, struct plot *plot)
{
    static const struct layout layout = {.width = 1040,
                                         .height = 440,
                                         .columns = 2,
                                         .room = {0.07, 0.93, 0.14, 0.84},
                                         .title = "A gas of Lennard-Jones bodies",
                                         .gap = {0.09, 0}};
    struct figure figure;
    char title[64];
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure, &(struct panel){.title = "A step of Verlet, cutoff 3 \xcf\x83",
                                          .x = "bodies",
                                          .y = "CPU time (s)",
                                          .log = "xy",
                                          .key = "top left"});
    figure_curve(&figure, sizes, "bodies", "all_pairs_s", "all pairs", STYLE("#e69f00", 7, 2, 0.6));
    figure_curve(&figure, sizes, "bodies", "near_pairs_s", "near pairs",
                 STYLE("#0072b2", 7, 2, 0.6));
    snprintf(title, sizeof title, "Order of %d bodies that cool", COOLED);
    figure_panel(&figure, &(struct panel){.title = title,
                                          .x = "kT / depth of the well",
                                          .y = "neighbours",
                                          .log = "x",
                                          .x_range = "[0.02:3]",
                                          .y_range = "[0:6.3]",
                                          .y_tics = "0,1,6",
                                          .key = "top right",
                                          .more = "set y2range [0:1.05]\nset y2tics 0,0.2,1\nset "
                                                  "border 11\nset y2label 'hexatic order'\n"});
    figure_curve(&figure, cooling, "temperature", "neighbours", "neighbours",
                 STYLE("#0072b2", 7, 0, 0.7));
    figure_curve(
        &figure, cooling, "temperature", "hexatic", "hexatic order",
        &(const struct style){.colour = "#d55e00", .mark = 7, .size = 0.7, .axes = "x1y2"});
    figure_end(&figure);
}

enum ad_status chart_gas(struct chart *chart, struct ad_error *error)
{
    struct sheet *sizes = chart_sheet(chart, "gas", size_columns, error);
    struct sheet *cooling = chart_sheet(chart, "gas-order", order_columns, error);
    struct plot *plot = chart_picture(chart, "gas", error);
    if (error->status != AD_OK || measure_sizes(sizes, chart->quick, error) != AD_OK ||
        measure_cooling(cooling, chart->quick, error) != AD_OK)
        return error->status;
    double from = crossover(sizes);
    if (!chart->quiet && !isnan(from))
        printf("near pairs are faster from %.0f bodies on\n", from);
    json_number(&chart->json, "crossover", from);
    sheet_json(sizes, "sizes", &chart->json);
    draw(sizes, cooling, plot);
    return error->status;
}
