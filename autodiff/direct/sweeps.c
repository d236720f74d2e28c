/* The two sweeps of direct evaluation (direct.h). The build compiles this file for each element
   type: AD_DIRECT_F32 or AD_DIRECT_F64.

   Formulas are those of ops.def. Its derivatives are recorded operations elsewhere; here the same
   expressions are read as numbers, by the macros below. Scalars go one way, all other shapes
   another: through strides, 0 along what is broadcast. */
#include "direct.h"
#include "autodiff/blas.h"
#include "autodiff/kernels/kernels.h"

#include <math.h>
#include <string.h>

#ifdef AD_DIRECT_F32
typedef float R;
#define F(name) name##f
#define FORWARD ad_forward_f32
#define BACKWARD ad_backward_f32
#define TYPE AD_F32
#else
typedef double R;
#define F(name) name
#define FORWARD ad_forward_f64
#define BACKWARD ad_backward_f64
#define TYPE AD_F64
#endif

/* a^b for whole |b| <= 32, the products of kernels.c. */
static R power(R a, R b)
{
    int n = (int)F(fabs)(b);
    R result = 1, square = a;
    for (; n; n >>= 1, square *= square)
        if (n & 1)
            result *= square;
    return b < 0 ? 1 / result : result;
}

/* ---- derivative expressions of the table, as numbers ---- */

#undef ad_add
#undef ad_sub
#undef ad_mul
#undef ad_pow
#undef ad_hypot
#undef ad_lt
#undef ad_le
#undef ad_eq
#undef ad_ne
#define ad_add(a, b) ((R)(a) + (R)(b))
#define ad_sub(a, b) ((R)(a) - (R)(b))
#define ad_mul(a, b) ((R)(a) * (R)(b))
#define ad_pow(a, b) power(a, (R)(b))
#define ad_hypot(a, b) F(hypot)(a, b)
#define ad_lt(a, b) ((R)((a) < (b)))
#define ad_le(a, b) ((R)((a) <= (b)))
#define ad_eq(a, b) ((R)((a) == (R)(b)))
#define ad_ne(a, b) ((R)((a) != (R)(b)))
#define ad_neg(x) (-(x))
#define ad_square(x) square(x)
#define ad_recip(x) (1 / (x))
#define ad_recip0(x) recip0(x)
#define ad_sign(x) sign(x)
#define ad_step(x) ((R)((x) > 0))
#define ad_sqrt(x) F(sqrt)(x)
#define ad_exp(x) F(exp)(x)
#define ad_sin(x) F(sin)(x)
#define ad_cos(x) F(cos)(x)
#define ad_sinh(x) F(sinh)(x)
#define ad_cosh(x) F(cosh)(x)
#define ad_sigmoid(x) (1 / (1 + F(exp)(-(x))))
#define ad_tanh_slope(x) (1 - square(x))
#define ad_value(x) (x)

static inline R square(R x) { return x * x; }
static inline R recip0(R x) { return x == 0 ? 0 : 1 / x; }
static inline R sign(R x) { return (R)(x > 0) - (R)(x < 0); }
/* b a^(b-1), 0 at base 0 where that is infinite; y log a, 0 at base 0. */
static inline R pow_base(R a, R b) { return a == 0 && b < 1 ? 0 : b * F(pow)(a, b - 1); }
static inline R pow_exponent(R a, R y) { return a == 0 ? 0 : y * F(log)(a); }

/* ---- scalars ---- */

/* Elementwise operations come last in the table. */
static inline bool is_elementwise(const struct node *n) { return n->op >= AD_OP_copy; }
static inline bool is_scalar(const struct node *n)
{
    return is_elementwise(n) && n->rows == 1 && n->cols == 1;
}

static inline R scalar_value(const struct node *n, R a, R b, R c)
{
    const R x = a;
    (void)x, (void)b, (void)c;
    switch (n->op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#include "autodiff/ops.def"
    default:
        return 0;
    }
}

/* A derivative of 0 is no dependence, whatever g is. */
#define IS_NONE(d) (__builtin_constant_p(d) && (d) == 0)

