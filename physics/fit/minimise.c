/* One minimum of a fit, by the method of Levenberg and Marquardt. */
#include "internal.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ITERATIONS = 100 };

void phys_fitting_keep(const struct phys_fitting *s, struct phys_fitting_point *to)
{
    memcpy(to->params, s->system.params, s->system.scene->params_bytes);
    memcpy(to->begin, s->begin, s->n_stretches * s->d * sizeof *s->begin);
}

void phys_fitting_restore(struct phys_fitting *s, const struct phys_fitting_point *from)
{
    memcpy(s->system.params, from->params, s->system.scene->params_bytes);
    memcpy(s->begin, from->begin, s->n_stretches * s->d * sizeof *s->begin);
}

/* Moves by a share of a step: parameters, and beginnings by the chain of the last measure. False
   where the parameters are no values. */
static bool move(struct phys_fitting *s, const double *step, double share, struct ad_error *error)
{
    const size_t d = s->d, N = s->fit->n_unknown;
    struct ad_error refused = {0};
    for (size_t k = 0; k < s->fit->n_free; k++) {
        const double p = phys_system_get(&s->system, s->settings->free[k]);
        if (phys_system_set(&s->system, s->settings->free[k], p + share * step[k], &refused) !=
            AD_OK)
            return false;
    }
    for (size_t k = 0; k < s->n_stretches; k++)
        for (size_t i = 0; i < d; i++) {
            const double *row = s->chain + (k * d + i) * (N + 1);
            double change = row[N];
            for (size_t j = 0; j < N; j++)
                change += row[j] * step[j];
            s->begin[k * d + i] += share * change;
        }
    for (size_t k = 0; s->settings->fixed_start && k < s->n_stretches; k++)
        if (phys_fitting_begins_trial(s, k))
            s->system.scene->start(s->system.params, s->settings->seed, s->begin + k * d,
                                   s->begin + k * d + d / 2, &refused);
    return phys_keep_memory(&refused, error) == AD_OK && refused.status == AD_OK;
}

bool phys_fitting_is_fatal(const struct ad_error *error)
{
    return error->status == AD_E_MEMORY || strstr(error->message, "interrupted");
}

/* One step that lowers the merit, or that at least halves the gaps where it hardly raises it above
   what the linear equations leave: near the minimum closing gaps costs residuals in proportion, and
   their own squares gain less. *down:
   by how much the merit changed, 0 where there is no such step. Shares of Gauss and Newton's come
   first: of a chaotic motion any damping of the unknowns is a large change at its end, which does
   not close the gaps any more. */
static enum ad_status descend(struct phys_fitting *s, const struct phys_squares *q,
                              struct phys_fitting_point *here, double *down, double *step,
                              struct ad_error *error)
{
    enum { SHARES = 6, ATTEMPTS = 22 };
    const double before = s->merit, gap = s->gap;
    const size_t chains = (s->n_stretches + 1) * s->d * (s->fit->n_unknown + 1);
    double *chain = malloc(chains * sizeof *chain);
    if (!chain)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(chain, s->chain, chains * sizeof *chain);
    phys_fitting_keep(s, here);
    *down = 0;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        struct ad_error cause = {0};
        const bool shared = attempt < SHARES;
        const double lambda = shared ? 0 : 1e-8 * pow(10, attempt - SHARES);
        phys_squares_solve(q, lambda * q->s[0] * q->s[0], step);
        memcpy(s->chain, chain, chains * sizeof *chain);
        const bool valid = move(s, step, shared ? ldexp(1, -attempt) : 1, &cause);
        if (valid)
            phys_fitting_measure(s, &cause);
        if (cause.status != AD_OK && phys_fitting_is_fatal(&cause)) {
            *error = cause;
            break;
        }
        const bool closes =
            s->gap > 0 && s->gap <= gap / 2 && s->merit <= 1.01 * fmax(before, q->left);
        if (valid && cause.status == AD_OK && (s->merit < before || closes)) {
            *down = fabs(before - s->merit);
            break;
        }
        phys_fitting_restore(s, here);
    }
    free(chain);
    return error->status;
}

/* By how much Gauss and Newton's step lowers the merit of the linear problem. */
static double promised(const struct phys_squares *q)
{
    double sum = 0;
    for (size_t k = 0; k < q->n; k++)
        sum += q->u_r[k] * q->u_r[k];
    return sum;
}

enum ad_status phys_fitting_minimise(struct phys_fitting *s, struct phys_fitting_point *here,
                                     bool *met, struct ad_error *error)
{
    const double rows = (double)s->fit->measured;
    double *step = malloc(s->fit->n_unknown * sizeof *step);
    *met = false;
    if (!step)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_fitting_measure(s, error);
    for (int k = 0; k < ITERATIONS && error->status == AD_OK && !*met; k++) {
        struct phys_squares q = {0};
        double down = 0, promise = INFINITY, before = s->merit, variance = before / rows;
        if (phys_squares_new(s->fit->measured, s->fit->n_unknown, s->J, s->r, &q, error) == AD_OK &&
            ((promise = promised(&q)) > 1e-8 * variance || s->gap > 1e-4))
            descend(s, &q, here, &down, step, error);
        phys_squares_free(&q);
        s->fit->iterations++;
        /* after a step of a thousandth of a standard deviation, or one that gains nothing: more
           finds rounding of the motion */
        *met =
            (promise <= 1e-6 * variance || down <= 1e-11 * before + 1e-22 * rows) && s->gap <= 1e-4;
        if (down == 0) {
            if (error->status == AD_OK)
                phys_fitting_measure(s, error);
            *met = s->gap <= 1e-3; /* no step, however short, goes down */
            break;
        }
    }
    free(step);
    return error->status;
}
