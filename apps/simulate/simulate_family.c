/* --continue: the family of the periodic motion, followed in its energy, its period or a parameter;
   its report, table and picture. */
#include "apps/output/figure.h"
#include "apps/output/report.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const kinds[] = {"",      "fold",    "branch", "doubling",
                                    "torus", "halving", "rest",   "change"};

enum ad_status simulate_family_read(struct simulate_run *run, struct ad_error *error)
{
    const size_t dof = run->system.dof;
    const char *text = run->options->follow, *is = strchr(text, '=');
    const size_t length = is ? (size_t)(is - text) : 0;
    double from;
    if (options_range(text, run->along, sizeof run->along, &from, &run->to)) {
        if (strcmp(run->along, "energy") == 0 || strcmp(run->along, "period") == 0)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--continue: the %s begins at that of the motion found; expected %s=TO",
                           run->along, run->along);
        const struct settings *set = &run->options->common.set;
        for (size_t k = 0; k < set->n; k++)
            if (strcmp(set->setting[k].name, run->along) == 0)
                return ad_fail(error, AD_E_ARGUMENT,
                               "--continue does not go with --set %s: it sets that parameter",
                               run->along);
        return phys_system_set(&run->system, run->along, from, error) != AD_OK ||
                       run->system.dof == dof
                   ? error->status
                   : ad_fail(error, AD_E_ARGUMENT,
                             "--continue %s: it changes the number of coordinates", run->along);
    }
    if (length == 0 || length >= sizeof run->along || !options_number(is + 1, &run->to))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--continue: expected energy=TO, period=TO or PARAMETER=FROM:TO, as in "
                       "mu=0.01:0.5, got '%s'",
                       text);
    memcpy(run->along, text, length);
    run->along[length] = 0;
    return AD_OK;
}

static enum ad_status read_hold(const struct simulate_run *run, enum phys_family_hold *hold,
                                struct ad_error *error)
{
    const char *text = run->options->hold;
    char product[80];
    snprintf(product, sizeof product, "period*%s", run->along);
    *hold = !text                         ? PHYS_HOLD_NOTHING
            : strcmp(text, "period") == 0 ? PHYS_HOLD_PERIOD
            : strcmp(text, "energy") == 0 ? PHYS_HOLD_ENERGY
            : strcmp(text, product) == 0  ? PHYS_HOLD_PRODUCT
                                          : (enum phys_family_hold) - 1;
    return *hold != (enum phys_family_hold) - 1
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "--hold: expected period, energy or %s, got '%s'",
                         product, text);
}

enum ad_status simulate_family(struct simulate_run *run, const double *x, double period,
                               struct ad_error *error)
{
    struct phys_family_settings how = {.size = sizeof how,
                                       .x = x,
                                       .period = period,
                                       .along = run->along,
                                       .to = run->to,
                                       .proceed = run->settings.proceed};
    struct phys_family *family = &run->family;
    struct ad_error cause = {0};
    const double cross = option_number_or(run->options->cross, 0);
    how.cross = fabs(cross) <= PHYS_BRANCHES_MOST ? (int)cross : 0;
    if (!isnan(run->options->cross) && (how.cross == 0 || how.cross != cross))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--cross: expected the number of a branch point, 1 or more, or negative for "
                       "its other side, got %g",
                       cross);
    if (read_hold(run, &how.hold, error) != AD_OK)
        return error->status;
    if (phys_family_follow(&run->system, &how, family, &cause) != AD_OK)
        return simulate_refuse("--continue: ", &cause, error);
    size_t last = family->n - 1;
    while (last > 0 && family->member[last].mark == PHYS_MARK_REST)
        last--;
    run->periodic = family->member[last].motion;
    if (strcmp(run->along, "energy") != 0 && strcmp(run->along, "period") != 0)
        phys_system_set(&run->system, run->along, family->member[last].value, error);
    return error->status;
}

enum ad_status simulate_family_judge(const struct simulate_run *run, struct ad_error *error)
{
    const struct phys_family *f = &run->family;
    if (f->n == 0 || f->end == PHYS_FAMILY_REACHED)
        return AD_OK;
    const struct phys_family_member *last = &f->member[f->n - 1];
    const char *text = run->options->follow;
    switch (f->end) {
    case PHYS_FAMILY_RETURNED:
        return ad_fail(error, AD_E_ACCURACY,
                       "--continue %s: not reached; the family turns back, and is beyond its "
                       "beginning at %s = %.9g",
                       text, run->along, last->value);
    case PHYS_FAMILY_CLOSED:
        return ad_fail(error, AD_E_ACCURACY,
                       "--continue %s: not reached; the family comes back to its first motion",
                       text);
    case PHYS_FAMILY_ENDS:
        return ad_fail(error, AD_E_ACCURACY, "--continue %s: not reached; at %s = %.9g, %s", text,
                       run->along, last->value, phys_family_mark_word(last->mark));
    case PHYS_FAMILY_LOST:
        return ad_fail(error, AD_E_ACCURACY,
                       "--continue %s: lost beyond %s = %.9g, period %.6g: %s", text, run->along,
                       last->value, last->motion.period, f->lost);
    default:
        return ad_fail(error, AD_E_ACCURACY,
                       "--continue %s: not reached after %zu motions; the last is at %s = %.9g",
                       text, f->n, run->along, last->value);
    }
}

/* ---- report ---- */

enum quantity { VALUE, PERIOD, ENERGY, MODULUS, COLUMNS };

