/* Sparse symmetric systems, real or complex, by fronts (Duff and Reid, ACM Trans. Math. Softw. 9,
   1983). Unknowns are eliminated in groups; those of a group and all that they are beside by then
   make a dense matrix, of which what is left adds to the front of a later group. Pivots are chosen
   within a group. */
#ifndef PHYSICS_LINEAR_FRONTS_H
#define PHYSICS_LINEAR_FRONTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct phys_front {
    size_t first, pivots; /* unknowns, by their order */
    size_t rows, row;     /* how many later ones they are beside, ascending from fronts.row[row] */
    size_t child, next;   /* numbers of fronts, plus 1: one that adds to this, one beside this */
    size_t at;            /* values[at]: [pivots x pivots], then [pivots x rows], by columns */
};

struct phys_fronts {
    size_t n, count, placed;    /* unknowns; fronts; unknowns in fronts so far */
    struct phys_front *front;   /* [count]: in order of elimination */
    uint32_t *order, *position; /* [n]: which unknown is where; where unknown u is */
    uint32_t *of;               /* [n]: the front that eliminates at a position */
    uint32_t *row, *local;      /* all rows; [n] room */
    size_t rows, size;          /* how many `row` and `values` have */
    size_t most;                /* pivots times rows of the largest front */
    double operations, bytes;   /* on real numbers; of all factors and what they take meanwhile */
    size_t parts, room;         /* of a number: 1 or 2; numbers in `values` and `work` */
    double *values, *work;
    double **left; /* [count]: what is left of a front until it is added */
    int *pivots;   /* [n] */
};

/* Room for n unknowns. Ends with phys_fronts_free, whatever it returned. False: no memory. */
bool phys_fronts_new(struct phys_fronts *fronts, size_t n);
void phys_fronts_free(struct phys_fronts *fronts);
/* Adds unknown u to the front that is being made; begins the next one. */
void phys_fronts_add(struct phys_fronts *fronts, size_t u);
void phys_fronts_next(struct phys_fronts *fronts);
/* Lists the unknowns that u is coupled to, at most n of them, and returns how many. */
typedef size_t phys_fronts_beside(const void *context, size_t u, uint32_t *to);
/* Finds the rows of all fronts, which have all unknowns. False: no memory. */
bool phys_fronts_link(struct phys_fronts *fronts, phys_fronts_beside *beside, const void *context);
/* Which of the values entry (i, j) is; SIZE_MAX: only (j, i) is. */
size_t phys_fronts_place(const struct phys_fronts *fronts, size_t i, size_t j);
/* All entries 0, of numbers of 1 or 2 parts: values[parts * place + part]. False: no memory. */
bool phys_fronts_clear(struct phys_fronts *fronts, size_t parts);
/* False: singular, or what is left grows so far that a group alone is nearly so; or no memory,
   which `no_memory` then says. */
bool phys_fronts_factor(struct phys_fronts *fronts, bool *no_memory);
/* x [n], of numbers of as many parts, becomes the solution. */
void phys_fronts_solve(struct phys_fronts *fronts, double *x);

#endif
