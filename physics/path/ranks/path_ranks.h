/* Paths over ranks (autodiff/ranks.h): each rank has a share of the slices, and memory for no more.
   The path is cut into blocks of elements that its number of slices fixes, of which each rank has
   whole ones; sums, and the elimination of Newton's method, go over the blocks by a fixed tree.
   Every result is the same bits for any number of ranks.

   All ranks call the same functions with the same arguments, but for their share of the path; all
   get the same status and message. Units are the scene's. Errors: as in path.h, and AD_E_IO where a
   function of the ranks failed. `ranks` NULL: one rank, alone.
   Threads: as in path.h; a struct ad_ranks is used by one at a time. */
#ifndef PHYSICS_PATH_RANKS_PATH_RANKS_H
#define PHYSICS_PATH_RANKS_PATH_RANKS_H

#include "autodiff/ranks.h"
#include "physics/path/path.h"

AD_HEADER_BEGIN

/* Slices first ... first + slices - 1 of a path. The last of them is the first of the next rank's
   share as well: both have it. A share of a path is [degree*dof x slices]; of its last column the
   inner nodes are unused. */
struct phys_path_share {
    size_t first, slices;
};
/* The share of a rank, of a path of `slices` slices. AD_E_ARGUMENT: there are more ranks than
   blocks, of which there are one for every 4 to 128 elements. */
enum ad_status phys_path_share(const struct ad_ranks *ranks, size_t rank, size_t slices,
                               struct phys_path_share *share, struct ad_error *error);

/* This rank's share of a path to begin with, [degree*dof x its slices]: the motion of the scene
   from its start for a seed, or the line between its ends; ends [dof][2] that are not NULL are met,
   by that line, or by a linear function of time added to the motion. Every rank follows the whole
   motion. AD_E_ARGUMENT: a scene without a start. */
enum ad_status phys_path_ranks_start(struct ad_ranks *ranks, const struct phys_system *system,
                                     const struct phys_path_settings *settings, uint64_t seed,
                                     bool line, const double *ends, double *path,
                                     struct ad_error *error);

/* Action and means of a path, and the norm of the gradient of action_mean; `gradient`, of the
   shape of the share, receives that gradient, 0 where the path is held. Each rank exchanges one
   slice with each of its neighbours. path: [degree*dof x slices of the share]. Of the settings
   rule, slices and dt count, and those that phys_path_ranks_solve refuses. */
enum ad_status phys_path_ranks_gradient(struct ad_ranks *ranks, const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        const double *path, double *gradient,
                                        struct phys_path_figures *figures, struct ad_error *error);

/* As phys_path_solve with newton, lbfgs, adam or sgd, for this rank's share of the path. Newton's
   system is eliminated block by block, and the slices between blocks by a tree; where a step does
   not make the gradient smaller it is halved, not damped. AD_E_ARGUMENT: another solver; a rule
   that counts the last slice twice; adam_steps of more than 0 with another than newton; hold, ends,
   mesh, reference, compare, start_momentum, or a penalty on the energy. progress is called with
   path NULL, on all ranks, of which rank 0 decides; proceed is not called. info as there,
   `compared` is NaN. */
enum ad_status phys_path_ranks_solve(struct ad_ranks *ranks, const struct phys_solver *solver,
                                     const struct phys_system *system,
                                     const struct phys_path_settings *settings, double *path,
                                     struct phys_path_info *info, struct ad_error *error);

/* The kind of a stationary path, of which `path` is the share [degree*dof x its slices]: of the
   spectrum legendre, not_definite, index, and whether it is undetermined as an eigenvalue is zero
   within rounding; the rest is unset, NaN or 0. The index is the inertia of the factors of Newton's
   method. Nothing to be freed. */
enum ad_status phys_path_ranks_spectrum(struct ad_ranks *ranks, const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        const double *path, struct phys_spectrum *spectrum,
                                        struct ad_error *error);

AD_HEADER_END
#endif
