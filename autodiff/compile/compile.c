/* Compiles a tape into a program: runs all passes in order. */
#include "autodiff/free.h"
#include "autodiff/exec/exec.h"
#include "plan.h"

#include <stdlib.h>
#include <string.h>

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

static bool copy_customs(ad_program *p, const ad_tape *tape)
{
    p->n_customs = tape->n_customs;
    p->customs = malloc((p->n_customs + 1) * sizeof *p->customs);
    for (size_t k = 0; p->customs && k < p->n_customs; k++)
        p->customs[k] = tape->customs[k];
    return p->customs;
}

/* Moves the arrays that graph and program share into the program. */
static void take_arrays(ad_program *p, struct graph *g)
{
    p->values = g->values;
    p->nodes = g->nodes;
    p->n_values = g->n;
    p->locs = g->locs;
    p->lists = g->lists;
    p->n_lists = g->n_lists;
    p->ports = g->ports;
    p->n_ports = g->n_ports;
    g->values = NULL;
    g->nodes = NULL;
    g->locs = NULL;
    g->lists = NULL;
    g->ports = NULL;
}

static bool allocate_memory(ad_program *p, const struct plan *plan)
{
    enum { PAGE = 4096 };
    p->memory_bytes = aligned(plan->memory + ALIGNMENT);
    p->window = aligned(plan->tile_bytes + ALIGNMENT); /* windows have a margin as memory has */
    p->tile_bytes = p->window + aligned(plan->window_bytes + ALIGNMENT);
    p->threads = 1;
    /* A load across two pages takes 60 cycles: the first rows begin with a page. */
    size_t pages = (p->memory_bytes + PAGE - 1) / PAGE * PAGE;
    p->memory = p->memory_bytes < PAGE ? aligned_alloc(ALIGNMENT, p->memory_bytes)
                                       : aligned_alloc(PAGE, pages);
    p->tiles = aligned_alloc(ALIGNMENT, p->tile_bytes);
    if (!p->memory || !p->tiles)
        return false;
    memset(p->memory, 0, p->memory_bytes);
    memset(p->tiles, 0, p->tile_bytes);
    return true;
}

static void *trimmed(void *array, size_t n, size_t size)
{
    void *smaller = realloc(array, n ? n * size : 1);
    return smaller ? smaller : array;
}

/* Trims the arrays, which grew in steps, to their final size. */
static void trim(ad_program *p, const struct graph *g)
{
    p->instructions = trimmed(p->instructions, p->n_instructions, sizeof *p->instructions);
    p->values = trimmed(p->values, p->n_values, sizeof *p->values);
    p->nodes = trimmed(p->nodes, p->n_values, sizeof *p->nodes);
    p->last = trimmed(p->last, p->n_values, sizeof *p->last);
    p->locs = trimmed(p->locs, g->n_locs, sizeof *p->locs);
}

static bool plan_program(struct graph *g, ad_program *p)
{
    size_t n = g->n + 1;
    struct plan plan = {.graph = g,
                        .program = p,
                        .memory =
                            ALIGNMENT, /* compiled code reads one lane before and one behind */
                        .last = ad_allocate_zeroed(n, sizeof *plan.last),
                        .link = ad_allocate_zeroed(n, sizeof *plan.link),
                        .spot = ad_allocate_zeroed(n, sizeof *plan.spot)};
    bool done = plan.last && plan.link && plan.spot && copy_labels(p, g) &&
                copy_customs(p, g->tape) && ad_plan_storage(&plan) && ad_plan_emit(&plan) &&
                allocate_memory(p, &plan);
    p->last = plan.last;
    AD_FREE(plan.link, plan.spot);
    return done;
}

enum ad_status ad_compile(ad_tape *tape, size_t n_out, const ad_var out[], ad_program **program)
{
    if (!program)
        return AD_E_ARGUMENT;
    *program = NULL;
    if (!tape)
        return AD_E_TAPE;
    if (n_out && !out)
        ad_refuse(tape, AD_E_ARGUMENT, "compile: got no outputs (NULL)");
    if (tape->error.status != AD_OK || !ad_all_on(tape, AD_COMPOSITE_compile, "output", n_out, out))
        return tape->error.status;
    struct graph graph = {0};
    ad_program *p = calloc(1, sizeof *p);
    bool done = false;
    if (p) {
        p->type = tape->type;
        p->recording = tape->recording;
        p->element = type_bytes(tape->type);
        p->kernels = ad_kernels_for(tape->type);
        done = ad_graph_build(&graph, tape, n_out, out) && ad_graph_find_views(&graph) &&
               ad_graph_schedule(&graph) && ad_graph_accumulate(&graph) && plan_program(&graph, p);
    }
    if (done) {
        take_arrays(p, &graph);
        trim(p, &graph);
        done = ad_resolve_calls(p) && ad_make_scans(p, tape, graph.renumber);
    }
    if (done) {
        write_constants(p, tape);
        ad_execute(p, p->segments, 0, p->n_constant_segments, NULL);
        if (ad_report_run(p, &tape->error) == UINT32_MAX)
            *program = p;
        else
            ad_program_free(p);
    } else {
        ad_program_free(p);
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory when compiling %zu nodes", tape->n_nodes);
    }
    ad_graph_release(&graph);
    return tape->error.status;
}
