/* Operations that form their own segment: products, transposition, placing, gathers and scatters of
   columns, cumulative sums. */
#include "autodiff/blas.h"
#include "autodiff/clock.h"
#include "exec.h"
#include "pool.h"

#include <string.h>

/* Row stride as BLAS requires it: a single row may be a view with stride 0. */
static size_t row_stride(const struct value *v, const struct loc *l)
{
    return v->rows == 1 ? v->cols : l->rs;
}

/* Products are split into the same pieces whatever the number of threads, because BLAS rounds
   differently for other shapes. Each piece packs one factor again, so pieces are few: this many
   multiply-adds each, and no narrower than two tiles of BLAS's kernels. */
enum { TILE = 48, PIECE = 2 * TILE, MAX_PIECES = 16 };
static const double PIECE_WORK = 1.5e7;

static size_t pieces_of(size_t extent, double work)
{
    size_t most = extent / PIECE < MAX_PIECES ? extent / PIECE : MAX_PIECES;
    size_t pieces = work < PIECE_WORK * MAX_PIECES ? (size_t)(work / PIECE_WORK) : MAX_PIECES;
    pieces = pieces < most ? pieces : most;
    return pieces ? pieces : 1;
}

/* Start of piece i: a multiple of vectors and tiles, of either type. */
static size_t cut(size_t extent, size_t i, size_t pieces)
{
    return i == pieces ? extent : extent / TILE * i / pieces * TILE;
}

/* Rows or columns [from, to) of a product; of one that adds up the columns of a pass, the columns
   of the tile. */
static void multiply(const ad_program *p, const struct segment *g, const struct instruction *in,
                     const struct tile *t, size_t from, size_t to)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]],
                     *b = &p->locs[in->loc[2]];
    const struct value *v = &p->values[in->value], *va = &p->values[in->loc[1]];
    size_t lda = row_stride(va, a), ldb = row_stride(&p->values[in->loc[2]], b), e = p->element;
    bool ta = in->loc[3] & MATMUL_TA, tb = in->loc[3] & MATMUL_TB;
    size_t m = v->rows, n = v->cols, k = ta ? va->rows : va->cols;
    bool by_rows = !g->pass && m > n;
    const char *pa = t->base[a->base] + a->off, *pb = t->base[b->base] + b->off;
    char *po = t->base[o->base] + o->off;
    if (g->adds) {
        pa += from * e;
        pb += from * e;
        k = to - from;
    } else if (by_rows) {
        pa += from * (ta ? 1 : lda) * e;
        po += from * o->rs * e;
        m = to - from;
    } else {
        pb += from * (tb ? ldb : 1) * e;
        po += from * e;
        n = to - from;
    }
    double began = p->products ? ad_now() : 0;
    ad_blas_gemm(p->type, ta, tb, m, n, k, pa, lda, pb, ldb,
                 in->loc[3] & MATMUL_ADDS || (g->adds && from > 0), po, o->rs);
    if (p->products)
        *p->products += ad_now() - began;
}

struct product {
    const ad_program *p;
    const struct segment *g;
    const struct instruction *in;
    const struct tile *t;
    size_t extent, pieces;
};

static void multiply_piece(void *context, size_t thread, size_t i)
{
    const struct product *of = context;
    (void)thread;
    multiply(of->p, of->g, of->in, of->t, cut(of->extent, i, of->pieces),
             cut(of->extent, i + 1, of->pieces));
}

static void matmul(const ad_program *p, const struct segment *g, const struct instruction *in,
                   const struct tile *t)
{
    const struct value *a = &p->values[in->loc[1]];
    double work = (double)a->rows * a->cols * g->cols;
    size_t extent = g->rows > g->cols ? g->rows : g->cols, pieces = pieces_of(extent, work);
    if (g->pass)
        multiply(p, g, in, t, t->col, t->col + t->cols);
    else
        ad_parallel(p->threads, pieces, multiply_piece,
                    &(struct product){p, g, in, t, extent, pieces});
}

