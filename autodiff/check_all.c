/* Every check of a scalar on the tape, and their report. */
#include "internal.h"
#include "text.h"

enum { ENTRIES = 200 };

/* Which operation of y is not finite at the point, if one is. */
static enum ad_status run_at(ad_var y, size_t n, const ad_var x[], const double *const at[],
                             struct ad_error *not_finite)
{
    ad_program *program = NULL;
    enum ad_status status = ad_compile(y.tape, 1, &y, &program);
    for (size_t k = 0; k < n && status == AD_OK; k++)
        status = ad_set(program, x[k], at[k]);
    if (status == AD_OK)
        ad_run_checked(program, not_finite);
    ad_program_free(program);
    return status;
}

enum ad_status ad_check_all(ad_var y, size_t n, const ad_var x[], const double *const at[],
                            double tolerance, struct ad_checks *checks)
{
    double asked = tolerance == 0 ? 1e-6 : tolerance;
    struct ad_checks c = {0};
    enum ad_status status =
        ad_check_gradient(y, n, x, at, asked, ENTRIES, checks ? &c.first : NULL);
    if (status == AD_OK)
        status = run_at(y, n, x, at, &c.not_finite);
    if (status == AD_OK && c.not_finite.status == AD_OK)
        status = ad_check_second(y, n, x, at, asked, ENTRIES, &c.second);
    c.passed = status == AD_OK && c.first.passed && c.second.passed;
    if (checks)
        *checks = c;
    return status;
}

static void add(struct ad_text *text, const char *what, const struct ad_check *check, size_t n,
                const ad_var x[])
{
    ad_text_add(text, "  %-15s %-7s worst of %zu entries: %.2g at [%zu, %zu] of ", what,
                check->passed ? "ok" : "FAILED", check->entries, check->worst, check->row,
                check->col);
    if (x && check->input < n && x[check->input].tape)
        ad_describe(text, x[check->input]);
    ad_text_add(text, "\n");
    if (!check->passed || check->cancels)
        ad_text_add(text, "    tape %.9g, difference %.9g%s\n", check->tape, check->difference,
                    check->kink      ? "; a kink is near"
                    : check->cancels ? ": terms cancel, no more is known"
                                     : "");
}

size_t ad_checks_text(const struct ad_checks *checks, size_t n, const ad_var x[], char *to,
                      size_t size)
{
    struct ad_text text = {to, to ? size : 0, 0};
    if (!checks)
        return 0;
    ad_text_add(&text, "  %-15s %s%s\n", "finite there",
                checks->not_finite.status == AD_OK ? "ok" : "FAILED  ", checks->not_finite.message);
    if (checks->not_finite.status != AD_OK)
        return text.length;
    add(&text, "gradient", &checks->first, n, x);
    add(&text, "second order", &checks->second, n, x);
    return text.length;
}
