/* The table of structure_cases.h. */
#include "structure_cases.h"

static double at(const struct matrix *m, size_t r, size_t c) { return m->v[r * m->cols + c]; }

/* ---- sums ---- */

/* Of a window of m: rows [r, r_end), columns [c, c_end). */
static double total(const struct matrix *m, size_t r, size_t r_end, size_t c, size_t c_end)
{
    double s = 0;
    for (size_t i = r; i < r_end; i++)
        for (size_t j = c; j < c_end; j++)
            s += at(m, i, j);
    return s;
}

static ad_var sum(const ad_var x[2]) { return ad_sum(x[0]); }

static double sum_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r, (void)c;
    return total(x, 0, x->rows, 0, x->cols);
}

static ad_var sum_rows(const ad_var x[2]) { return ad_sum_rows(x[0]); }

static double sum_rows_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return total(x, 0, x->rows, c, c + 1);
}

static ad_var sum_cols(const ad_var x[2]) { return ad_sum_cols(x[0]); }

static double sum_cols_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)c;
    return total(x, r, r + 1, 0, x->cols);
}

static ad_var mean(const ad_var x[2]) { return ad_mean(x[0]); }

static double mean_element(const struct matrix x[2], size_t r, size_t c)
{
    return sum_element(x, r, c) / (double)(x->rows * x->cols);
}

static ad_var dot(const ad_var x[2]) { return ad_dot(x[0], x[1]); }

static double dot_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    (void)r, (void)c;
    for (size_t i = 0; i < x->rows; i++)
        for (size_t j = 0; j < x->cols; j++)
            s += at(x, i, j) * at(x + 1, x[1].rows == 1 ? 0 : i, x[1].cols == 1 ? 0 : j);
    return s;
}

/* ---- matrices ---- */

/* Element (r, c) of op(a) op(b), where op transposes if its flag is set. */
static double product(const struct matrix *a, bool ta, const struct matrix *b, bool tb, size_t r,
                      size_t c)
{
    double s = 0;
    for (size_t k = 0; k < (ta ? a->rows : a->cols); k++)
        s += (ta ? at(a, k, r) : at(a, r, k)) * (tb ? at(b, c, k) : at(b, k, c));
    return s;
}

#define MATMUL(name, ta, tb)                                                                       \
    static ad_var name(const ad_var x[2]) { return ad_matmul(x[0], ta, x[1], tb); }                \
    static double name##_element(const struct matrix x[2], size_t r, size_t c)                     \
    {                                                                                              \
        return product(x, ta, x + 1, tb, r, c);                                                    \
    }
MATMUL(matmul_nn, false, false)
MATMUL(matmul_nt, false, true)
MATMUL(matmul_tn, true, false)
MATMUL(matmul_tt, true, true)

/* One row out of many that are the same has no row stride to speak of. */
static ad_var matmul_repeated(const ad_var x[2])
{
    ad_var repeated = ad_broadcast(ad_row(x[0], 0), 5, ad_cols(x[0]));
    return ad_matmul(ad_row(repeated, 2), false, x[1], false);
}

static double matmul_repeated_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return matmul_nn_element(x, 0, c);
}

static ad_var gram(const ad_var x[2]) { return ad_matmul(x[0], false, x[0], true); }

static double gram_element(const struct matrix x[2], size_t r, size_t c)
{
    return product(x, false, x, true, r, c);
}

static ad_var transpose(const ad_var x[2]) { return ad_transpose(x[0]); }

static double transpose_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x, c, r);
}

/* ---- views ---- */

static ad_var slice_rows(const ad_var x[2])
{
    return ad_slice_rows(x[0], ad_rows(x[0]) / 3, (ad_rows(x[0]) + 1) / 2);
}

static double slice_rows_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x, r + x->rows / 3, c);
}

static ad_var slice_cols(const ad_var x[2])
{
    return ad_slice_cols(x[0], ad_cols(x[0]) / 3, (ad_cols(x[0]) + 1) / 2);
}

static double slice_cols_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x, r, c + x->cols / 3);
}

static ad_var last_row(const ad_var x[2]) { return ad_row(x[0], ad_rows(x[0]) - 1); }

static double last_row_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return at(x, x->rows - 1, c);
}

static ad_var last_col(const ad_var x[2]) { return ad_col(x[0], ad_cols(x[0]) - 1); }

static double last_col_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)c;
    return at(x, r, x->cols - 1);
}

static ad_var reshape(const ad_var x[2]) { return ad_reshape(x[0], ad_cols(x[0]), ad_rows(x[0])); }

static double reshape_element(const struct matrix x[2], size_t r, size_t c)
{
    return x->v[r * x->rows + c];
}

static ad_var broadcast_row(const ad_var x[2])
{
    return ad_broadcast(ad_row(x[0], 0), 4, ad_cols(x[0]));
}

static double broadcast_row_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return at(x, 0, c);
}

