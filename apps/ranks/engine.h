/* What mpi.so has, which make MPI=1 builds beside the command: mpi.c, the one place that calls MPI.
   A command that runs alone neither links nor loads it. */
#ifndef APPS_RANKS_ENGINE_H
#define APPS_RANKS_ENGINE_H

#include "ranks.h"

struct ranks_engine {
    const char *version; /* of the command that it belongs to */
    /* As the functions of ranks.h, of `launched` processes, more than one by that variable. */
    struct ad_ranks *(*start)(size_t launched, const char *variable, struct ad_error *error);
    bool (*meet)(struct ad_ranks *ranks, bool failed);
    void (*end)(struct ad_ranks *ranks, bool met, int status);
};
extern const struct ranks_engine ranks_engine;

#endif
