/* Random views and place operations. */
#include "world_operations.h"

void world_slice(struct world *w)
{
    size_t a = world_any(w);
    const struct matrix *x = &w->m[a];
    bool by_rows = world_pick(w, 2);
    size_t length = by_rows ? x->rows : x->cols, first = world_pick(w, length);
    size_t count = 1 + world_pick(w, length - first);
    if (!by_rows && length > 8 && world_pick(w, 2)) { /* nearly all: neighbouring columns */
        first = world_pick(w, 2);
        count = length - 1;
    }
    struct matrix m = world_matrix(by_rows ? count : x->rows, by_rows ? x->cols : count);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] =
                x->v[(r + (by_rows ? first : 0)) * x->cols + c + (by_rows ? 0 : first)];
    world_add(w,
              by_rows ? ad_slice_rows(w->var[a], first, count)
                      : ad_slice_cols(w->var[a], first, count),
              m);
}

void world_reshape(struct world *w)
{
    size_t a = world_any(w), size = w->m[a].rows * w->m[a].cols, rows = 1 + world_pick(w, ROWS);
    if (world_pick(w, 4) == 0)
        rows = w->m[a].cols;
    while (size % rows)
        rows--;
    struct matrix m = world_matrix(rows, size / rows);
    for (size_t i = 0; i < size; i++)
        m.v[i] = w->m[a].v[i];
    world_add(w, ad_reshape(w->var[a], m.rows, m.cols), m);
}

void world_broadcast(struct world *w)
{
    size_t a = world_any(w), b = world_any(w);
    const struct matrix *x = &w->m[a];
    struct matrix m = world_matrix(x->rows == 1 ? 1 + world_pick(w, ROWS) : x->rows,
                                   x->cols == 1 && x->rows < 50 ? w->m[b].cols : x->cols);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = at(x, r, c);
    world_add(w, ad_broadcast(w->var[a], m.rows, m.cols), m);
}

void world_gather(struct world *w)
{
    size_t a = world_any(w), n = 1 + world_pick(w, 2 * ROWS);
    const struct matrix *x = &w->m[a];
    uint32_t list[2 * ROWS];
    if (n * x->cols > LARGEST)
        return;
    struct matrix m = world_matrix(n, x->cols);
    for (size_t k = 0; k < n; k++) {
        list[k] = (uint32_t)world_pick(w, x->rows);
        for (size_t c = 0; c < x->cols; c++)
            m.v[k * x->cols + c] = x->v[list[k] * x->cols + c];
    }
    world_add(w, ad_gather_rows(w->var[a], n, list), m);
}

/* One row picked by index, and repeated. */
void world_gather_one(struct world *w)
{
    size_t a = world_any(w), rows = 1 + world_pick(w, ROWS);
    const struct matrix *x = &w->m[a];
    uint32_t row = (uint32_t)world_pick(w, x->rows);
    if (rows * x->cols > LARGEST)
        return;
    struct matrix m = world_matrix(rows, x->cols);
    for (size_t i = 0; i < rows * x->cols; i++)
        m.v[i] = x->v[row * x->cols + i % x->cols];
    world_add(w, ad_broadcast(ad_gather_rows(w->var[a], 1, &row), rows, x->cols), m);
}

static void copy_to(struct matrix *m, const struct matrix *x, size_t row, size_t col)
{
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; c < x->cols; c++)
            m->v[(r + row) * m->cols + c + col] += x->v[r * x->cols + c];
}

void world_concat(struct world *w)
{
    size_t a = world_any(w), b = world_partner(w, a, a);
    const struct matrix *x = &w->m[a], *y = &w->m[b];
    bool by_rows = x->cols == y->cols;
    if ((!by_rows && x->rows != y->rows) || x->rows * x->cols + y->rows * y->cols > LARGEST ||
        (by_rows && x->rows + y->rows > 60))
        return;
    struct matrix m =
        world_matrix(x->rows + (by_rows ? y->rows : 0), x->cols + (by_rows ? 0 : y->cols));
    copy_to(&m, x, 0, 0);
    copy_to(&m, y, by_rows ? x->rows : 0, by_rows ? 0 : x->cols);
    const ad_var parts[] = {w->var[a], w->var[b]};
    world_add(w, by_rows ? ad_concat_rows(2, parts) : ad_concat_cols(2, parts), m);
}

void world_place(struct world *w)
{
    size_t id[] = {world_any(w), world_any(w), world_any(w)}, row[3], col[3];
    size_t rows = 1, cols = 1;
    ad_var parts[3];
    for (int k = 0; k < 3; k++) {
        row[k] = world_pick(w, 3);
        col[k] = world_pick(w, 3);
        rows = larger(rows, w->m[id[k]].rows + row[k]);
        cols = larger(cols, w->m[id[k]].cols + col[k]);
        parts[k] = w->var[id[k]];
    }
    if (rows * cols > LARGEST)
        return;
    struct matrix m = world_matrix(rows, cols);
    for (int k = 0; k < 3; k++)
        copy_to(&m, &w->m[id[k]], row[k], col[k]);
    for (size_t i = 0; i < rows * cols; i++)
        m.v[i] *= 0.5;
    world_add(w, ad_mul(0.5, ad_place(w->tape, rows, cols, 3, parts, row, col)), m);
}
