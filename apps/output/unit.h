/* Units in what people read. */
#ifndef APPS_UNIT_H
#define APPS_UNIT_H

#include <string.h>

/* Pure numbers carry the unit 1, which a reader need not see. */
static inline const char *unit_shown(const char *unit)
{
    return unit && strcmp(unit, "1") != 0 ? unit : "";
}

#endif
