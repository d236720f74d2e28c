/* A user's own operation on blocks of columns. What it reads and writes is copied: blocks are
   contiguous and in double, and what it writes beside its result is found by the numbers that lie
   between its matrices. */
#include "custom.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK_NUMBERS = 1 << 15, /* of all matrices of a block together: half of a second-level cache */
    BLOCK_COLUMNS = 256,
    GUARD = 8 /* numbers between matrices */
};

/* A NaN that no operation makes. */
static const uint64_t guard = 0x7ff4c0de5afe11e5u;

size_t ad_custom_block(const struct custom *c)
{
    size_t most = BLOCK_NUMBERS / (2 * ((size_t)c->inputs + c->by.rows));
    return most < 1 ? 1 : most < BLOCK_COLUMNS ? most : BLOCK_COLUMNS;
}

/* ---- one block of memory for all matrices ---- */

struct arena {
    double *next;
    double *guards[2 * CUSTOM_INPUTS + 3]; /* before each matrix, and behind the last */
    size_t n;
};

static void put_guard(struct arena *a)
{
    a->guards[a->n++] = a->next;
    for (size_t k = 0; k < GUARD; k++)
        memcpy(a->next++, &guard, sizeof guard);
}

static double *take(struct arena *a, size_t size)
{
    double *matrix = a->next;
    a->next += size;
    put_guard(a);
    return matrix;
}

static bool guards_stand(const struct arena *a)
{
    for (size_t k = 0; k < a->n; k++)
        for (size_t i = 0; i < GUARD; i++)
            if (memcmp(a->guards[k] + i, &guard, sizeof guard))
                return false;
    return true;
}

/* ---- to and from the tape's type ---- */

static void load(double *to, enum ad_type type, struct custom_matrix from, size_t row, size_t rows,
                 size_t first, size_t cols)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++) {
            size_t at = (row + r) * from.stride + first + c;
            to[r * cols + c] =
                type == AD_F32 ? (double)((float *)from.at)[at] : ((double *)from.at)[at];
        }
}

static void store(const double *from, enum ad_type type, struct custom_matrix to, size_t row,
                  size_t rows, size_t first, size_t cols)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++) {
            size_t at = (row + r) * to.stride + first + c;
            if (type == AD_F32)
                ((float *)to.at)[at] = (float)from[r * cols + c];
            else
                ((double *)to.at)[at] = from[r * cols + c];
        }
}

static void fill(double *to, size_t n, double value)
{
    for (size_t k = 0; k < n; k++)
        to[k] = value;
}

/* Zeros stay zeros, whatever the derivative is: no NaN comes through a branch not taken. */
static void keep_zeros(double *gx, size_t inputs, const double *gy, size_t rows, size_t cols)
{
    for (size_t c = 0; c < cols; c++) {
        bool any = false;
        for (size_t r = 0; r < rows; r++)
            any = any || gy[r * cols + c] != 0;
        for (size_t r = 0; !any && r < inputs; r++)
            gx[r * cols + c] = 0;
    }
}

enum custom_fault ad_custom_run(const struct custom *c, enum ad_type type, bool adjoint,
                                size_t first, size_t cols, const struct custom_matrix in[],
                                struct custom_matrix out)
{
    const size_t rows = c->by.rows, results = adjoint ? c->inputs : rows;
    const size_t size = (c->inputs + rows + (adjoint ? rows + c->inputs : 0)) * cols;
    double *memory = malloc((size + GUARD * (2 * (size_t)c->n + 4)) * sizeof *memory);
    const double *x[CUSTOM_INPUTS];
    double *gx[CUSTOM_INPUTS], *y, *gy = NULL;
    struct arena arena = {.next = memory};
    enum custom_fault fault = CUSTOM_MEMORY;
    if (memory) {
        put_guard(&arena);
        for (size_t k = 0, row = 0; k < c->n; row += c->rows[k++]) {
            double *to = take(&arena, c->rows[k] * cols);
            load(to, type, in[0], row, c->rows[k], first, cols);
            x[k] = to;
        }
        y = take(&arena, rows * cols);
        if (adjoint) {
            load(y, type, in[1], 0, rows, first, cols);
            gy = take(&arena, rows * cols);
            load(gy, type, in[2], 0, rows, first, cols);
        } else {
            fill(y, rows * cols, (double)NAN);
        }
        for (size_t k = 0; adjoint && k < c->n; k++) {
            gx[k] = take(&arena, c->rows[k] * cols);
            fill(gx[k], c->rows[k] * cols, (double)NAN);
        }
        bool failed = adjoint ? c->by.adjoint(c->by.user, cols, x, y, gy, gx)
                              : c->by.value(c->by.user, cols, x, y);
        fault = !guards_stand(&arena) ? CUSTOM_OUTSIDE : failed ? CUSTOM_FAILED : CUSTOM_DONE;
    }
    if (fault != CUSTOM_DONE) {
        double nan = (double)NAN;
        for (size_t r = 0; r < results; r++)
            for (size_t k = 0; k < cols; k++)
                store(&nan, type, out, r, 1, first + k, 1);
    } else if (!adjoint) {
        store(y, type, out, 0, rows, first, cols);
    } else {
        for (size_t k = 0, row = 0; k < c->n; row += c->rows[k++]) {
            keep_zeros(gx[k], c->rows[k], gy, rows, cols);
            store(gx[k], type, out, row, c->rows[k], first, cols);
        }
    }
    free(memory);
    return fault;
}

enum ad_status ad_custom_report(struct ad_error *error, uint32_t node, bool adjoint,
                                const struct custom *c, enum custom_fault fault, size_t col)
{
    static const struct {
        enum ad_status status;
        const char *text;
    } faults[] = {
        [CUSTOM_FAILED] = {AD_E_NONFINITE, "failed"},
        [CUSTOM_OUTSIDE] = {AD_E_ARGUMENT, "wrote beside its result"},
        [CUSTOM_MEMORY] = {AD_E_MEMORY, "found no memory"},
        [CUSTOM_NO_ADJOINT] = {AD_E_ARGUMENT, "is NULL; ad_gradient needs it"},
        [CUSTOM_SECOND] = {AD_E_ARGUMENT, "has no derivative in ad_gradient; expected ad_grad"},
    };
    return ad_fail(error, faults[fault].status,
                   "node %u (custom \"%s\"): %s %s (block of columns from %zu on)", node, c->name,
                   adjoint ? "adjoint" : "value", faults[fault].text, col);
}
