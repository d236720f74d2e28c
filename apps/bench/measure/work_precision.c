/* Work-precision curves (work_precision.h). */
#include "work_precision.h"

#include <math.h>

/* b where the line through two points on logarithmic scales is at `share`. */
static double between(double a, double b, double share) { return a * pow(b / a, share); }

bool work_at(const struct work_curve *curve, double error, struct work_point *at)
{
    const struct work_point *p = curve->point;
    for (size_t k = 0; k < curve->n; k++) {
        if (!(p[k].error <= error))
            continue;
        *at = p[k];
        if (k > 0 && p[k].error > 0) {
            double share = log(p[k - 1].error / error) / log(p[k - 1].error / p[k].error);
            at->setting = between(p[k - 1].setting, p[k].setting, share);
            at->steps = between(p[k - 1].steps, p[k].steps, share);
            at->evaluations = between(p[k - 1].evaluations, p[k].evaluations, share);
            at->seconds = between(p[k - 1].seconds, p[k].seconds, share);
        }
        at->error = error;
        return true;
    }
    return false;
}

size_t work_best(size_t n, const struct work_curve curves[], double error, struct work_point *at)
{
    size_t best = n;
    struct work_point candidate;
    for (size_t c = 0; c < n; c++)
        if (work_at(&curves[c], error, &candidate) &&
            (best == n || candidate.seconds < at->seconds)) {
            best = c;
            *at = candidate;
        }
    return best;
}

void work_print(FILE *out, const char *title, size_t n, const struct work_curve curves[])
{
    static const double errors[] = {1e-3, 1e-6, 1e-9, 1e-12};
    fprintf(out, "%s\n", title);
    for (size_t k = 0; k < sizeof errors / sizeof *errors; k++) {
        struct work_point at;
        size_t best = work_best(n, curves, errors[k], &at);
        if (best == n)
            fprintf(out, "  %5.0e  no method gets there\n", errors[k]);
        else
            fprintf(out, "  %5.0e  %-18s %3s %8.2g %9.0f steps %10.3g s\n", errors[k],
                    curves[best].name, curves[best].knob, at.setting, at.steps, at.seconds);
    }
}
