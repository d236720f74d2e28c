/* Accuracy of integrators on a network against evaluations of its field (chart_hnn.h). The weights
   are the same in f64 and f32; the arithmetic of the field differs. */
#include "chart_hnn.h"
#include "apps/bench/measure/work_precision.h"
#include "hnn/data/data.h"
#include "physics/integrators/stepper.h"

#include <math.h>
#include <stdlib.h>

enum { FEWEST_STEPS = 16, ROLLOUT_TYPES = 2, ROLLOUT_METHODS = 16 };

/* Evaluations after which no finer setting is tried, and most steps of one run. Each step, or
   tolerance, is finer than the last by a factor. */
static const struct effort {
    double limit, finer_step, finer_tolerance;
} thorough = {12000, 1.4142135623730951, 3.1622776601683795}, quick = {800, 2, 10};
static const double time_end = 20;
static const double start[2] = {1.5, 0}; /* a swing in the middle of the data's energies */
static const double reference_tolerance = 1e-12;
static const double trusted = 1e-11; /* ten times the error allowed for the reference */
static const double finest = 1e-14;  /* setting of any method */
static const enum ad_type rollout_types[ROLLOUT_TYPES] = {AD_F64, AD_F32};

struct rollouts {
    hnn_model *model;
    struct phys_ode ode;
    double time, end[2]; /* where the reference is */
    double model_error;  /* its distance from the true motion: finer than this is of no use */
    size_t n;
    struct work_curve curve[ROLLOUT_TYPES][ROLLOUT_METHODS];
    double least[ROLLOUT_TYPES]; /* error that any method comes to */
};

/* Where a motion is at the end. More steps than `most`: AD_E_ACCURACY, as in f32, where a
   tolerance under the roundings makes steps ever shorter. */
static enum ad_status follow(const struct phys_ode *ode, const struct phys_integrator *integrator,
                             double setting, double most, double end[2],
                             struct phys_simulation_info *info, struct ad_error *error)
{
    double scale[2];
    const struct phys_simulation simulation = {.size = sizeof simulation,
                                               .integrator = integrator,
                                               .t1 = time_end,
                                               .dt = integrator->adaptive ? 0 : setting,
                                               .rtol = setting,
                                               .atol = setting,
                                               .scale = scale,
                                               .max_steps = (size_t)most};
    end[0] = start[0];
    end[1] = start[1];
    if (phys_typical_sizes(ode, 0, start, scale, error) == AD_OK)
        phys_simulate(&simulation, ode, end, info, error);
    return error->status;
}

static double distance(const double a[2], const double b[2])
{
    return hypot(a[0] - b[0], a[1] - b[1]) / hypot(b[0], b[1]);
}

/* The reference, and the motion of the pendulum itself. */
static enum ad_status find_end(struct rollouts *r, struct ad_error *error)
{
    const struct phys_integrator *dop853 = phys_integrator_find("dop853", error);
    const struct hnn_task *task = hnn_task_find("pendulum", error);
    struct phys_ode truth = {0};
    struct phys_simulation_info info;
    double end[2];
    if (follow(&r->ode, dop853, reference_tolerance, thorough.limit, r->end, &info, error) ==
            AD_OK &&
        hnn_task_ode(task, task->published.strength, &truth, error) == AD_OK &&
        follow(&truth, dop853, reference_tolerance, thorough.limit, end, &info, error) == AD_OK)
        r->model_error = distance(r->end, end);
    phys_ode_free(&truth);
    return error->status;
}

/* ---- one method, coarse to fine ---- */

static double coarsest(const struct phys_integrator *integrator)
{
    return integrator->adaptive ? 1e-1 : time_end / FEWEST_STEPS;
}

