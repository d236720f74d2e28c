/* Rules of the action by their order (chart_paths.h): the path between two points of a motion,
   found by Newton's method, against the motion; and what the published descent reaches there. */
#include "chart_paths.h"
#include "../physics/integrate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 9, FEWEST = 11, MOST_RULES = 16, SUBSTEPS = 800, ROUNDS = 3 };

/* Between the ends of a motion that starts where the scene does. */
static const struct boundary {
    const char *scene, *title;
    double time;
    bool published; /* at 0: slices, steps and rate of the paper */
} boundaries[] = {
    {"pendulum", "Pendulum, a whole swing (index 1)", 99, true},
    {"dblpend", "Double pendulum, to t = 11.94 (index 6)", 11.94, true},
    {"kepler", "Half a Kepler orbit, e = 0.6", M_PI, false},
};

enum { N_BOUNDARIES = sizeof boundaries / sizeof *boundaries };

struct rule_point {
    size_t slices;
    double seconds, error;
};

struct rule_curve {
    const struct phys_rule *rule;
    size_t n;
    struct rule_point point[LEVELS];
};

struct panel {
    const struct boundary *boundary;
    struct phys_system system;
    size_t n;
    struct rule_curve curve[MOST_RULES];
    struct rule_point adam; /* slices 0: none */
};

/* ---- the motion at the slices, by gauss5 ---- */

struct samples {
    size_t dof, slices, n;
    double *path;
};

static bool sample(void *context, double t, const double *y)
{
    struct samples *s = context;
    (void)t;
    for (size_t k = 0; k < s->dof && s->n < s->slices; k++)
        s->path[k * s->slices + s->n] = y[k];
    s->n++;
    return true;
}

/* path [dof x slices] */
static enum ad_status motion_at(const struct panel *panel, size_t slices, double *path,
                                struct ad_error *error)
{
    size_t dof = panel->system.dof, each = (SUBSTEPS + slices - 2) / (slices - 1);
    struct samples samples = {dof, slices, 0, path};
    struct phys_simulation s = {.integrator = phys_integrator_find("gauss5", error),
                                .t1 = panel->boundary->time,
                                .every = each,
                                .sample = sample,
                                .context = &samples};
    struct phys_simulation_info info;
    struct phys_ode ode = {0};
    double *q = malloc(4 * dof * sizeof *q), *y = q + 2 * dof;
    s.dt = s.t1 / (double)(each * (slices - 1));
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_canonical(&panel->system, &ode, error) == AD_OK &&
        panel->system.scene->start(panel->system.params, 0, q, q + dof, error) == AD_OK &&
        ode.enter(ode.context, 0, q, q + dof, y, error) == AD_OK)
        phys_simulate(&s, &ode, y, &info, error);
    phys_ode_free(&ode);
    free(q);
    return error->status;
}

/* ---- one path ---- */

/* Moves the slices between the ends by a smooth bump of a hundredth of the path's size. */
static void disturb(size_t dof, size_t slices, double *path)
{
    for (size_t k = 0; k < dof; k++) {
        double size = 0;
        for (size_t i = 0; i < slices; i++)
            size = fmax(size, fabs(path[k * slices + i]));
        for (size_t i = 0; i < slices; i++)
            path[k * slices + i] += 0.01 * size * sin(M_PI * (double)i / (double)(slices - 1));
    }
}

/* Solves from the disturbed motion; the median of a few times. */
static enum ad_status measure(const struct panel *panel, const char *solver,
                              const struct phys_path_settings *settings, const double *motion,
                              const double *start, size_t rounds, struct rule_point *point,
                              struct ad_error *error)
{
    size_t n = panel->system.dof * settings->slices, whole = n * settings->rule->degree;
    double *path = malloc(whole * sizeof *path), seconds[ROUNDS];
    struct phys_path_info info;
    if (!path)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t r = 0; r < rounds && error->status == AD_OK; r++) {
        memcpy(path, start, whole * sizeof *path);
        double before = path_seconds();
        phys_path_solve(phys_solver_find(solver, error), &panel->system, settings, path, &info,
                        error);
        double now = path_seconds() - before;
        size_t at = r;
        for (; at > 0 && seconds[at - 1] > now; at--)
            seconds[at] = seconds[at - 1];
        seconds[at] = now;
    }
    *point =
        (struct rule_point){settings->slices, seconds[rounds / 2], path_distance(n, path, motion)};
    free(path);
    return error->status;
}

