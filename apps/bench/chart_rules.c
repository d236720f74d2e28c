/* Rules of the action by their order (chart_paths.h): the path between two points of a motion,
   found by Newton's method, against the motion; and what the published descent reaches there. */
#include "chart_rules.h"
#include "chart_paths.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEWEST = 11, SUBSTEPS = 800, ROUNDS = 3 };

static const struct boundary boundaries[N_BOUNDARIES] = {
    {"pendulum", "Pendulum, a whole swing (index 1)", 99, true},
    {"dblpend", "Double pendulum, to t = 11.94 (index 6)", 11.94, true},
    {"kepler", "Half a Kepler orbit, e = 0.6", M_PI, false},
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
    double *q = malloc(4 * dof * sizeof *q), *y = q ? q + 2 * dof : NULL;
    s.dt = s.t1 / (double)(each * (slices - 1));
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_canonical(&panel->system, &ode, error) == AD_OK &&
        panel->system.scene->start(panel->system.params, 0, q, q + dof, error) == AD_OK &&
        phys_ode_enter(&ode, 0, q, q + dof, y, error) == AD_OK)
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
        double before = processor_seconds();
        phys_path_solve(phys_solver_find(solver, error), &panel->system, settings, path, &info,
                        error);
        double now = processor_seconds() - before;
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
    double *motion = malloc((n + n * rule->degree) * sizeof *motion),
           *start = motion ? motion + n : NULL;
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
    double *motion = malloc(2 * n * sizeof *motion), *start = motion ? motion + n : NULL;
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
    size_t levels = quick ? 5 : RULE_LEVELS, rounds = quick ? 1 : ROUNDS;
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
               rule_order(&panel->curve[c]));
    puts("");
}

static void json_panel(const struct panel *panel, struct json *json)
{
    json_object(json, panel->boundary->scene);
    for (size_t c = 0; c < panel->n; c++)
        json_number(json, panel->curve[c].rule->name, rule_order(&panel->curve[c]));
    json_end_object(json);
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
    if (error->status == AD_OK)
        rules_draw(panels, &plot);
    chart_end(&plot, &csv, error);
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        phys_system_close(&panels[p].system);
    free(panels);
    return error->status;
}
