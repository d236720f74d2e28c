/* Writes the segments of a program: instructions over tiles, one segment per group of values. */
#include "autodiff/free.h"
#include "plan.h"

#include <stdlib.h>
#include <string.h>

static inline bool append_instruction(struct plan *p, struct instruction in)
{
    return APPEND(p->program->instructions, p->program->n_instructions, p->max_instructions, in);
}

/* ---- operands ---- */

static bool same_loc(const struct loc *a, const struct loc *b)
{
    return a->off == b->off && a->root == b->root && a->list == b->list && a->rs == b->rs &&
           a->base == b->base && a->cs == b->cs;
}

/* The index of a broadcast location; reused if the value was last read from the same one. */
static bool number_loc(struct plan *p, struct loc l, uint32_t *index)
{
    uint32_t *before = &p->link[l.root];
    *index = *before - 1;
    if (*before && same_loc(&p->graph->locs[*index], &l))
        return true;
    if (!ad_graph_add_loc(p->graph, l, index))
        return false;
    *before = *index + 1;
    return true;
}

/* The location of operand k of v, broadcast over a rows x cols space. */
static bool place_operand(struct plan *p, const struct value *v, uint32_t k, uint32_t rows,
                          uint32_t cols, uint32_t *index)
{
    struct graph *g = p->graph;
    const struct loc *at = operand_loc(g, v, k);
    *index = (uint32_t)(at - g->locs);
    if (rows == 1 && cols == 1)
        return true;
    const struct value *x = v->op == AD_OP_copy && v->in[1] ? v : &g->values[v->in[k]];
    if (x->rows == rows && x->cols == cols)
        return true;
    struct loc l = *at;
    if (x->rows == 1) {
        if (l.list)
            l.off += (size_t)g->lists[l.list - 1] * l.rs * p->program->element;
        l.list = 0;
        l.rs = 0;
    }
    if (x->cols == 1 && cols > 1)
        l.cs = 0;
    if (x->rows == 1 && x->cols == 1) {
        l.rs = 0;
        l.cs = 0;
    }
    return number_loc(p, l, index);
}

/* ---- instructions ---- */

/* True if a tile at this location is contiguous, or one number. */
static inline bool tile_is_flat(const struct loc *l, const struct segment *s)
{
    if (l->base == BASE_TILE || ad_is_number(l))
        return true;
    return !l->list && l->cs == 1 && (s->tile_rows == 1 || l->rs == s->tile_cols);
}

/* ---- two operations in one ---- */

static bool are_sine_and_cosine(const struct value *a, const struct value *b)
{
    return ((a->op == AD_OP_sin && b->op == AD_OP_cos) ||
            (a->op == AD_OP_cos && b->op == AD_OP_sin)) &&
           a->in[0] == b->in[0];
}

/* Operand k of v is a product on a tile that nothing else reads. */
static bool is_own_product(const struct plan *p, const struct value *v, uint32_t k)
{
    const struct graph *g = p->graph;
    const struct value *x = &g->values[v->in[k]];
    return (v->op == AD_OP_add || v->op == AD_OP_sub) &&
           (x->op == AD_OP_mul || x->op == AD_OP_square) && !(x->flags & VALUE_STORED) &&
           p->readers[v->in[k]] == 1 && operand_root(g, v, k) == v->in[k] && x->rows == v->rows &&
           x->cols == v->cols;
}

static void move(uint32_t *order, uint32_t from, uint32_t to)
{
    uint32_t moved = order[from];
    if (from < to)
        memmove(order + from, order + from + 1, (to - from) * sizeof *order);
    else
        memmove(order + to + 1, order + to, (from - to) * sizeof *order);
    order[to] = moved;
}

/* Puts the sine behind the cosine of one argument, or the other way round, and a product before the
   sum that reads it, where they are not far apart. */
static void bring_together(const struct plan *p, const struct group *group)
{
    enum { FARTHEST = 64 };
    const struct graph *g = p->graph;
    uint32_t *order = g->order + group->first, n = group->count;
    for (uint32_t i = 0; i < n; i++) {
        const struct value *v = &g->values[order[i]];
        uint32_t k = is_own_product(p, v, 1) ? 1 : 0, near = i;
        if (v->op == AD_OP_sin || v->op == AD_OP_cos) {
            while (++near < n && near - i < FARTHEST)
                if (are_sine_and_cosine(v, &g->values[order[near]])) {
                    move(order, near, ++i);
                    break;
                }
        } else if (k || is_own_product(p, v, 0)) {
            while (near > 0 && i - near < FARTHEST)
                if (order[--near] == v->in[k]) {
                    move(order, near, i - 1);
                    break;
                }
        }
    }
}

