/* How exactly integrators follow a network, over evaluations of its field (chart_hnn.h). The
   weights are the same in f64 and in f32; what differs is the arithmetic of the field. */
#include "chart_hnn.h"
#include "work.h"
#include "../hnn/data.h"

#include <math.h>
#include <stdlib.h>

enum { FEWEST_STEPS = 16, MOST_METHODS = 16, TYPES = 2 };

/* Evaluations: no finer setting after so many, and no more steps in one run. */
static const double limit = 12000, limit_quick = 1500;
static const double time_end = 20;
static const double start[2] = {1.5, 0}; /* a swing in the middle of the data's energies */
static const double reference_tolerance = 1e-12;
static const double trusted = 1e-11; /* ten times what the reference may err by */
static const double finest = 1e-14;  /* setting of any method */
static const enum ad_type types[TYPES] = {AD_F64, AD_F32};

struct rollouts {
    hnn_model *model;
    struct phys_ode ode;
    double end[2];      /* where the reference is */
    double model_error; /* its distance from the true motion: finer than this is of no use */
    size_t n;
    struct work_curve curve[TYPES][MOST_METHODS];
};

/* Where a motion is at the end. More evaluations than `most`: AD_E_ACCURACY, as in f32, where a
   tolerance under the roundings makes steps ever shorter. */
