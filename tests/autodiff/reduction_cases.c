/* Reductions, cumulative sums and lists of columns of structure_cases.h. */
#include "structure_cases.h"

#include <math.h>

static double at(const struct matrix *m, size_t r, size_t c) { return m->v[r * m->cols + c]; }

/* Row r or column c as a whole: element k. */
struct line {
    const struct matrix *m;
    size_t n, r, c;
    bool rows;
};

static struct line line(const struct matrix *m, bool rows, size_t r, size_t c)
{
    return (struct line){m, rows ? m->rows : m->cols, r, c, rows};
}

static double element(const struct line *l, size_t k)
{
    return l->rows ? at(l->m, k, l->c) : at(l->m, l->r, k);
}

static double largest(const struct line *l)
{
    double most = -INFINITY;
    for (size_t k = 0; k < l->n; k++)
        most = fmax(most, element(l, k));
    return most;
}

static double smallest(const struct line *l)
{
    double least = INFINITY;
    for (size_t k = 0; k < l->n; k++)
        least = fmin(least, element(l, k));
    return least;
}

static double place_of_largest(const struct line *l)
{
    size_t best = 0;
    for (size_t k = 0; k < l->n; k++)
        if (element(l, k) > element(l, best))
            best = k;
    return (double)best;
}

static double log_sum(const struct line *l)
{
    double s = 0;
    for (size_t k = 0; k < l->n; k++)
        s += exp(element(l, k));
    return log(s);
}

static double share(const struct line *l) { return exp(at(l->m, l->r, l->c) - log_sum(l)); }

static double sum_so_far(const struct line *l)
{
    double s = 0;
    for (size_t k = 0; k <= (l->rows ? l->r : l->c); k++)
        s += element(l, k);
    return s;
}

#define OVER(name, suffix, rows, definition)                                                       \
    static ad_var name##_##suffix(const ad_var x[2]) { return ad_##name##_##suffix(x[0]); }        \
    static double name##_##suffix##_element(const struct matrix x[2], size_t r, size_t c)          \
    {                                                                                              \
        const struct line l = line(x, rows, r, c);                                                 \
        return definition(&l);                                                                     \
    }
#define BOTH(name, definition)                                                                     \
    OVER(name, rows, true, definition)                                                             \
    OVER(name, cols, false, definition)
BOTH(max, largest)
BOTH(min, smallest)
BOTH(arg_max, place_of_largest)
BOTH(log_sum_exp, log_sum)
BOTH(softmax, share)
BOTH(cumsum, sum_so_far)

/* The largest of what is far beyond the range of exp. */
static ad_var log_sum_exp_large(const ad_var x[2])
{
    return ad_mul(1e-4, ad_log_sum_exp_cols(ad_mul(1e4, x[0])));
}

static double log_sum_exp_large_element(const struct matrix x[2], size_t r, size_t c)
{
    const struct line l = line(x, false, r, c);
    double s = 0, most = largest(&l);
    for (size_t k = 0; k < l.n; k++)
        s += exp(1e4 * (element(&l, k) - most));
    return most + 1e-4 * log(s);
}

/* ---- lists of columns ---- */

enum { LIST = 2100, WIDTH = 5 };

static size_t picked(size_t k, size_t n) { return (k * k * 5 + k * 3 + n - 1) % n; }

static ad_var gather_cols(const ad_var x[2])
{
    uint32_t list[LIST];
    size_t n = 2 * ad_cols(x[0]) + 1;
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)picked(k, ad_cols(x[0]));
    return ad_gather_cols(x[0], n, list);
}

static double gather_cols_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x, r, picked(c, x->cols));
}

/* Of a repeated row, which is no plain memory. */
static ad_var gather_cols_repeated(const ad_var x[2])
{
    return gather_cols((ad_var[2]){ad_broadcast(ad_row(x[0], 0), 3, ad_cols(x[0]))});
}

static double gather_cols_repeated_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return gather_cols_element(x, 0, c);
}

static ad_var scatter_cols(const ad_var x[2])
{
    uint32_t list[LIST];
    for (size_t k = 0; k < ad_cols(x[0]); k++)
        list[k] = (uint32_t)picked(k, WIDTH);
    return ad_scatter_cols(x[0], list, WIDTH);
}

static double scatter_cols_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t k = 0; k < x->cols; k++)
        if (picked(k, WIDTH) == c)
            s += at(x, r, k);
    return s;
}

/* Of a slice, and of the transpose: rows that are not beside each other. */
static ad_var cumsum_of_slice(const ad_var x[2])
{
    ad_var first = ad_slice_cols(x[0], 0, ad_cols(x[0]) - 1);
    return ad_add(ad_cumsum_cols(first), ad_cumsum_rows(first));
}

static double cumsum_of_slice_element(const struct matrix x[2], size_t r, size_t c)
{
    return cumsum_cols_element(x, r, c) + cumsum_rows_element(x, r, c);
}

/* ---- the table ---- */

#define CASE(name, nature)                                                                         \
    {                                                                                              \
#name, name, name##_element, NONE, 1, nature                                               \
    }

const struct structure reduction_cases[] = {
    CASE(max_rows, KINKED),
    CASE(max_cols, KINKED),
    CASE(min_rows, KINKED),
    CASE(min_cols, KINKED),
    CASE(arg_max_rows, KINKED),
    CASE(arg_max_cols, KINKED),
    CASE(log_sum_exp_rows, SMOOTH),
    CASE(log_sum_exp_cols, SMOOTH),
    CASE(softmax_rows, SMOOTH),
    CASE(softmax_cols, SMOOTH),
    CASE(cumsum_rows, LINEAR),
    CASE(cumsum_cols, LINEAR),
    {"log_sum_exp_cols beyond exp", log_sum_exp_large, log_sum_exp_large_element, NONE, 1, KINKED},
    CASE(gather_cols, LINEAR),
    CASE(gather_cols_repeated, LINEAR),
    CASE(scatter_cols, LINEAR),
    {"cumsum of a slice", cumsum_of_slice, cumsum_of_slice_element, NONE, 2, LINEAR},
};
const size_t reduction_n_cases = sizeof reduction_cases / sizeof reduction_cases[0];