/* Adds g times the local derivatives to the adjoints of the operands. */
static inline void scalar_adjoint(const struct node *n, R y, R g, R a, R b, R *ga, R *gb, R *gc)
{
    const R x = a;
    (void)x, (void)y, (void)b, (void)gb, (void)gc;
    switch (n->op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        if (!IS_NONE(dx))                                                                          \
            *ga += g * (R)(dx);                                                                    \
        break;
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name: {                                                                           \
        const R to_a = (R)(da), to_b = (R)(db);                                                    \
        *ga += g * to_a;                                                                           \
        *gb += g * to_b;                                                                           \
    } break;
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name: {                                                                           \
        const R to_b = (R)(db), to_c = (R)(dc);                                                    \
        *gb += g * to_b;                                                                           \
        *gc += g * to_c;                                                                           \
    } break;
#include "autodiff/ops.def"
    default:
        break;
    }
}

/* ---- other shapes, element by element ---- */

/* Where element (r, c) of an operand lies that is broadcast to a larger shape. */
struct spread {
    size_t offset, row, col;
};

static struct spread spread_of(const ad_tape *tape, const struct ad_direct *d, uint32_t id)
{
    const struct node *x = node_at(tape, id);
    return (struct spread){direct_offset(d, id), x->rows == 1 ? 0 : x->cols, x->cols == 1 ? 0 : 1};
}

static void elementwise(const ad_tape *tape, struct ad_direct *d, uint32_t id, bool backward)
{
    const struct node *n = node_at(tape, id);
    const size_t arity = ad_ops[n->op].arity, at = direct_offset(d, id);
    struct spread in[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    R *v = d->value, *adjoint = d->adjoint;
    for (size_t k = 0; k < arity; k++)
        in[k] = spread_of(tape, d, n->in[k]);
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            size_t o = at + r * n->cols + c, i[3];
            for (size_t k = 0; k < 3; k++)
                i[k] = in[k].offset + r * in[k].row + c * in[k].col;
            if (!backward)
                v[o] = scalar_value(n, v[i[0]], v[i[1]], v[i[2]]);
            else if (adjoint[o] != 0)
                scalar_adjoint(n, v[o], adjoint[o], v[i[0]], v[i[1]], &adjoint[i[0]],
                               &adjoint[i[1]], &adjoint[i[2]]);
        }
}

/* ---- what moves or reduces values: each is y += M x, and its adjoint x += M^T y ---- */

/* Adds element x[i] to y[o], or back. */
static inline void carry(R *y, R *x, bool backward)
{
    if (backward)
        *x += *y;
    else
        *y += *x;
}

/* y [rows x cols] at strides along x: y[r][c] is x at from + row_of(r) * rs + col_of(c) * cs. */
static void view(const ad_tape *tape, const struct node *n, R *y, R *x, const struct spread *at,
                 bool backward)
{
    const uint32_t *rows = n->op == AD_OP_gather ? tape->lists + n->aux + 1 : NULL;
    const uint32_t *cols = n->op == AD_OP_gather_cols ? tape->lists + n->aux + 1 : NULL;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            carry(&y[r * n->cols + c],
                  &x[at->offset + (rows ? rows[r] : r) * at->row + (cols ? cols[c] : c) * at->col],
                  backward);
}

/* x [rows x cols] added into y: element (r, c) at row_of(r) * rs + col_of(c) * cs. */
static void sum_into(const ad_tape *tape, const struct node *n, const struct node *in, R *y, R *x,
                     bool backward)
{
    const uint32_t *rows = n->op == AD_OP_scatter ? tape->lists + n->aux + 1 : NULL;
    const uint32_t *cols = n->op == AD_OP_scatter_cols ? tape->lists + n->aux + 1 : NULL;
    const size_t rs = n->rows == 1 && !rows ? 0 : n->cols, cs = n->cols == 1 ? 0 : 1;
    for (size_t r = 0; r < in->rows; r++)
        for (size_t c = 0; c < in->cols; c++)
            carry(&y[(rows ? rows[r] : r) * rs + (cols ? cols[c] : c) * cs], &x[r * in->cols + c],
                  backward);
}

/* Cumulative sums; backward, those of the adjoint from the other end. */
static void cumsum(const struct node *n, R *y, R *x, bool backward)
{
    const bool rows = n->aux & CUMSUM_ROWS, reversed = !(n->aux & CUMSUM_REVERSED) == backward;
    const size_t length = rows ? n->rows : n->cols, others = rows ? n->cols : n->rows,
                 step = rows ? n->cols : 1, next = rows ? 1 : n->cols;
    for (size_t k = 0; k < others; k++) {
        double s = 0;
        for (size_t j = 0; j < length; j++) {
            const size_t i = k * next + (reversed ? length - 1 - j : j) * step;
            s += (double)(backward ? y[i] : x[i]);
            if (backward)
                x[i] += (R)s;
            else
                y[i] = (R)s;
        }
    }
}

