/* Which --set keeps a motion from beginning. */
#ifndef APPS_SET_FAULT_H
#define APPS_SET_FAULT_H

#include "options.h"

/* The --set without which the motion of the scene can begin; NULL: none, or several. */
const struct phys_setting *set_fault(const struct common *common);
/* AD_E_ARGUMENT, naming that --set, if the motion of the system cannot begin because of it. */
enum ad_status set_check(const struct common *common, const struct phys_system *system,
                         struct ad_error *error);

#endif
