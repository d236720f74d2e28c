/* Operations that form their own segment: products, transposition, placing, gathers and scatters of
   columns, cumulative sums. */
#include "autodiff/blas.h"
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

/* Piece i, of rows or of columns. */
static void multiply(const ad_program *p, const struct segment *g, const struct instruction *in,
                     size_t i, size_t pieces)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]],
                     *b = &p->locs[in->loc[2]];
    const struct value *va = &p->values[in->loc[1]], *vb = &p->values[in->loc[2]];
    size_t lda = row_stride(va, a), ldb = row_stride(vb, b);
    bool ta = in->loc[3] & MATMUL_TA, tb = in->loc[3] & MATMUL_TB;
    size_t m = g->rows, n = g->cols, k = ta ? va->rows : va->cols, e = p->element;
    bool by_rows = m > n;
    size_t from = cut(by_rows ? m : n, i, pieces), to = cut(by_rows ? m : n, i + 1, pieces);
    const char *pa = p->memory + a->off, *pb = p->memory + b->off;
    pa += by_rows ? from * (ta ? 1 : lda) * e : 0;
    pb += by_rows ? 0 : from * (tb ? ldb : 1) * e;
    ad_blas_gemm(p->type, ta, tb, by_rows ? to - from : m, by_rows ? n : to - from, k, pa, lda, pb,
                 ldb, in->loc[3] & MATMUL_ADDS,
                 p->memory + o->off + from * (by_rows ? o->rs : 1) * e, o->rs);
}

struct product {
    const ad_program *p;
    const struct segment *g;
    const struct instruction *in;
    size_t pieces;
};

static void multiply_piece(void *context, size_t thread, size_t i)
{
    const struct product *of = context;
    (void)thread;
    multiply(of->p, of->g, of->in, i, of->pieces);
}

static void matmul(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    const struct value *a = &p->values[in->loc[1]];
    double work = (double)a->rows * a->cols * g->cols;
    size_t pieces = pieces_of(g->rows > g->cols ? g->rows : g->cols, work);
    ad_parallel(p->threads, pieces, multiply_piece, &(struct product){p, g, in, pieces});
}

static void place(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    const struct loc *o = &p->locs[in->loc[0]];
    if (g->clear)
        memset(p->memory + o->off, 0, (size_t)g->rows * g->cols * p->element);
    for (uint32_t k = 0; k < in->loc[2]; k++) {
        const struct part *part = &p->parts[in->loc[1] + k];
        const struct loc *x = &p->locs[part->loc];
        ad_kernel *copy = p->kernels->op[AD_OP_copy][x->cs == 0];
        ad_kernel *add = p->kernels->op[AD_OP_add][x->cs == 0 ? VARIANT_B_NUMBER : 0];
        for (uint32_t r = 0; r < part->rows; r++) {
            char *to = value_row(p, o, part->row + r) + part->col * p->element;
            const char *from = value_row(p, x, r);
            if (g->clear)
                add(part->cols, to, to, from, NULL);
            else
                copy(part->cols, to, from, NULL, NULL);
        }
    }
}

static void move_columns(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    const uint32_t *list = p->lists + in->loc[2] - 1;
    size_t n = in->kind == DO_GATHER_COLS ? g->cols : p->values[in->loc[1]].cols;
    if (in->kind == DO_SCATTER_COLS)
        memset(p->memory + o->off, 0, (size_t)g->rows * g->cols * p->element);
    for (uint32_t r = 0; r < g->rows; r++)
        (in->kind == DO_GATHER_COLS ? p->kernels->gather : p->kernels->scatter)(
            n, value_row(p, o, r), value_row(p, a, r), list);
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

void ad_run_alone(const ad_program *p, const struct segment *g)
{
    const struct instruction *in = &p->instructions[g->first];
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    switch (in->kind) {
    case DO_MATMUL:
        matmul(p, g, in);
        break;
    case DO_PLACE:
        place(p, g, in);
        break;
    case DO_GATHER_COLS:
    case DO_SCATTER_COLS:
        move_columns(p, g, in);
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
