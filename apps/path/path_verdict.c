/* Reports the kind of stationary path found and its conjugate points (path.h). That needs a path
   that is stationary and an L_vv that is definite along it; otherwise the reason is reported. */
#include "path.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Why there is no Morse index of S. */
static void reason(const struct path_run *run, char *text, size_t size)
{
    const struct phys_spectrum *s = &run->found.spectrum;
    const char *cause = run->ends.n_relations ? "paths that keep the relations form a family"
                                              : "the ends are conjugate";
    if (strcmp(run->solver->name, "newton") != 0)
        snprintf(text, size, "%s does not make the path stationary to rounding; newton does",
                 run->solver->name);
    else if (!run->found.stationary)
        snprintf(text, size, "the path is not stationary: %s, |gradient| %.3g",
                 path_stop_name(run->found.info.stop), run->found.info.grad_norm);
    else if (run->found.singular)
        snprintf(text, size, "the path passes a singularity between two slices");
    else if (s->legendre == PHYS_NEGATIVE)
        snprintf(text, size, "L_vv is negative definite: of -S it is %zu, %s of the action",
                 s->index, s->index ? "a saddle" : "a maximum");
    else if (s->legendre == PHYS_POSITIVE && isnan(s->around[0]))
        snprintf(
            text, size,
            "an eigenvalue of the Hessian is zero within rounding: %s or nearly, or the slices "
            "too many",
            cause);
    else if (s->legendre == PHYS_POSITIVE)
        snprintf(text, size,
                 "an eigenvalue of the second variation, %.2g, is zero within its error: %s or "
                 "nearly, or the slices too few",
                 fmin(fabs(s->around[0]), fabs(s->around[1])), cause);
    else
        snprintf(text, size, "L_vv is not definite at t = %.6g (Legendre's condition)",
                 s->not_definite);
}

/* As many digits of a time as its error leaves, the last one of the error's own size; at most 10.
 */
static int digits(const struct phys_conjugate *c)
{
    double known = floor(log10(c->time)) - floor(log10(c->error)) + 1;
    return (int)fmax(1, fmin(10, known));
}

enum { SHOWN = 40 }; /* conjugate points, at most; --json has all */

static void report_conjugate(const struct path_run *run, const struct phys_spectrum *s,
                             struct report *report)
{
    const char *unit = unit_shown(run->system.scene->time_unit);
    double *values = malloc((2 * s->n_conjugate + 1) * sizeof *values);
    char text[400];
    size_t n = 0;
    if (!values) {
        report->failed = true;
        return;
    }
    for (size_t k = 0; k < s->n_conjugate; k++) {
        values[k] = s->conjugate[k].time;
        values[s->n_conjugate + k] = s->conjugate[k].error;
    }
    const size_t shown = s->n_conjugate > SHOWN ? SHOWN : s->n_conjugate;
    for (size_t k = 0; k < shown; k++) {
        n += (size_t)snprintf(text + n, sizeof text - n, "%s%.*g", n ? ", " : "",
                              digits(&s->conjugate[k]), s->conjugate[k].time);
        if (n > sizeof text - 24 || k + 1 == shown) {
            report_line(report, "  conjugate to the start%s%s: %s", *unit ? ", in " : "", unit,
                        text);
            n = 0;
        }
    }
    if (shown < s->n_conjugate)
        report_line(report, "  and %zu more, up to %.*g", s->n_conjugate - shown,
                    digits(&s->conjugate[s->n_conjugate - 1]),
                    s->conjugate[s->n_conjugate - 1].time);
    report_list(report, "conjugate_times", NULL, unit, s->n_conjugate, values);
    report_list(report, "conjugate_errors", NULL, unit, s->n_conjugate, values + s->n_conjugate);
    free(values);
    if (s->n_conjugate == 0)
        return;
    if (!s->of_motion)
        report_line(report, "  (+-%.2g: between two slices%s)", s->conjugate[0].error,
                    run->system.scene->constraint
                        ? ""
                        : "; the motion near the path was not found, or has too "
                          "many coordinates");
    else if (s->legendre == PHYS_INDEFINITE)
        report_line(report, "  (changes of sign of the Jacobi fields' determinant, for L_vv is "
                            "indefinite: where the fields lose an even rank there is none)");
    else if (s->n_conjugate != s->index)
        report_line(report,
                    "  the motion has %zu of them, the path of this grid %zu: try a smaller --dt",
                    s->n_conjugate, s->index);
}

void path_report_kind(const struct path_run *run, struct report *report)
{
    const struct phys_spectrum *s = &run->found.spectrum;
    char why[200];
    bool known = run->found.stationary && !run->found.singular && s->legendre == PHYS_POSITIVE;
    if (known && !s->undetermined) {
        report_line(report, "\n  Morse index %zu: %s of the action", s->index,
                    s->index ? "a saddle" : "a minimum");
        report_count(report, "morse_index", NULL, s->index);
    } else {
        reason(run, why, sizeof why);
        if (strcmp(run->solver->name, "newton") == 0)
            report_line(report, "\n  no Morse index: %s", why);
        report_text(report, "morse_index", NULL, NULL);
        report_text(report, "no_morse_index", NULL, why);
    }
    if (known) {
        report_number(report, "smallest_eigenvalue", "smallest eigenvalue", NULL, s->smallest);
        report_number(report, "second_variation", "of the second variation", NULL,
                      s->second_variation);
    }
    if (s->unknown_conjugate)
        report_line(report, "  conjugate points are not computed of so many coordinates");
    else if (run->found.stationary)
        report_conjugate(run, s, report);
}
