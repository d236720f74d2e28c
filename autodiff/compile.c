/* Compiling: from a tape to a program, and the program's inputs, outputs and reports. */
#include "exec.h"
#include "native.h"
#include "plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ALIGNMENT = 64 };

static size_t aligned(size_t bytes) { return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT; }

/* ---- making a program ---- */

static void write_constants(const ad_program *p, const ad_tape *tape)
{
    for (size_t i = 0; i < p->n_values; i++) {
        const struct value *v = &p->values[i];
        if (v->op == AD_OP_constant)
            p->kernels->from_double((size_t)v->rows * v->cols, p->memory + p->locs[i].off,
                                    tape->numbers + v->aux);
    }
}

static bool copy_labels(ad_program *p, const struct graph *g)
{
    const ad_tape *tape = g->tape;
    p->labels = calloc(tape->n_labels + 1, sizeof *p->labels);
    p->label_values = calloc(tape->n_labels + 1, sizeof *p->label_values);
    if (!p->labels || !p->label_values)
        return false;
    for (size_t k = 0; k < tape->n_labels; k++) {
        uint32_t value = g->renumber[tape->labels[k].id];
        const char *text = tape->texts + tape->labels[k].text;
        if (value == UINT32_MAX)
            continue;
        char *copy = malloc(strlen(text) + 1);
        if (!copy)
            return false;
        p->labels[p->n_labels] = strcpy(copy, text);
        p->label_values[p->n_labels++] = value;
    }
    return true;
}

/* Hands over what the graph and the program share. */
static void take_arrays(ad_program *p, struct graph *g)
{
    p->values = g->values;
    p->n_values = g->n;
    p->locs = g->locs;
    p->lists = g->lists;
    p->n_lists = g->n_lists;
    p->ports = g->ports;
    p->n_ports = g->n_ports;
    g->values = NULL;
    g->locs = NULL;
    g->lists = NULL;
    g->ports = NULL;
}

static bool allocate_memory(ad_program *p, const struct plan *plan)
{
    p->memory_bytes = aligned(plan->memory + ALIGNMENT);
    p->tile_bytes = aligned(plan->tile_bytes + ALIGNMENT);
    p->threads = 1;
    p->memory = aligned_alloc(ALIGNMENT, p->memory_bytes);
    p->tiles = aligned_alloc(ALIGNMENT, p->tile_bytes);
    if (!p->memory || !p->tiles)
        return false;
    memset(p->memory, 0, p->memory_bytes);
    return true;
}

static void *trimmed(void *array, size_t n, size_t size)
{
    void *smaller = realloc(array, n ? n * size : 1);
    return smaller ? smaller : array;
}

/* Arrays grew in steps; a program keeps only what it uses. */
static void trim(ad_program *p, const struct graph *g)
{
    p->instructions = trimmed(p->instructions, p->n_instructions, sizeof *p->instructions);
    p->values = trimmed(p->values, p->n_values, sizeof *p->values);
    p->locs = trimmed(p->locs, g->n_locs, sizeof *p->locs);
}

static bool plan_program(struct graph *g, ad_program *p)
{
    size_t n = g->n + 1;
    struct plan plan = {.graph = g,
                        .program = p,
                        .memory = ALIGNMENT, /* compiled code reads a lane before and behind */
                        .last = calloc(n, sizeof *plan.last),
                        .link = calloc(n, sizeof *plan.link),
                        .spot = calloc(n, sizeof *plan.spot)};
    bool done = plan.last && plan.link && plan.spot && copy_labels(p, g) &&
                ad_plan_storage(&plan) && ad_plan_emit(&plan) && allocate_memory(p, &plan);
    free(plan.last);
    free(plan.link);
    free(plan.spot);
    return done;
}

static enum ad_status check_outputs(ad_tape *tape, size_t n_out, const ad_var out[])
{
    for (size_t k = 0; k < n_out; k++)
        if (out[k].tape != tape)
            ad_fail(&tape->error, AD_E_TAPE, "compile: output %zu is not of this tape", k);
    return tape->error.status;
}

