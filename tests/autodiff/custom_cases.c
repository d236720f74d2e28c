/* Operations of one's own of structure_cases.h: one that mixes all rows, and one of two inputs, one
   of which may stand for all columns. */
#include "ring.h"
#include "structure_cases.h"

enum { TAKEN = 5 };

/* A few rows, however many there are. */
static ad_var few(ad_var x)
{
    uint32_t list[TAKEN];
    for (size_t k = 0; k < TAKEN; k++)
        list[k] = (uint32_t)(k * 3 % ad_rows(x));
    return ad_gather_rows(x, TAKEN, list);
}

static double few_element(const struct matrix *x, size_t k, size_t c)
{
    return x->v[k * 3 % x->rows * x->cols + (x->cols == 1 ? 0 : c)];
}

static ad_var mixed(const ad_var x[2]) { return ring(few(x[0])); }

static double mixed_element(const struct matrix x[2], size_t r, size_t c)
{
    double column[TAKEN];
    for (size_t k = 0; k < TAKEN; k++)
        column[k] = few_element(x, k, c);
    return ring_element(column, TAKEN, 1, r, 0);
}

/* Two rows: the product of the inputs summed, and a linear one. */
static int products(void *user, size_t cols, const double *const x[], double *y)
{
    (void)user;
    for (size_t c = 0; c < cols; c++) {
        y[c] = y[cols + c] = 0;
        for (size_t k = 0; k < TAKEN; k++) {
            y[c] += x[0][k * cols + c] * x[1][k * cols + c];
            y[cols + c] += 0.25 * x[1][k * cols + c];
        }
    }
    return 0;
}

static int products_adjoint(void *user, size_t cols, const double *const x[], const double *y,
                            const double *gy, double *const gx[])
{
    (void)user, (void)y;
    for (size_t k = 0; k < TAKEN; k++)
        for (size_t c = 0; c < cols; c++) {
            gx[0][k * cols + c] = gy[c] * x[1][k * cols + c];
            gx[1][k * cols + c] = gy[c] * x[0][k * cols + c] + 0.25 * gy[cols + c];
        }
    return 0;
}

static void products_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)y;
    gx[0] = ad_mul(ad_row(gy, 0), x[1]);
    gx[1] = ad_add(ad_mul(ad_row(gy, 0), x[0]), ad_mul(0.25, ad_row(gy, 1)));
}

static ad_var multiplied(const ad_var x[2])
{
    const struct ad_custom operation = {.size = sizeof operation,
                                        .name = "products",
                                        .rows = 2,
                                        .value = products,
                                        .adjoint = products_adjoint,
                                        .recorded = products_recorded};
    return ad_custom(2, (ad_var[]){few(x[0]), few(x[1])}, &operation);
}

static double multiplied_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t k = 0; k < TAKEN; k++)
        s += few_element(x + 1, k, c) * (r ? 0.25 : few_element(x, k, c));
    return s;
}

const struct structure custom_cases[] = {
    {"custom", mixed, mixed_element, NONE, 1, SMOOTH},
    {"custom of two", multiplied, multiplied_element, SAME, 1, SMOOTH},
    {"custom by one column", multiplied, multiplied_element, ONE_COL, 1, SMOOTH},
};
const size_t custom_n_cases = sizeof custom_cases / sizeof custom_cases[0];
