/* leastaction path: the path of stationary action between two ends. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "path.h"
#include "physics/motion/time_scan.h"
#include "physics/path/ends.h"

#include <stdlib.h>
#include <string.h>

/* --tol, and the start of the output files. */
static enum ad_status begin(void *context, struct outputs *outputs, struct ad_error *error)
{
    struct path_run *run = context;
    if (path_wants_tolerance(run->options) &&
        (path_is_periodic(run->options) ? path_periodic_refine : path_refine)(run, error) != AD_OK)
        return error->status;
    path_record_begin(&run->record, run, outputs->file, outputs->plot.script != NULL);
    return outputs->file ? path_file_begin(run, outputs->file, error) : AD_OK;
}

static enum ad_status solve(void *context, struct ad_error *error)
{
    struct path_run *run = context;
    struct path_record *record = &run->record;
    struct phys_path_info first;
    run->settings.progress = path_record_step;
    run->settings.proceed = path_record_proceed;
    run->settings.context = record;
    run->settings.compare = path_is_periodic(run->options) ? NULL : run->reference;
    interrupt_catch();
    if (path_is_periodic(run->options)) {
        path_periodic_solve(run, &first, error);
    } else if (path_wants_all(run->options)) {
        path_find_all(run, error);
    } else if (run->ends.free_time) {
        phys_path_free_time(&run->system, &run->settings, run->ends.energy, run->path,
                            &run->found.info, error);
        run->settings.adam_steps = 0; /* the path is found */
    }
    if (error->status == AD_OK)
        phys_path_find(run->solver, &run->system, &run->settings, run->path, &run->found, error);
    if (error->status == AD_OK && path_is_periodic(run->options) && !interrupted())
        path_periodic_compare(run, &first, error);
    progress_end(&record->progress);
    if (record->failed)
        ad_fail(error, AD_E_MEMORY, "out of memory for the history of the run");
    path_diagnose_lost(run, error);
    return error->status;
}

static const struct output_kind outputs = {path_report, path_file, path_write_csv, path_picture,
                                           begin};

/* Newton's method converges or fails; a descent has a target only with --grad-tol. */
static bool converged(const struct path_run *run)
{
    enum phys_stop stop = run->found.info.stop;
    bool asked = run->settings.tolerance > 0 || strcmp(run->solver->name, "newton") == 0;
    return !asked || run->solver == &phys_solver_march || stop == PHYS_STOP_TOLERANCE ||
           stop == PHYS_STOP_ROUNDING;
}

/* The hint after a solver that did not converge. */
static const char *advice(const struct path_run *run)
{
    if (run->found.info.stop == PHYS_STOP_STEPS)
        return "; try more --steps";
    if (strcmp(run->solver->name, "newton") != 0)
        return "";
    if (run->options->data && !path_from_tables(run->options))
        return "; try --init table, or fewer --days";
    if (run->ends.free_time || path_from_file(run->options))
        return "; try --adam-steps 500, --rule gauss4, or a smaller --dt";
    if (path_from_line(run->options))
        return "; a line is far from a path of many turns or close passes: try --init ode "
               "--tol 1e-6, or a shorter time (--slices)";
    return "; where L has a kink (a clamp, a cap) it may never vanish; else try --adam-steps "
           "100, --rule gauss4, or a smaller --dt";
}

/* What kinks L has, where the path is further from the motion of its own start than --tol:
   estimates from coarser grids hold for smooth L. */
static const char *kinks_in_doubt(const struct path_run *run)
{
    if (!path_wants_tolerance(run->options) ||
        !(run->found.true_distance > run->options->tolerance))
        return NULL;
    const char *kinks = phys_check_kinks(&run->system);
    if (!kinks && phys_path_jumps(&run->system, &run->settings, run->path))
        kinks = "its forces jump along the path";
    return kinks;
}

/* Whether the forces change abruptly with time, where the path is further from the motion of its
   own start than --tol: elements may be blind to a pulse, coarse and fine ones alike. */
static bool pulses_in_doubt(const struct path_run *run)
{
    if (!path_wants_tolerance(run->options) ||
        !(run->found.true_distance > run->options->tolerance))
        return false;
    const size_t dof = run->system.dof, slices = run->settings.slices;
    double *q = malloc(2 * dof * sizeof *q);
    struct phys_time_scan scan = {0};
    struct ad_error none = {0};
    for (size_t k = 0; q && k < dof; k++) {
        q[k] = run->path[k * slices];
        q[dof + k] = (run->path[k * slices + 1] - q[k]) / run->settings.dt;
    }
    if (q)
        phys_time_scan(&run->system, q, q + dof, 0, (double)(slices - 1) * run->settings.dt, &scan,
                       &none);
    const bool any = scan.n > 0;
    phys_time_scan_free(&scan);
    free(q);
    return any;
}