static ad_var broadcast_col(const ad_var x[2])
{
    return ad_broadcast(ad_col(x[0], 0), ad_rows(x[0]), 300);
}

static double broadcast_col_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)c;
    return at(x, r, 0);
}

static ad_var broadcast_scalar(const ad_var x[2]) { return ad_broadcast(ad_sum(x[0]), 3, 151); }

/* A view of a view of a view: rows 1.. of the transpose of all but the last two columns, reshaped.
 */
static ad_var views(const ad_var x[2])
{
    size_t rows = ad_rows(x[0]), cols = ad_cols(x[0]);
    ad_var inner = ad_slice_cols(x[0], 0, cols - 2);
    ad_var turned = ad_slice_rows(ad_transpose(inner), 1, cols - 3);
    return ad_reshape(ad_slice_rows(turned, 0, cols - 3), 1, (cols - 3) * rows);
}

static double views_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return at(x, c % x->rows, 1 + c / x->rows);
}

/* ---- indices ---- */

enum { LIST = 300 };

static size_t picked(size_t k, size_t rows) { return (k * k * 5 + k * 3 + rows - 1) % rows; }

static ad_var gather(const ad_var x[2])
{
    uint32_t list[LIST];
    size_t n = 2 * ad_rows(x[0]) + 1;
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)picked(k, ad_rows(x[0]));
    return ad_gather_rows(x[0], n, list);
}

static double gather_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x, picked(r, x->rows), c);
}

static ad_var gather_one(const ad_var x[2])
{
    uint32_t last = (uint32_t)ad_rows(x[0]) - 1;
    return ad_broadcast(ad_gather_rows(x[0], 1, &last), 3, ad_cols(x[0]));
}

/* One number picked by index stands for a row of numbers. */
static ad_var gathered_number(const ad_var x[2])
{
    uint32_t last = (uint32_t)ad_rows(x[0]) - 1;
    ad_var number = ad_gather_rows(ad_col(x[0], 0), 1, &last);
    return ad_sub(ad_row(x[1], 0), number);
}

static double gathered_number_element(const struct matrix x[2], size_t r, size_t c)
{
    (void)r;
    return at(x + 1, 0, c) - at(x, x->rows - 1, 0);
}

enum { HEIGHT = 4 };

static ad_var scatter(const ad_var x[2])
{
    uint32_t list[LIST];
    for (size_t k = 0; k < ad_rows(x[0]); k++)
        list[k] = (uint32_t)picked(k, HEIGHT);
    return ad_scatter_rows(x[0], list, HEIGHT);
}

static double scatter_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t k = 0; k < x->rows; k++)
        if (picked(k, HEIGHT) == r)
            s += at(x, k, c);
    return s;
}

/* Rows in order and in reverse: the difference of two scatters. */
static ad_var scatter_difference(const ad_var x[2])
{
    uint32_t list[LIST], reversed[LIST];
    size_t n = ad_rows(x[0]);
    for (size_t k = 0; k < n; k++)
        reversed[n - 1 - k] = list[k] = (uint32_t)picked(k, HEIGHT);
    return ad_sub(ad_scatter_rows(ad_mul(2.0, x[0]), list, HEIGHT),
                  ad_scatter_rows(ad_mul(x[0], x[1]), reversed, HEIGHT));
}

static double scatter_difference_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t k = 0; k < x->rows; k++) {
        s += picked(k, HEIGHT) == r ? 2 * at(x, k, c) : 0;
        s -= picked(x->rows - 1 - k, HEIGHT) == r ? at(x, k, c) * at(x + 1, k, c) : 0;
    }
    return s;
}

static ad_var concat_rows(const ad_var x[2])
{
    return ad_concat_rows(3, (ad_var[]){x[0], x[1], x[0]});
}

static double concat_rows_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x + (r / x->rows == 1), r % x->rows, c);
}

static ad_var concat_cols(const ad_var x[2])
{
    return ad_concat_cols(3, (ad_var[]){x[1], x[0], x[0]});
}

static double concat_cols_element(const struct matrix x[2], size_t r, size_t c)
{
    return at(x + (c / x->cols == 0), r, c % x->cols);
}

static ad_var place(const ad_var x[2])
{
    return ad_place(x[0].tape, ad_rows(x[0]) + 2, ad_cols(x[0]) + 3, 3,
                    (ad_var[]){x[0], x[1], ad_row(x[0], 0)}, (size_t[]){0, 1, 1},
                    (size_t[]){0, 2, 1});
}

static double placed(const struct matrix *x, size_t rows, size_t r, size_t c, size_t row,
                     size_t col)
{
    bool inside = r >= row && r - row < rows && c >= col && c - col < x->cols;
    return inside ? at(x, r - row, c - col) : 0;
}

static double place_element(const struct matrix x[2], size_t r, size_t c)
{
    return placed(x, x->rows, r, c, 0, 0) + placed(x + 1, x->rows, r, c, 1, 2) +
           placed(x, 1, r, c, 1, 1);
}