static enum ad_status refine(const struct rollouts *r, const struct phys_integrator *integrator,
                             const struct effort *effort, struct work_curve *curve,
                             struct ad_error *error)
{
    double setting = coarsest(integrator), evaluations = 0, distant = INFINITY;
    *curve =
        (struct work_curve){.name = integrator->name, .knob = integrator->adaptive ? "tol" : "dt"};
    for (; evaluations < effort->limit && distant > trusted && setting > finest &&
           curve->n < WORK_POINTS;
         setting /= integrator->adaptive ? effort->finer_tolerance : effort->finer_step) {
        struct phys_simulation_info info = {0};
        struct ad_error lost = {0};
        double end[2];
        enum ad_status status =
            follow(&r->ode, integrator, setting, effort->limit, end, &info, &lost);
        evaluations = fmax(evaluations, (double)info.evaluations);
        if (status == AD_E_MEMORY || status == AD_E_ARGUMENT)
            return ad_fail(error, status, "%s", lost.message);
        if (status != AD_OK) { /* too coarse to be followed, or finer than f32 can tell */
            if (curve->n)
                break;
            continue;
        }
        distant = distance(end, r->end);
        curve->point[curve->n++] = (struct work_point){.setting = setting,
                                                       .evaluations = (double)info.evaluations,
                                                       .seconds = info.seconds,
                                                       .error = distant};
    }
    return AD_OK;
}

static double least_error(const struct work_curve *curve)
{
    double least = INFINITY;
    for (size_t k = 0; k < curve->n; k++)
        least = fmin(least, curve->point[k].error);
    return least;
}

static enum ad_status measure(struct rollouts *r, const struct effort *effort,
                              struct ad_error *error)
{
    for (size_t t = 0; t < ROLLOUT_TYPES; t++)
        r->least[t] = INFINITY;
    for (size_t k = 0; phys_integrators[k] && r->n < ROLLOUT_METHODS; k++) {
        const struct phys_integrator *integrator = phys_integrators[k];
        if (integrator->separable || integrator->lagrangian ||
            integrator->scheme == &phys_power_series)
            continue;
        for (size_t t = 0; t < ROLLOUT_TYPES; t++) {
            hnn_model_evaluate_in(r->model, rollout_types[t]);
            if (refine(r, integrator, effort, &r->curve[t][r->n], error) != AD_OK)
                return error->status;
            r->least[t] = fmin(r->least[t], least_error(&r->curve[t][r->n]));
        }
        r->n++;
    }
    return AD_OK;
}

/* ---- output ---- */

static const struct column columns[] = {{.key = "method"},
                                        {.key = "precision"},
                                        {.key = "setting"},
                                        {.key = "evaluations", .digits = 15},
                                        {.key = "seconds", .digits = 4},
                                        {.key = "error"},
                                        {.key = NULL}};

/* The fastest methods at some errors, in either precision. */
static void print_fastest(const struct rollouts *r, FILE *out)
{
    static const double errors[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10};
    fprintf(out, "%-8s %-38s %s\n", "rollout", "field in f64", "in f32");
    for (size_t k = 0; k < sizeof errors / sizeof *errors; k++) {
        fprintf(out, "  %5.0e", errors[k]);
        for (size_t t = 0; t < ROLLOUT_TYPES; t++) {
            struct work_point at;
            size_t best = work_best(r->n, r->curve[t], errors[k], &at);
            if (best < r->n)
                fprintf(out, "  %-11s %6.0f fields %8.2g s ", r->curve[t][best].name,
                        at.evaluations, at.seconds);
            else
                fprintf(out, "  %-37s", "no method gets there");
        }
        fputc('\n', out);
    }
    fprintf(out,
            "errors at t = %g against the network's own exact motion, which is %.1e from the "
            "pendulum's;\nwith the field in f32 no method comes nearer than %.1e\n",
            r->time, r->model_error, r->least[1]);
}

static void report(struct chart *chart, const struct rollouts *r, struct sheet *sheet,
                   struct ad_error *error)
{
    struct json *json = &chart->json;
    json_object(json, "rollouts");
    json_number(json, "model_error", r->model_error);
    for (size_t t = 0; t < ROLLOUT_TYPES; t++) {
        json_object(json, hnn_precisions[rollout_types[t]]);
        for (size_t c = 0; c < r->n; c++) {
            const struct work_curve *curve = &r->curve[t][c];
            for (const struct work_point *p = curve->point; p < curve->point + curve->n; p++)
                sheet_row(sheet,
                          ROW(NAME(curve->name), NAME(hnn_precisions[rollout_types[t]]),
                              NUMBER(p->setting), NUMBER(p->evaluations), NUMBER(p->seconds),
                              NUMBER(p->error)),
                          error);
            json_number(json, curve->name, least_error(curve));
        }
        json_number(json, "least", r->least[t]);
        json_end_object(json);
    }
    json_end_object(json);
    if (!chart->quiet)
        print_fastest(r, stdout);
}

