/* Records place operations: parts added at given positions of a zero matrix. The list of a node is
   the number of parts, then id, row and column of each. */
#include "autodiff/internal.h"

#include <stdlib.h>

/* Room for the places of n parts, to be filled; NULL when out of memory. */
static uint32_t *new_list(ad_tape *tape, size_t n, uint32_t *list)
{
    if (n >= UINT32_MAX / 4 || 3 * n + 1 >= UINT32_MAX - tape->n_lists ||
        !ad_reserve((void **)&tape->lists, tape->n_lists, &tape->max_lists, 3 * n + 1,
                    sizeof *tape->lists)) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory for %zu parts", n);
        return NULL;
    }
    uint32_t *places = tape->lists + tape->n_lists;
    *places++ = (uint32_t)n;
    *list = (uint32_t)tape->n_lists;
    tape->n_lists += 3 * n + 1;
    return places;
}

static ad_var append(ad_tape *tape, size_t rows, size_t cols, uint32_t list)
{
    return ad_append(
        tape, (struct node){
                  .op = AD_OP_place, .rows = (uint32_t)rows, .cols = (uint32_t)cols, .aux = list});
}

static bool part_fits(ad_var part, size_t rows, size_t cols, size_t row, size_t col)
{
    return row <= rows && ad_rows(part) <= rows - row && col <= cols && ad_cols(part) <= cols - col;
}

ad_var ad_place(ad_tape *tape, size_t rows, size_t cols, size_t n, const ad_var parts[],
                const size_t row[], const size_t col[])
{
    uint32_t list;
    if (!ad_shape_fits(tape, AD_OP_place, 0, NULL, rows, cols))
        return ad_refused(tape);
    if (n && (!parts || !row || !col))
        return ad_refuse(tape, AD_E_ARGUMENT, "place: got no parts, or no places of them (NULL)");
    if (!ad_all_on(tape, AD_OP_place, "part", n, parts))
        return ad_at(tape, 0);
    for (size_t k = 0; k < n; k++)
        if (!part_fits(parts[k], rows, cols, row[k], col[k]))
            return ad_refuse_operands(tape, AD_E_SHAPE, AD_OP_place, 1, &parts[k],
                                      "part %zu at (%zu, %zu) leaves the %zu x %zu value", k,
                                      row[k], col[k], rows, cols);
    if (n == 1 && ad_rows(parts[0]) == rows && ad_cols(parts[0]) == cols)
        return parts[0];
    uint32_t *to = new_list(tape, n, &list);
    if (!to)
        return ad_at(tape, 0);
    for (size_t k = 0; k < n; k++) {
        *to++ = parts[k].id;
        *to++ = (uint32_t)row[k];
        *to++ = (uint32_t)col[k];
    }
    return append(tape, rows, cols, list);
}

/* Scalar constants, as one; refused where memory is missing, for a recording that depends on it has
   other roundings. */
static bool constants(bool rows, size_t n, const ad_var parts[], ad_var *y)
{
    double value, *values;
    for (size_t k = 0; k < n; k++)
        if (!ad_constant_value(parts[k], &value))
            return false;
    if (!(values = malloc(n * sizeof *values))) {
        *y = ad_refuse(parts->tape, AD_E_MEMORY, "out of memory for %zu parts", n);
        return true;
    }
    for (size_t k = 0; k < n; k++)
        ad_constant_value(parts[k], &values[k]);
    *y = ad_const(parts->tape, rows ? n : 1, rows ? 1 : n, values);
    free(values);
    return true;
}

/* Adjacent parts, one below the other (rows) or side by side. */
static ad_var concat(unsigned op, size_t n, const ad_var parts[])
{
    bool rows = op == AD_COMPOSITE_concat_rows;
    ad_var none = {0};
    if ((n && !parts) || !ad_operands(op, n, parts, &none))
        return none;
    ad_tape *tape = parts[0].tape;
    size_t across = rows ? ad_cols(parts[0]) : ad_rows(parts[0]), along = 0;
    for (size_t k = 0; k < n; k++) {
        if ((rows ? ad_cols(parts[k]) : ad_rows(parts[k])) != across)
            return ad_refuse_operands(tape, AD_E_SHAPE, op, 2, (ad_var[]){parts[0], parts[k]},
                                      "part %zu differs from the first", k);
        along += rows ? ad_rows(parts[k]) : ad_cols(parts[k]);
    }
    if (n == 1 || constants(rows, n, parts, &none))
        return n == 1 ? parts[0] : none;
    uint32_t list, at = 0, *to;
    if (!ad_shape_fits(tape, op, 1, parts, rows ? along : across, rows ? across : along) ||
        !(to = new_list(tape, n, &list)))
        return none;
    for (size_t k = 0; k < n; k++) {
        *to++ = parts[k].id;
        *to++ = rows ? at : 0;
        *to++ = rows ? 0 : at;
        at += (uint32_t)(rows ? ad_rows(parts[k]) : ad_cols(parts[k]));
    }
    return append(tape, rows ? along : across, rows ? across : along, list);
}

ad_var ad_concat_rows(size_t n, const ad_var parts[])
{
    return concat(AD_COMPOSITE_concat_rows, n, parts);
}

ad_var ad_concat_cols(size_t n, const ad_var parts[])
{
    return concat(AD_COMPOSITE_concat_cols, n, parts);
}