static enum ad_status follow(const struct phys_ode *ode, const struct phys_integrator *integrator,
                             double setting, double most, double end[2],
                             struct phys_simulation_info *info, struct ad_error *error)
{
    double scale[2];
    const struct phys_simulation simulation = {.integrator = integrator,
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
    if (follow(&r->ode, dop853, reference_tolerance, limit, r->end, &info, error) == AD_OK &&
        hnn_task_ode(task, task->published.strength, &truth, error) == AD_OK &&
        follow(&truth, dop853, reference_tolerance, limit, end, &info, error) == AD_OK)
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
                             double most, struct work_curve *curve, struct ad_error *error)
{
    double setting = coarsest(integrator), evaluations = 0, distant = INFINITY;
    *curve =
        (struct work_curve){.name = integrator->name, .knob = integrator->adaptive ? "tol" : "dt"};
    for (; evaluations < most && distant > trusted && setting > finest && curve->n < WORK_POINTS;
         setting /= integrator->adaptive ? sqrt(10) : sqrt(2)) {
        struct phys_simulation_info info = {0};
        struct ad_error lost = {0};
        double end[2];
        enum ad_status status = follow(&r->ode, integrator, setting, most, end, &info, &lost);
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

static enum ad_status measure(struct rollouts *r, double most, struct ad_error *error)
{
    for (size_t k = 0; phys_integrators[k] && r->n < MOST_METHODS; k++) {
        const struct phys_integrator *integrator = phys_integrators[k];
        if (integrator->separable || integrator->lagrangian)
            continue;
        for (size_t t = 0; t < TYPES; t++) {
            hnn_model_evaluate_in(r->model, types[t]);
            if (refine(r, integrator, most, &r->curve[t][r->n], error) != AD_OK)
                return error->status;
        }
        r->n++;
    }
    return AD_OK;
}

/* ---- what is told ---- */

static double least_error(const struct work_curve *curve)
{
    double least = INFINITY;
    for (size_t k = 0; k < curve->n; k++)
        least = fmin(least, curve->point[k].error);
    return least;
}

/* The fastest in either precision. */
static void print_table(const struct rollouts *r)
{
    static const double errors[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10};
    printf("%-8s %-38s %s\n", "rollout", "field in f64", "in f32");
    for (size_t k = 0; k < sizeof errors / sizeof *errors; k++) {
        printf("  %5.0e", errors[k]);
        for (size_t t = 0; t < TYPES; t++) {
            struct work_point at;
            size_t best = work_best(r->n, r->curve[t], errors[k], &at);
            if (best < r->n)
                printf("  %-11s %6.0f fields %8.2g s ", r->curve[t][best].name, at.evaluations,
                       at.seconds);
            else
                printf("  %-37s", "no method gets there");
        }
        putchar('\n');
    }
    printf("errors at t = %g against the network's own exact motion, which is %.1e from the "
           "pendulum's\n",
           time_end, r->model_error);
}

static void report(const struct chart_settings *settings, const struct rollouts *r, FILE *csv,
                   struct json *json)
{
    json_object(json, "rollouts");
    json_number(json, "model_error", r->model_error);
    for (size_t t = 0; t < TYPES; t++) {
        json_object(json, hnn_precisions[types[t]]);
        for (size_t c = 0; c < r->n; c++) {
            const struct work_curve *curve = &r->curve[t][c];
            for (size_t k = 0; k < curve->n; k++)
                fprintf(csv, "%s,%s,%.6g,%.0f,%.4g,%.6g\n", curve->name, hnn_precisions[types[t]],
                        curve->point[k].setting, curve->point[k].evaluations,
                        curve->point[k].seconds, curve->point[k].error);
            json_number(json, curve->name, least_error(curve));
        }
        json_end_object(json);
    }
    json_end_object(json);
    if (settings->quiet)
        return;
    print_table(r);
}

/* ---- the picture ---- */

static void draw_panel(const struct rollouts *r, size_t type, FILE *out)
{
    fputs("plot ", out);
    for (size_t c = 0; c < r->n; c++) {
        struct work_style s = work_style_of(r->curve[type][c].name);
        fprintf(out,
                "data index %zu using 3:1 with linespoints lw 2 dt %s pt %d ps 0.6 lc rgb '%s' "
                "title '%s', \\\n    ",
                type * r->n + c, s.dashed ? "(8,3)" : "1", s.mark, s.colour, s.name);
    }
    fprintf(out, "%.6g with lines lw 1.5 dt (3,3) lc rgb '#444444' notitle\n", r->model_error);
}

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

static void draw(const struct rollouts *r, struct plot *plot)
{
    static const char *const titles[TYPES] = {"field in f64", "the same field in f32"};
    FILE *out = plot->script;
    plot->width = 1040;
    plot->height = 480;
    for (size_t t = 0; t < TYPES; t++)
        for (size_t c = 0; c < r->n; c++)
            work_write_curve(&r->curve[t][c], plot->data);
    fprintf(out,
            "set multiplot layout 1,2 margins 0.08,0.8,0.12,0.92 spacing 0.05,0\n"
            "set logscale xy\nset format xy '10^{%%T}'\nset ytics 100\nset border 3\n"
            "set tics nomirror\nset grid lc rgb '#e6e6e6' lt 1\nset xrange [30:2e4]\n"
            "set yrange [1e-12:3]\nset xlabel 'evaluations of the field'\nunset key\n"
            "set ylabel 'error at t = %g, relative' offset 1\n"
            "set label 1 'the network itself errs by this' at graph 0.02, first %.3g "
            "left font ',10' textcolor rgb '#444444' front\n",
            time_end, r->model_error / 1.7);
    for (size_t t = 0; t < TYPES; t++) {
        if (t > 0)
            fputs("unset ylabel\nset key at screen 0.998,0.92 right top Left reverse samplen 2.5 "
                  "spacing 1.3\n",
                  out);
        fprintf(out, "set title '%s' offset 0,-0.5\n", titles[t]);
        name_missing(r, t, out);
        draw_panel(r, t, out);
    }
    fputs("unset multiplot\n", out);
}

enum ad_status chart_rollouts(const struct chart_settings *settings, hnn_model *model,
                              struct json *json, struct ad_error *error)
{
    struct result csv = {0};
    struct plot plot = {0};
    struct rollouts *r = calloc(1, sizeof *r);
    if (!r)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    r->model = model;
    hnn_model_evaluate_in(model, AD_F64);
    if (chart_csv(settings, "hnn-rollouts", &csv, error) == AD_OK &&
        chart_picture(settings, "hnn-rollouts", &plot, error) == AD_OK &&
        hnn_model_ode(model, &r->ode, error) == AD_OK && find_end(r, error) == AD_OK &&
        measure(r, settings->quick ? limit_quick : limit, error) == AD_OK) {
        fprintf(csv.out,
                "# the network errs by %.6g\nmethod,precision,setting,evaluations,"
                "seconds,error\n",
                r->model_error);
        report(settings, r, csv.out, json);
        draw(r, &plot);
        if (plot_commit(&plot, error) == AD_OK)
            result_commit(&csv, error);
    }
    plot_abandon(&plot);
    result_abandon(&csv);
    phys_ode_free(&r->ode);
    free(r);
    return error->status;
}
