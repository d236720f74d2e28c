/* Errors of recording: which operands an operation refuses, and the message: the operation, its
   number, and its operands by label or by the nearest label recorded before them. */
#include "autodiff/internal.h"
#include "autodiff/text.h"

#include <stdarg.h>
#include <stdio.h>

#define NAME(name) #name,
static const char *const composites[] = {AD_COMPOSITES(NAME)};
#undef NAME

static const char *name_of(unsigned op)
{
    return op < AD_N_OPS                        ? ad_ops[op].name
           : op - AD_N_OPS < LENGTH(composites) ? composites[op - AD_N_OPS]
                                                : "?";
}

/* ---- descriptions ---- */

/* The label of node `last`, or the nearest one before it; NULL if there is none. */
static const struct label *nearest_label(const ad_tape *tape, size_t last)
{
    const struct label *nearest = NULL;
    for (size_t k = 0; k < tape->n_labels; k++)
        if (tape->labels[k].id <= last && (!nearest || tape->labels[k].id >= nearest->id))
            nearest = &tape->labels[k];
    return nearest;
}

bool ad_describe(struct ad_text *t, ad_var x)
{
    const ad_tape *tape = x.tape;
    uint32_t id = x.id;
    const struct node *n = node_at(tape, id);
    const struct label *label = nearest_label(tape, id);
    const char *name = label ? tape->texts + label->text : NULL;
    ad_text_add(t, "%u x %u ", n->rows, n->cols);
    if (name && label->id == id)
        ad_text_add(t, "\"%.32s\"", name);
    else if (name)
        ad_text_add(t, "%s (operation %u, after \"%.32s\")", ad_ops[n->op].name, id, name);
    else
        ad_text_add(t, "%s (operation %u)", ad_ops[n->op].name, id);
    return name;
}

/* The operands that exist; if there are none, the last label recorded. */
static void append_operands(struct ad_text *t, const ad_tape *tape, size_t n, const ad_var x[])
{
    const struct label *label = nearest_label(tape, tape->n_nodes);
    const char *between = ", of ";
    bool labelled = false;
    for (size_t k = 0; k < n; k++) {
        if (x[k].tape != tape || !ad_is_current(x[k]))
            continue;
        ad_text_add(t, "%s", between);
        labelled |= ad_describe(t, x[k]);
        between = " and ";
    }
    if (!labelled && label)
        ad_text_add(t, ", after \"%.32s\"", tape->texts + label->text);
}

ad_var ad_refuse_operands(ad_tape *tape, enum ad_status status, unsigned op, size_t n,
                          const ad_var x[], const char *format, ...)
{
    char message[sizeof tape->error.message];
    struct ad_text t = {message, sizeof message, 0};
    va_list list;
    ad_text_add(&t, "%s (operation %zu): ", name_of(op), tape->n_nodes);
    va_start(list, format);
    ad_text_add_list(&t, format, list);
    va_end(list);
    append_operands(&t, tape, n, x);
    return ad_refuse(tape, status, "%s", message);
}

/* ---- operands ---- */

/* A handle without a tape carries the operation that could not record its error. */
static ad_var nowhere(unsigned op, size_t n, const ad_var x[])
{
    for (size_t k = 0; k < n; k++)
        if (x[k].id)
            return x[k];
    return (ad_var){.id = op + 1};
}

bool ad_all_on(ad_tape *tape, unsigned op, const char *what, size_t n, const ad_var x[])
{
    enum { MOST_NAMED = 3 };
    size_t k = 0;
    while (k < n && x[k].tape == tape && ad_is_current(x[k]))
        k++;
    if (k == n)
        return true;
    const char *why = !x[k].tape          ? "was never recorded"
                      : x[k].tape->freed  ? "is of a tape that was freed"
                      : x[k].tape != tape ? "is of another tape"
                                          : "was recorded before the tape was reset";
    const char *cause = !x[k].tape && x[k].id ? name_of(x[k].id - 1) : NULL;
    char number[24] = "";
    if (n > 1)
        snprintf(number, sizeof number, " %zu", k);
    ad_refuse_operands(tape, AD_E_TAPE, op, n <= MOST_NAMED ? n : 0, x, "%s%s %s%s%s", what, number,
                       why, cause ? ": it is the result of " : "", cause ? cause : "");
    return false;
}

bool ad_operands(unsigned op, size_t n, const ad_var x[], ad_var *none)
{
    ad_tape *tape = NULL;
    for (size_t k = 0; k < n && !tape; k++)
        tape = x[k].tape;
    *none = tape ? ad_at(tape, 0) : nowhere(op, n, x);
    if (!tape || tape->error.status != AD_OK)
        return false;
    return ad_all_on(tape, op, "variable", n, x);
}

bool ad_shape_fits(ad_tape *tape, unsigned op, size_t n, const ad_var x[], size_t rows, size_t cols)
{
    if (!tape || tape->error.status != AD_OK)
        return false;
    if (ad_is_shape(rows, cols))
        return true;
    ad_refuse_operands(tape, AD_E_SHAPE, op, n, x, "%zu x %zu is %s", rows, cols,
                       rows && cols ? "too large, expected at most 2^31 - 1 rows, 2^31 - 1 columns "
                                      "and 2^46 elements"
                                    : "empty");
    return false;
}
