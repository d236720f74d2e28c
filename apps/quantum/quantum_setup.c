/* Sets up a wave packet's run from the options (quantum.h). */
#include "quantum.h"
#include "apps/interrupt.h"
#include "apps/option_values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Scenes under their usual names in quantum mechanics, with settings at which each is accurate. */
static const struct preset {
    const char *name, *scene;
    struct phys_setting set[2];
    double low, high;
    size_t points, steps;
    double dt;
    enum qm_walls walls;
    struct qm_gaussian packet;
} presets[] = {
    {"free", "freebody", {{"g", 0}}, -10, 10, 256, 4, 0.5, QM_OPEN, {-2, 0.7, 2}},
    {"gravity", "freebody", {{"g", 1}}, -12, 14, 1300, 12, 0.25, QM_OPEN, {0, 0.7, 2}},
    {"harmonic", "spring", {{0}}, -6, 6, 512, 64, M_PI / 32, QM_OPEN, {1.5, M_SQRT1_2, 0}},
    {"pendulum", "pendulum", {{"l", 1}}, -M_PI, M_PI, 256, 200, 0.1, QM_RING, {1, 0.4, 0}},
    {"double-well", "double-well", {{0}}, -4, 4, 600, 300, 0.04, QM_REFLECT, {-1.5, 0.4, 0}},
};

/* Any other scene. */
static const struct preset other = {NULL, NULL, {{0}},       -10,     10,
                                    256,  20,   (double)NAN, QM_OPEN, {0, 0.5, 0}};

static const struct preset *preset_of(const char *name)
{
    for (size_t k = 0; k < sizeof presets / sizeof *presets; k++)
        if (strcmp(presets[k].name, name) == 0)
            return &presets[k];
    return &other;
}

/* ---- the scene ---- */

/* Other subcommands name scenes otherwise: suggests the names of this one first. */
static enum ad_status mention_presets(const char *name, struct ad_error *error)
{
    enum { N = sizeof presets / sizeof *presets };
    const char *names[N + 1];
    for (size_t k = 0; k < N; k++)
        names[k] = presets[k].name;
    names[N] = "double-slit";
    const char *nearest = phys_nearest(name, N + 1, names);
    if (nearest && error->status == AD_E_ARGUMENT) {
        *error = (struct ad_error){0};
        ad_fail(error, AD_E_ARGUMENT, "no scene '%s'; did you mean '%s'?", name, nearest);
    }
    return error->status;
}

static enum ad_status open_scene(const struct preset *preset, struct quantum_run *run,
                                 struct ad_error *error)
{
    const struct quantum_options *options = run->options;
    const char *name = preset->scene ? preset->scene : run->name;
    if (hnn_system_open(name, &run->system, error) != AD_OK)
        return mention_presets(name, error);
    for (size_t k = 0; k < 2 && preset->set[k].name; k++)
        phys_system_set(&run->system, preset->set[k].name, preset->set[k].value, error);
    return phys_system_set_all(&run->system, options->common.set.n, options->common.set.setting,
                               error);
}

static enum ad_status read_packets(const struct preset *preset, struct quantum_run *run,
                                   struct ad_error *error)
{
    const struct texts *given = &run->options->packets;
    run->settings.packets = given->n ? given->n : 1;
    struct qm_gaussian *packet = calloc(run->settings.packets, sizeof *packet);
    run->settings.packet = packet;
    if (!packet)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    packet[0] = preset->packet;
    for (size_t k = 0; k < given->n; k++) {
        double x[3];
        if (numbers_read("packet", given->text[k], 3, "position, width and momentum", x, error) !=
            AD_OK)
            return error->status;
        if (!(x[1] > 0))
            return ad_fail(error, AD_E_ARGUMENT,
                           "--packet %s: expected a width above 0, the second number",
                           given->text[k]);
        packet[k] = (struct qm_gaussian){x[0], x[1], x[2]};
    }
    return AD_OK;
}

/* ---- the slice ---- */

