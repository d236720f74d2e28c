/* The command without MPI: one rank. */
#include "ranks.h"

struct ad_ranks *ranks_start(struct ad_error *error)
{
    const char *variable;
    size_t n = ranks_launched(&variable);
    if (n > 1)
        ad_fail(error, AD_E_ARGUMENT,
                "%s: started as %zu processes, but built without MPI; expected one, or a program "
                "of make MPI=1; try env -u %s for runs of their own",
                variable, n, variable);
    return NULL;
}

bool ranks_meet(struct ad_ranks *ranks, bool failed)
{
    (void)ranks, (void)failed;
    return true;
}

void ranks_end(struct ad_ranks *ranks, bool met, int status)
{
    (void)ranks, (void)met, (void)status;
}
