#include "report.h"
#include "autodiff/free.h"
#include "hnn/rollout/rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* (q, v) to the states of the model, which has momenta unless it is Lagrangian. */
static bool to_states(const struct phys_system *system, const hnn_model *model,
                      struct hnn_path *path)
{
    const size_t dof = system->dof;
    struct ad_error error = {0};
    phys_legendre *legendre = NULL;
    if (hnn_model_settings(model)->kind == HNN_LAGRANGIAN)
        return true;
    double *p = malloc(dof * sizeof *p);
    if (p && phys_legendre_new(system, &legendre, &error) == AD_OK)
        for (size_t i = 0; i < path->n; i++) {
            double *x = path->x + i * path->states;
            phys_legendre_momentum(legendre, x, x + dof, path->t[i], p, NULL);
            memcpy(x + dof, p, dof * sizeof *p);
        }
    phys_legendre_free(legendre);
    free(p);
    return p && error.status == AD_OK;
}

void report_learnt(const struct phys_system *system, size_t n, const double *t, const double *x,
                   struct report *report)
{
    hnn_model *model = hnn_system_model(system);
    struct hnn_path path = {.states = 2 * system->dof, .n = n};
    char what[160] = "";
    if (!model)
        return;
    report_flag(report, "learnt", NULL, true);
    report_line(report, "  learnt from data: errors are of this model's own motion, not of what "
                        "it learnt from");
    path.t = calloc(n + 1, sizeof *path.t);
    if (path.t && t && n)
        memcpy(path.t, t, n * sizeof *t);
    path.x = malloc((n + 1) * path.states * sizeof *path.x);
    if (path.x && n)
        memcpy(path.x, x, n * path.states * sizeof *path.x);
    report->failed = report->failed || !path.t || !path.x || !to_states(system, model, &path);
    size_t first = report->failed ? n : hnn_path_outside(model, &path, what, sizeof what);
    AD_FREE(path.x, path.t);
    report_number(report, "outside_from", NULL, NULL, first < n && t ? t[first] : (double)NAN);
    report_text(report, "outside", first < n ? "  outside its training" : NULL,
                first < n ? what : NULL);
}