/* True if the run reached what was asked. */
static int judge(const struct path_run *run, struct ad_error *error)
{
    const char *kinks = kinks_in_doubt(run);
    if (run->solutions.interrupted)
        ad_fail(error, AD_E_ACCURACY, "interrupted after %zu path%s; there may be more",
                run->solutions.n, run->solutions.n == 1 ? "" : "s");
    else if (run->found.info.stop == PHYS_STOP_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted after step %zu of %zu; results are partial",
                run->found.info.steps, run->settings.steps);
    else if (!converged(run))
        ad_fail(error, AD_E_ARGUMENT, "not converged: %s, |gradient| %.3g after %zu steps%s",
                path_stop_name(run->found.info.stop), run->found.info.grad_norm,
                run->found.info.steps, advice(run));
    else if (path_is_periodic(run->options))
        path_periodic_judge(run, error);
    else if (run->found.unknown && !path_wants_all(run->options))
        ad_fail(error, AD_E_ACCURACY,
                "the path is not known: the ends are conjugate or nearly, and between such there "
                "is none, or many; %s, or more slices",
                phys_ends_advice(&run->ends));
    else if (run->found.singular && !path_wants_all(run->options))
        ad_fail(error, AD_E_ACCURACY,
                "the path passes a singularity between two slices, as at a collision: no motion "
                "does, and the grid alone may hold it; try --tol, or other ends");
    else if (path_wants_tolerance(run->options) &&
             run->found.discretisation > run->options->tolerance)
        ad_fail(
            error, AD_E_ACCURACY,
            "--tol %g is not met: a rule of higher order is %.2g away, for an estimate of %.2g; "
            "allow a larger error or take another --rule",
            run->options->tolerance, run->found.discretisation, path_estimate(run));
    else if (path_wants_tolerance(run->options) && run->found.spectrum.undetermined)
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g cannot be verified: an eigenvalue of the second variation is zero within "
                "its error, so that the path may lie elsewhere; %s",
                run->options->tolerance, phys_ends_advice(&run->ends));
    else if (kinks)
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g cannot be verified: L has kinks (%s), where the estimate does not hold, "
                "and the motion from the path's start is %.2g away; try other --slices, or a "
                "smooth L",
                run->options->tolerance, kinks, run->found.true_distance);
    else if (pulses_in_doubt(run))
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g is not met: the forces change abruptly with time, where elements may be "
                "blind, and the motion from the path's start is %.2g away; try to --continue from "
                "a wider pulse",
                run->options->tolerance, run->found.true_distance);
    else if (run->options->reference && run->found.another && !path_wants_all(run->options))
        ad_fail(error, AD_E_ACCURACY,
                "--reference %s leads to another stationary path between the same ends, up to %.3g "
                "away; try --init %s, or --all for several",
                run->options->reference, run->found.reference_distance, run->options->reference);
    else
        path_ephemeris_judge(run, error);
    return error->status == AD_OK ? DONE : NOT_REACHED;
}

static int run(const void *options, struct ad_error *error)
{
    struct path_run run;
    int status;
    if (path_by_blocks(options))
        return path_blocks_run(options, error);
    if (path_setup(options, &run, error) == AD_OK &&
        outputs_run(&outputs, &run.options->common, &run, solve, error) == AD_OK) {
        path_diagnose(&run);
        status = judge(&run, error);
    } else {
        status = command_status(error);
    }
    path_run_free(&run);
    return status;
}

#define AT(member) offsetof(struct path_options, member)

