/* leastaction simulate: the motion from a start. */
#include "autodiff/free.h"
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/set_fault.h"
#include "apps/output/outputs.h"
#include "apps/output/progress.h"
#include "simulate.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- options ---- */

static enum ad_status check(const struct simulate_options *options, struct ad_error *error)
{
    if (options->horizon >= PHYS_MOTION_LOST)
        return ad_fail(error, AD_E_ARGUMENT, "--horizon: expected less than %g, got %g",
                       PHYS_MOTION_LOST, options->horizon);
    bool fixed = !isnan(options->dt);
    const char *plot = options->common.plot, *dot = plot ? strrchr(plot, '.') : NULL;
    const bool still = dot && (!strcasecmp(dot, ".svg") || !strcasecmp(dot, ".png")),
               of_mode = options->mode != OPTION_NO_COUNT;
    const struct conflict conflicts[] = {
        {fixed && !isnan(options->tolerance),
         "--dt and --tol: expected one of them; leave the other out"},
        {fixed && !options->integrator,
         "--dt needs --integrator NAME, one with fixed steps such as rk4"},
        {options->common.ranks && !options->ensemble,
         "one motion is followed by one rank; expected --ensemble or --scan, which ranks share"},
        {options->hold && isnan(options->periodic) && !options->follow,
         "--hold needs --periodic T"},
        {options->choreography && isnan(options->periodic), "--choreography needs --periodic T"},
        {!isnan(options->periodic) && (options->data || options->ensemble),
         "--periodic: not with --data or --ensemble; leave one out"},
        {of_mode && !options->follow, "--mode needs --continue, the family that begins with it"},
        {of_mode && !isnan(options->periodic),
         "--mode and --periodic: expected one of them; leave the other out"},
        {options->follow && isnan(options->periodic) && !of_mode,
         "--continue needs --periodic T or --mode M, where the family begins"},
        {options->follow && (options->choreography || options->section || options->ensemble),
         "--continue: not with --choreography, --section or --ensemble"},
        {!isnan(options->cross) && !options->follow,
         "--cross needs --continue, the family that is crossed"},
        {options->follow && plot && !still,
         "--plot: a family is a still; expected a name ending in .svg or .png"},
        {options->section && plot && !still,
         "--plot: --section is a still; expected a name ending in .svg or .png"},
        {options->section_axes && !(options->section && options->common.plot),
         "--section-axes needs --section and --plot"},
        {options->by && !options->sensitivity, "--by needs --sensitivity"},
        {options->every != OPTION_NO_COUNT && options->samples != OPTION_NO_COUNT,
         "--every and --samples: expected one of them; leave the other out"},
    };
    if (options_conflicts(sizeof conflicts / sizeof *conflicts, conflicts, error) == AD_OK &&
        !options->data)
        options_refuse(&options->common, "from rough days",
                       "needs --data DIR, a folder of Horizons tables", error);
    return error->status;
}

static enum ad_status read_crossings(struct simulate_run *run, struct ad_error *error)
{
    const struct texts *texts = &run->options->events;
    const char *until = run->options->until, *section = run->options->section;
    size_t n = texts->n + (section != NULL) + (until != NULL), k = 0;
    run->section.number = section ? texts->n + 1 : 0;
    run->crossings = calloc(n + 1, sizeof *run->crossings);
    if (!run->crossings)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (; k < n; k++)
        if (phys_crossing_read(&run->system,
                               k < texts->n                   ? texts->text[k]
                               : k + 1 == run->section.number ? section
                                                              : until,
                               &run->crossings[k], error) != AD_OK)
            return error->status;
    if (until)
        run->crossings[n - 1].last = true;
    run->settings.n_crossings = n;
    run->settings.crossings = run->crossings;
    return simulate_section_axes(run, error);
}

/* --tol is the error of a step where the method given chooses them, else that of the motion. */
static enum ad_status choose_steps(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    struct phys_motion_settings *s = &run->settings;
    if (o->integrator && !(s->integrator = phys_integrator_find(o->integrator, error)))
        return error->status;
    bool of_a_step = s->integrator && s->integrator->adaptive;
    if (of_a_step && !isnan(o->dt))
        return ad_fail(error, AD_E_ARGUMENT, "--dt: %s chooses its steps; give --tol E",
                       s->integrator->name);
    s->dt = option_number_or(o->dt, 0);
    *(of_a_step ? &s->tolerance : &s->error) = option_number_or(o->tolerance, 0);
    return AD_OK;
}

