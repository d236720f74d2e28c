/* leastaction simulate: the motion from a start. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "simulate.h"

static enum ad_status write_results(const struct simulate_run *run,
                                    const struct simulate_result *result, struct outputs *outputs,
                                    struct ad_error *error)
{
    struct report report = {0};
    simulate_report(run, result, &report);
    if (outputs->file)
        simulate_file(run, result, &report, outputs->file, error);
    if (outputs->csv.out)
        simulate_write_csv(run, result, outputs->csv.out);
    if (outputs->plot.script && result->gas.on)
        simulate_gas_picture(run, result, &outputs->plot, error);
    else if (outputs->plot.script)
        simulate_picture(run, result, &outputs->plot);
    if (error->status == AD_OK)
        outputs_commit(outputs, error);
    else
        outputs_abandon(outputs);
    return report_show(&report, &run->options->common, error);
}

static enum ad_status choose(struct simulate_run *run, struct ad_error *error)
{
    bool undecided = !run->integrator || (!run->integrator->adaptive && isnan(run->dt));
    if (undecided && simulate_choose(run, error) != AD_OK)
        return error->status;
    return simulate_ode(run, run->integrator, &run->ode, error);
}

/* Runs; where --tol chose the method and the measured error is more, tighter again. */
static void run_as_asked(struct simulate_run *run, struct simulate_result *result,
                         struct ad_error *error)
{
    enum { TRIES = 3 };
    for (int k = 0; simulate_run(run, result, error) == AD_OK && k + 1 < TRIES; k++) {
        struct ad_error missed = {0};
        if (simulate_miss(run, result, &missed) == AD_OK || isnan(result->error) ||
            !simulate_tighten(run, result->error))
            return;
        simulate_result_free(result);
    }
}

static int run_simulation(struct simulate_run *run, struct ad_error *error)
{
    const struct common *common = &run->options->common;
    struct outputs outputs;
    struct simulate_result result = {0};
    if (outputs_begin(common, &outputs, error) != AD_OK)
        return command_status(error);
    interrupt_catch();
    if (choose(run, error) == AD_OK)
        run_as_asked(run, &result, error);
    simulate_outlook(run, &result, error);
    if (error->status != AD_OK)
        outputs_abandon(&outputs);
    else
        write_results(run, &result, &outputs, error);
    if (error->status == AD_OK && result.info.stop == PHYS_SIMULATION_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted at t = %g; results are those so far",
                result.info.t);
    if (error->status == AD_OK && run->options->until && result.info.stop == PHYS_SIMULATION_END)
        ad_fail(error, AD_E_ACCURACY, "--until %s: not before t = %g; try a longer --time",
                run->options->until, result.info.t);
    if (error->status == AD_OK)
        simulate_ephemeris_judge(run, &result, error);
    if (error->status == AD_OK)
        simulate_miss(run, &result, error);
    simulate_result_free(&result);
    return command_status(error);
}

static int run(const void *options, struct ad_error *error)
{
    struct simulate_run simulation;
    int status = WRONG_USE;
    if (simulate_setup(options, &simulation, error) == AD_OK)
        status = run_simulation(&simulation, error);
    else
        status = command_status(error);
    simulate_free(&simulation);
    return status;
}

#define AT(member) offsetof(struct simulate_options, member)

static const struct option table[] = {
    {"integrator", "NAME", OPTION_TEXT, NULL, "see below [dop853; with --tol: dop853 or gauss5]",
     AT(integrator)},
    {"dt", "DT", OPTION_NUMBER, NULL, "length of fixed steps [the scene's]", AT(dt)},
    {"tol", "E", OPTION_NUMBER, NULL, "error, see below [1e-9]", AT(tolerance)},
    {"time", "T", OPTION_NUMBER, NULL, "when to stop [the scene's span]", AT(time)},
    {"event", "QUANTITY=VALUE", OPTION_TEXTS, NULL, "when it crosses it, see below; repeatable",
     AT(events)},
    {"until", "QUANTITY=VALUE", OPTION_TEXT, NULL, "the same, and the run ends there", AT(until)},
    {"every", "K", OPTION_COUNT, NULL, "steps from sample to sample", AT(every)},
    {"samples", "N", OPTION_COUNT, NULL, "equal intervals of time between samples [1000]",
     AT(samples)},
    {"set", "NAME=VALUE", OPTION_SETTINGS, NULL, "a parameter of the scene; repeatable", AT(set)},
    {"data", "DIR", OPTION_INPUT, NULL, "ephemeris: start and reference from Horizons tables",
     AT(data)},
    {"from", "DATE|INDEX", OPTION_TEXT, NULL, "of the tables: first epoch [the published one]",
     AT(from)},
    {"days", "N", OPTION_COUNT, NULL, "of the tables: how many [65]", AT(days)},
    {"rough", "BODIES", OPTION_TEXT, NULL, "besides, without a table: jupiter,saturn,moon",
     AT(rough)},
    {"reverse", NULL, OPTION_FLAG, NULL, "run back, too: how far from the start does it end?",
     AT(reverse)},
    {"horizon", "E", OPTION_NUMBER, NULL,
     "how long does a difference E of the start, in units of its size, stay under 0.1?",
     AT(horizon)},
    {"no-reference", NULL, OPTION_FLAG, NULL, "leave out the reference run, and the error",
     AT(no_reference)},
};

const struct command command_simulate = {
    .line =
        {.name = "simulate",
         .what = "the motion from a start",
         .arguments = {"SCENE"},
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "Fixed steps: euler semi-implicit verlet velocity-verlet yoshida4 yoshida6 rk4 "
             "implicit-midpoint\n"
             "gauss2 ... gauss5, and the discrete motion of the action rules, variational-RULE "
             "for\n"
             "left midpoint trapezoid gauss2 gauss3 gauss4. These choose their steps: dopri5 "
             "dop853;\n"
             "with them --tol is the error of a step, relative to the coordinates. Without\n"
             "--integrator, or with fixed steps, --tol is the error of the whole motion in\n"
             "units of the coordinates: dop853, or gauss5 where rounding stops it, or the method\n"
             "named is refined until its estimate is under it; the exit status is 1 if the\n"
             "reported error is not. That is the largest distance of the coordinates from a\n"
             "reference, run by extrapolation at a tolerance of 1e-15, there twice and back, plus\n"
             "its own uncertainty. Where a chaotic motion outruns the reference none is given.\n"
             "An event is a QUANTITY that crosses a value: a coordinate, v_ and a coordinate, "
             "energy,\n"
             "distance:A of body A from the origin, distance:A,B of two bodies. 'theta=0' finds\n"
             "every crossing, 'theta>0' those where it rises, 'theta<0' where it falls.\n"
             "With --data the error is the largest distance of a planet from its table, seen from\n"
             "the Sun; the share of the integration is the distance from the same model followed\n"
             "by another method, gauss5 or dop853. --tol is in km then. By itself it asks for a\n"
             "model: they are tried from the published one on, and the least that stays as near\n"
             "is run. With --set or --rough the model is given, and --tol is what it must keep.\n"
             "With --integrator it is the error of integration, or, of dopri5 and dop853, that\n"
             "of a step as ever [1e-14]."},
    .bytes = sizeof(struct simulate_options),
    .run = run,
};