enum ad_status ad_compile(ad_tape *tape, size_t n_out, const ad_var out[], ad_program **program)
{
    *program = NULL;
    if (check_outputs(tape, n_out, out) != AD_OK)
        return tape->error.status;
    struct graph graph = {0};
    ad_program *p = calloc(1, sizeof *p);
    bool done = false;
    if (p) {
        p->type = tape->type;
        p->element = type_bytes(tape->type);
        p->kernels = ad_kernels_for(tape->type);
        done = ad_graph_build(&graph, tape, n_out, out) && ad_graph_schedule(&graph) &&
               ad_graph_merge(&graph) && plan_program(&graph, p);
    }
    if (done) {
        take_arrays(p, &graph);
        trim(p, &graph);
        done = ad_resolve_calls(p);
    }
    if (done) {
        write_constants(p, tape);
        ad_program_execute(p, 0, p->n_constant_segments, NULL);
        *program = p;
    } else {
        ad_program_free(p);
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory when compiling %zu nodes", tape->n_nodes);
    }
    ad_graph_release(&graph);
    return tape->error.status;
}

void ad_program_free(ad_program *p)
{
    if (!p)
        return;
    for (size_t i = 0; i < p->n_labels; i++)
        free(p->labels[i]);
    ad_native_free(p->native);
    free(p->labels);
    free(p->label_values);
    free(p->values);
    free(p->locs);
    free(p->instructions);
    free(p->segments);
    free(p->sinks);
    free(p->parts);
    free(p->numbers);
    free(p->lists);
    free(p->ports);
    free(p->calls);
    free(p->memory);
    free(p->tiles);
    free(p->more_tiles);
    free(p);
}

void ad_set_threads(ad_program *p, size_t threads)
{
    threads = threads < 1 ? 1 : threads > 1024 ? 1024 : threads;
    char *more = threads > 1 ? aligned_alloc(ALIGNMENT, (threads - 1) * p->tile_bytes) : NULL;
    if (threads > 1 && !more)
        return; /* goes on with the threads it has */
    free(p->more_tiles);
    p->more_tiles = more;
    p->threads = threads;
}

/* ---- inputs and outputs ---- */

static const struct port *find_port(const ad_program *p, ad_var x)
{
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
    const struct value *v = &p->values[port->value];
    p->kernels->from_double((size_t)v->rows * v->cols, p->memory + p->locs[port->value].off,
                            values);
    return AD_OK;
}

enum ad_status ad_get(const ad_program *p, ad_var x, double *values)
{
    const struct port *port = find_port(p, x);
    if (!port)
        return AD_E_TAPE;
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
    ad_program_execute(p, 0, p->n_segments, &check);
    look_at_leaves(p, &check);
    if (check.value == UINT32_MAX)
        return AD_OK;
    const struct value *v = &p->values[check.value];
    const char *label = label_of(p, check.value);
    check.row += check.col / v->cols; /* flat segments run all rows as one */
    check.col %= v->cols;
    return ad_fail(error, AD_E_NONFINITE, "node %u (%s%s%s%s) is %g at row %u, column %u", v->node,
                   ad_op_name((enum ad_op)v->op), label ? ", \"" : "", label ? label : "",
                   label ? "\"" : "", check.found, check.row, check.col);
}

struct ad_program_info ad_program_info(const ad_program *p)
{
    struct ad_program_info info = {.nodes = p->n_values,
                                   .segments = p->n_segments - p->n_constant_segments,
                                   .value_bytes = p->memory_bytes + p->threads * p->tile_bytes};
    for (size_t i = 0; i < p->n_values; i++)
        info.constants += (p->values[i].flags & VALUE_CONSTANT) != 0;
    for (size_t i = p->n_constant_segments; i < p->n_segments; i++)
        info.instructions += p->segments[i].count;
    info.bytes = sizeof *p + p->n_values * (sizeof *p->values + sizeof *p->locs) +
                 p->n_instructions * sizeof *p->instructions + p->n_segments * sizeof *p->segments +
                 p->n_sinks * sizeof *p->sinks + p->n_parts * sizeof *p->parts +
                 p->n_numbers * sizeof *p->numbers + p->n_lists * sizeof *p->lists +
                 p->n_ports * sizeof *p->ports + p->n_calls * sizeof *p->calls;
    return info;
}
