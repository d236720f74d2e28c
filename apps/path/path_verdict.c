/* What kind of stationary path was found, and which points are conjugate to its start (path.h). A
   verdict needs a path that is stationary and an L_vv that is definite along it; else it is said
   why there is none. */
#include "path.h"
#include "apps/output/json.h"
#include "apps/output/unit.h"

#include <math.h>
#include <string.h>

/* Where --grad-tol asks for no more than this, the path is not stationary yet. */
static const double stationary = 1e-6;

static bool is_stationary(const struct path_run *run, const struct path_result *result)
{
    return strcmp(run->solver->name, "newton") == 0 &&
           (result->info.stop == PHYS_STOP_ROUNDING ||
            (result->info.stop == PHYS_STOP_TOLERANCE && run->settings.tolerance <= stationary));
}

enum ad_status path_judge_kind(const struct path_run *run, struct path_result *result,
                               struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    struct phys_spectrum *spectrum = &result->spectrum;
    result->stationary = is_stationary(run, result);
    if (!result->stationary ||
        phys_path_spectrum(&run->system, settings, run->path, spectrum, error) != AD_OK)
        return error->status;
    if (spectrum->n_conjugate > 0 || spectrum->legendre == PHYS_INDEFINITE)
        phys_path_conjugate(&run->system, settings, run->path, spectrum, error);
    return error->status;
}

/* Why there is no Morse index of S. */
static void reason(const struct path_run *run, const struct path_result *result, char *text,
                   size_t size)
{
    const struct phys_spectrum *s = &result->spectrum;
    if (strcmp(run->solver->name, "newton") != 0)
        snprintf(text, size, "%s does not make the path stationary to rounding; newton does",
                 run->solver->name);
    else if (!result->stationary)
        snprintf(text, size, "the path is not stationary: %s, |gradient| %.3g",
                 path_stop_name(result->info.stop), result->info.grad_norm);
    else if (s->legendre == PHYS_NEGATIVE)
        snprintf(text, size, "L_vv is negative definite: of -S it is %zu, %s of the action",
                 s->index, s->index ? "a saddle" : "a maximum");
    else
        snprintf(text, size, "L_vv is not definite at t = %.6g (Legendre's condition)",
                 s->not_definite);
}

/* As many digits of a time as are known, at least one and at most 10. */
static int digits(const struct phys_conjugate *c)
{
    double known = floor(log10(c->time / c->error));
    return (int)fmax(1, fmin(10, known));
}

static void print_conjugate(const struct path_run *run, const struct phys_spectrum *s)
{
    const char *unit = unit_shown(run->system.scene->time_unit);
    if (s->n_conjugate == 0)
        return;
    printf("  conjugate to the start%s%s:", *unit ? ", in " : "", unit);
    for (size_t k = 0; k < s->n_conjugate; k++)
        printf("%s %.*g", k ? "," : "", digits(&s->conjugate[k]), s->conjugate[k].time);
    if (!s->of_motion)
        printf(" (+-%.2g: between which slices; no motion was found near the path)",
               s->conjugate[0].error);
    putchar('\n');
    if (s->of_motion && s->legendre != PHYS_INDEFINITE && s->n_conjugate != s->index)
        printf("  the motion has %zu of them, the path of this grid %zu: try a smaller --dt\n",
               s->n_conjugate, s->index);
}

void path_print_kind(const struct path_run *run, const struct path_result *result)
{
    const struct phys_spectrum *s = &result->spectrum;
    char why[160];
    if (strcmp(run->solver->name, "newton") != 0)
        return;
    if (result->stationary && s->legendre == PHYS_POSITIVE) {
        printf("\n  Morse index %zu: %s of the action\n", s->index,
               s->index ? "a saddle" : "a minimum");
        if (!isnan(s->smallest))
            printf("  smallest eigenvalue of the Hessian %.9g, of the second variation %.9g\n",
                   s->smallest, s->second_variation);
    } else {
        reason(run, result, why, sizeof why);
        printf("\n  no Morse index: %s\n", why);
    }
    if (result->stationary)
        print_conjugate(run, s);
}

void path_json_kind(struct json *json, const struct path_run *run, const struct path_result *result)
{
    const struct phys_spectrum *s = &result->spectrum;
    char why[160];
    if (result->stationary && s->legendre == PHYS_POSITIVE) {
        json_count(json, "morse_index", s->index);
        json_number(json, "smallest_eigenvalue", s->smallest);
        json_number(json, "second_variation", s->second_variation);
    } else {
        reason(run, result, why, sizeof why);
        json_null(json, "morse_index");
        json_text(json, "no_morse_index", why);
    }
    if (!result->stationary)
        return;
    json_array(json, "conjugate_times");
    for (size_t k = 0; k < s->n_conjugate; k++)
        json_number(json, NULL, s->conjugate[k].time);
    json_end_array(json);
    json_array(json, "conjugate_errors");
    for (size_t k = 0; k < s->n_conjugate; k++)
        json_number(json, NULL, s->conjugate[k].error);
    json_end_array(json);
}
