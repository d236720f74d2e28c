/* Internals of sparse Jacobians: their sparsity pattern (pattern.c, over sets of columns in
   sets.c), the colouring of columns or rows (colours.c), which of these takes the fewest runs
   (directions.c), the seeds and the program (record.c), and its runs (jacobian.c). */
#ifndef AUTODIFF_JACOBIAN_JACOBIAN_H
#define AUTODIFF_JACOBIAN_JACOBIAN_H

#include "autodiff/derivatives.h"
#include "autodiff/internal.h"
#include "autodiff/tape/elements.h"

/* Entries by rows, as in struct ad_sparse. */
struct pattern {
    size_t rows, cols;
    size_t *start;
    uint32_t *col;
};

/* Immutable sets of numbers below `limit`, ascending; number 0 is the empty set. */
struct sets {
    size_t limit;
    size_t *start; /* set k is items[start[k]] up to items[start[k + 1] - 1] */
    uint32_t *items;
    size_t n, max_sets, max_items;
    struct known_union {
        uint32_t a, b, both;
    } * known;              /* hash table of unions */
    uint32_t *stamp, epoch; /* per number: the last union of many sets that contained it */
    bool failed;            /* out of memory */
};

bool ad_sets_init(struct sets *sets, size_t limit);
void ad_sets_free(struct sets *sets);
/* Each returns the number of a set, 0 when out of memory. */
uint32_t ad_set_single(struct sets *sets, uint32_t item);
uint32_t ad_set_union(struct sets *sets, uint32_t a, uint32_t b);
uint32_t ad_set_union_all(struct sets *sets, size_t n, const uint32_t of[]);

/* Which elements of y depend on which of the x; false when out of memory. */
bool ad_pattern_find(struct pattern *pattern, ad_var y, size_t n, const ad_var x[]);
bool ad_pattern_transpose(const struct pattern *pattern, struct pattern *transposed);
void ad_pattern_free(struct pattern *pattern);

/* Colours the columns such that no row has a colour twice; `rows` is the transpose. Returns the
   number of colours, 0 when out of memory; gives up beyond `most` colours and returns more. */
size_t ad_colour_columns(const struct pattern *pattern, const struct pattern *transposed,
                         size_t most, uint32_t *colour);

/* What the runs compute: each the elements of one colour, columns of `pattern` (forward) or rows
   (backward) of `computed`. */
struct directions {
    struct pattern pattern;  /* of the matrix */
    struct pattern computed; /* by the elements of the variables; the same, or with copies */
    size_t n;                /* variables of the runs: those of the matrix, or gathered from them */
    ad_var *x;
    uint32_t *column; /* per column of `computed` that of the matrix; NULL: the same */
    bool forward;
    size_t colours;
    uint32_t *colour;
};

/* Those with the fewest colours. False when out of memory. */
bool ad_directions_choose(struct directions *d, ad_var y, size_t n, const ad_var x[]);
void ad_directions_free(struct directions *d);

/* A variable in the program's memory. */
struct vector {
    void *data;
    size_t size;
};

struct ad_jacobian {
    struct ad_sparse matrix;
    struct directions by;
    double *value;
    ad_program *program;
    enum ad_type type;
    bool at_once;        /* one run computes all colours, by constant seeds */
    bool adds;           /* some entries have several terms */
    struct vector *seed; /* n_seeds of a run */
    ad_var *result;      /* n_results of each colour of a run, on the tape of its recording */
    size_t n_seeds, n_results;
    struct vector *one; /* the results of one colour, where each has a run */
    size_t results;     /* elements of one colour */
    size_t *first_seed; /* per colour, in: */
    size_t *seeds;      /* elements of the seeds that are 1 */
    size_t *first_term; /* per batch of runs, in: */
    uint32_t *term;     /* elements of the results of a batch, or of the program's memory */
    uint32_t *entry;    /* the entry of the matrix each is a term of; NULL: one after the other */
    double *batch;      /* results of its runs, one behind the other */
};

/* Records the program of J, whose directions are known, and compiles it. Results that are copies of
   other values are not computed: element `at` of a result is that of the value it is a copy of. */
bool ad_jacobian_record(ad_jacobian *J, ad_var y);
ad_var ad_jacobian_source(ad_var result, size_t *at);

#endif
