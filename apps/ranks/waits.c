/* Reports at the end of a run which ranks waited, and for which (ranks.h). */
#include "ranks.h"

#include <stdio.h>
#include <stdlib.h>

void ranks_tell_waits(struct ad_ranks *ranks, bool quiet)
{
    struct ad_error error = {0};
    size_t least = 0, most = 0;
    double mine = ranks->seconds, *all = malloc(ranks->count * sizeof *all);
    if (all && ad_ranks_gather(ranks, &mine, sizeof mine, all, &error) == AD_OK && !quiet &&
        ranks->rank == 0) {
        for (size_t k = 1; k < ranks->count; k++) {
            least = all[k] < all[least] ? k : least;
            most = all[k] > all[most] ? k : most;
        }
        if (all[most] > 0)
            fprintf(stderr, "%zu ranks: waited %.3g s (rank %zu) to %.3g s (rank %zu)\n",
                    ranks->count, all[least], least, all[most], most);
    }
    free(all);
}
