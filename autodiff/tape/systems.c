/* Records small linear systems, one per column. The factor of a matrix is a value of its own,
   shared by its solutions, its determinant and their gradients. */
#include "autodiff/internal.h"
#include "autodiff/kernels/kernels.h"

#include <stdlib.h>

enum { ROOM = AD_MOST_SIDE * AD_MOST_SIDE };

/* Size n of the n x n matrices in the columns of a; 0: refused. */
static size_t side_of(unsigned op, ad_var a, enum ad_factors factors)
{
    size_t n = 1;
    while (n * n < ad_rows(a) && n < AD_MOST_SIDE)
        n++;
    if (factors != AD_LU && factors != AD_CHOLESKY)
        ad_refuse_operands(a.tape, AD_E_ARGUMENT, op, 1, &a,
                           "got factors %d; expected AD_LU or "
                           "AD_CHOLESKY",
                           (int)factors);
    else if (n * n != ad_rows(a))
        ad_refuse_operands(
            a.tape, AD_E_SHAPE, op, 1, &a,
            "got %zu rows; expected n*n, n up to %d, of an n x n matrix in each column", ad_rows(a),
            AD_MOST_SIDE);
    return a.tape->error.status == AD_OK ? n : 0;
}

/* The lower triangle in both. */
static ad_var symmetric(ad_var a, size_t n)
{
    uint32_t list[ROOM];
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            list[i * n + j] = (uint32_t)((i > j ? i : j) * n + (i > j ? j : i));
    return ad_gather_rows(a, n * n, list);
}

/* Records the factor of *a; for Cholesky *a becomes symmetric. */
static ad_var factor(ad_var *a, size_t n, enum ad_factors factors, uint32_t *aux)
{
    *aux = (uint32_t)n | (factors == AD_CHOLESKY ? SYSTEM_CHOLESKY : 0);
    if (factors == AD_CHOLESKY && n > 1)
        *a = symmetric(*a, n);
    return ad_append(a->tape, (struct node){.op = AD_OP_factor,
                                            .rows = (uint32_t)(n * n + (factors == AD_LU ? n : 0)),
                                            .cols = (uint32_t)ad_cols(*a),
                                            .in = {a->id},
                                            .aux = *aux});
}

static ad_var columns(ad_var x, size_t cols) { return ad_broadcast(x, ad_rows(x), cols); }

ad_var ad_solve_factored(ad_var a, ad_var f, ad_var b, uint32_t aux)
{
    size_t cols = ad_cols(a) > ad_cols(b) ? ad_cols(a) : ad_cols(b);
    a = columns(a, cols);
    f = columns(f, cols);
    b = columns(b, cols);
    if (a.tape->error.status != AD_OK)
        return ad_at(a.tape, 0);
    return ad_append(a.tape, (struct node){.op = AD_OP_solve,
                                           .rows = (uint32_t)ad_rows(b),
                                           .cols = (uint32_t)cols,
                                           .in = {a.id, f.id, b.id},
                                           .aux = aux});
}

ad_var ad_solve(ad_var a, ad_var b, enum ad_factors factors)
{
    ad_var in[] = {a, b}, none;
    uint32_t aux;
    size_t n;
    if (!ad_operands(AD_OP_solve, 2, in, &none) || !(n = side_of(AD_OP_solve, a, factors)))
        return none;
    if (ad_rows(b) % n || (ad_cols(a) != ad_cols(b) && ad_cols(a) != 1 && ad_cols(b) != 1))
        return ad_refuse_operands(a.tape, AD_E_SHAPE, AD_OP_solve, 2, in,
                                  "expected right sides of a multiple of %zu rows, and as many "
                                  "columns",
                                  n);
    ad_var f = factor(&a, n, factors, &aux);
    return ad_solve_factored(a, f, b, aux);
}

enum ad_status ad_name_singular(struct ad_error *error, uint32_t node, uint32_t aux, size_t col)
{
    return ad_fail(error, AD_E_NONFINITE, "node %u (%s): the matrix of column %zu is %s", node,
                   ad_op_name(AD_OP_factor), col,
                   aux & SYSTEM_CHOLESKY ? "not positive definite, or singular to rounding"
                                         : "singular to rounding");
}

ad_var ad_each_unit(ad_tape *tape, size_t n, size_t cols)
{
    double unit[ROOM] = {0};
    for (size_t i = 0; i < n; i++)
        unit[i * n + i] = 1;
    return ad_broadcast(ad_const(tape, n * n, 1, unit), n * n, cols);
}

ad_var ad_inverse(ad_var a, enum ad_factors factors)
{
    ad_var none;
    uint32_t aux;
    size_t n;
    if (!ad_operands(AD_COMPOSITE_inverse, 1, &a, &none) ||
        !(n = side_of(AD_COMPOSITE_inverse, a, factors)))
        return none;
    ad_var f = factor(&a, n, factors, &aux);
    return ad_solve_factored(a, f, ad_each_unit(a.tape, n, ad_cols(a)), aux);
}

ad_var ad_logdet(ad_var a, enum ad_factors factors)
{
    ad_var none;
    uint32_t aux;
    size_t n;
    if (!ad_operands(AD_OP_logdet, 1, &a, &none) || !(n = side_of(AD_OP_logdet, a, factors)))
        return none;
    ad_var f = factor(&a, n, factors, &aux);
    return ad_append(a.tape, (struct node){.op = AD_OP_logdet,
                                           .rows = 1,
                                           .cols = (uint32_t)ad_cols(a),
                                           .in = {a.id, f.id},
                                           .aux = aux});
}

/* ---- products, as sums of products of gathered rows ---- */

static ad_var plus(ad_var sum, ad_var x) { return sum.id ? ad_add(sum, x) : x; }

ad_var ad_each_outer(ad_var u, ad_var v, size_t n, size_t m)
{
    ad_var sum = ad_at(u.tape, 0);
    uint32_t of_u[ROOM], of_v[ROOM];
    for (size_t k = 0; k < m; k++) {
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                of_u[i * n + j] = (uint32_t)(i * m + k);
                of_v[i * n + j] = (uint32_t)(j * m + k);
            }
        sum = plus(sum, ad_mul(ad_gather_rows(u, n * n, of_u), ad_gather_rows(v, n * n, of_v)));
    }
    return sum;
}

ad_var ad_each_product(ad_var a, ad_var x, size_t n, size_t m, bool transposed)
{
    ad_var sum = ad_at(a.tape, 0);
    uint32_t *of_a = malloc(2 * n * m * sizeof *of_a);
    if (!of_a)
        return ad_refuse(a.tape, AD_E_MEMORY, "out of memory for products of small systems");
    uint32_t *of_x = of_a + n * m;
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < m; k++) {
                of_a[i * m + k] = (uint32_t)(transposed ? j * n + i : i * n + j);
                of_x[i * m + k] = (uint32_t)(j * m + k);
            }
        sum = plus(sum, ad_mul(ad_gather_rows(a, n * m, of_a), ad_gather_rows(x, n * m, of_x)));
    }
    free(of_a);
    return sum;
}