static enum ad_status read_walls(const char *text, enum qm_walls *walls, struct ad_error *error)
{
    static const char *const names[] = {
        [QM_OPEN] = "open", [QM_REFLECT] = "reflect", [QM_RING] = "ring"};
    if (text)
        *walls = (enum qm_walls)options_choose("walls", text, sizeof names / sizeof *names, names,
                                               error);
    return error->status;
}

static enum ad_status make_slice(const struct preset *preset, struct quantum_run *run,
                                 struct ad_error *error)
{
    const struct quantum_options *options = run->options;
    double box[2] = {preset->low, preset->high};
    struct qm_slice *slice = &run->slice;
    if (options->box &&
        numbers_read("box", options->box, 2, "positions of the walls", box, error) != AD_OK)
        return error->status;
    *slice = (struct qm_slice){
        .size = sizeof(struct qm_slice),
        .system = &run->system,
        .grid = {box[0], box[1], option_count_or(options->points, preset->points)},
        .walls = preset->walls,
        .absorb = option_number_or(options->absorb, 0),
        .dt = option_number_or(options->dt, preset->dt),
        .hbar = options->hbar,
        .threads = options->common.threads,
    };
    run->settings.steps = option_count_or(options->steps, preset->steps);
    run->settings.every = option_count_or(options->every, run->settings.steps / 200 + 1);
    run->settings.leap = options->power != OPTION_NO_COUNT;
    run->settings.power = options->power;
    run->settings.normalise = options->normalise;
    run->settings.reference = !options->no_reference;
    if (run->settings.leap && options->power > 60)
        return ad_fail(error, AD_E_ARGUMENT, "--power: expected at most 60, got %zu",
                       options->power);
    slice->rule = phys_rule_find(options->rule, error);
    run->settings.method = qm_method_find(options->method, error);
    return error->status == AD_OK ? read_walls(options->walls, &slice->walls, error)
                                  : error->status;
}

/* ---- before a run ---- */

/* A scene without a box of its own needs one, and packets need to be in it. */
static enum ad_status check_box(const struct preset *preset, const struct quantum_run *run,
                                struct ad_error *error)
{
    const struct qm_slice *slice = &run->slice;
    const struct qm_grid *box = &slice->grid;
    if (!preset->name && !run->options->box && run->system.dof == 1 &&
        phys_keeps_energy(&run->system, error)) {
        double low, high;
        qm_box(&run->system, run->slice.hbar, run->settings.packet, &low, &high);
        return ad_fail(error, AD_E_ARGUMENT,
                       "--box: %s has none of its own; expected A,B, positions of the walls; try "
                       "--box=%.3g,%.3g",
                       run->name, low, high);
    }
    for (size_t k = 0; k < run->settings.packets; k++) {
        const struct qm_gaussian *p = &run->settings.packet[k];
        double inside = qm_inside(slice, p);
        if (!(box->high > box->low) || inside >= 0.99)
            continue;
        if (slice->walls == QM_RING && slice->absorb == 0)
            return ad_fail(
                error, AD_E_ARGUMENT,
                "--packet %g,%g,%g: %.3g %% of it is within half a turn of the ring from "
                "%g to %g; expected 99 %% or more; try a width of %.3g",
                p->x, p->sigma, p->p, 100 * inside, box->low, box->high,
                0.19 * (box->high - box->low));
        return ad_fail(error, AD_E_ARGUMENT,
                       "--packet %g,%g,%g: %.3g %% of it is in the box from %g to %g; expected "
                       "99 %% or more; try --box=%.4g,%.4g",
                       p->x, p->sigma, p->p, 100 * inside, box->low, box->high,
                       fmin(box->low, p->x - 6 * p->sigma), fmax(box->high, p->x + 6 * p->sigma));
    }
    return error->status;
}

