/* The ranks on which the command runs, by an engine that is loaded where there are more than one
   (engine.h). */
#ifndef APPS_RANKS_RANKS_H
#define APPS_RANKS_RANKS_H

#include "autodiff/ranks.h"

/* Joins the ranks that mpirun, mpiexec or srun started; NULL where there is none but this one.
   AD_E_ARGUMENT where there are others that this program cannot reach. From then on standard output
   of ranks above 0 is discarded. */
struct ad_ranks *ranks_start(struct ad_error *error);
/* Waits until all ranks call it, after an error for a few seconds at most; whether they did. */
bool ranks_meet(struct ad_ranks *ranks, bool failed);
/* Leaves the other ranks, or, where they have not been met, ends them all. Takes NULL. */
void ranks_end(struct ad_ranks *ranks, bool met, int status);

/* Rank 0 reports on standard error, unless quiet, how many seconds the ranks waited for each other
   or sent. All ranks call it (waits.c). */
void ranks_tell_waits(struct ad_ranks *ranks, bool quiet);

/* The number of processes that a launcher of this or another MPI started, by its environment
   variable, which is named; 1: no launcher (launcher.c). */
size_t ranks_launched(const char **variable);

#endif