static void place(const ad_tape *tape, struct ad_direct *d, const struct node *n, R *y, R *base,
                  bool backward)
{
    const uint32_t *list = tape->lists + n->aux;
    for (size_t k = 0; k < list[0]; k++) {
        const uint32_t *part = list + 1 + 3 * k;
        const struct node *x = node_at(tape, part[0]);
        for (size_t r = 0; r < x->rows; r++)
            for (size_t c = 0; c < x->cols; c++)
                carry(&y[(part[1] + r) * n->cols + part[2] + c],
                      &base[direct_offset(d, part[0]) + r * x->cols + c], backward);
    }
}

/* y[i] = scale (x[i+1] - x[i]) along rows, the last column twice if in[2] says so. */
static void diff(const ad_tape *tape, const struct node *n, const struct node *wide, size_t narrow,
                 R *y, R *x, bool to_x)
{
    const R scale = (R)tape->numbers[n->aux];
    for (size_t r = 0; r < wide->rows; r++)
        for (size_t c = 0; c < narrow; c++) {
            size_t i = c + 1 < wide->cols ? c : wide->cols - 2;
            R *at = &x[r * wide->cols + i], *u = &y[r * narrow + c];
            if (to_x) {
                at[1] += scale * *u;
                at[0] -= scale * *u;
            } else {
                *u += scale * (at[1] - at[0]);
            }
        }
}

static void matmul(const struct node *n, const struct node *a, const struct node *b, R *y, R *va,
                   R *vb, R *ga, R *gb)
{
    const bool ta = n->aux & 1, tb = n->aux >> 1 & 1;
    const size_t inner = ta ? a->rows : a->cols;
    if (!ga) {
        ad_blas_gemm(TYPE, ta, tb, n->rows, n->cols, inner, va, a->cols, vb, b->cols, false, y,
                     n->cols);
        return;
    }
    if (ta) /* a^T b: a += b y^T */
        ad_blas_gemm(TYPE, tb, true, inner, n->rows, n->cols, vb, b->cols, y, n->cols, true, ga,
                     a->cols);
    else
        ad_blas_gemm(TYPE, false, !tb, n->rows, inner, n->cols, y, n->cols, vb, b->cols, true, ga,
                     a->cols);
    if (tb)
        ad_blas_gemm(TYPE, true, ta, n->cols, inner, n->rows, y, n->cols, va, a->cols, true, gb,
                     b->cols);
    else
        ad_blas_gemm(TYPE, !ta, false, inner, n->cols, n->rows, va, a->cols, y, n->cols, true, gb,
                     b->cols);
}

#include "systems.h"

/* base: values forward, adjoints backward; both sweeps move the same elements, in opposite
   directions. */
static void structure(const ad_tape *tape, struct ad_direct *d, uint32_t id, bool backward)
{
    const struct node *n = node_at(tape, id), *in = node_at(tape, n->in[0]);
    R *values = d->value, *base = backward ? d->adjoint : d->value;
    R *y = base + direct_offset(d, id), *x = base + direct_offset(d, n->in[0]);
    struct spread at = {0, in->cols, 1};
    if (!backward)
        memset(y, 0, node_size(n) * sizeof *y);
    switch (n->op) {
    case AD_OP_slice:
        at.offset = (size_t)n->in[1] * in->cols + n->in[2];
        view(tape, n, y, x, &at, backward);
        break;
    case AD_OP_reshape:
        at.row = n->cols;
        view(tape, n, y, x, &at, backward);
        break;
    case AD_OP_transpose:
        at = (struct spread){0, 1, in->cols};
        view(tape, n, y, x, &at, backward);
        break;
    case AD_OP_broadcast:
        at = (struct spread){0, in->rows == 1 ? 0 : in->cols, in->cols == 1 ? 0 : 1};
        view(tape, n, y, x, &at, backward);
        break;
    case AD_OP_gather:
    case AD_OP_gather_cols:
        view(tape, n, y, x, &at, backward);
        break;
    case AD_OP_scatter:
    case AD_OP_scatter_cols:
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
        sum_into(tape, n, in, y, x, backward);
        break;
    case AD_OP_cumsum:
        cumsum(n, y, x, backward);
        break;
    case AD_OP_place:
        place(tape, d, n, y, base, backward);
        break;
    case AD_OP_diff:
        diff(tape, n, in, n->cols, y, x, backward);
        break;
    case AD_OP_diff_adjoint:
        diff(tape, n, n, in->cols, x, y, !backward);
        break;
    case AD_OP_factor:
    case AD_OP_solve:
    case AD_OP_logdet:
        if (!backward)
            system_forward(n, d, id, y);
        else if (n->op == AD_OP_solve)
            solve_backward(n, d, values + direct_offset(d, id), y);
        else if (n->op == AD_OP_logdet)
            logdet_backward(n, d, y);
        break;
    case AD_OP_matmul: {
        const size_t b = direct_offset(d, n->in[1]);
        R *adjoints = backward ? d->adjoint : NULL;
        matmul(n, in, node_at(tape, n->in[1]), y, values + direct_offset(d, n->in[0]), values + b,
               backward ? x : NULL, backward ? adjoints + b : NULL);
        break;
    }
    default:
        break;
    }
}

