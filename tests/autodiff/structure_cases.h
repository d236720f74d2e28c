/* Operations that move or reduce values, each with its definition element by element:
   structure_cases.c; reduction_cases.c for extrema, softmax, cumulative sums and index lists of
   columns; system_cases.c for small systems; custom_cases.c for a user's own. */
#ifndef TESTS_AUTODIFF_STRUCTURE_CASES_H
#define TESTS_AUTODIFF_STRUCTURE_CASES_H

#include "autodiff/autodiff.h"

struct matrix {
    size_t rows, cols;
    const double *v; /* row-major */
};

/* Shape of the second argument, of a first of rows x cols. */
enum second { NONE, SAME, ONE_ROW, ONE_COL, COLS_BY_4, FOUR_BY_COLS, ROWS_BY_4, FOUR_BY_ROWS };

/* Linear in all arguments together; kinked where two elements are equal: all are different then. */
enum nature { SMOOTH, LINEAR, KINKED };

struct structure {
    const char *name;
    /* The value recorded, and element (r, c) of the same by definition; x[0], x[1] are the
       arguments. */
    ad_var (*record)(const ad_var x[2]);
    double (*element)(const struct matrix x[2], size_t r, size_t c);
    enum second second;
    size_t min_cols;
    enum nature nature;
};

/* Shape of the second argument; 0 x 0: none. */
static inline struct matrix structure_second(const struct structure *s, size_t rows, size_t cols)
{
    switch (s->second) {
    case SAME:
        return (struct matrix){rows, cols, NULL};
    case ONE_ROW:
        return (struct matrix){1, cols, NULL};
    case ONE_COL:
        return (struct matrix){rows, 1, NULL};
    case COLS_BY_4:
        return (struct matrix){cols, 4, NULL};
    case FOUR_BY_COLS:
        return (struct matrix){4, cols, NULL};
    case ROWS_BY_4:
        return (struct matrix){rows, 4, NULL};
    case FOUR_BY_ROWS:
        return (struct matrix){4, rows, NULL};
    default:
        return (struct matrix){0, 0, NULL};
    }
}

extern const struct structure structure_cases[], reduction_cases[], system_cases[], custom_cases[];
extern const size_t structure_n_cases, reduction_n_cases, system_n_cases, custom_n_cases;

/* Of all tables; NULL behind the last. */
static inline const struct structure *structure_case(size_t k)
{
    if (k < structure_n_cases)
        return &structure_cases[k];
    k -= structure_n_cases;
    if (k < reduction_n_cases)
        return &reduction_cases[k];
    k -= reduction_n_cases;
    if (k < system_n_cases)
        return &system_cases[k];
    k -= system_n_cases;
    return k < custom_n_cases ? &custom_cases[k] : NULL;
}

#endif
