/* --sensitivity: derivatives of a motion's end by its start and by parameters. */
#include "autodiff/free.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STATES = 1000 }; /* coordinates and velocities with a matrix */

static struct phys_lyapunov_settings until_the_end(const struct simulate_run *run)
{
    return (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings),
                                           .t1 = run->motion.info.t,
                                           .proceed = run->settings.proceed,
                                           .context = run->settings.context};
}

static enum ad_status by_start(struct simulate_run *run, struct ad_error *error)
{
    const size_t d = 2 * run->system.dof;
    const struct phys_lyapunov_settings how = until_the_end(run);
    struct ad_error cause = {0};
    if (d > MOST_STATES)
        return ad_fail(error, AD_E_ARGUMENT, "--sensitivity: %zu coordinates; expected at most %d",
                       d / 2, MOST_STATES / 2);
    run->sensitivity = malloc(2 * d * d * sizeof *run->sensitivity);
    if (!run->sensitivity)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_transition(&run->system, run->motion.start, &how, run->sensitivity,
                        run->sensitivity + d * d, &cause) != AD_OK)
        simulate_refuse("--sensitivity: ", &cause, error);
    return error->status;
}

/* The parameters of --by; or all that L does not have as plain numbers, which are told of. */
static enum ad_status choose(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    const bool quiet = run->options->common.quiet;
    char *rest = NULL;
    if (run->options->by && !(run->by_text = strdup(run->options->by)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (char *name = run->by_text ? strtok_r(run->by_text, ",", &rest) : NULL; name;
         name = strtok_r(NULL, ",", &rest)) {
        if (run->n_by == SIMULATE_PARAMETERS)
            return ad_fail(error, AD_E_ARGUMENT, "--by: expected at most %d parameters",
                           SIMULATE_PARAMETERS);
        run->by[run->n_by++] = name;
    }
    for (size_t k = 0; !run->by_text && k < scene->n_params && run->n_by < SIMULATE_PARAMETERS;
         k++) {
        const char *name = scene->params[k].name;
        const enum phys_param_use use = phys_param_use(&run->system, name, error);
        if (error->status != AD_OK)
            return error->status;
        if (use == PHYS_PARAM_VARIABLE || use == PHYS_PARAM_MIXED)
            run->by[run->n_by++] = name;
        if (use == PHYS_PARAM_PLAIN && !quiet)
            fprintf(stderr,
                    "leastaction simulate: warning: no derivative by %s, which L has as a plain "
                    "number or in a condition; see PHYS_PARAM\n",
                    name);
    }
    return AD_OK;
}

static enum ad_status by_parameters(struct simulate_run *run, struct ad_error *error)
{
    const size_t d = 2 * run->system.dof;
    const struct phys_lyapunov_settings how = until_the_end(run);
    struct ad_error cause = {0};
    if (choose(run, error) != AD_OK || run->n_by == 0)
        return error->status;
    run->by_parameters = malloc(2 * d * run->n_by * sizeof *run->by_parameters);
    if (!run->by_parameters)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_sensitivity(&run->system, run->settings.q ? run->motion.start : NULL,
                         run->settings.seed, &how, run->n_by, run->by, run->by_parameters,
                         run->by_parameters + d * run->n_by, &cause) != AD_OK)
        simulate_refuse(run->by_text ? "--by: " : "--sensitivity: ", &cause, error);
    return error->status;
}

enum ad_status simulate_sensitivity(struct simulate_run *run, struct ad_error *error)
{
    if (!run->options->sensitivity || run->motion.info.stop == PHYS_SIMULATION_INTERRUPTED)
        return AD_OK;
    return by_start(run, error) == AD_OK ? by_parameters(run, error) : error->status;
}

void simulate_sensitivity_free(struct simulate_run *run)
{
    AD_FREE(run->sensitivity, run->by_parameters, run->by_text);
}

/* A matrix, row after row, and below the columns' names. Two runs of a chaotic motion may be nearer
   to each other than to the truth: digits are printed of ten times what they differ by. */
static void report_matrix(const struct simulate_run *run, size_t cols, const double *x,
                          const double *u, struct report *report)
{
    enum { COLUMNS = 48 };
    char name[64];
    for (size_t i = 0; i < 2 * run->system.dof && cols <= COLUMNS; i++) {
        char line[COLUMNS * 16 + 1] = "";
        for (size_t k = i * cols, used = 0; k < (i + 1) * cols; k++)
            used +=
                (size_t)snprintf(line + used, sizeof line - used, " %12.6g",
                                 fabs(x[k]) > 10 * u[k] ? phys_known_digits(x[k], 10 * u[k]) : 0);
        phys_ode_component(&run->motion.ode, i, name, sizeof name);
        report_line(report, "  %-12.40s%s", name, line);
    }
    if (cols > COLUMNS)
        report_line(report, "  too many, see --json");
}

void simulate_report_sensitivity(const struct simulate_run *run, struct report *report)
{
    const size_t d = 2 * run->system.dof, n = run->n_by;
    char names[SIMULATE_PARAMETERS * 32 + 1] = "";
    if (!run->sensitivity)
        return;
    report_line(report, "derivatives of the end by the start (columns in the same order)");
    report_matrix(run, d, run->sensitivity, run->sensitivity + d * d, report);
    report_list(report, "sensitivity", NULL, NULL, d * d, run->sensitivity);
    report_list(report, "sensitivity_uncertainty", NULL, NULL, d * d, run->sensitivity + d * d);
    if (!run->by_parameters)
        return;
    for (size_t k = 0, used = 0; k < n && used + 32 < sizeof names; k++)
        used += (size_t)snprintf(names + used, sizeof names - used, " %12.24s", run->by[k]);
    report_line(report, "derivatives of the end by parameters");
    report_line(report, "  %-12s%s", "", names);
    report_matrix(run, n, run->by_parameters, run->by_parameters + d * n, report);
    report_texts(report, "sensitivity_parameters", n, run->by);
    report_list(report, "parameter_sensitivity", NULL, NULL, d * n, run->by_parameters);
    report_list(report, "parameter_sensitivity_uncertainty", NULL, NULL, d * n,
                run->by_parameters + d * n);
}
