/* Elimination by fronts (fronts.h). */
#include "autodiff/ascending.h"
#include "fronts.h"
#include "autodiff/free.h"
#include "linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double GROWTH = 1e6; /* of the largest entry */

bool phys_fronts_new(struct phys_fronts *fronts, size_t n)
{
    struct phys_fronts *f = fronts;
    *f = (struct phys_fronts){.n = n, .front = calloc(n + 1, sizeof *f->front)};
    f->order = malloc(4 * n * sizeof *f->order);
    f->left = calloc(n, sizeof *f->left);
    f->pivots = malloc(n * sizeof *f->pivots);
    if (n >= UINT32_MAX || !f->front || !f->order || !f->left || !f->pivots)
        return false;
    f->position = f->order + n;
    f->of = f->position + n;
    f->local = f->of + n;
    return true;
}

void phys_fronts_free(struct phys_fronts *f)
{
    for (size_t k = 0; f->left && k < f->count; k++)
        free(f->left[k]);
    AD_FREE(f->front, f->order, f->row, f->values, f->work, f->left, f->pivots);
    *f = (struct phys_fronts){0};
}

void phys_fronts_add(struct phys_fronts *f, size_t u)
{
    f->order[f->placed] = (uint32_t)u;
    f->of[f->placed] = (uint32_t)f->count;
    f->position[u] = (uint32_t)f->placed++;
    f->front[f->count].pivots++;
}

void phys_fronts_next(struct phys_fronts *f)
{
    if (f->front[f->count].pivots == 0)
        return;
    f->count++;
    f->front[f->count].first = f->placed;
}

/* ---- rows ---- */

/* Takes a position among the rows of front k, once. */
static void take(struct phys_fronts *f, size_t k, uint32_t position)
{
    struct phys_front *front = &f->front[k];
    if (position < front->first + front->pivots || f->local[position] == k)
        return;
    f->local[position] = (uint32_t)k;
    f->row[front->row + front->rows++] = position;
}

/* Room for all the rows that front k may have. */
static bool make_rows(struct phys_fronts *f, size_t more)
{
    if (f->rows + more <= f->room)
        return true;
    const size_t room = 2 * (f->rows + more);
    uint32_t *row = realloc(f->row, room * sizeof *row);
    if (!row)
        return false;
    f->row = row;
    f->room = room;
    return true;
}

static bool find_rows(struct phys_fronts *f, size_t k, uint32_t *list, phys_fronts_beside *beside,
                      const void *context)
{
    struct phys_front *front = &f->front[k];
    front->row = f->rows;
    for (size_t p = front->first; p < front->first + front->pivots; p++) {
        const size_t count = beside(context, f->order[p], list);
        if (!make_rows(f, front->rows + count))
            return false;
        for (size_t c = 0; c < count; c++)
            take(f, k, f->position[list[c]]);
    }
    for (size_t child = front->child; child > 0; child = f->front[child - 1].next) {
        const struct phys_front *from = &f->front[child - 1];
        if (!make_rows(f, front->rows + from->rows))
            return false;
        for (size_t c = 0; c < from->rows; c++)
            take(f, k, f->row[from->row + c]);
    }
    qsort(f->row + front->row, front->rows, sizeof *f->row, ad_ascending_indices);
    f->rows += front->rows;
    if (front->rows > 0) {
        struct phys_front *parent = &f->front[f->of[f->row[front->row]]];
        front->next = parent->child;
        parent->child = k + 1;
    }
    return true;
}

bool phys_fronts_link(struct phys_fronts *f, phys_fronts_beside *beside, const void *context)
{
    double left = 0, most = 0;
    uint32_t *list = malloc(f->n * sizeof *list);
    bool made = list != NULL;
    memset(f->local, 0xff, f->n * sizeof *f->local);
    for (size_t k = 0; made && k < f->count; k++) {
        made = find_rows(f, k, list, beside, context);
        struct phys_front *front = &f->front[k];
        const double p = (double)front->pivots, m = (double)front->rows;
        front->at = f->size;
        f->size += front->pivots * (front->pivots + front->rows);
        f->most = f->most > front->pivots * front->rows ? f->most : front->pivots * front->rows;
        f->operations += 2 * p * p * p / 3 + 2 * p * p * m + 2 * p * m * m;
        left += m * m;
        most = fmax(most, left);
        for (size_t child = front->child; child > 0; child = f->front[child - 1].next)
            left -= pow((double)f->front[child - 1].rows, 2);
    }
    f->room = 0; /* of values from now on */
    f->bytes = sizeof(double) * ((double)f->size + 2 * (double)f->most + 2 * (double)f->n + most);
    free(list);
    return made;
}

size_t phys_fronts_place(const struct phys_fronts *f, size_t i, size_t j)
{
    const uint32_t at = f->position[i], by = f->position[j];
    const struct phys_front *front = &f->front[f->of[at < by ? at : by]];
    const size_t end = front->first + front->pivots;
    if (at >= end)
        return SIZE_MAX;
    size_t column = by - front->first;
    if (by >= end) {
        const uint32_t *row = f->row + front->row;
        const uint32_t *found = bsearch(&by, row, front->rows, sizeof by, ad_ascending_indices);
        column = front->pivots + (size_t)(found - row);
    }
    return front->at + column * front->pivots + at - front->first;
}

/* ---- factors ---- */

bool phys_fronts_clear(struct phys_fronts *f, size_t parts)
{
    const size_t work = 2 * (f->most > f->n ? f->most : f->n);
    f->parts = parts;
    if (parts * (f->size + work) > f->room) {
        AD_FREE(f->values, f->work);
        f->values = malloc(parts * f->size * sizeof *f->values);
        f->work = malloc(parts * work * sizeof *f->work);
        f->room = f->values && f->work ? parts * (f->size + work) : 0;
        if (!f->room)
            return false;
    }
    memset(f->values, 0, parts * f->size * sizeof *f->values);
    return true;
}

