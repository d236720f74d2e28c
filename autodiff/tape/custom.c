/* Recording of a user's own operation: its inputs lie one above the other in one operand. */
#include "autodiff/internal.h"
#include "autodiff/sized.h"

#include <stdio.h>
#include <string.h>

/* Its number: that of the last one where this is the same, so that equal values are computed once.
   UINT32_MAX when out of memory. */
static uint32_t number_of(ad_tape *tape, const struct custom *c)
{
    if (tape->n_customs && !memcmp(&tape->customs[tape->n_customs - 1], c, sizeof *c))
        return (uint32_t)tape->n_customs - 1;
    if (!ad_reserve((void **)&tape->customs, tape->n_customs, &tape->max_customs, 1,
                    sizeof *tape->customs)) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory for an operation of the caller's");
        return UINT32_MAX;
    }
    memcpy(&tape->customs[tape->n_customs], c, sizeof *c); /* what lies between members, too */
    return (uint32_t)tape->n_customs++;
}

/* What is wrong with an operation on n inputs; NULL: nothing. */
static const char *mistake(size_t n, const struct ad_custom *operation)
{
    return !operation->value   ? "got no value callback (NULL)"
           : !operation->rows  ? "got a result of 0 rows"
           : n > CUSTOM_INPUTS ? "got more than 16 inputs"
                               : NULL;
}

ad_var ad_custom(size_t n, const ad_var x[], const struct ad_custom *operation)
{
    ad_var none, in[CUSTOM_INPUTS];
    if (!x || !ad_operands(AD_OP_custom, n, x, &none))
        return x ? none : (ad_var){0};
    ad_tape *tape = none.tape;
    struct ad_custom own;
    struct ad_error error = {0};
    const char *wrong = AD_TAKE(&own, operation, user, &error) ? mistake(n, &own) : error.message;
    if (wrong)
        return ad_refuse_operands(tape, AD_E_ARGUMENT, AD_OP_custom, n > 3 ? 0 : n, x, "%s", wrong);
    struct custom c;
    memset(&c, 0, sizeof c);
    operation = &own;
    memcpy(&c.by, operation, sizeof c.by);
    c.by.name = NULL;
    c.n = (uint32_t)n;
    snprintf(c.name, sizeof c.name, "%s", operation->name ? operation->name : "");
    size_t cols = 1, inputs = 0;
    for (size_t k = 0; k < n; k++)
        cols = ad_cols(x[k]) > 1 ? ad_cols(x[k]) : cols;
    for (size_t k = 0; k < n; k++) {
        if (ad_cols(x[k]) != cols && ad_cols(x[k]) != 1)
            return ad_refuse_operands(tape, AD_E_SHAPE, AD_OP_custom, n > 3 ? 0 : n, x,
                                      "input %zu has %zu columns; expected %zu or 1", k,
                                      ad_cols(x[k]), cols);
        c.rows[k] = (uint32_t)ad_rows(x[k]);
        inputs += c.rows[k];
        in[k] = ad_broadcast(x[k], c.rows[k], cols);
    }
    if (!ad_shape_fits(tape, AD_OP_custom, 0, NULL, inputs, cols) ||
        !ad_shape_fits(tape, AD_OP_custom, 0, NULL, operation->rows, cols))
        return none;
    c.inputs = (uint32_t)inputs;
    ad_var above = n == 1 ? in[0] : ad_concat_rows(n, in);
    uint32_t number = number_of(tape, &c);
    return ad_append(tape, (struct node){.op = AD_OP_custom,
                                         .rows = (uint32_t)operation->rows,
                                         .cols = (uint32_t)cols,
                                         .in = {above.id},
                                         .aux = number});
}