static double column_of(const struct phys_family_member *m, enum quantity column)
{
    return column == VALUE        ? m->value
           : column == PERIOD     ? m->motion.period
           : column == ENERGY     ? m->energy
           : m->motion.multiplier ? hypot(m->motion.multiplier->re, m->motion.multiplier->im)
                                  : (double)NAN;
}

static void report_marks(const struct simulate_run *run, struct report *report)
{
    const struct phys_family *f = &run->family;
    const struct phys_scene *scene = run->system.scene;
    const bool energies = strcmp(run->along, "energy") == 0,
               periods = strcmp(run->along, "period") == 0;
    for (size_t k = 0; k < f->n; k++) {
        const struct phys_family_member *m = &f->member[k];
        if (m->mark == PHYS_MARK_NONE)
            continue;
        report_item(report, "marks");
        report_count(report, "number", "motion", k + 1);
        report_number(report, "value", run->along, NULL,
                      phys_known_digits(m->value, 0.1 * m->uncertainty));
        report_number(report, "uncertainty", "+-", NULL,
                      phys_known_digits(m->uncertainty, 0.01 * m->uncertainty));
        report_number(report, "period", periods ? NULL : "period", scene->time_unit,
                      phys_known_digits(m->motion.period, 0.1 * m->motion.uncertainty));
        report_number(report, "energy", energies ? NULL : "energy", scene->energy_unit, m->energy);
        report_text(report, "mark", "", kinds[m->mark]);
    }
    report_item(report, NULL);
    for (enum phys_family_mark mark = PHYS_MARK_FOLD; mark <= PHYS_MARK_CHANGE; mark++)
        for (size_t k = 0; k < f->n; k++)
            if (f->member[k].mark == mark) {
                report_line(report, "  %-24s %s", kinds[mark], phys_family_mark_word(mark));
                break;
            }
}

void simulate_family_report(const struct simulate_run *run, struct report *report)
{
    static const char *const keys[] = {"family_values", "family_periods", "family_energies",
                                       "family_moduli"};
    const struct phys_family *f = &run->family;
    if (f->n == 0)
        return;
    double *list = malloc(f->n * sizeof *list);
    report->failed = report->failed || !list;
    report_line(report, "  family followed in %s from %.9g to %.9g: %zu motions", run->along,
                f->member[0].value, f->member[f->n - 1].value, f->n);
    report_text(report, "family_along", NULL, run->along);
    for (size_t c = 0; c < COLUMNS && list; c++) {
        for (size_t k = 0; k < f->n; k++)
            list[k] = column_of(&f->member[k], (enum quantity)c);
        report_list(report, keys[c], NULL, NULL, f->n, list);
    }
    free(list);
    report_marks(run, report);
}

/* ---- tables ---- */

void simulate_family_csv(const struct simulate_run *run, FILE *out)
{
    const struct phys_family *f = &run->family;
    const size_t d = 2 * run->system.dof;
    char name[SIMULATE_NAME];
    fputs("number,value,uncertainty,mark,period,period_uncertainty,energy,closure", out);
    for (size_t k = 0; k < d; k++) {
        simulate_quantity(&run->system, k, name);
        fprintf(out, ",%s", name);
    }
    for (size_t k = 0; k < d; k++)
        fprintf(out, ",multiplier%zu,multiplier%zu_imaginary", k + 1, k + 1);
    fputc('\n', out);
    for (size_t i = 0; i < f->n; i++) {
        const struct phys_family_member *m = &f->member[i];
        const struct phys_periodic *p = &m->motion;
        fprintf(out, "%zu,%.17g,%.3g,%s,%.17g,%.3g,%.17g,%.3g", i + 1, m->value, m->uncertainty,
                kinds[m->mark], p->period, p->uncertainty, m->energy, p->closure);
        for (size_t k = 0; k < d; k++)
            fprintf(out, ",%.17g", p->x[k]);
        for (size_t k = 0; k < d; k++)
            fprintf(out, ",%.17g,%.17g", p->multiplier ? p->multiplier[k].re : NAN,
                    p->multiplier ? p->multiplier[k].im : NAN);
        fputc('\n', out);
    }
}

enum ad_status simulate_family_file(const struct simulate_run *run, phys_hdf5 *file,
                                    struct ad_error *error)
{
    const struct phys_family *f = &run->family;
    const size_t d = 2 * run->system.dof;
    if (f->n == 0)
        return AD_OK;
    double *x = malloc(3 * f->n * d * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *multiplier = x + f->n * d;
    for (size_t i = 0; i < f->n; i++) {
        const struct phys_periodic *p = &f->member[i].motion;
        memcpy(x + i * d, p->x, d * sizeof *x);
        for (size_t k = 0; k < d; k++) {
            multiplier[2 * (i * d + k)] = p->multiplier ? p->multiplier[k].re : NAN;
            multiplier[2 * (i * d + k) + 1] = p->multiplier ? p->multiplier[k].im : NAN;
        }
    }
    phys_hdf5_folder(file, "family");
    phys_hdf5_write(file, "family/state", AD_F64, 2, (size_t[]){f->n, d}, x);
    phys_hdf5_text(file, "family/state", "axes", "motion, coordinates and velocities");
    phys_hdf5_write(file, "family/multiplier", AD_F64, 3, (size_t[]){f->n, d, 2}, multiplier);
    phys_hdf5_text(file, "family/multiplier", "axes", "motion, multiplier, real and imaginary");
    free(x);
    return AD_OK;
}
