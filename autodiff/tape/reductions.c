/* Records reductions as other operations: largest and smallest values, their positions,
   log-sum-exp, softmax. */
#include "autodiff/internal.h"

#include <float.h>
#include <stdlib.h>

static size_t extent(ad_var x, bool rows) { return rows ? ad_rows(x) : ad_cols(x); }

static ad_var part(ad_var x, bool rows, size_t first, size_t count)
{
    return rows ? ad_slice_rows(x, first, count) : ad_slice_cols(x, first, count);
}

/* Combines one half with the other until one row is left: log2(n) passes over n elements in all.
   The remainder of odd numbers comes last. */
static ad_var extreme(ad_var x, enum ad_op op, bool rows)
{
    ad_var rest = {0};
    for (size_t n = extent(x, rows); n > 1; n /= 2) {
        if (n % 2) {
            ad_var last = part(x, rows, n - 1, 1);
            rest = rest.tape ? ad_binary(op, AD_ARG(last), AD_ARG(rest)) : last;
        }
        x = ad_binary(op, AD_ARG(part(x, rows, 0, n / 2)), AD_ARG(part(x, rows, n / 2, n / 2)));
    }
    return rest.tape ? ad_binary(op, AD_ARG(x), AD_ARG(rest)) : x;
}

/* ---- largest and smallest ---- */

static ad_var reduce(unsigned name, ad_var x, enum ad_op op, bool rows)
{
    ad_var none;
    return ad_operands(name, 1, &x, &none) ? extreme(x, op, rows) : none;
}

ad_var ad_max_rows(ad_var x) { return reduce(AD_COMPOSITE_max_rows, x, AD_OP_max, true); }

ad_var ad_max_cols(ad_var x) { return reduce(AD_COMPOSITE_max_cols, x, AD_OP_max, false); }

ad_var ad_min_rows(ad_var x) { return reduce(AD_COMPOSITE_min_rows, x, AD_OP_min, true); }

ad_var ad_min_cols(ad_var x) { return reduce(AD_COMPOSITE_min_cols, x, AD_OP_min, false); }

/* 0, 1, ... as a column or a row. */
static ad_var numbers(ad_tape *tape, size_t n, bool rows)
{
    double *values = malloc(n * sizeof *values);
    if (!values)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory for %zu numbers", n);
    for (size_t k = 0; k < n; k++)
        values[k] = (double)k;
    ad_var y = ad_const(tape, rows ? n : 1, rows ? 1 : n, values);
    free(values);
    return y;
}

/* The first position at which x equals the largest value, or is NaN if that is NaN. */
static ad_var arg_max(unsigned name, ad_var x, bool rows)
{
    ad_var none;
    if (!ad_operands(name, 1, &x, &none))
        return none;
    size_t n = extent(x, rows);
    if (x.tape->type == AD_F32 && n > (1u << FLT_MANT_DIG))
        return ad_refuse_operands(x.tape, AD_E_SHAPE, name, 1, &x,
                                  "f32 has no number for each of %zu; expected at most 2^%d", n,
                                  FLT_MANT_DIG);
    ad_var at = ad_detach(x), largest = extreme(at, AD_OP_max, rows);
    ad_var found = ad_max(ad_eq(at, largest), ad_ne(at, at));
    return extreme(ad_select(found, numbers(x.tape, n, rows), (double)n), AD_OP_min, rows);
}

ad_var ad_arg_max_rows(ad_var x) { return arg_max(AD_COMPOSITE_arg_max_rows, x, true); }

ad_var ad_arg_max_cols(ad_var x) { return arg_max(AD_COMPOSITE_arg_max_cols, x, false); }

/* ---- log-sum-exp and softmax ---- */

static ad_var sum(ad_var x, bool rows) { return rows ? ad_sum_rows(x) : ad_sum_cols(x); }

/* exp(x - m) and its sum, where m is the largest x, or 0 if that is not finite. m is detached: its
   gradient vanishes but for rounding. */
static ad_var shifted_exp(ad_var x, ad_var largest, bool rows, ad_var *total)
{
    double most = x.tape->type == AD_F32 ? (double)FLT_MAX : DBL_MAX;
    ad_var m = ad_select(ad_le(ad_abs(largest), most), largest, 0.0);
    ad_var e = ad_exp(ad_sub(x, m));
    *total = sum(e, rows);
    return e;
}

/* Where all x are -inf the sum is 0. Then the logarithm is taken of 1, so that the gradient is 0
   instead of 0/0; the value is -inf through m. */
static ad_var log_sum_exp(unsigned name, ad_var x, bool rows)
{
    ad_var none, total;
    if (!ad_operands(name, 1, &x, &none))
        return none;
    ad_var largest = ad_detach(extreme(x, AD_OP_max, rows));
    shifted_exp(x, largest, rows, &total);
    return ad_add(largest, ad_log(ad_add(total, ad_eq(total, 0.0))));
}

ad_var ad_log_sum_exp_rows(ad_var x) { return log_sum_exp(AD_COMPOSITE_log_sum_exp_rows, x, true); }

ad_var ad_log_sum_exp_cols(ad_var x)
{
    return log_sum_exp(AD_COMPOSITE_log_sum_exp_cols, x, false);
}

static ad_var softmax(unsigned name, ad_var x, bool rows)
{
    ad_var none, total;
    if (!ad_operands(name, 1, &x, &none))
        return none;
    ad_var e = shifted_exp(x, ad_detach(extreme(x, AD_OP_max, rows)), rows, &total);
    return ad_div(e, total);
}

ad_var ad_softmax_rows(ad_var x) { return softmax(AD_COMPOSITE_softmax_rows, x, true); }

ad_var ad_softmax_cols(ad_var x) { return softmax(AD_COMPOSITE_softmax_cols, x, false); }
