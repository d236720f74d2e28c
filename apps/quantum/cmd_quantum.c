/* leastaction quantum: wave packets from the Lagrangian of a scene. */
#include "apps/command.h"
#include "quantum.h"

#include <math.h>
#include <string.h>

/* The least norm of a packet at the end. */
static double least_norm(const struct quantum_run *run)
{
    const struct qm_run_result *result = &run->result;
    size_t packets = run->settings.packets;
    double least = INFINITY;
    for (size_t k = 0; k < packets; k++)
        least = fmin(least, result->moments[(result->n - 1) * packets + k].norm);
    return least;
}

static int run_packets(struct quantum_run *run, struct ad_error *error)
{
    const struct qm_run_result *result = &run->result;
    if (outputs_run(&quantum_outputs, &run->options->common, run, quantum_run, error) != AD_OK)
        return command_status(error);
    double end = result->t[result->n - 1];
    if (isinf(result->error))
        ad_fail(error, AD_E_ACCURACY,
                "the error is not known: %s takes too many steps to t = %g; try fewer --steps",
                result->truth, end);
    else if (result->error > run->options->tolerance)
        ad_fail(error, AD_E_ACCURACY, "--tol %g: the error is %.2g, against %s; try %s%s",
                run->options->tolerance, result->error, result->truth,
                least_norm(run) < 0.5
                    ? "a larger --box or a shorter time: most of a packet has left"
                    : "more --points and a shorter --dt, a larger --box",
                least_norm(run) < 0.5 || strcmp(run->options->method, "kernel") != 0
                    ? ""
                    : ", or --method fft");
    else if (result->stopped)
        ad_fail(error, AD_E_ACCURACY, "interrupted at t = %g; results are partial", end);
    return command_status(error);
}

/* L may not be defined at the speeds of the straight paths from one wall to the other. */
static void advise(const struct quantum_run *run, struct ad_error *error)
{
    size_t length = strlen(error->message);
    if (error->status == AD_E_NONFINITE)
        snprintf(error->message + length, sizeof error->message - length,
                 ": L of %s on a straight path of this slice; try a longer --dt or a smaller --box",
                 run->options->scene);
}

/* Options that a run does not look at. */
static enum ad_status refuse_unused(const struct quantum_options *options, struct ad_error *error)
{
    const struct unused rows[] = {
        {options->preset,
         "scene points box dt steps power packet hbar method rule walls absorb every normalise "
         "force tol no-reference set",
         "is not for --preset paper; see --scale"},
        {!options->preset, "scale", "needs --preset paper"},
        {options->no_reference, "tol", "needs the error; leave --no-reference out"},
        {options->power != OPTION_NO_COUNT, "steps every method normalise",
         "is not for --power, one slice of the kernel"},
        {strcmp(options->method, qm_method_crank_nicolson.name) == 0, "rule",
         "is not for crank-nicolson, which has no paths"},
    };
    return options_unused(&options->common, sizeof rows / sizeof *rows, rows, error);
}

static int run(const void *values, struct ad_error *error)
{
    const struct quantum_options *options = values;
    struct quantum_run run;
    int status = WRONG_USE;
    if (refuse_unused(options, error) != AD_OK)
        return WRONG_USE;
    if (options->preset)
        return options_choose("preset", options->preset, 1, (const char *const[]){"paper"},
                              error) == 0
                   ? quantum_paper(options, error)
                   : WRONG_USE;
    if (strcmp(options->scene, "double-slit") == 0)
        return quantum_slit(options, error);
    if (quantum_setup(options, &run, error) == AD_OK)
        status = run_packets(&run, error);
    else
        status = command_status(error);
    advise(&run, error);
    quantum_free(&run);
    return status;
}

#define AT(member) offsetof(struct quantum_options, member)

static const struct option table[] = {
    {"scene", "NAME", OPTION_INPUT, "free",
     "free gravity harmonic pendulum double-well double-slit, or another of one coordinate, "
     "FILE.so",
     AT(scene)},
    {"points", "N", OPTION_COUNT, NULL, "of the grid [the scene's]", AT(points)},
    {"box", "A,B", OPTION_TEXT, NULL, "positions of the walls [the scene's]", AT(box)},
    {"dt", "DT", OPTION_NUMBER, NULL, "length of a slice [the scene's]", AT(dt)},
    {"steps", "K", OPTION_COUNT, NULL, "slices [the scene's]", AT(steps)},
    {"power", "K", OPTION_COUNT, NULL, "one slice of 2^K instead, by squaring", AT(power)},
    {"packet", "X0,SIGMA,P", OPTION_TEXTS, NULL,
     "position, width and momentum; repeatable, moved together [the scene's]", AT(packets)},
    {"hbar", "H", OPTION_NUMBER, "1", "in units of the scene's action", AT(hbar)},
    {"method", "NAME", OPTION_TEXT, "kernel", "kernel, fft or crank-nicolson", AT(method)},
    {"rule", "NAME", OPTION_TEXT, "trapezoid", "of the action: left, midpoint or trapezoid",
     AT(rule)},
    {"walls", "KIND", OPTION_TEXT, NULL, "open, reflect or ring [the scene's]", AT(walls)},
    {"absorb", "WIDTH", OPTION_NUMBER, "0", "of absorbing layers at both ends", AT(absorb)},
    {"every", "K", OPTION_SOME, NULL, "slices from sample to sample [200 samples]", AT(every)},
    {"normalise", NULL, OPTION_FLAG, NULL, "force the norm to 1 after every slice", AT(normalise)},
    {"force", NULL, OPTION_FLAG, NULL, "run even if it aliases or takes hours, with a warning",
     AT(force)},
    {"tol", "E", OPTION_POSITIVE, "1e-2", "largest error with exit status 0", AT(tolerance)},
    {"no-reference", NULL, OPTION_FLAG, NULL, "do not measure the error", AT(no_reference)},
    {"preset", "paper", OPTION_TEXT, NULL, "the published variant, and a correct one", AT(preset)},
    {"scale", "S", OPTION_NUMBER, "1", "of the preset, 0.25 to 2: 1 / hbar", AT(scale)},
};

const struct command command_quantum = {
    .line =
        {.name = "quantum",
         .what = "wave packets from a Lagrangian",
         .scene = true,
         .outputs = true,
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "In a slice of time a wave is multiplied by the matrix of exp(i S / hbar), S the\n"
             "action of the straight path between two points (fft: the same, faster). Phases of\n"
             "neighbouring paths must differ by less than pi, or ghosts appear: the command\n"
             "refuses, and says which dt, points or box would do. On a ring of 2^k points fft\n"
             "sums all windings in closed form and has no such limit. The norm is not touched;\n"
             "1 less it is what was lost. The error is sqrt(int |psi - truth|^2 dx) against the\n"
             "closed form where the potential is quadratic and the walls are open, else against\n"
             "Schroedinger's equation, or, of an L without a potential of its own, against slices\n"
             "three times as fine; a wave beyond an open wall is an error, too. Above --tol the\n"
             "exit status is 1."},
    .bytes = sizeof(struct quantum_options),
    .run = run,
};
