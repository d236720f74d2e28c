/* --periodic: the periodic motion near the start, and its multipliers. */
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum ad_status simulate_periodic(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    const struct phys_scene *scene = run->system.scene;
    const size_t dof = run->system.dof;
    struct ad_error cause = {0};
    if (isnan(o->periodic))
        return AD_OK;
    if (o->hold && strcmp(o->hold, "period") != 0 && strcmp(o->hold, "energy") != 0)
        return ad_fail(error, AD_E_ARGUMENT, "--hold: expected period or energy, got '%s'",
                       o->hold);
    if (!(run->start = calloc(2 * dof, sizeof *run->start)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    const struct phys_periodic_settings how = {.size = sizeof how,
                                               .x = run->start,
                                               .period = o->periodic,
                                               .hold_period = o->hold && *o->hold == 'p',
                                               .hold_energy = o->hold && *o->hold == 'e',
                                               .proceed = run->settings.proceed,
                                               .choreography = o->choreography};
    if (scene->start(run->system.params, o->common.seed, run->start, run->start + dof, &cause) !=
            AD_OK ||
        phys_periodic_find(&run->system, &how, &run->periodic, &cause) != AD_OK)
        return simulate_refuse("--periodic: ", &cause, error);
    memcpy(run->start, run->periodic.x, 2 * dof * sizeof *run->start);
    run->settings.q = run->start;
    run->settings.v = run->start + dof;
    run->settings.time = isnan(o->time) ? run->periodic.period : o->time;
    return AD_OK;
}

void simulate_report_periodic(const struct simulate_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_periodic *p = &run->periodic;
    if (p->n == 0)
        return;
    report_number(report, "period", "period", scene->time_unit,
                  phys_known_digits(p->period, 0.1 * p->uncertainty));
    report_number(report, "period_uncertainty", "  known to", scene->time_unit, p->uncertainty);
    report_number(report, "closure", "  after it, from the start", "of its size", p->closure);
    report_count(report, "turns", p->turns > 1 ? "  goes round in it" : NULL, p->turns);
    report_list(report, "periodic_start", NULL, NULL, p->n, p->x);
    report_text(report, "kind", "", phys_periodic_word(p->kind));
    for (size_t k = 0; k < p->n; k++) {
        const struct phys_multiplier *m = &p->multiplier[k];
        const double size = hypot(m->re, m->im), off = 0.1 * m->uncertainty;
        report_item(report, "multipliers");
        report_count(report, "number", "multiplier", k + 1);
        report_number(report, "re", "real", NULL, phys_known_digits(m->re, off));
        report_number(report, "im", "imaginary", NULL, phys_known_digits(m->im, off));
        report_number(report, "modulus", "modulus", NULL, phys_known_digits(size, off));
        report_number(report, "angle", "turns", NULL,
                      phys_known_digits(atan2(m->im, m->re) / (2 * M_PI), off / (2 * M_PI * size)));
        report_number(report, "uncertainty", "+-", NULL,
                      phys_known_digits(m->uncertainty, 0.01 * m->uncertainty));
    }
    report_item(report, NULL);
}
