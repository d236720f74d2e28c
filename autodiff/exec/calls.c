/* Kernel calls with precomputed addresses, for segments of few tiles: operand addresses are known
   at compile time, so the segment becomes a list of calls. 1.1 to 1.3 times as fast at a hundred
   slices, 1.8 times at one. */
#include "exec.h"

#include <stdlib.h>

enum { MAX_CALLS = 1024 }; /* calls of a segment at most; longer ones gain little */

static bool is_short(const struct segment *g)
{
    return g->fused && g->chunks == 1 && g->cols <= g->tile_cols &&
           (size_t)g->count * g->rows <= MAX_CALLS;
}

static struct call call_at(const struct instruction *in, size_t n, const struct cursor c[4],
                           uint32_t row)
{
    return (struct call){in->run,
                         n,
                         cursor_row(&c[0], row),
                         NULL,
                         cursor_row(&c[1], row),
                         in->n_in > 1 ? cursor_row(&c[2], row) : NULL,
                         in->n_in > 2 ? cursor_row(&c[3], row) : NULL};
}

/* ---- sums over rows ---- */

/* The calls of a segment so far; those from `fresh` on have no values computed behind them. */
struct calls {
    struct call *call;
    size_t n, fresh;
};

static void append(struct calls *to, struct call call) { to->call[to->n++] = call; }

static bool is_negated(const ad_program *p, const struct instruction *in)
{
    return p->values[in->value].flags & VALUE_NEGATED;
}

/* The call that last added to this row, or NULL. */
static struct call *adding_to(const struct calls *calls, const void *row)
{
    for (size_t k = calls->n; k-- > 0;)
        if (calls->call[k].o == row)
            return &calls->call[k];
    return NULL;
}

/* x, of instruction `in`, is added to a row, whose first values are not added to zero. */
static void add_row(const ad_program *p, struct calls *to, const struct instruction *in, size_t n,
                    char *row, const char *x)
{
    ad_kernel *const(*op)[N_VARIANTS] = p->kernels->op;
    const bool minus = is_negated(p, in), number = in->run != op[minus ? AD_OP_sub : AD_OP_add][0];
    struct call *first = adding_to(to, row);
    ad_kernel *fresh = first && first >= to->call + to->fresh && !number ? first->run : NULL;
    if (!first)
        append(to, (struct call){op[minus ? AD_OP_neg : AD_OP_copy][number ? VARIANT_A_NUMBER : 0],
                                 n, row, NULL, x, NULL, NULL});
    else if (fresh == op[AD_OP_copy][0])
        *first = (struct call){in->run, n, row, NULL, first->a, x, NULL};
    else if (fresh == op[AD_OP_neg][0] && !minus)
        *first = (struct call){op[AD_OP_sub][0], n, row, NULL, x, first->a, NULL};
    else
        append(to, (struct call){in->run, n, row, NULL, row, x, NULL});
}

/* The instruction before a sum is a product that only this sum reads: one kernel does both, with
   the rounding of two. */
static bool is_product_of(const ad_program *p, const struct segment *g,
                          const struct instruction *in)
{
    const struct instruction *first = p->instructions + g->first, *x = in - 1;
    if (in == first || in->kind != DO_ADD_ROWS || x->kind != DO_ELEMENTWISE || x->joined ||
        (p->values[x->value].op != AD_OP_mul && p->values[x->value].op != AD_OP_square) ||
        x->loc[0] != in->loc[1] || p->locs[x->loc[0]].base != BASE_TILE)
        return false;
    for (const struct instruction *by = in + 1; by < first + g->count; by++)
        for (uint32_t k = 1; k <= by->n_in; k++)
            if (by->loc[k] == in->loc[1])
                return false;
    return true;
}

static void add_product(const ad_program *p, struct calls *to, const struct instruction *product,
                        const struct call *of, bool minus)
{
    const uint32_t a = product->loc[1], b = product->loc[product->n_in];
    const unsigned variant =
        (p->locs[a].cs ? 0 : VARIANT_A_NUMBER) | (p->locs[b].cs ? 0 : VARIANT_B_NUMBER);
    if (!adding_to(to, of->o)) {
        append(to, *of);
        if (minus)
            append(to, (struct call){p->kernels->op[AD_OP_neg][0], of->n, of->o, NULL, of->o, NULL,
                                     NULL});
        return;
    }
    append(to, (struct call){p->kernels->product_sum[minus ? MINUS_PRODUCT : PLUS_PRODUCT][variant],
                             of->n, of->o, NULL, of->a, of->b ? of->b : of->a, of->o});
}