/* ---- the sweeps ---- */

static void set_constant(const ad_tape *tape, const struct node *n, R *value)
{
    for (size_t k = 0; k < node_size(n); k++)
        value[k] = (R)tape->numbers[n->aux + k];
}

static void other_forward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    R *v = d->value;
    if (is_elementwise(n))
        elementwise(tape, d, id, false);
    else if (n->op == AD_OP_constant)
        set_constant(tape, n, v + direct_offset(d, id));
    else if (n->op != AD_OP_input)
        structure(tape, d, id, false);
}

static void other_backward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    const R *g = (const R *)d->adjoint + direct_offset(d, id);
    bool any = false;
    for (size_t k = 0; k < node_size(n) && !any; k++)
        any = g[k] != 0;
    if (any && is_elementwise(n))
        elementwise(tape, d, id, true);
    else if (any && n->op != AD_OP_constant && n->op != AD_OP_input)
        structure(tape, d, id, true);
}

/* at(id): where a node's value lies. Written twice, so that scalars alone read no table of places.
 */
#define SWEEPS(name, at)                                                                           \
    static void forward_##name(const ad_tape *tape, struct ad_direct *d, uint32_t end)             \
    {                                                                                              \
        R *restrict v = d->value;                                                                  \
        for (uint32_t first = 0; first < end; first += BLOCK_SIZE) {                               \
            const struct node *block = tape->blocks[first >> BLOCK_BITS];                          \
            const uint32_t count = end - first < BLOCK_SIZE ? end - first : BLOCK_SIZE;            \
            for (uint32_t k = 0; k < count; k++) {                                                 \
                const struct node *n = &block[k];                                                  \
                if (is_scalar(n))                                                                  \
                    v[at(first + k)] =                                                             \
                        scalar_value(n, v[at(n->in[0])], v[at(n->in[1])], v[at(n->in[2])]);        \
                else                                                                               \
                    other_forward(tape, d, first + k);                                             \
            }                                                                                      \
        }                                                                                          \
    }                                                                                              \
    static void backward_##name(const ad_tape *tape, struct ad_direct *d, uint32_t end)            \
    {                                                                                              \
        const R *restrict v = d->value;                                                            \
        R *g = d->adjoint;                                                                         \
        for (uint32_t id = end; id-- > 0;) {                                                       \
            const struct node *n = node_at(tape, id);                                              \
            if (!is_scalar(n))                                                                     \
                other_backward(tape, d, id);                                                       \
            else if (g[at(id)] != 0)                                                               \
                scalar_adjoint(n, v[at(id)], g[at(id)], v[at(n->in[0])], v[at(n->in[1])],          \
                               &g[at(n->in[0])], &g[at(n->in[1])], &g[at(n->in[2])]);              \
        }                                                                                          \
    }
#define ITSELF(id) (id)
#define PLACE(id) (d->offset[id])
SWEEPS(scalars, ITSELF)
SWEEPS(shapes, PLACE)

void FORWARD(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    (d->offset ? forward_shapes : forward_scalars)(tape, d, end);
}

void BACKWARD(const ad_tape *tape, struct ad_direct *d, uint32_t end)
{
    (d->offset ? backward_shapes : backward_scalars)(tape, d, end);
}
