/* Public functions of direct evaluation (direct.h): memory, inputs, results. */
#include "autodiff/free.h"
#include "direct.h"

#include <stdlib.h>
#include <string.h>

/* Places of the nodes recorded since the last time. Scalars before the first other shape need no
   places: node k is element k. */
static bool place_nodes(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    d->n_scalars = tape->n_scalars;
    if (end <= d->n_scalars) {
        d->elements = d->elements < end ? end : d->elements;
        return true;
    }
    if (end > d->n_offsets && !ad_reserve((void **)&d->offset, d->n_offsets, &d->max_offsets,
                                          end - d->n_offsets, sizeof *d->offset))
        return false;
    for (; d->n_offsets < end; d->n_offsets++) {
        const size_t id = d->n_offsets;
        const struct node *n = node_at(tape, (uint32_t)id - (id > 0));
        d->offset[id] = id ? d->offset[id - 1] + node_size(n) : 0;
    }
    const size_t last = d->n_offsets - 1;
    d->elements = d->offset[last] + node_size(node_at(tape, (uint32_t)last));
    return true;
}

static bool list_scalars(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    _Static_assert(AD_N_OPS <= UINT8_MAX, "operations are listed as bytes");
    if (end > d->max_listed) {
        const size_t most = (size_t)end + end / 4;
        AD_FREE(d->op, d->in);
        d->op = ad_allocate_large(most);
        d->in = ad_allocate_large(most * sizeof *d->in);
        d->n_listed = 0;
        d->max_listed = d->op && d->in ? (uint32_t)(most < UINT32_MAX ? most : UINT32_MAX) : 0;
    }
    for (; d->n_listed < end && d->max_listed; d->n_listed++) {
        const struct node *n = node_at(tape, d->n_listed);
        d->op[d->n_listed] = (uint8_t)n->op;
        d->in[d->n_listed] = (struct operands){n->in[0], n->in[1]};
    }
    return d->max_listed;
}

static bool reserve(const ad_tape *tape, struct ad_direct *d, uint32_t end, bool adjoints)
{
    if (!place_nodes(tape, d, end) || (end <= d->n_scalars && !list_scalars(tape, d, end)))
        return false;
    const size_t size = type_bytes(tape->type);
    if (d->elements > SIZE_MAX / 2 / size)
        return false;
    if (d->bytes < d->elements * size) {
        size_t bytes = d->elements * size + d->elements * size / 2;
        AD_FREE(d->value, d->adjoint);
        d->adjoint = NULL;
        d->value = ad_allocate_large(bytes);
        d->bytes = d->value ? bytes : 0;
    }
    if (adjoints && d->value && !d->adjoint)
        d->adjoint = ad_allocate_large(d->bytes);
    return d->value && (!adjoints || d->adjoint);
}

void ad_direct_reset(struct ad_direct *d)
{
    if (d)
        d->n_offsets = d->elements = d->n_listed = 0;
}

void ad_direct_free(struct ad_direct *d)
{
    if (!d)
        return;
    AD_FREE(d->offset, d->value, d->adjoint, d->op, d->in, d);
}

size_t ad_direct_bytes(const struct ad_direct *d)
{
    return d ? sizeof *d + d->bytes * (d->adjoint ? 2 : 1) + d->max_offsets * sizeof *d->offset +
                   d->max_listed * (sizeof *d->op + sizeof *d->in)
             : 0;
}

static void put(const ad_tape *tape, void *array, size_t at, size_t n, const double *from)
{
    if (tape->type == AD_F64)
        memcpy((double *)array + at, from, n * sizeof *from);
    else
        for (size_t k = 0; k < n; k++)
            ((float *)array)[at + k] = (float)from[k];
}

static void get(const ad_tape *tape, const void *array, size_t at, size_t n, double *to)
{
    if (tape->type == AD_F64)
        memcpy(to, (const double *)array + at, n * sizeof *to);
    else
        for (size_t k = 0; k < n; k++)
            to[k] = (double)((const float *)array)[at + k];
}

/* Each input before y is one of x. Sorted handles would make this n log n; inputs are few, or come
   in the order of their recording, which is looked at first. */
