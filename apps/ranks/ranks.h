/* The ranks on which the command runs. One of two files is linked: mpi.c by make MPI=1, the one
   place that calls MPI; else alone.c. */
#ifndef APPS_RANKS_RANKS_H
#define APPS_RANKS_RANKS_H

#include "autodiff/ranks.h"

/* Joins the ranks that mpirun, mpiexec or srun started; NULL where there is none but this one.
   AD_E_ARGUMENT where there are others that this program cannot reach. Standard output of ranks
   above 0 goes nowhere from then on. */
struct ad_ranks *ranks_start(struct ad_error *error);
/* Whether all ranks have come here: waits for them, after an error for some seconds at most. */
bool ranks_meet(struct ad_ranks *ranks, bool failed);
/* Leaves the other ranks, or, where they have not been met, ends them all. Takes NULL. */
void ranks_end(struct ad_ranks *ranks, bool met, int status);

/* How many seconds the ranks waited for each other, or sent: rank 0 says so
   on standard error unless it is quiet. All call it (waits.c). */
void ranks_tell_waits(struct ad_ranks *ranks, bool quiet);

/* How many processes a launcher of this or of another MPI says that it has started, and the
   variable of the environment where it does; 1: no launcher (launcher.c). */
size_t ranks_launched(const char **variable);

#endif
