/* The report of a periodic motion (periodic.h). */
#include "apps/output/periodic.h"

#include <math.h>

void report_periodic(const struct phys_system *system, const struct phys_periodic *p,
                     struct report *report)
{
    const struct phys_scene *scene = system->scene;
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