static bool all_given(const ad_tape *tape, uint32_t end, size_t n, const ad_var x[],
                      struct ad_error *error)
{
    size_t next = n;
    for (uint32_t id = tape->last_input; id; id = node_at(tape, id)->in[0]) {
        if (id >= end)
            continue;
        size_t k = next - 1;
        for (size_t tried = 0; tried < n && (k >= n || x[k].id != id); tried++)
            k = tried;
        if (k >= n || x[k].id != id) {
            ad_fail(error, AD_E_ARGUMENT, "input %s%u has no value; expected all inputs in x",
                    "recorded as operation ", id);
            return false;
        }
        next = k;
    }
    return true;
}

static enum ad_status check(ad_var y, size_t n, const ad_var x[], struct ad_error *error)
{
    if (y.tape && y.tape->error.status != AD_OK)
        return ad_fail(error, y.tape->error.status, "%s", y.tape->error.message);
    if (!ad_is_current(y))
        return ad_fail(error, AD_E_TAPE, "y is no variable of a tape, or of an earlier recording");
    for (size_t k = 0; k < n; k++) {
        if (!ad_is_current(x[k]) || x[k].tape != y.tape)
            return ad_fail(error, AD_E_TAPE, "x[%zu] is no variable of the tape of y", k);
        if (node_at(y.tape, x[k].id)->op != AD_OP_input)
            return ad_fail(error, AD_E_ARGUMENT, "x[%zu] is no input", k);
    }
    return all_given(y.tape, y.id + 1, n, x, error) ? AD_OK : error->status;
}

static enum ad_status run(size_t n, const ad_var x[], const double *const at[], ad_var y,
                          double *value, double *const gradient[], struct ad_error *error)
{
    struct ad_error own = {0};
    error = error ? error : &own;
    if (n && (!x || !at))
        return ad_fail(error, AD_E_ARGUMENT, "no inputs, or no values of them (NULL)");
    if (check(y, n, x, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++)
        if (!at[k])
            return ad_fail(error, AD_E_ARGUMENT, "no values of x[%zu] (NULL)", k);
    ad_tape *tape = y.tape;
    const uint32_t end = y.id + 1;
    if (!tape->direct)
        tape->direct = calloc(1, sizeof *tape->direct);
    struct ad_direct *d = tape->direct;
    if (!d || !reserve(tape, d, end, gradient != NULL))
        return ad_fail(error, AD_E_MEMORY, "out of memory for the values of %u operations", end);
    const bool wide = tape->type == AD_F64;
    for (size_t k = 0; k < n; k++)
        if (x[k].id < end)
            put(tape, d->value, direct_offset(d, x[k].id), node_size(node_at(tape, x[k].id)),
                at[k]);
    d->singular = 0;
    d->error = (struct ad_error){0};
    (wide ? ad_forward_f64 : ad_forward_f32)(tape, d, end);
    if (d->singular)
        return ad_name_singular(error, d->singular, node_at(tape, d->singular)->aux, d->column);
    if (d->error.status != AD_OK)
        return ad_fail(error, d->error.status, "%s", d->error.message);
    const size_t y_at = direct_offset(d, y.id), y_size = node_size(node_at(tape, y.id));
    if (value)
        get(tape, d->value, y_at, y_size, value);
    if (!gradient)
        return AD_OK;
    memset(d->adjoint, 0, (y_at + y_size) * type_bytes(tape->type));
    for (size_t k = 0; k < y_size; k++)
        put(tape, d->adjoint, y_at + k, 1, &(double){1});
    (wide ? ad_backward_f64 : ad_backward_f32)(tape, d, end);
    if (d->error.status != AD_OK)
        return ad_fail(error, d->error.status, "%s", d->error.message);
    for (size_t k = 0; k < n; k++) {
        const size_t size = node_size(node_at(tape, x[k].id));
        if (gradient[k] && x[k].id < end)
            get(tape, d->adjoint, direct_offset(d, x[k].id), size, gradient[k]);
        else if (gradient[k])
            memset(gradient[k], 0, size * sizeof(double));
    }
    return AD_OK;
}

enum ad_status ad_evaluate(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, struct ad_error *error)
{
    return run(n, x, at, y, value, NULL, error);
}

enum ad_status ad_gradient(size_t n, const ad_var x[], const double *const at[], ad_var y,
                           double *value, double *const gradient[], struct ad_error *error)
{
    return run(n, x, at, y, value, gradient, error);
}