static enum ad_status newton_point(const struct panel *panel, const struct phys_rule *rule,
                                   size_t slices, size_t rounds, struct rule_point *point,
                                   struct ad_error *error)
{
    size_t n = panel->system.dof * slices;
    double *motion = malloc((n + n * rule->degree) * sizeof *motion), *start = motion + n;
    struct phys_path_settings settings = {.rule = rule,
                                          .slices = slices,
                                          .steps = 50,
                                          .dt = panel->boundary->time / (double)(slices - 1),
                                          .learning_rate = 1e-2,
                                          .threads = 1};
    if (!motion)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (motion_at(panel, slices, motion, error) == AD_OK) {
        memcpy(start, motion, n * sizeof *start);
        disturb(panel->system.dof, slices, start);
        phys_rule_interpolate(rule, panel->system.dof, slices, start);
        measure(panel, "newton", &settings, motion, start, rounds, point, error);
    }
    free(motion);
    return error->status;
}

/* The published descent: its rule, steps, rate and noise. */
static enum ad_status adam_point(struct panel *panel, size_t rounds, struct ad_error *error)
{
    const struct phys_preset *paper = panel->system.scene->paper;
    size_t n = panel->system.dof * paper->slices;
    double *motion = malloc(2 * n * sizeof *motion), *start = motion + n;
    struct phys_path_settings settings = {.rule = phys_rule_find("left+repeat", error),
                                          .slices = paper->slices,
                                          .steps = paper->steps,
                                          .dt = paper->dt,
                                          .learning_rate = paper->learning_rate,
                                          .energy_weight = paper->energy_weight,
                                          .threads = 1};
    if (!motion)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (motion_at(panel, paper->slices, motion, error) == AD_OK) {
        memcpy(start, motion, n * sizeof *start);
        phys_noise_add(&paper->noise, &panel->system, paper->slices, 1, start);
        measure(panel, "adam", &settings, motion, start, rounds, &panel->adam, error);
    }
    free(motion);
    return error->status;
}

/* ---- a panel ---- */

static enum ad_status fill(struct panel *panel, const struct boundary *boundary, bool quick,
                           struct ad_error *error)
{
    static const double rounding = 1e-12;
    size_t levels = quick ? 5 : LEVELS, rounds = quick ? 1 : ROUNDS;
    panel->boundary = boundary;
    if (phys_system_open(boundary->scene, &panel->system, error) != AD_OK)
        return error->status;
    for (; phys_rules[panel->n] && panel->n < MOST_RULES; panel->n++) {
        struct rule_curve *curve = &panel->curve[panel->n];
        curve->rule = phys_rules[panel->n];
        for (size_t level = 0; level < levels; level++) {
            size_t slices = (FEWEST - 1) * ((size_t)1 << level) + 1;
            struct rule_point *point = &curve->point[curve->n++];
            if (newton_point(panel, curve->rule, slices, rounds, point, error) != AD_OK)
                return error->status;
            if (point->error < rounding)
                break;
        }
    }
    return boundary->published ? adam_point(panel, rounds, error) : AD_OK;
}

/* Slope of the last stretch above rounding; NaN if there is none. */
static double measured_order(const struct rule_curve *curve)
{
    double order = NAN;
    for (size_t k = 1; k < curve->n; k++) {
        const struct rule_point *a = &curve->point[k - 1], *b = &curve->point[k];
        if (b->error > 1e-11 && a->error < 0.3)
            order =
                log(a->error / b->error) / log((double)(b->slices - 1) / (double)(a->slices - 1));
    }
    return order;
}

static void write_rows(const struct panel *panel, FILE *csv)
{
    for (size_t c = 0; c < panel->n; c++)
        for (size_t k = 0; k < panel->curve[c].n; k++) {
            const struct rule_point *p = &panel->curve[c].point[k];
            fprintf(csv, "%s,newton,%s,%zu,%.6g,%.6g\n", panel->boundary->scene,
                    panel->curve[c].rule->name, p->slices, p->seconds, p->error);
        }
    if (panel->adam.slices)
        fprintf(csv, "%s,adam,left+repeat,%zu,%.6g,%.6g\n", panel->boundary->scene,
                panel->adam.slices, panel->adam.seconds, panel->adam.error);
}

static void print(const struct panel *panel)
{
    printf("%s: measured order", panel->boundary->title);
    for (size_t c = 0; c < panel->n; c++)
        printf("%s %s %.2f", c ? "," : "", panel->curve[c].rule->name,
               measured_order(&panel->curve[c]));
    puts("");
}

static void json_panel(const struct panel *panel, struct json *json)
{
    json_object(json, panel->boundary->scene);
    for (size_t c = 0; c < panel->n; c++)
        json_number(json, panel->curve[c].rule->name, measured_order(&panel->curve[c]));
    json_end_object(json);
}

/* ---- the picture: above errors over slices, below over seconds ---- */

