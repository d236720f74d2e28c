/* Warns about descents that move away from the reference path. */
#include "path.h"

#include <string.h>

/* Far from the reference the gradient is not conclusive: it may grow on the way to a narrow valley.
 */
static bool moved_away(const struct path_run *run)
{
    return !(run->found.info.grad_norm <= run->found.info.start.grad_norm) &&
           !(path_mse(run, run->path) <= path_mse(run, run->start));
}

void path_diagnose_lost(const struct path_run *run, struct ad_error *error)
{
    size_t length = strlen(error->message), room = sizeof error->message - length;
    if (error->status != AD_E_NONFINITE)
        return;
    if (run->record.n == 0)
        snprintf(error->message + length, room,
                 "; the path begins there: try another --init, or --set");
    else
        snprintf(error->message + length, room,
                 "; %s lost the path: try a smaller --lr than %g, another --init, or --solver "
                 "newton",
                 run->solver->name, run->settings.learning_rate);
}

void path_diagnose(const struct path_run *run)
{
    struct phys_spectrum spectrum;
    struct ad_error none = {0};
    if (run->options->common.quiet || run->solver == &phys_solver_march ||
        strcmp(run->solver->name, "newton") == 0 || !moved_away(run))
        return;
    fprintf(stderr,
            "leastaction path: warning: %s moves away from the stationary path: |gradient| grew "
            "from %.3g to %.3g; ",
            run->solver->name, run->found.info.start.grad_norm, run->found.info.grad_norm);
    if (phys_path_spectrum(&run->system, &run->settings, run->path, &spectrum, &none) == AD_OK &&
        spectrum.legendre == PHYS_POSITIVE && spectrum.index > 0)
        fprintf(stderr,
                "the second derivative of the action is negative along %zu direction%s there, and "
                "no descent can hold a saddle; try --solver newton\n",
                spectrum.index, spectrum.index == 1 ? "" : "s");
    else
        fprintf(stderr, "try a smaller --lr than %g, or --solver newton\n",
                run->settings.learning_rate);
    phys_spectrum_free(&spectrum);
}