/* ---- time differences ---- */

static ad_var diff(const ad_var x[2]) { return ad_diff(x[0], 2.5, false); }

static double diff_element(const struct matrix x[2], size_t r, size_t c)
{
    size_t i = c < x->cols - 1 ? c : x->cols - 2;
    return 2.5 * (at(x, r, i + 1) - at(x, r, i));
}

static ad_var diff_repeat(const ad_var x[2]) { return ad_diff(x[0], 2.5, true); }

static ad_var diff_adjoint(const ad_var x[2])
{
    return ad_diff_adjoint(x[0], -1.5, false, ad_cols(x[0]) + 1);
}

static double diff_adjoint_element(const struct matrix x[2], size_t r, size_t c)
{
    double before = c > 0 ? at(x, r, c - 1) : 0, after = c < x->cols ? at(x, r, c) : 0;
    return -1.5 * (before - after);
}

static ad_var diff_adjoint_repeat(const ad_var x[2])
{
    return ad_diff_adjoint(x[0], -1.5, true, ad_cols(x[0]));
}

/* The last column of the difference stands twice, so its adjoint is the sum of both. */
static double diff_adjoint_repeat_element(const struct matrix x[2], size_t r, size_t c)
{
    size_t n = x->cols;
    double before = c > 0 ? at(x, r, c - 1) : 0, after = c + 1 < n ? at(x, r, c) : 0;
    if (c == n - 1)
        before += at(x, r, n - 1);
    if (c == n - 2)
        after += at(x, r, n - 1);
    return -1.5 * (before - after);
}

/* ---- the table ---- */

const struct structure structure_cases[] = {
    {"sum", sum, sum_element, NONE, 1, LINEAR},
    {"sum_rows", sum_rows, sum_rows_element, NONE, 1, LINEAR},
    {"sum_cols", sum_cols, sum_cols_element, NONE, 1, LINEAR},
    {"mean", mean, mean_element, NONE, 1, LINEAR},
    {"dot", dot, dot_element, SAME, 1, SMOOTH},
    {"dot with a row", dot, dot_element, ONE_ROW, 1, SMOOTH},
    {"dot with a column", dot, dot_element, ONE_COL, 1, SMOOTH},
    {"matmul", matmul_nn, matmul_nn_element, COLS_BY_4, 1, SMOOTH},
    {"matmul, b transposed", matmul_nt, matmul_nt_element, FOUR_BY_COLS, 1, SMOOTH},
    {"matmul, a transposed", matmul_tn, matmul_tn_element, ROWS_BY_4, 1, SMOOTH},
    {"matmul, both transposed", matmul_tt, matmul_tt_element, FOUR_BY_ROWS, 1, SMOOTH},
    {"matmul, row of a repeated row", matmul_repeated, matmul_repeated_element, COLS_BY_4, 1,
     SMOOTH},
    {"x x'", gram, gram_element, NONE, 1, SMOOTH},
    {"transpose", transpose, transpose_element, NONE, 1, LINEAR},
    {"slice_rows", slice_rows, slice_rows_element, NONE, 1, LINEAR},
    {"slice_cols", slice_cols, slice_cols_element, NONE, 1, LINEAR},
    {"row", last_row, last_row_element, NONE, 1, LINEAR},
    {"col", last_col, last_col_element, NONE, 1, LINEAR},
    {"reshape", reshape, reshape_element, NONE, 1, LINEAR},
    {"broadcast a row", broadcast_row, broadcast_row_element, NONE, 1, LINEAR},
    {"broadcast a column", broadcast_col, broadcast_col_element, NONE, 1, LINEAR},
    {"broadcast a scalar", broadcast_scalar, sum_element, NONE, 1, LINEAR},
    {"views of views", views, views_element, NONE, 4, LINEAR},
    {"gather_rows", gather, gather_element, NONE, 1, LINEAR},
    {"gathered number", gathered_number, gathered_number_element, SAME, 1, LINEAR},
    {"gather one row", gather_one, last_row_element, NONE, 1, LINEAR},
    {"difference of scatters", scatter_difference, scatter_difference_element, SAME, 1, SMOOTH},
    {"scatter_rows", scatter, scatter_element, NONE, 1, LINEAR},
    {"concat_rows", concat_rows, concat_rows_element, SAME, 1, LINEAR},
    {"concat_cols", concat_cols, concat_cols_element, SAME, 1, LINEAR},
    {"place", place, place_element, SAME, 1, LINEAR},
    {"diff", diff, diff_element, NONE, 2, LINEAR},
    {"diff, repeated", diff_repeat, diff_element, NONE, 2, LINEAR},
    {"diff_adjoint", diff_adjoint, diff_adjoint_element, NONE, 1, LINEAR},
    {"diff_adjoint, repeated", diff_adjoint_repeat, diff_adjoint_repeat_element, NONE, 2, LINEAR},
};
const size_t structure_n_cases = sizeof structure_cases / sizeof structure_cases[0];
