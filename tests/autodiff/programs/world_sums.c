/* Random sums, products and differences. */
#include "world_operations.h"

#include <stdlib.h>

void world_sum(struct world *w)
{
    size_t a = world_any(w), which = world_pick(w, 4);
    const struct matrix *x = &w->m[a];
    bool rows = which != 1, cols = which != 0;
    struct matrix m = world_matrix(rows ? 1 : x->rows, cols ? 1 : x->cols);
    double scale = (double)(m.rows * m.cols) / (double)(x->rows * x->cols);
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; c < x->cols; c++)
            m.v[(rows ? 0 : r) * m.cols + (cols ? 0 : c)] += scale * at(x, r, c);
    ad_var y = which == 0   ? ad_sum_rows(w->var[a])
               : which == 1 ? ad_sum_cols(w->var[a])
               : which == 2 ? ad_sum(w->var[a])
                            : ad_mean(w->var[a]);
    world_add(w, which == 3 ? y : ad_mul(scale, y), m);
}

void world_dot(struct world *w)
{
    size_t a = world_any(w), b = world_partner(w, a, a);
    size_t rows = larger(w->m[a].rows, w->m[b].rows), cols = larger(w->m[a].cols, w->m[b].cols);
    struct matrix m = world_matrix(1, 1);
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            *m.v += at(&w->m[a], r, c) * at(&w->m[b], r, c);
    double scale = 1.0 / (double)(rows * cols);
    *m.v *= scale;
    world_add(w, ad_mul(ad_dot(w->var[a], w->var[b]), scale), m);
}

/* Transposition flags are drawn until the inner dimensions agree; x' x always does. */
void world_matmul(struct world *w)
{
    size_t a = world_any(w), b = world_any(w);
    bool ta = world_pick(w, 2), tb = world_pick(w, 2);
    const struct matrix *x = &w->m[a], *y = &w->m[b];
    if ((ta ? x->rows : x->cols) != (tb ? y->cols : y->rows)) {
        b = a;
        y = x;
        tb = !ta;
    }
    size_t rows = ta ? x->cols : x->rows, cols = tb ? y->rows : y->cols;
    size_t inner = ta ? x->rows : x->cols;
    if (rows * cols > LARGEST || rows * cols * inner > 2000000)
        return;
    struct matrix m = world_matrix(rows, cols);
    double scale = 1.0 / (double)inner;
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            for (size_t k = 0; k < inner; k++)
                m.v[r * cols + c] += scale * (ta ? x->v[k * x->cols + r] : x->v[r * x->cols + k]) *
                                     (tb ? y->v[c * y->cols + k] : y->v[k * y->cols + c]);
    world_add(w, ad_mul(ad_matmul(w->var[a], ta, w->var[b], tb), scale), m);
}

void world_transpose(struct world *w)
{
    size_t a = world_any(w);
    struct matrix m = world_matrix(w->m[a].cols, w->m[a].rows);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = w->m[a].v[c * m.rows + r];
    world_add(w, ad_transpose(w->var[a]), m);
}

void world_scatter(struct world *w)
{
    size_t a = world_any(w), height = 1 + world_pick(w, ROWS);
    const struct matrix *x = &w->m[a];
    if (x->rows > 4 * ROWS)
        return;
    uint32_t list[4 * ROWS];
    struct matrix m = world_matrix(height, x->cols);
    for (size_t k = 0; k < x->rows; k++) {
        list[k] = (uint32_t)world_pick(w, height);
        for (size_t c = 0; c < x->cols; c++)
            m.v[list[k] * x->cols + c] += x->v[k * x->cols + c];
    }
    world_add(w, ad_scatter_rows(w->var[a], list, height), m);
}

/* Sums over rows and scatters of one value and its sine, added or subtracted: the compiler lets
   such sums of sums share one total, but for those that are read elsewhere too. */
void world_sum_of_sums(struct world *w)
{
    enum { TERMS = 3 };
    size_t a = world_any(w), height = world_pick(w, 3) ? 1 + world_pick(w, ROWS) : 1,
           n = 2 + world_pick(w, TERMS - 1);
    const struct matrix *x = &w->m[a];
    if (x->rows > 4 * ROWS)
        return;
    bool scatters = world_pick(w, 3);
    struct matrix m = world_matrix(scatters ? height : 1, x->cols);
    ad_var total = {0}, sine = ad_sin(w->var[a]);
    for (size_t k = 0; k < n; k++) {
        uint32_t list[4 * ROWS] = {0};
        bool negative = world_pick(w, 2);
        struct matrix term = world_matrix(m.rows, m.cols);
        for (size_t r = 0; r < x->rows; r++) {
            list[r] = (uint32_t)world_pick(w, m.rows);
            for (size_t c = 0; c < x->cols; c++) {
                double v = x->v[r * x->cols + c];
                term.v[list[r] * x->cols + c] += k % 2 ? v : sin(v);
            }
        }
        for (size_t i = 0; i < m.rows * m.cols; i++)
            m.v[i] += negative && k ? -term.v[i] : term.v[i];
        ad_var from = k % 2 ? w->var[a] : sine;
        ad_var sum = scatters ? ad_scatter_rows(from, list, height) : ad_sum_rows(from);
        total = k == 0 ? sum : negative ? ad_sub(total, sum) : ad_add(total, sum);
        if (world_pick(w, 4) == 0 && w->n < MAX_NODES - 1)
            world_add(w, sum, term);
        else
            free(term.v);
    }
    double scale = 1.0 / (double)(x->rows + 1);
    for (size_t i = 0; i < m.rows * m.cols; i++)
        m.v[i] *= scale;
    world_add(w, ad_mul(total, scale), m);
}

void world_diff(struct world *w)
{
    size_t a = world_any(w);
    const struct matrix *x = &w->m[a];
    bool repeat = world_pick(w, 2);
    double scale = world_number(w, 0.2, 0.6);
    if (x->cols < 2)
        return;
    struct matrix m = world_matrix(x->rows, x->cols - !repeat);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++) {
            const double *row = x->v + r * x->cols;
            size_t i = c < x->cols - 1 ? c : x->cols - 2;
            m.v[r * m.cols + c] = scale * (row[i + 1] - row[i]);
        }
    world_add(w, ad_diff(w->var[a], scale, repeat), m);
}

void world_diff_adjoint(struct world *w)
{
    size_t a = world_any(w);
    const struct matrix *x = &w->m[a];
    bool repeat = world_pick(w, 2);
    double scale = world_number(w, 0.2, 0.6);
    if (x->cols < 2)
        return;
    struct matrix m = world_matrix(x->rows, x->cols + !repeat);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < x->cols; c++) {
            size_t i = c < m.cols - 1 ? c : m.cols - 2;
            m.v[r * m.cols + i + 1] += scale * x->v[r * x->cols + c];
            m.v[r * m.cols + i] -= scale * x->v[r * x->cols + c];
        }
    world_add(w, ad_diff_adjoint(w->var[a], scale, repeat, m.cols), m);
}
