/* Paths that the tests of ranks solve, and what each rank says of them. */
#ifndef TESTS_PHYSICS_PATH_PATH_JOBS_H
#define TESTS_PHYSICS_PATH_PATH_JOBS_H

#include "autodiff/ranks.h"
#include "physics/physics.h"

enum { PATH_JOB_RANKS = 4, PATH_TASKS = 5 };

struct path_task {
    const char *scene, *rule;
    size_t slices;
    double dt, bend; /* bend: how far the start is from the motion */
    bool ring;       /* of ten sites, whose element matrices have another order */
};

extern const struct path_task path_tasks[PATH_TASKS];

struct path_job {
    const struct phys_solver *solver;
    struct phys_system system;
    struct phys_path_settings settings;
    size_t rows;
    const double *start;     /* [rows x slices] */
    double *path, *gradient; /* [rows x slices] */
    struct phys_path_info info[PATH_JOB_RANKS];
    struct phys_path_figures figures[PATH_JOB_RANKS];
    struct phys_spectrum spectrum[PATH_JOB_RANKS];
    struct ad_error error[PATH_JOB_RANKS];
};

/* Columns of a share from those of the whole path, or back, but for its last one's inner nodes. */
void path_job_copy_share(const struct path_job *j, const struct phys_path_share *s, double *share,
                         double *whole, bool back);
/* Gradient, path and spectrum of this rank. */
void path_job_work(void *context, struct ad_ranks *ranks);
struct path_job path_job_of(const struct path_task *task, const char *solver);
void path_job_free(struct path_job *j);
/* The largest difference of two paths, but for the unused nodes of the last column. */
double path_job_apart(const struct path_job *j, const double *a, const double *b);

#endif
