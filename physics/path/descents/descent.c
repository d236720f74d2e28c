/* Descent of the action along its gradient: Adam (Kingma, Ba, ICLR 2015), as published, and
   gradient descent with momentum. The gradient is zero at the held ends. A step is one run of the
   program and one step of the optimiser on the program's storage, and allocates nothing. Descents
   find minima, and the true path often is none (Morse index > 0). */
#include "autodiff/optim.h"
#include "physics/path/path_program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static ad_optimiser *optimiser(const struct phys_path_program *p, enum ad_optimiser_method method,
                               struct ad_error *error)
{
    struct ad_optimiser_settings settings = ad_optimiser_defaults(method);
    settings.learning_rate = p->settings->learning_rate;
    if (method == AD_SGD)
        settings.momentum = p->settings->momentum;
    return ad_optimiser_new(&settings, AD_F64, p->n, error);
}

static enum ad_status descend(struct phys_path_program *p, ad_optimiser *o, double *path,
                              struct phys_path_info *info, struct ad_error *error)
{
    for (size_t step = 0;; step++) {
        struct phys_path_step at = phys_path_program_run(p, step);
        if (phys_path_program_finite(p, &at, error) != AD_OK)
            return error->status;
        enum phys_stop stop = phys_path_program_report(p, &at);
        if (stop) {
            phys_path_program_end(p, stop, &at, path, info);
            return AD_OK;
        }
        ad_optimiser_step(o, p->x, p->g);
    }
}

static enum ad_status solve(enum ad_optimiser_method method, const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    struct phys_path_program p;
    ad_optimiser *o = NULL;
    if (phys_path_program_new(&p, system, settings, path, error) == AD_OK &&
        (o = optimiser(&p, method, error))) {
        if (settings->native)
            ad_native(p.program, (double)settings->steps, NULL);
        descend(&p, o, path, info, error);
    }
    ad_optimiser_free(o);
    phys_path_program_free(&p);
    return error->status;
}

static enum ad_status adam(const struct phys_system *system,
                           const struct phys_path_settings *settings, double *path,
                           struct phys_path_info *info, struct ad_error *error)
{
    return solve(AD_ADAM, system, settings, path, info, error);
}

static enum ad_status sgd(const struct phys_system *system,
                          const struct phys_path_settings *settings, double *path,
                          struct phys_path_info *info, struct ad_error *error)
{
    return solve(AD_SGD, system, settings, path, info, error);
}

enum ad_status phys_path_program_adam(struct phys_path_program *p,
                                      bool (*enough)(void *context, size_t step), void *context,
                                      struct ad_error *error)
{
    enum { FIRST = 10 }; /* steps */
    if (!p->settings->adam_steps)
        return AD_OK;
    ad_optimiser *o = optimiser(p, AD_ADAM, error);
    double *kept = malloc(p->n * sizeof *kept);
    if (o && !kept)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t step = 0, ask = 0; o && kept && step <= p->settings->adam_steps; step++) {
        if (enough && step == ask) {
            if (enough(context, step))
                break;
            ask = step ? 2 * step : FIRST;
        }
        struct phys_path_step at = phys_path_program_run(p, step);
        if (step > 0 && !isfinite(at.objective)) {
            memcpy(p->x, kept, p->n * sizeof *kept);
            break;
        }
        memcpy(kept, p->x, p->n * sizeof *kept);
        if (step < p->settings->adam_steps)
            ad_optimiser_step(o, p->x, p->g);
        phys_end_space_meet_path(&p->ends, p->settings->slices, p->x);
    }
    free(kept);
    ad_optimiser_free(o);
    return error->status;
}

const struct phys_solver phys_solver_adam = {
    "adam", "descent of the action by Adam, the ends held, as published", adam, true};
const struct phys_solver phys_solver_sgd = {
    "sgd", "plain descent of the action, with momentum if asked for", sgd, true};