/* Lets one kernel compute an instruction with the one before. */
static void join(const struct plan *p, const struct segment *s, struct instruction *in)
{
    const struct ad_program *program = p->program;
    const struct value *values = p->graph->values, *v = &values[in->value];
    struct instruction *before = program->instructions + program->n_instructions - 1;
    if (program->n_instructions == s->first || before->kind != DO_ELEMENTWISE || before->joined ||
        before->flat != in->flat)
        return;
    const struct loc *locs = p->graph->locs;
    bool joined = false;
    if (are_sine_and_cosine(&values[before->value], v)) {
        joined =
            program->kernels->sin_and_cos && before->loc[1] == in->loc[1] && locs[in->loc[1]].cs;
        before->joined = joined ? JOINED_CIRCLE : JOINED_NOT;
    }
    for (uint32_t k = 0; k < 2 && !joined && s->rows * s->cols > 1; k++) {
        if (!is_own_product(p, v, k) || in->loc[1 + k] != before->loc[0])
            continue;
        const uint32_t of[] = {before->loc[1], before->loc[before->n_in], in->loc[2 - k]};
        unsigned kind = v->op == AD_OP_add ? PRODUCT_PLUS + k : PRODUCT_MINUS + k, variant = 0;
        for (uint32_t j = 0; j < LENGTH(of); j++)
            variant |= (locs[of[j]].cs == 0 ? 1u : 0) << j;
        before->joined = (uint8_t)(JOINED_PRODUCT + kind * N_VARIANTS + variant);
        joined = true;
    }
    in->joined = joined ? JOINED_BEHIND : JOINED_NOT;
}

static bool emit_elementwise(struct plan *p, const struct segment *s, uint32_t id)
{
    struct graph *g = p->graph;
    const struct value *v = &g->values[id];
    const struct ad_kernels *kernels = p->program->kernels;
    struct instruction in = {
        .kind = DO_ELEMENTWISE, .n_in = ad_ops[v->op].arity, .value = id, .loc = {id}};
    unsigned variant = 0;
    in.flat = tile_is_flat(&g->locs[id], s);
    for (uint32_t k = 0; k < in.n_in; k++) {
        if (!place_operand(p, v, k, v->rows, v->cols, &in.loc[1 + k]))
            return false;
        const struct loc *l = &g->locs[in.loc[1 + k]];
        variant |= (l->cs == 0 ? 1u : 0) << k;
        in.flat = in.flat && tile_is_flat(l, s);
    }
    in.run = kernels->op[v->op][variant];
    join(p, s, &in);
    return append_instruction(p, in);
}

static bool emit_stencil(struct plan *p, uint32_t id)
{
    const struct value *v = &p->graph->values[id];
    struct ad_program *program = p->program;
    struct instruction in = {.kind = v->op == AD_OP_diff ? DO_DIFF : DO_DIFF_ADJOINT,
                             .n_in = 1,
                             .value = id,
                             .loc = {id, v->in[0], (uint32_t)program->n_numbers, v->in[2]}};
    return APPEND(program->numbers, program->n_numbers, p->max_numbers,
                  p->graph->tape->numbers[v->aux]) &&
           append_instruction(p, in);
}

/* The sink of this segment that accumulates into the same memory, or a new one. */
static bool find_sink(struct plan *p, const struct segment *s, uint32_t id, struct sink sink,
                      uint32_t *number)
{
    struct graph *g = p->graph;
    struct ad_program *program = p->program;
    uint32_t total = id;
    while ((g->values[total].flags & VALUE_BORROWED) &&
           (g->values[g->host[total]].flags & VALUE_ACCUMULATED))
        total = g->host[total];
    if (total != id) { /* link of an accumulated value: 1 + the sink shared by all its terms */
        *number = p->spot[total] - 1;
        if (p->spot[total])
            return true;
        p->spot[total] = (uint32_t)program->n_sinks + 1;
    }
    /* private copies of the chunks: sums in double; rows only where chunks split rows */
    size_t copies = s->chunks;
    if (sink.kind == DO_ADD_ROWS) {
        copies = s->by_rows && s->chunks > 1 ? s->chunks : 0;
        sink.stride = aligned((size_t)sink.rows * sink.cols * program->element);
    } else {
        copies = sink.kind == DO_SUM_COLS && s->by_rows ? 1 : copies;
        sink.stride = sink.rows * sizeof(double);
    }
    *number = (uint32_t)program->n_sinks;
    return ad_plan_memory(p, copies, sink.stride, &sink.partial) &&
           APPEND(program->sinks, program->n_sinks, p->max_sinks, sink);
}

