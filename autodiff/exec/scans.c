/* Loops of a program: where their operands lie, and which loop a way back goes through. */
#include "autodiff/free.h"
#include "autodiff/scan/scan.h"
#include "exec.h"

#include <stdlib.h>

/* The number of the loop whose value is `value`. */
static uint32_t number_of(const ad_program *p, uint32_t value)
{
    uint32_t k = 0;
    while (p->scans[k].value != value || p->scans[k].adjoint)
        k++;
    return k;
}

static bool make_adjoint(ad_program *p, struct program_scan *s, const struct loop *l,
                         const uint32_t *list, const uint32_t *renumber, struct ad_error *error)
{
    const uint32_t n = loop_operands(l);
    uint8_t *wanted = malloc(n + 1);
    for (uint32_t k = 0; wanted && k < n; k++)
        wanted[k] = list[1 + 3 * k + 1] != 0;
    if (wanted)
        s->adjoint = ad_scan_adjoint_new(l, wanted, error);
    free(wanted);
    s->of = number_of(p, renumber[list[1 + 3 * n]]);
    return s->adjoint && ad_scan_keep(p->scans[s->of].scan);
}

static bool make(ad_program *p, ad_tape *tape, const struct instruction *in,
                 const uint32_t *renumber)
{
    const struct node *node = node_at(tape, p->nodes[in->value]);
    const struct loop *l = &tape->loops[node->in[1]];
    const uint32_t *list = tape->lists + node->aux;
    struct program_scan *s = &p->scans[in->loc[1]];
    s->value = in->value;
    s->n_operands = list[0];
    s->operand = malloc(list[0] * sizeof *s->operand + 1);
    s->z = malloc(list[0] * sizeof *s->z + 1);
    if (!s->operand || !s->z)
        return false;
    for (uint32_t k = 0; k < list[0]; k++) {
        const uint32_t x = renumber[list[1 + 3 * k]];
        const struct loc *at = &p->locs[x];
        s->operand[k] = x;
        s->z[k] = (struct matrix_at){p->memory + at->off, at->rs * p->element};
    }
    if (node->op == AD_OP_scan_adjoint)
        return make_adjoint(p, s, l, list, renumber, &tape->error);
    s->scan = ad_scan_new(l, &tape->error);
    return s->scan;
}

bool ad_make_scans(ad_program *p, ad_tape *tape, const uint32_t *renumber)
{
    if (!p->n_scans)
        return true;
    p->scans = calloc(p->n_scans, sizeof *p->scans);
    bool done = p->scans;
    for (size_t k = 0; done && k < p->n_scans; k++)
        p->scans[k].value = UINT32_MAX;
    for (size_t i = 0; done && i < p->n_instructions; i++)
        if (p->instructions[i].kind == DO_SCAN)
            done = make(p, tape, &p->instructions[i], renumber);
    return done;
}

void ad_run_scan(const ad_program *p, const struct instruction *in, struct check *check)
{
    struct program_scan *s = &p->scans[in->loc[1]];
    char *result = p->memory + p->locs[in->value].off;
    if (s->adjoint)
        ad_scan_adjoint_run(s->adjoint, p->scans[s->of].scan, s->z, s->z[s->n_operands - 1].start,
                            result, check);
    else
        ad_scan_run(s->scan, s->z, result, check);
    if (check)
        ad_inspect_value(p, in, check);
}

static const struct ad_error *error_of(const struct program_scan *s)
{
    return s->adjoint ? ad_scan_adjoint_error(s->adjoint) : ad_scan_error(s->scan);
}

uint32_t ad_report_run(const ad_program *p, struct ad_error *error)
{
    const struct factor *singular = ad_report_singular(p, error);
    uint32_t first = singular ? singular->value : UINT32_MAX;
    for (size_t k = 0; k < p->n_scans; k++) {
        const struct program_scan *s = &p->scans[k];
        if (error_of(s)->status == AD_OK || s->value >= first)
            continue;
        first = s->value;
        error->status = AD_OK;
        ad_fail(error, error_of(s)->status, "node %u (%s): %s", p->nodes[first],
                ad_op_name((enum ad_op)p->values[first].op), error_of(s)->message);
    }
    return first;
}

ad_program *ad_step_program(const ad_program *p, size_t k)
{
    const struct program_scan *s = &p->scans[k];
    return s->adjoint ? ad_scan_adjoint_program(s->adjoint) : ad_scan_program(s->scan);
}

size_t ad_step_count(const ad_program *p, size_t k)
{
    return ad_scan_steps(p->scans[p->scans[k].adjoint ? p->scans[k].of : k].scan);
}

size_t ad_scans_bytes(const ad_program *p)
{
    size_t bytes = 0;
    for (size_t k = 0; k < p->n_scans; k++) {
        const struct ad_program_info step = ad_program_info(ad_step_program(p, k));
        bytes += step.value_bytes + step.bytes;
        bytes += p->scans[k].adjoint ? ad_scan_adjoint_bytes(p->scans[k].adjoint)
                                     : ad_scan_bytes(p->scans[k].scan);
    }
    return bytes;
}

void ad_free_scans(ad_program *p)
{
    for (size_t k = 0; p->scans && k < p->n_scans; k++) {
        ad_scan_free(p->scans[k].scan);
        ad_scan_adjoint_free(p->scans[k].adjoint);
        AD_FREE(p->scans[k].operand, p->scans[k].z);
    }
    free(p->scans);
}