static const struct option table[] = {
    {"solver", "NAME", OPTION_TEXT, NULL,
     "solver [newton; with --preset, --lr or options of descents: adam]", AT(solver)},
    {"rule", "NAME", OPTION_TEXT, NULL, "action rule [left; paper: left+repeat]", AT(rule)},
    {"slices", "N", OPTION_SLICES, NULL, "points of the path, both ends included [the scene's]",
     AT(slices)},
    {"dt", "DT", OPTION_POSITIVE, NULL, "time from slice to slice [the scene's]", AT(dt)},
    {"steps", "K", OPTION_COUNT, NULL, "of the solver [as published, else 500]", AT(steps)},
    {"lr", "X", OPTION_POSITIVE, NULL, "learning rate [as published, else 0.01]",
     AT(learning_rate)},
    {"ends", "WHICH", OPTION_TEXT, "both",
     "what is given: both ends; start: the first two slices, and the motion follows; periodic: "
     "none, "
     "the path closes, see below",
     AT(ends)},
    {"choreography", NULL, OPTION_FLAG, NULL,
     "of --ends periodic: bodies that are alike follow each other on one curve", AT(choreography)},
    {"start", "ENDS", OPTION_INPUT, NULL,
     "one end, x=1,y=-pi/2 or the first row of FILE.csv; y=free: its momentum is 0 [the scene's]",
     AT(start)},
    {"end", "ENDS", OPTION_INPUT, NULL,
     "the other, or the last row of FILE.csv; theta=1+2pi winds once [the motion's]", AT(end)},
    {"inputs", "TABLE", OPTION_INPUT, NULL,
     "of a model with inputs: those that --set does not give, over the column t", AT(inputs)},
    {"relate", "EQUATIONS", OPTION_TEXT, NULL,
     "linear relations between the ends, 'x(T)=-x(0)+1,y(0)=2*x(0)'; what --start and --end do not "
     "name is free, and momenta keep the natural conditions",
     AT(relate)},
    {"time", "T", OPTION_TEXT, NULL,
     "from end to end, or free: of the path of energy --energy, near --slices, --dt [these]; with "
     "--all they are the longest",
     AT(time)},
    {"all", NULL, OPTION_FLAG, NULL,
     "newton: all stationary paths between the ends, by energy, or with --time free those of one "
     "energy, by time; the first is the result",
     AT(all)},
    {"energy", "E", OPTION_NUMBER, NULL,
     "the same, and the one of this energy, to 0.2%, is the result; with --time free its energy "
     "[0]",
     AT(energy)},
    {"adam-steps", "K", OPTION_COUNT, NULL,
     "newton, lbfgs: steps of adam before [200 from a line, else 0]", AT(adam_steps)},
    {"momentum", "M", OPTION_NUMBER, "0", "sgd: share of the last step in the next", AT(momentum)},
    {"hold", "K", OPTION_SOME, "1", "slices held at either end", AT(hold)},
    {"energy-loss", "KIND", OPTION_TEXT, NULL,
     "descents: penalty on the change of energy, global (from the start) or local",
     AT(energy_loss)},
    {"energy-weight", "C", OPTION_NUMBER, NULL, "its weight [1; paper: as published]",
     AT(energy_weight)},
    {"stop-at-reference", NULL, OPTION_FLAG, NULL,
     "descents: end at the step nearest to the reference", AT(stop_at_reference)},
    {"tol", "E", OPTION_POSITIVE, NULL,
     "newton: rule and slices, coarse to fine and close where the path is steep, until the "
     "estimated error of every coordinate is under E",
     AT(tolerance)},
    {"continue", "NAME=A:B", OPTION_TEXT, NULL,
     "with --tol: the path at B of a parameter, followed from that at A where it is found easily",
     AT(follow)},
    {"grad-tol", "E", OPTION_SIZE, NULL, "stop where |gradient| is E of its start [never]",
     AT(grad_tolerance)},
    {"init", "HOW", OPTION_INPUT, NULL,
     "start: line, ode, with --data table, or FILE.csv [line; --data: table; paper, --ends start: "
     "ode]",
     AT(init)},
    {"noise", "SIGMA", OPTION_SIZE, NULL, "on the start [none; paper: as published with ode]",
     AT(noise)},
    {"reference", "FILE.csv", OPTION_INPUT, NULL,
     "path that errors are measured against [see below]", AT(reference)},
    {"preset", "paper", OPTION_TEXT, NULL, "the published setting of the scene, all of it",
     AT(preset)},
    {"every", "K", OPTION_SOME, NULL, "steps between paths stored by --out [about 200 in all]",
     AT(every)},
    {"blocks", NULL, OPTION_FLAG, NULL,
     "by fixed blocks of slices, as many ranks do: their bits, less memory, few estimates",
     AT(blocks)},
    {"data", "DIR", OPTION_INPUT, NULL, "ephemeris: a folder of Horizons vector tables", AT(data)},
    {"from", "DATE", OPTION_TEXT, NULL, "ephemeris: first epoch, YYYY-MM-DD or an index", AT(from)},
    {"days", "N", OPTION_SLICES, NULL, "ephemeris: epochs, one per slice", AT(days)},
    {"dims", "2|3", OPTION_COUNT, NULL, "ephemeris: coordinates of a body", AT(dims)},
    {"bodies", "NAMES", OPTION_TEXT, NULL, "ephemeris: names or ids, as in sun,mercury,399",
     AT(bodies)},
};

const struct command command_path = {
    .line =
        {.name = "path",
         .what = "stationary path between two ends",
         .arguments = {"SCENE"},
         .scene = true,
         .ranks = true,
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "SCENE is a name from `leastaction scenes`, or a shared object. FILE.csv has\n"
             "a row for each slice, and columns named as the coordinates, or nothing else; the\n"
             "time, where it has one, is named t. The reference path is, without\n"
             "--reference, the motion from the scene's start: by the same discretisation\n"
             "(rules left and left+repeat, as long as that is near) or tightly integrated;\n"
             "the table itself with --data and no preset; none where --init FILE.csv gives\n"
             "the ends. The true motion is integrated from the start of the path found. Where\n"
             "the reference leads to another stationary path that is said; the exit status is\n"
             "1 where --reference asked for it, or --data, but 0 with --tol, whose estimate is\n"
             "that of the path found.\n\n"
             "--ends periodic closes the path after --time T, or after the period of --energy E, "
             "which\n"
             "is looked for near T. The start, --init FILE.csv or the scene's motion, is rough: "
             "from\n"
             "what newton makes of it the periodic motion is found by shooting, with its "
             "multipliers,\n"
             "and is the reference; --tol is the distance from it. With --choreography the path is "
             "the\n"
             "share of the period after which each body is where the next one was.\n\n"
             "mpirun -n N leastaction path ... splits the slices among ranks, each with memory\n"
             "for its share (make MPI=1; docs/scale.md). The bits do not depend on N."},
    .bytes = sizeof(struct path_options),
    .run = run,
};
