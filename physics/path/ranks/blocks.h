/* A rank's share of a path, block by block: what evaluates it, and the sums over all ranks. */
#ifndef PHYSICS_PATH_RANKS_BLOCKS_H
#define PHYSICS_PATH_RANKS_BLOCKS_H

#include "path_ranks.h"
#include "physics/action/hessian.h"
#include "physics/path/internal.h"

/* Elements of a path in blocks of `length`, the last one shorter. */
struct phys_blocks {
    size_t elements, length, count;
};
struct phys_blocks phys_blocks_of(size_t elements);
/* The first element of a block; beyond the last the number of elements. */
size_t phys_block_first(const struct phys_blocks *blocks, size_t block);

struct phys_ranked_path {
    struct ad_ranks *ranks;
    const struct phys_system *system;
    const struct phys_path_settings *settings;
    struct phys_blocks blocks;
    size_t begin, end;    /* blocks of this rank */
    size_t rows, columns; /* of its share, which begins with slice `first` */
    size_t first;
    struct phys_hessian hessian; /* of one block: phys_ranked_load */
    double *block;               /* [rows x length + 1]: its part of the path */
    const double *path;          /* share under evaluation */
    const double *factor[2];     /* of products that are summed */
    double *g;                   /* [rows x columns]: gradient of the action there, 0 where held */
    double *scale;               /* [dof]: 1 / sqrt of the stiffness at the start */
    double *ends;                /* [3][dof] room */
    double energy, range[2];     /* v L_v - L at the first point (rank 0), and its range here */
};

/* AD_E_ARGUMENT for what paths over ranks do not do. */
enum ad_status phys_ranked_check(const struct phys_system *system,
                                 const struct phys_path_settings *settings,
                                 const struct phys_solver *solver, struct ad_error *error);
/* Ends with phys_ranked_free, whatever it returned. With `second` for second derivatives, too. */
enum ad_status phys_ranked_new(struct phys_ranked_path *p, struct ad_ranks *ranks,
                               const struct phys_system *system,
                               const struct phys_path_settings *settings, bool second,
                               struct ad_error *error);
void phys_ranked_free(struct phys_ranked_path *p);
/* Units of the coordinates, from the second derivatives in the first block. */
enum ad_status phys_ranked_scale(struct phys_ranked_path *p, struct ad_error *error);

/* Block b of p->path into p->block, and its size into p->hessian. Returns when it begins. */
double phys_ranked_load(struct phys_ranked_path *p, size_t b);

/* Sums over a whole path. */
struct phys_ranked_sums {
    double action, kinetic; /* integrals of L and of v L_v / 2 */
    double plain, scaled;   /* squares of the gradient, and of that times scale */
};
/* Evaluates p->path: p->g and the sums. */
enum ad_status phys_ranked_gradient(struct phys_ranked_path *p, struct phys_ranked_sums *sums,
                                    struct ad_error *error);
/* Sums of products over a whole path of shares a and b, plain and times scale of both, the last
   slice left out. */
enum ad_status phys_ranked_products(struct phys_ranked_path *p, const double *a, const double *b,
                                    double sums[2], struct ad_error *error);
/* The least of all ranks' range[0] and the largest range[1], on every rank. */
enum ad_status phys_ranked_range(struct phys_ranked_path *p, double range[2],
                                 struct ad_error *error);

#endif