/* ---- the picture: error against evaluations, the precisions side by side ---- */

/* The methods that have no curve: the stages of implicit ones are not solved to the roundings of
   f64 by a field in f32. */
static void name_missing(const struct rollouts *r, size_t type, FILE *out)
{
    const char *between = "no solution of the stages:\\n";
    fputs("set label 2 \"", out);
    for (size_t c = 0; c < r->n; c++)
        if (r->curve[type][c].n == 0) {
            fprintf(out, "%s%s", between, r->curve[type][c].name);
            between = ", ";
        }
    fputs("\" at graph 0.02,0.1 left font ',10' textcolor rgb '#444444'\n", out);
}

static void draw_panel(struct figure *figure, const struct rollouts *r, size_t type)
{
    static const char *const titles[ROLLOUT_TYPES] = {"field in f64", "the same field in f32"};
    char y[64], labels[400];
    snprintf(y, sizeof y, "relative error at t = %g", r->time);
    snprintf(labels, sizeof labels,
             "set label 4 'error of the network' at graph 0.02, first %.3g left font ',10' "
             "textcolor rgb '#444444' front\n"
             "set label 3 'f32 ends: %.1e' at graph 0.02, first %.3g left font ',10' textcolor rgb "
             "'#d55e00' front\n",
             r->model_error * 1.9, r->least[1], r->least[1] * 1.9);
    figure_panel(figure, &(struct panel){.title = titles[type],
                                         .x = "evaluations of the field",
                                         .y = type ? NULL : y,
                                         .log = "xy",
                                         .x_range = "[30:2e4]",
                                         .y_range = "[1e-12:3]",
                                         .y_tics = "100",
                                         .key = type ? "at screen 0.81,0.85 left top Left reverse "
                                                       "samplen 2.5 spacing 1.3"
                                                     : NULL,
                                         .more = labels});
    name_missing(r, type, figure->plot->script);
    for (size_t c = 0; c < r->n; c++)
        work_curve_element(figure, &r->curve[type][c], "3:1", 2, 0.6);
    work_legend(figure, r->n, r->curve[0]);
    figure_element(figure, "%.6g with lines lw 1.5 dt (3,3) lc rgb '#444444' notitle",
                   r->model_error);
    figure_element(figure, "%.6g with lines lw 1.5 dt (1,3) lc rgb '#d55e00' notitle", r->least[1]);
}

static void draw(const struct rollouts *r, struct plot *plot)
{
    static const struct layout layout = {.width = 1040,
                                         .height = 480,
                                         .columns = 2,
                                         .room = {0.08, 0.8, 0.12, 0.85},
                                         .title = "A network followed by several methods",
                                         .gap = {0.05, 0}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t t = 0; t < ROLLOUT_TYPES; t++)
        draw_panel(&figure, r, t);
    figure_end(&figure);
}

/* ---- all ---- */

enum ad_status chart_rollouts(struct chart *chart, hnn_model *model, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "hnn-rollouts", columns, error);
    struct plot *plot = chart_picture(chart, "hnn-rollouts", error);
    struct rollouts *r = calloc(1, sizeof *r);
    if (!r)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    r->model = model;
    r->time = time_end;
    hnn_model_evaluate_in(model, AD_F64);
    if (error->status == AD_OK && hnn_model_ode(model, &r->ode, error) == AD_OK &&
        find_end(r, error) == AD_OK &&
        measure(r, chart->quick ? &quick : &thorough, error) == AD_OK) {
        fprintf(sheet->csv, "# the network errs by %.6g\n", r->model_error);
        report(chart, r, sheet, error);
        draw(r, plot);
    }
    phys_ode_free(&r->ode);
    free(r);
    return error->status;
}
