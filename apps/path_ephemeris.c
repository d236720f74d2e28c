/* The ephemeris scene from Horizons tables (path.h). */
#include "path.h"

#include <string.h>

enum ad_status path_ephemeris(const struct path_options *options, struct path_run *run,
                              double **observed, struct ad_error *error)
{
    (void)options;
    (void)run;
    *observed = NULL;
    return error->status;
}