static const char *const colours[] = {"#9a9a9a", "#6b6b6b", "#e8a33d", "#d1622b",
                                      "#8fc7e8", "#3c8dc5", "#0b4f8a", "#4d1654"};
enum { N_COLOURS = sizeof colours / sizeof *colours };

/* Blocks: a curve each, then Adam's point. */
static void write_data(const struct panel *panel, FILE *data)
{
    for (size_t c = 0; c < panel->n; c++) {
        fprintf(data, "# %s, %s: slices, seconds, error\n", panel->boundary->scene,
                panel->curve[c].rule->name);
        for (size_t k = 0; k < panel->curve[c].n; k++)
            fprintf(data, "%zu %.6g %.6g\n", panel->curve[c].point[k].slices,
                    panel->curve[c].point[k].seconds, panel->curve[c].point[k].error);
        fputs("\n\n", data);
    }
    if (panel->adam.slices)
        fprintf(data, "%zu %.6g %.6g\n\n\n", panel->adam.slices, panel->adam.seconds,
                panel->adam.error);
    else
        fputs("NaN NaN NaN\n\n\n", data);
}

static void draw_panel(const struct panel *panels, size_t p, int row, FILE *out)
{
    const struct panel *panel = &panels[p];
    size_t first = p * (panel->n + 1);
    double left = 0.06 + 0.255 * (double)p;
    fprintf(out,
            "set lmargin at screen %g\nset rmargin at screen %g\nset tmargin at screen %g\n"
            "set bmargin at screen %g\nset title '%s' font ',11' offset 0,-0.5\nset xlabel '%s' "
            "offset 0,0.6\nset ylabel '%s' offset 1\nset format x '%s'\n%s\n",
            left, left + 0.21, row ? 0.46 : 0.94, row ? 0.08 : 0.56,
            row ? "" : panel->boundary->title, row ? "seconds of the processor" : "slices",
            p ? "" : "error of the path", row ? "10^{%T}" : "%g",
            row ? "set xtics auto\nset xrange [*:*]"
                : "set xtics (11, 41, 161, 641, 2561)\nset xrange [10:3000]");
    bool titles = row == 0 && p == 0;
    fputs(titles ? "set key at screen 0.995, screen 0.93 right top Left reverse samplen 2 spacing "
                   "1.4 font ',11'\nplot "
                 : "set key off\nplot ",
          out);
    for (size_t c = 0; c < panel->n; c++)
        fprintf(out,
                "data index %zu using %d:3 with linespoints lw 1.8 pt 7 ps 0.5 lc rgb '%s' title "
                "'%s: order %.2f', \\\n    ",
                first + c, row ? 2 : 1, colours[c % N_COLOURS], panel->curve[c].rule->name,
                measured_order(&panels[N_BOUNDARIES - 1].curve[c]));
    fprintf(
        out,
        "data index %zu using %d:3 with points pt 3 ps 1.4 lw 2 lc rgb '#b8261b' title 'Adam as "
        "published'\n",
        first + panel->n, row ? 2 : 1);
}

static void draw(const struct panel *panels, struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 1120;
    plot->height = 640;
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        write_data(&panels[p], plot->data);
    fputs("set multiplot\nset logscale xy\nset yrange [1e-14:3]\nset format y '10^{%T}'\n"
          "set ytics 100\nset grid lc rgb '#e6e6e6' lt 1\nset border 3\nset tics nomirror\n",
          out);
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        for (int row = 0; row < 2; row++)
            draw_panel(panels, p, row, out);
    fputs("unset multiplot\n", out);
}

enum ad_status chart_rules(const struct chart_settings *settings, struct json *json,
                           struct ad_error *error)
{
    struct result csv = {0};
    struct plot plot = {0};
    struct panel *panels = calloc(N_BOUNDARIES, sizeof *panels);
    if (!panels)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (chart_csv(settings, "rules", &csv, error) == AD_OK &&
        chart_picture(settings, "rules", &plot, error) == AD_OK)
        fputs("scene,solver,rule,slices,seconds,error\n", csv.out);
    for (size_t p = 0; p < N_BOUNDARIES && error->status == AD_OK; p++)
        if (fill(&panels[p], &boundaries[p], settings->quick, error) == AD_OK) {
            write_rows(&panels[p], csv.out);
            json_panel(&panels[p], json);
            if (!settings->quiet)
                print(&panels[p]);
        }
    if (error->status == AD_OK) {
        draw(panels, &plot);
        if (plot_commit(&plot, error) == AD_OK)
            result_commit(&csv, error);
    }
    plot_abandon(&plot);
    result_abandon(&csv);
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        phys_system_close(&panels[p].system);
    free(panels);
    return error->status;
}