static void resolve_sum(const ad_program *p, const struct segment *g, const struct instruction *in,
                        const struct tile *t, struct calls *to)
{
    const bool product = is_product_of(p, g, in);
    const struct instruction *of = product ? in - 1 : in;
    const struct cursor o = cursor_at(p, &p->locs[in->loc[0]], t);
    struct cursor x[4] = {o};
    for (uint32_t k = 1; k <= of->n_in; k++)
        x[k] = cursor_at(p, &p->locs[of->loc[k]], t);
    for (uint32_t r = 0; r < t->rows; r++)
        if (product) {
            const struct call call = call_at(of, t->cols, x, r);
            add_product(p, to, of, &call, is_negated(p, in));
        } else {
            add_row(p, to, in, t->cols, cursor_row(&o, r), cursor_row(&x[1], r));
        }
}

/* Sinks whose rows all begin with a value need not be zero before. */
static void mark_begun(const ad_program *p, const struct segment *g, const struct calls *calls)
{
    for (struct sink *s = p->sinks + g->first_sink; s < p->sinks + g->first_sink + g->n_sinks;
         s++) {
        const struct loc *o = &p->locs[p->instructions[s->instruction].value];
        s->begun = s->kind == DO_ADD_ROWS && o->base == BASE_MEMORY;
        for (uint32_t r = 0; r < s->rows && s->begun; r++)
            s->begun = adding_to(calls, p->memory + o->off + (size_t)r * s->cols * p->element);
    }
}

/* ---- all instructions ---- */

static void resolve(const ad_program *p, const struct segment *g, const struct instruction *in,
                    const struct tile *t, struct calls *to)
{
    struct cursor c[4];
    if (in->joined == JOINED_BEHIND ||
        (in + 1 < p->instructions + g->first + g->count && is_product_of(p, g, in + 1)))
        return;
    if (in->kind == DO_ADD_ROWS) {
        resolve_sum(p, g, in, t, to);
        return;
    }
    const uint32_t rows = in->flat ? 1 : t->rows;
    if (in->joined) {
        for (uint32_t r = 0; r < rows; r++)
            append(to, ad_joined_call(p, in, t, r));
    } else if (in->kind == DO_ELEMENTWISE) {
        for (uint32_t k = 0; k <= in->n_in; k++)
            c[k] = cursor_at(p, &p->locs[in->loc[k]], t);
        for (uint32_t r = 0; r < rows; r++)
            append(to, call_at(in, (size_t)(in->flat ? t->rows : 1) * t->cols, c, r));
    } else {
        append(to, (struct call){.a = in, .n = t->row});
    }
    to->fresh = to->n;
}

static size_t resolve_tiles(const ad_program *p, const struct segment *g, struct call *calls)
{
    struct tile t = {.cols = g->cols, .base = {p->memory, p->tiles}};
    struct calls to = {calls, 0, 0};
    for (; t.row < g->rows; t.row += g->tile_rows) {
        t.rows = tile_rows_at(g, t.row);
        for (uint32_t k = 0; k < g->count; k++)
            resolve(p, g, &p->instructions[g->first + k], &t, &to);
    }
    mark_begun(p, g, &to);
    return to.n;
}

bool ad_resolve_calls(ad_program *p)
{
    size_t most = 0, n = 0;
    for (size_t i = 0; i < p->n_segments; i++)
        if (is_short(&p->segments[i]))
            most += (size_t)p->segments[i].count * p->segments[i].rows;
    p->calls = malloc((most + 1) * sizeof *p->calls);
    if (!p->calls)
        return false;
    for (size_t i = 0; i < p->n_segments; i++) {
        struct segment *g = &p->segments[i];
        if (!is_short(g))
            continue;
        g->first_call = (uint32_t)n;
        g->n_calls = (uint32_t)resolve_tiles(p, g, p->calls + n);
        n += g->n_calls;
    }
    struct call *trimmed = realloc(p->calls, (n + 1) * sizeof *p->calls);
    if (trimmed)
        p->calls = trimmed;
    p->n_calls = n;
    return true;
}
