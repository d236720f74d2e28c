/* Decides whether a value is independent of others: its compiled derivative then folds to zero. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

ad_var phys_irregular(ad_tape *tape, size_t rows, size_t cols, double phase)
{
    size_t n = rows * cols;
    double *w = malloc((n + 1) * sizeof *w);
    if (!w)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        w[k] = 1 + sin(1.7 * (double)k + phase) / 3;
    ad_var c = ad_const(tape, rows, cols, w);
    free(w);
    return c;
}

ad_var phys_mixed(ad_var x, double phase)
{
    return ad_matmul(phys_irregular(x.tape, 1, ad_rows(x), phase), false, x, false);
}

static bool folds_to_zero(ad_tape *tape, ad_var g)
{
    ad_program *program;
    ad_var largest = ad_sum(ad_abs(g));
    double sum = NAN;
    if (ad_compile(tape, 1, &largest, &program) != AD_OK)
        return false;
    if (ad_program_info(program).instructions == 0) {
        ad_run(program);
        ad_get(program, largest, &sum);
    }
    ad_program_free(program);
    return sum == 0;
}

bool phys_is_independent(ad_tape *tape, ad_var y, size_t n, const ad_var x[],
                         struct ad_error *error)
{
    ad_var g;
    for (size_t k = 0; k < n; k++)
        if (ad_grad(ad_dot(y, phys_irregular(tape, ad_rows(y), ad_cols(y), 0.3)), 1, &x[k], &g) !=
                AD_OK ||
            !folds_to_zero(tape, g)) {
            phys_keep_memory(ad_tape_error(tape), error);
            return false;
        }
    return true;
}
