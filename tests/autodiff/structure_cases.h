/* Operations that move or reduce values, each beside its definition, one element at a time. */
#ifndef TESTS_AUTODIFF_STRUCTURE_CASES_H
#define TESTS_AUTODIFF_STRUCTURE_CASES_H

#include "autodiff/autodiff.h"

struct matrix {
    size_t rows, cols;
    const double *v; /* row-major */
};

/* Shape of the second argument, of a first of rows x cols. */
enum second { NONE, SAME, ONE_ROW, ONE_COL, COLS_BY_4, FOUR_BY_COLS, ROWS_BY_4, FOUR_BY_ROWS };

struct structure {
    const char *name;
    /* The value recorded, and element (r, c) of the same by definition; x[0], x[1] are the
       arguments. */
    ad_var (*record)(const ad_var x[2]);
    double (*element)(const struct matrix x[2], size_t r, size_t c);
    enum second second;
    size_t min_cols;
    bool linear; /* in all arguments together */
};

extern const struct structure structure_cases[];
extern const size_t structure_n_cases;

#endif