static bool emit_sink(struct plan *p, const struct segment *s, uint32_t id)
{
    struct graph *g = p->graph;
    const struct value *v = &g->values[id], *x = &g->values[v->in[0]];
    struct ad_program *program = p->program;
    struct loc result = g->locs[id];
    struct instruction in = {.n_in = 1, .value = id, .loc = {0, v->in[0]}};
    struct sink sink = {
        .instruction = (uint32_t)program->n_instructions, .rows = v->rows, .cols = v->cols};
    in.kind = v->op == AD_OP_sum ? DO_SUM : v->op == AD_OP_sum_cols ? DO_SUM_COLS : DO_ADD_ROWS;
    sink.kind = in.kind;
    if (v->op == AD_OP_sum_rows)
        result.rs = 0;
    if (v->op == AD_OP_scatter)
        result.list = v->in[1];
    if (in.kind == DO_ADD_ROWS) {
        bool number = g->locs[v->in[0]].cs == 0 && x->cols > 1;
        in.run = program->kernels->op[v->flags & VALUE_NEGATED ? AD_OP_sub : AD_OP_add]
                                     [number ? VARIANT_B_NUMBER : 0];
    }
    in.flat = tile_is_flat(&g->locs[v->in[0]], s);
    return find_sink(p, s, id, sink, &in.loc[3]) && ad_graph_add_loc(g, result, &in.loc[0]) &&
           append_instruction(p, in);
}

static bool emit_member(struct plan *p, const struct segment *s, uint32_t id)
{
    uint16_t op = p->graph->values[id].op;
    return is_sink(op)      ? emit_sink(p, s, id)
           : is_stencil(op) ? emit_stencil(p, id)
                            : emit_elementwise(p, s, id);
}

static bool emit_fused(struct plan *p, const struct group *group, struct segment s)
{
    const struct graph *g = p->graph;
    const struct value *first = &g->values[g->order[group->first]];
    const struct value *space = is_sink(first->op) ? &g->values[first->in[0]] : first;
    s.fused = true;
    s.rows = space->rows;
    s.cols = space->cols;
    s.count = group->count;
    bring_together(p, group);
    if (!ad_plan_tiles(p, group, &s))
        return false;
    for (uint32_t i = 0; i < group->count; i++)
        if (!emit_member(p, &s, g->order[group->first + i]))
            return false;
    s.count = (uint32_t)p->program->n_instructions - s.first;
    s.n_sinks = (uint32_t)p->program->n_sinks - s.first_sink;
    return APPEND(p->program->segments, p->program->n_segments, p->max_segments, s);
}

/* ---- segments in order ---- */

/* Records where the constant and the held segments end, before those of a group. */
static void mark_stages(struct plan *p, size_t group)
{
    if (group == p->graph->n_constant_groups)
        p->program->n_constant_segments = p->program->n_segments;
    if (group == p->graph->n_held_groups)
        p->program->n_held_segments = p->program->n_segments;
}

/* Which segment reads the memory of a value last, by those of the groups: hosts come behind those
   that borrow from them. */
static void find_last(const struct plan *p, const uint32_t segments[])
{
    const struct graph *g = p->graph;
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        uint32_t o = i, last = p->last[i];
        while (g->values[o].flags & VALUE_BORROWED)
            o = g->host[o];
        bool stays = is_leaf(v) || (v->flags | g->values[o].flags) &
                                       (VALUE_OUTPUT | VALUE_CONSTANT | VALUE_HELD | VALUE_VIEW);
        p->last[i] = stays ? UINT32_MAX : segments[p->last[o] > last ? p->last[o] : last];
    }
}

static bool emit_groups(struct plan *p, uint32_t segments[])
{
    struct graph *g = p->graph;
    memset(p->link, 0, g->n * sizeof *p->link);
    p->program->instructions = ad_allocate_large((g->n + 1) * sizeof *p->program->instructions);
    if (!p->program->instructions)
        return false;
    p->max_instructions = g->n + 1;
    for (uint32_t i = 0; i < g->n_groups; i++) {
        mark_stages(p, i);
        segments[i] = (uint32_t)p->program->n_segments;
        const struct group *group = &g->groups[i];
        if (!group->count)
            continue;
        struct segment s = {.first = (uint32_t)p->program->n_instructions,
                            .first_sink = (uint32_t)p->program->n_sinks,
                            .pass = group->pass,
                            .before = (uint8_t)group->before,
                            .after = (uint8_t)group->after,
                            .margin = (uint8_t)group->margin,
                            .adds = (uint8_t)group->adds,
                            .turn = (uint8_t)group->turn};
        bool alone = is_alone(g->values[g->order[group->first]].op);
        if (alone ? !ad_plan_alone(p, group, s) : !emit_fused(p, group, s))
            return false;
    }
    mark_stages(p, g->n_groups);
    find_last(p, segments);
    return true;
}

bool ad_plan_emit(struct plan *p)
{
    const struct graph *g = p->graph;
    uint32_t *segments = calloc(g->n_groups + 1, sizeof *segments);
    p->readers = ad_allocate_zeroed(g->n + 1, sizeof *p->readers);
    for (uint32_t i = 0; p->readers && i < g->n; i++)
        for (size_t k = 0; k < n_operands(g, &g->values[i]); k++)
            p->readers[operand_root(g, &g->values[i], k)]++;
    bool done = segments && p->readers && emit_groups(p, segments);
    AD_FREE(segments, p->readers);
    return done;
}