static char *row_at(const ad_program *p, const struct loc *l, const struct tile *t, size_t r)
{
    return t->base[l->base] + l->off +
           (l->list ? p->lists[l->list - 1 + r] : r) * l->rs * p->element;
}

/* Columns of the tile. */
static void place(const ad_program *p, const struct segment *g, const struct instruction *in,
                  const struct tile *t)
{
    const struct loc *o = &p->locs[in->loc[0]];
    const size_t e = p->element, end = (size_t)t->col + t->cols;
    for (uint32_t r = 0; g->clear && r < g->rows; r++)
        memset(row_at(p, o, t, r) + t->col * e, 0, t->cols * e);
    for (uint32_t k = 0; k < in->loc[2]; k++) {
        const struct part *part = &p->parts[in->loc[1] + k];
        const struct loc *x = &p->locs[part->loc];
        ad_kernel *copy = p->kernels->op[AD_OP_copy][x->cs == 0];
        ad_kernel *add = p->kernels->op[AD_OP_add][x->cs == 0 ? VARIANT_B_NUMBER : 0];
        size_t from = part->col > t->col ? part->col : t->col, to = part->col + part->cols;
        to = to < end ? to : end;
        for (uint32_t r = 0; r < part->rows && from < to; r++) {
            char *into = row_at(p, o, t, part->row + r) + from * e;
            const char *of = row_at(p, x, t, r) + (from - part->col) * x->cs * e;
            if (g->clear)
                add(to - from, into, into, of, NULL);
            else
                copy(to - from, into, of, NULL, NULL);
        }
    }
}

/* Gathers the columns of the tile, or scatters all. */
static void move_columns(const ad_program *p, const struct segment *g, const struct instruction *in,
                         const struct tile *t)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    const uint32_t *list = p->lists + in->loc[2] - 1;
    bool gathers = in->kind == DO_GATHER_COLS;
    if (!gathers)
        memset(p->memory + o->off, 0, (size_t)g->rows * g->cols * p->element);
    for (uint32_t r = 0; r < g->rows; r++)
        if (gathers)
            p->kernels->gather(t->cols, row_at(p, o, t, r) + t->col * p->element,
                               row_at(p, a, t, r), list + t->col);
        else
            p->kernels->scatter(p->values[in->loc[1]].cols, row_at(p, o, t, r), row_at(p, a, t, r),
                                list);
}

static void cumsum(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    bool reversed = in->loc[3] & CUMSUM_REVERSED, rows = in->loc[3] & CUMSUM_ROWS;
    for (uint32_t k = 0; k < g->rows; k++) {
        uint32_t r = reversed ? g->rows - 1 - k : k;
        char *y = value_row(p, o, r);
        const char *x = value_row(p, a, r);
        if (!rows)
            p->kernels->cumsum(g->cols, y, x, reversed);
        else if (k == 0)
            p->kernels->op[AD_OP_copy][0](g->cols, y, x, NULL, NULL);
        else
            p->kernels->op[AD_OP_add][0](g->cols, y, value_row(p, o, reversed ? r + 1 : r - 1), x,
                                         NULL);
    }
}

void ad_run_alone(const ad_program *p, const struct segment *g, const struct tile *t)
{
    const struct instruction *in = &p->instructions[g->first];
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    switch (in->kind) {
    case DO_MATMUL:
        matmul(p, g, in, t);
        break;
    case DO_PLACE:
        place(p, g, in, t);
        break;
    case DO_GATHER_COLS:
    case DO_SCATTER_COLS:
        move_columns(p, g, in, t);
        break;
    case DO_CUMSUM:
        cumsum(p, g, in);
        break;
    case DO_FACTOR:
    case DO_SOLVE:
    case DO_LOGDET:
        ad_run_system(p, g);
        break;
    case DO_CUSTOM:
        ad_run_custom(p, g);
        break;
    default:
        p->kernels->transpose(g->cols, g->rows, p->memory + o->off, o->rs, p->memory + a->off,
                              a->rs);
    }
}
