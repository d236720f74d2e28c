/* Writes segments of one instruction: products, transposition, and placing of parts that are not
   already computed in place. */
#include "plan.h"

static bool emit_place(struct plan *p, uint32_t id, struct instruction *in, struct segment *s)
{
    struct graph *g = p->graph;
    const struct value *v = &g->values[id];
    in->kind = DO_PLACE;
    in->loc[1] = (uint32_t)p->program->n_parts;
    s->clear = !ad_place_tiles(g, v);
    for (size_t k = 0; k < n_operands(g, v); k++) {
        const uint32_t *at = place_part(g, v, k);
        uint32_t x = operand(g, v, k), root = g->locs[x].root;
        size_t there =
            g->locs[id].off + ((size_t)at[1] * g->locs[id].rs + at[2]) * p->program->element;
        if ((g->values[root].flags & VALUE_BORROWED) && g->host[root] == id &&
            g->locs[root].off == there)
            continue; /* computed in place */
        struct part part = {x, g->values[x].rows, g->values[x].cols, at[1], at[2]};
        if (!APPEND(p->program->parts, p->program->n_parts, p->max_parts, part))
            return false;
        in->loc[2]++;
    }
    return true;
}

static uint8_t kind_of(uint16_t op)
{
    switch (op) {
    case AD_OP_matmul:
        return DO_MATMUL;
    case AD_OP_gather_cols:
        return DO_GATHER_COLS;
    case AD_OP_scatter_cols:
        return DO_SCATTER_COLS;
    case AD_OP_cumsum:
        return DO_CUMSUM;
    case AD_OP_factor:
        return DO_FACTOR;
    case AD_OP_solve:
        return DO_SOLVE;
    case AD_OP_logdet:
        return DO_LOGDET;
    case AD_OP_custom:
    case AD_OP_custom_adjoint:
        return DO_CUSTOM;
    default:
        return DO_TRANSPOSE;
    }
}

/* By LAPACK. */
static bool is_large_system(const struct value *v)
{
    return (v->op == AD_OP_factor || v->op == AD_OP_solve) && (v->aux & SYSTEM_SIDE) > AD_MOST_SIDE;
}

bool ad_plan_alone(struct plan *p, const struct group *group, struct segment s)
{
    const uint32_t id = p->graph->order[group->first];
    const struct value *v = &p->graph->values[id];
    struct instruction in = {.value = id, .loc = {id, v->in[0], v->in[1], v->aux}};
    s.rows = v->rows;
    s.cols = group->pass ? ad_pass_columns(p->graph, v) : v->cols;
    s.chunks = group->pass ? group->blocks : 1;
    s.count = 1;
    if (v->op == AD_OP_place) {
        in.loc[2] = 0;
        if (!emit_place(p, id, &in, &s))
            return false;
        if (!in.loc[2] && !s.clear)
            return true; /* nothing left to do */
    } else if (v->op == AD_OP_scan || v->op == AD_OP_scan_adjoint) {
        in.kind = DO_SCAN;
        in.loc[1] = (uint32_t)p->program->n_scans++; /* made by ad_make_scans */
    } else {
        in.kind = kind_of(v->op);
        if (v->op == AD_OP_solve || v->op == AD_OP_logdet) { /* of the factor */
            in.loc[1] = v->in[1];
            in.loc[2] = v->in[2];
        }
        if (v->op == AD_OP_factor || ad_is_custom(v->op)) {
            in.loc[2] = (uint32_t)p->program->n_factors;
            struct factor f = {id, {.singular = SIZE_MAX}, CUSTOM_DONE};
            if (!APPEND(p->program->factors, p->program->n_factors, p->max_factors, f))
                return false;
        }
        in.loc[3] |= v->flags & VALUE_ADDS ? MATMUL_ADDS : 0;
        p->program->has_matmul |= v->op == AD_OP_matmul || is_large_system(v);
    }
    return APPEND(p->program->instructions, p->program->n_instructions, p->max_instructions, in) &&
           APPEND(p->program->segments, p->program->n_segments, p->max_segments, s);
}