static enum ad_status look_for_aliasing(struct quantum_run *run, struct ad_error *error)
{
    struct qm_slice *slice = &run->slice;
    bool choose = isnan(slice->dt);
    if (choose)
        slice->dt = 0.1;
    if (qm_aliasing(slice, &run->aliasing, error) != AD_OK)
        return error->status;
    const struct qm_aliasing *a = &run->aliasing;
    if (choose && a->ratio > 1 && !isnan(a->dt_least)) {
        slice->dt = qm_aliasing_advice(slice, a).dt;
        return qm_aliasing(slice, &run->aliasing, error);
    }
    if (!run->settings.method->aliases(slice) || a->ratio <= 1 + 1e-9)
        return AD_OK;
    char text[sizeof error->message], longer[48] = "";
    struct qm_advice such = qm_aliasing_advice(slice, a);
    if (!isnan(such.dt))
        snprintf(longer, sizeof longer, "--dt %.4g or more, ", such.dt);
    snprintf(text, sizeof text,
             "phases of neighbouring paths differ by up to %.3g (limit: 3.14), and a ghost is %.3g "
             "away; expected %s--points %.0f or more, or a box of %.4g",
             M_PI * a->ratio, a->ghost, longer, such.points, such.box);
    if (!run->options->force)
        return ad_fail(error, AD_E_ARGUMENT, "%s (--force runs it anyway)", text);
    fprintf(stderr, "leastaction quantum: warning: %s\n", text);
    return AD_OK;
}

/* Operations per second, a low estimate, so that only hopeless runs are refused. */
static const double speed = 1e9;
static const double patience = 3600;

static enum ad_status look_for_cost(const struct quantum_run *run, struct ad_error *error)
{
    struct qm_cost cost;
    double n = (double)run->slice.grid.n,
           samples = (double)(run->settings.steps / run->settings.every + 2);
    run->settings.method->cost(&run->slice, &cost);
    if (run->options->power != OPTION_NO_COUNT)
        cost.setup += 8 * n * n * n * (double)run->options->power, cost.bytes *= 2;
    double bytes = cost.bytes + 8 * n * samples;
    double seconds =
        (cost.setup + cost.step * (double)(run->settings.steps * run->settings.packets)) / speed;
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    if (pages > 0 && bytes > 0.9 * (double)pages * (double)page)
        return ad_fail(error, AD_E_ARGUMENT,
                       "this needs %.3g GB, the machine has %.3g; expected fewer --points, or "
                       "--method fft or crank-nicolson",
                       bytes / 1e9, (double)pages * (double)page / 1e9);
    if (seconds > patience && !run->options->force)
        return ad_fail(error, AD_E_ARGUMENT,
                       "this takes about %.0f hours; expected fewer --points or --steps (--force "
                       "runs it anyway)",
                       ceil(seconds / 3600));
    return AD_OK;
}

enum ad_status quantum_setup(const struct quantum_options *options, struct quantum_run *run,
                             struct ad_error *error)
{
    *run = (struct quantum_run){.options = options,
                                .name = options->scene,
                                .settings = {.size = sizeof run->settings, .slice = &run->slice}};
    const struct preset *preset = preset_of(run->name);
    if (open_scene(preset, run, error) != AD_OK || make_slice(preset, run, error) != AD_OK ||
        read_packets(preset, run, error) != AD_OK || check_box(preset, run, error) != AD_OK ||
        look_for_cost(run, error) != AD_OK)
        return error->status;
    return look_for_aliasing(run, error);
}

void quantum_free(struct quantum_run *run)
{
    qm_run_free(&run->result);
    free((struct qm_gaussian *)run->settings.packet);
    phys_system_close(&run->system);
}

/* ---- the run ---- */

static bool after_slice(void *context, size_t slice)
{
    struct quantum_run *run = context;
    if (progress_due(&run->progress))
        progress_line(&run->progress, (double)slice, (double)run->settings.steps,
                      "slice %zu of %zu", slice, run->settings.steps);
    return !interrupted();
}

enum ad_status quantum_run(void *context, struct ad_error *error)
{
    struct quantum_run *run = context;
    run->settings.progress = after_slice;
    run->settings.context = run;
    progress_start(&run->progress, run->options->common.quiet, run->options->common.log);
    interrupt_catch();
    qm_run(&run->settings, &run->result, error);
    progress_end(&run->progress);
    return error->status;
}
