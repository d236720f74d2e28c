/* Public functions of programs: threads, inputs and outputs, checked runs, reports. */
#include "autodiff/free.h"
#include "exec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void ad_program_free(ad_program *p)
{
    if (!p)
        return;
    for (size_t i = 0; i < p->n_labels; i++)
        free(p->labels[i]);
    if (p->back_end)
        p->back_end->free(p->back_end_state);
    AD_FREE(p->labels, p->label_values, p->values, p->nodes, p->last, p->locs, p->instructions,
            p->segments, p->sinks, p->parts, p->customs, p->numbers, p->lists, p->ports, p->calls,
            p->factors);
    ad_free_scans(p);
    AD_FREE(p->memory, p->tiles, p->more_tiles, p);
}

void ad_set_threads(ad_program *p, size_t threads)
{
    if (!p)
        return;
    threads = threads < 1 ? 1 : threads > 1024 ? 1024 : threads;
    char *more = threads > 1 ? aligned_alloc(ALIGNMENT, (threads - 1) * p->tile_bytes) : NULL;
    if (threads > 1 && !more)
        return; /* keeps the threads it has */
    if (more)
        memset(more, 0, (threads - 1) * p->tile_bytes);
    free(p->more_tiles);
    p->more_tiles = more;
    p->threads = threads;
    for (size_t k = 0; k < p->n_scans; k++)
        ad_set_threads(ad_step_program(p, k), threads);
}

/* ---- inputs and outputs ---- */

static const struct port *find_port(const ad_program *p, ad_var x)
{
    if (!p || x.recording != p->recording)
        return NULL;
    size_t low = 0, high = p->n_ports;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (p->ports[middle].node < x.id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < p->n_ports && p->ports[low].node == x.id ? &p->ports[low] : NULL;
}

void *ad_data(ad_program *p, ad_var x)
{
    const struct port *port = find_port(p, x);
    return port ? p->memory + p->locs[port->value].off : NULL;
}

enum ad_status ad_set(ad_program *p, ad_var x, const double *values)
{
    const struct port *port = find_port(p, x);
    if (!port || !port->input)
        return AD_E_TAPE;
    if (!values)
        return AD_E_ARGUMENT;
    const struct value *v = &p->values[port->value];
    p->held_stand = p->held_stand && !(v->flags & VALUE_HELD);
    p->kernels->from_double((size_t)v->rows * v->cols, p->memory + p->locs[port->value].off,
                            values);
    return AD_OK;
}

enum ad_status ad_get(const ad_program *p, ad_var x, double *values)
{
    const struct port *port = find_port(p, x);
    if (!port)
        return AD_E_TAPE;
    if (!values)
        return AD_E_ARGUMENT;
    const struct value *v = &p->values[port->value];
    p->kernels->to_double((size_t)v->rows * v->cols, values, p->memory + p->locs[port->value].off);
    return AD_OK;
}

/* ---- reports ---- */

/* The first constant or input that is not finite, in the order of recording. */
static void look_at_leaves(const ad_program *p, struct check *check)
{
    size_t lane;
    for (uint32_t i = 0; i < p->n_values && i < check->value; i++) {
        const struct value *v = &p->values[i];
        const char *at = p->memory + p->locs[i].off;
        if ((v->op != AD_OP_input && v->op != AD_OP_constant) ||
            !p->kernels->nonfinite((size_t)v->rows * v->cols, at, &lane))
            continue;
        *check = (struct check){i, (uint32_t)(lane / v->cols), (uint32_t)(lane % v->cols), 0};
        p->kernels->to_double(1, &check->found, at + lane * p->element);
    }
}

static const char *label_of(const ad_program *p, uint32_t value)
{
    for (size_t i = p->n_labels; i-- > 0;)
        if (p->label_values[i] == value)
            return p->labels[i];
    return NULL;
}

enum ad_status ad_run_checked(ad_program *p, struct ad_error *error)
{
    struct check check = {.value = UINT32_MAX};
    if (AD_LACKS(error, p))
        return error->status;
    ad_execute(p, p->segments, 0, p->n_segments, &check);
    look_at_leaves(p, &check);
    uint32_t wrong = ad_report_run(p, &p->error);
    p->was_run = true;
    p->held_stand = p->error.status != AD_E_ACCURACY;
    if (check.value == UINT32_MAX || wrong <= check.value)
        return wrong != UINT32_MAX ? ad_fail(error, p->error.status, "%s", p->error.message)
                                   : AD_OK;
    const struct value *v = &p->values[check.value];
    const char *label = label_of(p, check.value);
    check.row += check.col / v->cols; /* flat segments run all rows as one */
    check.col %= v->cols;
    return ad_fail(error, AD_E_NONFINITE, "node %u (%s%s%s%s) is %g at row %u, column %u",
                   p->nodes[check.value], ad_op_name((enum ad_op)v->op), label ? ", \"" : "",
                   label ? label : "", label ? "\"" : "",
                   isnan(check.found) ? (double)NAN : check.found, check.row, check.col);
}

struct ad_program_info ad_program_info(const ad_program *p)
{
    if (!p)
        return (struct ad_program_info){0};
    struct ad_program_info info = {.nodes = p->n_values,
                                   .segments = p->n_segments - p->n_constant_segments,
                                   .value_bytes = p->memory_bytes + p->threads * p->tile_bytes +
                                                  ad_scans_bytes(p)};
    for (size_t i = 0; i < p->n_values; i++)
        info.constants += (p->values[i].flags & VALUE_CONSTANT) != 0;
    for (size_t i = p->n_constant_segments; i < p->n_segments; i++)
        info.instructions += p->segments[i].count;
    info.bytes = sizeof *p + p->n_values * (sizeof *p->values + sizeof *p->locs) +
                 p->n_instructions * sizeof *p->instructions + p->n_segments * sizeof *p->segments +
                 p->n_sinks * sizeof *p->sinks + p->n_parts * sizeof *p->parts +
                 p->n_numbers * sizeof *p->numbers + p->n_lists * sizeof *p->lists +
                 p->n_ports * sizeof *p->ports + p->n_customs * sizeof *p->customs +
                 p->n_calls * sizeof *p->calls;
    return info;
}