static enum ad_status setup(const struct simulate_options *o, struct simulate_run *run,
                            struct ad_error *error)
{
    *run = (struct simulate_run){.options = o};
    if (check(o, error) != AD_OK ||
        hnn_system_open(o->common.argument[0], &run->system, error) != AD_OK ||
        phys_system_set_all(&run->system, o->common.set.n, o->common.set.setting, error) != AD_OK ||
        scene_inputs_read(&o->common, o->inputs, &run->system, &run->inputs, error) != AD_OK)
        return error->status;
    const struct phys_scene *scene = run->system.scene;
    run->settings = (struct phys_motion_settings){
        .size = sizeof(struct phys_motion_settings),
        .seed = o->common.seed,
        .time = option_number_or(o->time, (double)(scene->slices - 1) * scene->dt),
        .every = option_count_or(o->every, 0),
        .n_samples = option_count_or(o->samples, 0),
        .reverse = o->reverse,
        .no_reference = o->no_reference,
        .proceed = interrupt_proceed};
    if (read_crossings(run, error) == AD_OK && choose_steps(run, error) == AD_OK && o->data)
        simulate_ephemeris(run, error);
    return error->status;
}

static void release(struct simulate_run *run)
{
    phys_motion_solution_free(&run->motion);
    AD_FREE(run->exponents, run->cyclic, run->kept, run->reactions, run->observed,
            run->section.row);
    simulate_sensitivity_free(run);
    simulate_ephemeris_free(run);
    simulate_periodic_free(run);
    free(run->crossings);
    phys_system_close(&run->system);
    scene_inputs_free(&run->inputs);
}

/* ---- the run ---- */

struct watch {
    struct progress progress;
    double time;
};

static bool watch(void *context, double t)
{
    struct watch *w = context;
    if (progress_due(&w->progress))
        progress_line(&w->progress, t, w->time, "t = %.6g of %.6g", t, w->time);
    return !interrupted();
}

static enum ad_status measure_order(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    const double *last = m->x + 2 * (m->n - 1) * run->system.dof;
    run->has_order = strcmp(run->system.scene->name, "gas") == 0;
    if (run->has_order && phys_gas_order(&run->system, m->x, &run->order_start, error) == AD_OK)
        phys_gas_order(&run->system, last, &run->order_end, error);
    return error->status;
}

