/* Records linear systems, small ones in each column or a large one in a single column. The factor
   of a matrix is a value of its own, shared by its solutions, its determinant and their gradients.
 */
#include "autodiff/internal.h"
#include "autodiff/kernels/kernels.h"

#include <stdlib.h>

/* Size n of the n x n matrices in the columns of a; 0: refused. */
static size_t side_of(unsigned op, ad_var a, enum ad_factors factors)
{
    size_t n = 1;
    while (n * n < ad_rows(a) && n < AD_LARGEST_SIDE)
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
            ad_cols(a) == 1 ? AD_LARGEST_SIDE : AD_MOST_SIDE);
    else if (n > AD_MOST_SIDE && ad_cols(a) != 1)
        ad_refuse_operands(a.tape, AD_E_SHAPE, op, 1, &a,
                           "got matrices of %zu x %zu in %zu columns; expected n up to %d, or one "
                           "column",
                           n, n, ad_cols(a), AD_MOST_SIDE);
    return a.tape->error.status == AD_OK ? n : 0;
}

static void *room(ad_tape *tape, size_t n, size_t size)
{
    void *p = calloc(n, size);
    if (!p)
        ad_refuse(tape, AD_E_MEMORY, "out of memory for a linear system");
    return p;
}

/* The lower triangle in both. */
static ad_var symmetric(ad_var a, size_t n)
{
    uint32_t *list = room(a.tape, n * n, sizeof *list);
    for (size_t i = 0; list && i < n; i++)
        for (size_t j = 0; j < n; j++)
            list[i * n + j] = (uint32_t)((i > j ? i : j) * n + (i > j ? j : i));
    ad_var both = list ? ad_gather_rows(a, n * n, list) : a;
    free(list);
    return both;
}

/* Records the factor of *a; for Cholesky *a becomes symmetric. */
static ad_var factor(ad_var *a, size_t n, enum ad_factors factors, uint32_t *aux)
{
    const size_t more = n > AD_MOST_SIDE ? 4 * n : factors == AD_LU ? n : 0;
    *aux = (uint32_t)n | (factors == AD_CHOLESKY ? SYSTEM_CHOLESKY : 0);
    if (factors == AD_CHOLESKY && n > 1)
        *a = symmetric(*a, n);
    return ad_append(a->tape, (struct node){.op = AD_OP_factor,
                                            .rows = (uint32_t)(n * n + more),
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
    const size_t rows = ad_rows(b), cols = ad_cols(b);
    if (n > AD_MOST_SIDE) /* all right sides in one column */
        b = ad_reshape(b, rows * cols, 1);
    ad_var x = ad_solve_factored(a, f, b, aux);
    return n > AD_MOST_SIDE ? ad_reshape(x, rows, cols) : x;
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
    double *unit = room(tape, n * n, sizeof *unit);
    for (size_t i = 0; unit && i < n; i++)
        unit[i * n + i] = 1;
    ad_var all = unit ? ad_broadcast(ad_const(tape, n * n, 1, unit), n * n, cols) : ad_at(tape, 0);
    free(unit);
    return all;
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

/* ---- products: sums of products of gathered rows, or of large matrices in a single column ---- */

/* Matrices in the columns of x: element (i, j) is row i*row + j*col. */
struct matrices {
    ad_var x;
    size_t row, col;
};

/* a [n x inner] b [inner x m] */
static ad_var product(struct matrices a, struct matrices b, size_t n, size_t inner, size_t m)
{
    ad_var sum = ad_at(a.x.tape, 0);
    uint32_t *of_a = room(a.x.tape, 2 * n * m, sizeof *of_a), *of_b = of_a ? of_a + n * m : NULL;
    for (size_t j = 0; of_a && j < inner; j++) {
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < m; k++) {
                of_a[i * m + k] = (uint32_t)(i * a.row + j * a.col);
                of_b[i * m + k] = (uint32_t)(j * b.row + k * b.col);
            }
        ad_var term = ad_mul(ad_gather_rows(a.x, n * m, of_a), ad_gather_rows(b.x, n * m, of_b));
        sum = j ? ad_add(sum, term) : term;
    }
    free(of_a);
    return sum;
}

/* The same of one column; a flag says that the columns of the matrix are its rows there. */
static ad_var large(ad_var a, bool ta, ad_var b, bool tb, size_t n, size_t inner, size_t m)
{
    a = ta ? ad_reshape(a, inner, n) : ad_reshape(a, n, inner);
    b = tb ? ad_reshape(b, m, inner) : ad_reshape(b, inner, m);
    return ad_reshape(ad_matmul(a, ta, b, tb), n * m, 1);
}

ad_var ad_each_outer(ad_var u, ad_var v, size_t n, size_t m)
{
    return n > AD_MOST_SIDE
               ? large(u, false, v, true, n, m, n)
               : product((struct matrices){u, m, 1}, (struct matrices){v, 1, m}, n, m, n);
}

ad_var ad_each_product(ad_var a, ad_var x, size_t n, size_t m, bool transposed)
{
    const struct matrices by_rows = {a, n, 1}, by_cols = {a, 1, n}, b = {x, m, 1};
    return n > AD_MOST_SIDE ? large(a, transposed, x, false, n, n, m)
                            : product(transposed ? by_cols : by_rows, b, n, n, m);
}

ad_var ad_product(ad_var a, ad_var b, size_t inner)
{
    ad_var in[] = {a, b}, none;
    const size_t rows = ad_rows(a), more = ad_rows(b), cols = ad_cols(a);
    if (!ad_operands(AD_COMPOSITE_product, 2, in, &none))
        return none;
    if (!inner || rows % inner || more % inner ||
        (cols != ad_cols(b) && cols != 1 && ad_cols(b) != 1))
        return ad_refuse_operands(a.tape, AD_E_SHAPE, AD_COMPOSITE_product, 2, in,
                                  "expected as many columns, and rows of multiples of inner, got "
                                  "%zu",
                                  inner);
    return product((struct matrices){a, inner, 1}, (struct matrices){b, more / inner, 1},
                   rows / inner, inner, more / inner);
}
