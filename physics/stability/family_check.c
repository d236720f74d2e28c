/* What families are refused (family_parts.h). */
#include "family_parts.h"

#include <math.h>

enum ad_status phys_family_check_numbers(const struct phys_system *system,
                                         const struct phys_family_settings *s,
                                         struct ad_error *error)
{
    if (!(s->period > 0) || !isfinite(s->period))
        return ad_fail(error, AD_E_ARGUMENT, "period: expected more than 0, got %g", s->period);
    if (!isfinite(s->to))
        return ad_fail(error, AD_E_ARGUMENT, "%s to %g: expected a number", s->along, s->to);
    if (s->hold < PHYS_HOLD_NOTHING || s->hold > PHYS_HOLD_PRODUCT)
        return ad_fail(error, AD_E_ARGUMENT, "hold = %d: no such choice", (int)s->hold);
    if (s->cross < -PHYS_BRANCHES_MOST || s->cross > PHYS_BRANCHES_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "cross = %d: expected -%d to %d", s->cross,
                       PHYS_BRANCHES_MOST, PHYS_BRANCHES_MOST);
    for (size_t i = 0; i < 2 * system->dof; i++)
        if (!isfinite(s->x[i]))
            return ad_fail(error, AD_E_ARGUMENT, "x[%zu] = %g; expected a finite start", i,
                           s->x[i]);
    return system->dof <= PHYS_PERIODIC_DOF
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT,
                         "%s: families of motions of %zu coordinates; expected at most %d",
                         system->scene->name, system->dof, PHYS_PERIODIC_DOF);
}

enum ad_status phys_family_check(struct family_run *run, struct ad_error *error)
{
    const struct phys_family_settings *s = run->settings;
    const bool conserves = run->timeless && run->symplectic;
    const char *name = run->system.scene->name;
    if (run->along != ALONG_PARAMETER && !conserves)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s does not conserve energy: its periodic motions have no family in the "
                       "%s; expected a parameter",
                       name, s->along);
    if (run->along != ALONG_PARAMETER && s->hold != PHYS_HOLD_NOTHING)
        return ad_fail(error, AD_E_ARGUMENT, "nothing is held in a family in the %s", s->along);
    if (run->along != ALONG_PARAMETER)
        return error->status;
    if (conserves ? s->hold != PHYS_HOLD_ENERGY && s->hold != PHYS_HOLD_PERIOD
                  : run->timeless != (s->hold == PHYS_HOLD_NOTHING) || s->hold == PHYS_HOLD_ENERGY)
        return ad_fail(error, AD_E_ARGUMENT, "%s: a family in %s holds %s", name, s->along,
                       conserves       ? "energy or period; expected one of them as `hold`"
                       : run->timeless ? "nothing; expected no `hold`"
                                       : "the period, or its product with a frequency, as `hold`");
    return error->status;
}