/* Adds what is left of `child` to front k and to what is left of that; its largest number. */
static double add_child(struct phys_fronts *f, size_t k, size_t child)
{
    const struct phys_front *to = &f->front[k], *from = &f->front[child];
    const size_t m = from->rows, p = to->pivots, parts = f->parts;
    const uint32_t *row = f->row + from->row;
    double most = 0;
    for (size_t j = 0; j < m; j++) {
        const size_t column = f->local[row[j]];
        const double *x = f->left[child] + parts * j * m;
        /* those of pivots come first; of a later column they are the whole of it */
        for (size_t i = 0; i < m; i++, x += parts) {
            const size_t at = f->local[row[i]];
            double *y = at < p        ? f->values + parts * (to->at + column * p + at)
                        : column >= p ? f->left[k] + parts * ((column - p) * to->rows + at - p)
                                      : NULL;
            for (size_t part = 0; y && part < parts; part++)
                y[part] += x[part];
            most = fabs(x[0]) > most ? fabs(x[0]) : most;
        }
    }
    free(f->left[child]);
    f->left[child] = NULL;
    return most;
}

static bool factor_front(struct phys_fronts *f, size_t k, double largest)
{
    struct phys_front *front = &f->front[k];
    const size_t p = front->pivots, m = front->rows, parts = f->parts;
    double *a = f->values + parts * front->at, *b = a + parts * p * p, most = 0;
    for (size_t i = 0; i < p; i++)
        f->local[front->first + i] = (uint32_t)i;
    for (size_t r = 0; r < m; r++)
        f->local[f->row[front->row + r]] = (uint32_t)(p + r);
    for (size_t child = front->child; child > 0; child = f->front[child - 1].next)
        most = fmax(most, add_child(f, k, child - 1));
    if (!(most <= GROWTH * largest) ||
        phys_lapack_block_factor(parts == 2, p, a, f->pivots + front->first) != 0)
        return false;
    if (m == 0)
        return true;
    memcpy(f->work, b, parts * p * m * sizeof *b);
    phys_lapack_block_eliminate(parts == 2, p, a, f->pivots + front->first, m, f->work,
                                f->work + parts * p * m, f->left[k]);
    return true;
}

bool phys_fronts_factor(struct phys_fronts *f, bool *no_memory)
{
    double largest = 0;
    for (size_t k = 0; k < f->parts * f->size; k++)
        largest = fabs(f->values[k]) > largest ? fabs(f->values[k]) : largest;
    for (size_t k = 0; k < f->count; k++) {
        const size_t m = f->front[k].rows;
        free(f->left[k]);
        f->left[k] = m ? calloc(f->parts * m * m, sizeof *f->left[k]) : NULL;
        *no_memory = m && !f->left[k];
        if (*no_memory || !factor_front(f, k, largest))
            return false;
    }
    return true;
}

/* ---- solving ---- */

/* x of rows -= b^T y, or y -= b x of rows, which are at `row`. */
static void subtract(const struct phys_fronts *f, const struct phys_front *front, bool transpose,
                     double *y, double *x)
{
    const size_t p = front->pivots, parts = f->parts;
    const double *b = f->values + parts * (front->at + p * p);
    for (size_t r = 0; r < front->rows; r++, b += parts * p) {
        double *at = x + parts * f->row[front->row + r], re = 0, im = 0;
        if (parts == 1 && transpose) {
#pragma omp simd reduction(+ : re)
            for (size_t i = 0; i < p; i++)
                re += b[i] * y[i];
            at[0] -= re;
        } else if (parts == 1) {
            const double by = at[0];
#pragma omp simd
            for (size_t i = 0; i < p; i++)
                y[i] -= b[i] * by;
        } else if (transpose) {
            for (size_t i = 0; i < p; i++) {
                re += b[2 * i] * y[2 * i] - b[2 * i + 1] * y[2 * i + 1];
                im += b[2 * i] * y[2 * i + 1] + b[2 * i + 1] * y[2 * i];
            }
            at[0] -= re;
            at[1] -= im;
        } else {
            for (size_t i = 0; i < p; i++) {
                y[2 * i] -= b[2 * i] * at[0] - b[2 * i + 1] * at[1];
                y[2 * i + 1] -= b[2 * i] * at[1] + b[2 * i + 1] * at[0];
            }
        }
    }
}

static void solve_pivots(const struct phys_fronts *f, const struct phys_front *front, double *x)
{
    phys_lapack_block_solve(f->parts == 2, front->pivots, f->values + f->parts * front->at,
                            f->pivots + front->first, x);
}

void phys_fronts_solve(struct phys_fronts *f, double *x)
{
    const size_t parts = f->parts, bytes = parts * sizeof *x;
    double *y = f->work, *z = y + parts * f->n;
    for (size_t p = 0; p < f->n; p++)
        memcpy(y + parts * p, x + parts * f->order[p], bytes);
    for (size_t k = 0; k < f->count; k++) {
        const struct phys_front *front = &f->front[k];
        memcpy(z, y + parts * front->first, front->pivots * bytes);
        solve_pivots(f, front, z);
        subtract(f, front, true, z, y);
    }
    for (size_t k = f->count; k-- > 0;) {
        const struct phys_front *front = &f->front[k];
        subtract(f, front, false, y + parts * front->first, y);
        solve_pivots(f, front, y + parts * front->first);
    }
    for (size_t p = 0; p < f->n; p++)
        memcpy(x + parts * f->order[p], y + parts * p, bytes);
}