/* The spectrum of the motion from its start to its end. */
static enum ad_status find_exponents(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    const size_t k = m->info.stop == PHYS_SIMULATION_INTERRUPTED
                         ? 0
                         : option_count_or(run->options->lyapunov, 0);
    const struct phys_lyapunov_settings how = {.size = sizeof how,
                                               .t1 = m->info.t,
                                               .proceed = run->settings.proceed,
                                               .context = run->settings.context};
    struct ad_error cause = {0};
    double *values = k ? malloc(2 * k * sizeof *values) : NULL;
    if (k && !values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (k && phys_lyapunov_spectrum(&run->system, m->start, &how, k, values, values + k, &cause) !=
                 AD_OK)
        simulate_refuse("--lyapunov: ", &cause, error);
    run->exponents = values;
    run->change = values ? values + k : NULL;
    return error->status;
}

/* What stopped the motion, with the option that is to blame. */
static void refuse(const struct simulate_run *run, const struct ad_error *cause,
                   struct ad_error *error)
{
    char option[128] = "";
    const struct phys_setting *fault = cause->status == AD_E_ARGUMENT && !run->settings.q
                                           ? set_fault(&run->options->common)
                                           : NULL;
    if (fault)
        snprintf(option, sizeof option, "--set %.60s=%g: ", fault->name, fault->value);
    else if (cause->status != AD_E_ARGUMENT && run->motion.n_trials && !run->motion.n)
        snprintf(option, sizeof option, "--tol: ");
    simulate_refuse(option, cause, error);
}

static enum ad_status follow(void *context, struct ad_error *error)
{
    struct simulate_run *run = context;
    const struct common *common = &run->options->common;
    struct watch w = {.time = run->settings.time};
    struct ad_error cause = {0};
    progress_start(&w.progress, common->quiet, common->log);
    interrupt_catch();
    if (simulate_periodic(run, error) != AD_OK) {
        progress_end(&w.progress);
        return error->status;
    }
    w.time = run->settings.time;
    run->settings.progress = watch;
    run->settings.context = &w;
    phys_motion_solve(&run->system, &run->settings, &run->motion, &cause);
    progress_end(&w.progress);
    if (cause.status != AD_OK && simulate_family_judge(run, error) == AD_OK)
        refuse(run, &cause, error);
    if (error->status == AD_OK && run->tables.n && !run->options->no_reference)
        simulate_ephemeris_compare(run, error);
    if (error->status == AD_OK)
        measure_order(run, error);
    phys_motion_diagnose(&run->settings, &run->motion, option_number_or(run->options->horizon, 0),
                         &run->diagnosis, error);
    if (error->status == AD_OK)
        simulate_measure(run, error);
    if (error->status == AD_OK)
        find_exponents(run, error);
    if (error->status == AD_OK)
        simulate_sensitivity(run, error);
    if (error->status == AD_OK)
        simulate_section(run, NULL, error);
    for (size_t k = 0; k < run->diagnosis.n_warnings && !common->quiet; k++)
        fprintf(stderr, "leastaction simulate: warning: %s\n", run->diagnosis.warning[k]);
    return error->status;
}

static const struct output_kind outputs = {simulate_report, simulate_file, simulate_write_csv,
                                           simulate_picture, NULL};

/* AD_E_ACCURACY names what was asked for and missed. */
static enum ad_status judge(const struct simulate_run *run, struct ad_error *error)
{
    const struct phys_simulation_info *info = &run->motion.info;
    if (info->stop == PHYS_SIMULATION_INTERRUPTED)
        return ad_fail(error, AD_E_ACCURACY, "interrupted at t = %g; results are partial", info->t);
    size_t last = run->settings.n_crossings - 1;
    if (run->options->until && run->motion.crossed.constant[last])
        return ad_fail(error, AD_E_ACCURACY,
                       "--until %s: never, that is constant but for rounding in this motion",
                       run->options->until);
    if (run->options->until && info->stop == PHYS_SIMULATION_END)
        return ad_fail(error, AD_E_ACCURACY, "--until %s: not before t = %g; try a longer --time",
                       run->options->until, info->t);
    struct ad_error missed = {0};
    if (simulate_family_judge(run, error) == AD_OK && simulate_section_judge(run, error) == AD_OK &&
        simulate_ephemeris_judge(run, error) == AD_OK &&
        phys_motion_met(&run->settings, &run->motion, &missed) != AD_OK)
        simulate_refuse("--tol: ", &missed, error);
    return error->status;
}

static int run(const void *options, struct ad_error *error)
{
    struct simulate_run run;
    if (setup(options, &run, error) == AD_OK && run.options->ensemble)
        simulate_ensemble(&run, error);
    else if (error->status == AD_OK &&
             outputs_run(&outputs, &run.options->common, &run, follow, error) == AD_OK)
        judge(&run, error);
    release(&run);
    return command_status(error);
}

#define AT(member) offsetof(struct simulate_options, member)

static const struct option table[] = {
    {"integrator", "NAME", OPTION_TEXT, NULL, "see below [dop853; with --tol: taylor]",
     AT(integrator)},
    {"dt", "DT", OPTION_POSITIVE, NULL, "length of fixed steps [the scene's]", AT(dt)},
    {"tol", "E", OPTION_POSITIVE, NULL, "error, see below [1e-9]", AT(tolerance)},
    {"time", "T", OPTION_POSITIVE, NULL, "when to stop [the scene's span]", AT(time)},
    {"event", "QUANTITY=VALUE", OPTION_TEXTS, NULL, "when it crosses it, see below; repeatable",
     AT(events)},
    {"until", "QUANTITY=VALUE", OPTION_TEXT, NULL, "the same, and the run ends there", AT(until)},
    {"inputs", "TABLE", OPTION_INPUT, NULL,
     "of a model with inputs: those that --set does not give, over the column t", AT(inputs)},
    {"section", "QUANTITY=VALUE", OPTION_TEXT, NULL,
     "the states where it crosses it: what --csv, --out and --plot have", AT(section)},
    {"section-axes", "A,B", OPTION_TEXT, NULL,
     "of --section --plot: two of coordinates, velocities and t [what spreads most]",
     AT(section_axes)},
    {"ensemble", "FILE.csv", OPTION_INPUT, NULL, "many motions, a row each, see below",
     AT(ensemble)},
    {"every", "K", OPTION_SOME, NULL, "steps from sample to sample", AT(every)},
    {"samples", "N", OPTION_SOME, NULL, "equal intervals of time between samples [1000]",
     AT(samples)},
    {"data", "DIR", OPTION_INPUT, NULL, "ephemeris: start and reference from Horizons tables",
     AT(data)},
    {"from", "DATE|INDEX", OPTION_TEXT, NULL, "of the tables: first epoch [the published one]",
     AT(from)},
    {"days", "N", OPTION_SOME, NULL, "of the tables: how many [65]", AT(days)},
    {"rough", "BODIES", OPTION_TEXT, NULL, "further bodies, without a table: jupiter,saturn,moon",
     AT(rough)},
    {"reverse", NULL, OPTION_FLAG, NULL, "also run back: how far from the start does it end?",
     AT(reverse)},
    {"horizon", "E", OPTION_POSITIVE, NULL,
     "time until a difference E of the start, in units of its size, has grown to 0.1", AT(horizon)},
    {"periodic", "T", OPTION_POSITIVE, NULL,
     "first find the periodic motion near the start, of period near T, and its multipliers",
     AT(periodic)},
    {"hold", "WHAT", OPTION_TEXT, NULL,
     "of --periodic: period or energy stays as given; of a drive's family, period*NAME", AT(hold)},
    {"choreography", NULL, OPTION_FLAG, NULL,
     "of --periodic: bodies that are alike follow each other on one curve", AT(choreography)},
    {"continue", "NAME=[A:]B", OPTION_TEXT, NULL,
     "follow its family until energy, period or a parameter is B, see below", AT(follow)},
    {"cross", "K", OPTION_NUMBER, NULL,
     "of --continue: at its K-th branch point or doubling, go on along the family that crosses; "
     "-K: to its "
     "other side",
     AT(cross)},
    {"mode", "M", OPTION_SOME, NULL,
     "begin the family with mode M (of `modes`) of the equilibrium near the start", AT(mode)},
    {"sensitivity", NULL, OPTION_FLAG, NULL,
     "derivatives of the end by the start, and by parameters", AT(sensitivity)},
    {"by", "NAME,NAME", OPTION_TEXT, NULL,
     "of --sensitivity: parameters [all that L has by PHYS_PARAM, or not]", AT(by)},
    {"lyapunov", "K", OPTION_SOME, NULL, "the K largest Lyapunov exponents of this motion",
     AT(lyapunov)},
    {"no-reference", NULL, OPTION_FLAG, NULL, "no reference run, and no error", AT(no_reference)},
};

static const char more[] =
    "Fixed steps: euler semi-implicit verlet velocity-verlet yoshida4 yoshida6 rk4\n"
    "implicit-midpoint rattle (symplectic with constraints, too) gauss2 ... gauss5,\n"
    "wisdom-holman and wisdom-holman-corrected (one kick a step, few samples) for planets,\n"
    "and the discrete motion of the action rules, variational-RULE for left midpoint\n"
    "trapezoid gauss2 gauss3 gauss4. These choose their steps: dopri5 dop853 taylor, the\n"
    "series of the motion, for L without kinks; with them --tol is the error of a step,\n"
    "relative to the coordinates. Without --integrator, or with fixed steps, --tol is the\n"
    "error of the whole motion in units of the coordinates: taylor, or dop853 where L has\n"
    "kinks or many bodies, and gauss5 where rounding stops them; or the method named is\n"
    "refined until its estimate is under it; the exit status is 1 if the reported error is\n"
    "not. That is the largest distance of the coordinates from a reference, run by\n"
    "extrapolation at a tolerance of 1e-15, there twice and back, plus its own uncertainty.\n"
    "Where a chaotic motion outruns the reference none is given.\n\n"
    "An event is a QUANTITY that crosses a value: a coordinate, v_ and a coordinate, energy,\n"
    "an observable of the scene, distance:A of body A from the origin, distance:A,B of two\n"
    "bodies. 'theta=0' finds every crossing, 'theta>0' those where it rises, 'theta<0' where\n"
    "it falls. --section has a row for each, with the error there: neither the start nor a\n"
    "touch is one. Points are known until that error exceeds --tol, or a thousandth of the\n"
    "largest coordinate.\n\n"
    "The columns of --ensemble are named by coordinates, v_ and a coordinate, and parameters;\n"
    "what has none is the scene's. All members go by taylor (dop853 where it has no series),\n"
    "several at once, to 100 times (--samples). The error of each is estimated by another run\n"
    "at a hundredth of the tolerance, two of them are compared with a reference. --csv has a\n"
    "row for each member and time, --out statistics at all times. Where members fail, the\n"
    "others go on, and the exit status is 1.\n\n"
    "--continue follows the family of --periodic, or of --mode, around folds: a row of --csv\n"
    "for each motion; folds, branch points, period doublings and bifurcations to tori are\n"
    "located and marked. A parameter's family holds the energy or the period (--hold) where\n"
    "energy is conserved. The last motion is the one that is reported. The exit status is 1\n"
    "where B is not reached.\n\n"
    "With --data the error is the largest distance of a planet from its table, seen from the\n"
    "Sun; the share of the integration is the distance from the same model followed by\n"
    "another method, gauss5 or dop853. --tol is in km then. By itself it asks for a model:\n"
    "they are tried from the published one on, and the least that stays as near is run. With\n"
    "--set or --rough the model is given, and --tol is what it must keep. With --integrator\n"
    "it is the error of integration, or, of dopri5 and dop853, that of a step as ever\n"
    "[1e-14].";

const struct command command_simulate = {
    .line = {.name = "simulate",
             .ranks = true,
             .what = "the motion from a start",
             .arguments = {"SCENE"},
             .scene = true,
             .outputs = true,
             .options = table,
             .n_options = sizeof table / sizeof *table,
             .more = more},
    .bytes = sizeof(struct simulate_options),
    .run = run,
};
