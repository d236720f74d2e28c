/* The number of processes started by a launcher, from its environment variables (ranks.h). */
#include "ranks.h"

#include <stdlib.h>

size_t ranks_launched(const char **variable)
{
    /* Open MPI; MPICH and others by PMI; srun, but not the script of sbatch. */
    static const char *const names[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        const char *text = getenv(names[k]);
        unsigned long long n = text ? strtoull(text, NULL, 10) : 0;
        *variable = names[k];
        if (n > 1)
            return (size_t)n;
    }
    return 1;
}
