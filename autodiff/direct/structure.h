/* What moves or reduces values in direct evaluation, for sweeps.c: each operation is y += M x, and
   its adjoint x += M^T y. */

/* Adds element x[i] to y[o], or back. */
static inline void carry(R *y, R *x, bool backward)
{
    if (backward)
        *x += *y;
    else
        *y += *x;
}

static void view(const struct elements *at, const struct node *n, R *y, R *x, bool backward)
{
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            carry(&y[r * n->cols + c], &x[element_at(at, r, c)], backward);
}

/* Forward, of all, of rows or of columns; added in double. */
static void sum(const struct node *n, const struct node *in, R *y, const R *x)
{
    const size_t sums = node_size(n), terms = node_size(in) / sums;
    const size_t step = n->op == AD_OP_sum_rows ? in->cols : 1, next = step > 1 ? 1 : terms;
    for (size_t k = 0; k < sums; k++) {
        double s = 0;
        for (size_t j = 0; j < terms; j++)
            s += (double)x[k * next + j * step];
        y[k] = (R)s;
    }
}

static void sum_into(const struct elements *to, const struct node *in, R *y, R *x, bool backward)
{
    for (size_t r = 0; r < in->rows; r++)
        for (size_t c = 0; c < in->cols; c++)
            carry(&y[element_at(to, r, c)], &x[r * in->cols + c], backward);
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

static void matmul(const ad_tape *tape, const struct ad_direct *d, const struct node *n, R *y,
                   bool backward)
{
    const struct node *a = node_at(tape, n->in[0]), *b = node_at(tape, n->in[1]);
    const size_t at = direct_offset(d, n->in[0]), bt = direct_offset(d, n->in[1]);
    R *va = (R *)d->value + at, *vb = (R *)d->value + bt;
    const bool ta = n->aux & 1, tb = n->aux >> 1 & 1;
    const size_t inner = ta ? a->rows : a->cols;
    if (!backward) {
        ad_blas_gemm(TYPE, ta, tb, n->rows, n->cols, inner, va, a->cols, vb, b->cols, false, y,
                     n->cols);
        return;
    }
    R *ga = (R *)d->adjoint + at, *gb = (R *)d->adjoint + bt;
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

/* base: values forward, adjoints backward; both sweeps move the same elements, in opposite
   directions. */
static void structure(const ad_tape *tape, struct ad_direct *d, uint32_t id, bool backward)
{
    const struct node *n = node_at(tape, id), *in = node_at(tape, n->in[0]);
    R *base = backward ? d->adjoint : d->value;
    R *y = base + direct_offset(d, id), *x = base + direct_offset(d, n->in[0]);
    struct elements at;
    if (!backward)
        memset(y, 0, node_size(n) * sizeof *y);
    switch (n->op) {
    case AD_OP_slice:
    case AD_OP_reshape:
    case AD_OP_transpose:
    case AD_OP_broadcast:
    case AD_OP_gather:
    case AD_OP_gather_cols:
        at = ad_viewed_elements(tape, n);
        view(&at, n, y, x, backward);
        break;
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
        if (!backward) {
            sum(n, in, y, x);
            break;
        }
        /* fallthrough */
    case AD_OP_scatter:
    case AD_OP_scatter_cols:
        at = ad_summed_elements(tape, n);
        sum_into(&at, in, y, x, backward);
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
    case AD_OP_scan:
    case AD_OP_scan_adjoint:
        (backward ? ad_direct_scan_back : ad_direct_scan)(tape, d, id);
        break;
    case AD_OP_factor:
    case AD_OP_solve:
    case AD_OP_logdet:
        (backward ? system_backward : system_forward)(n, d, id, y);
        break;
    case AD_OP_custom:
    case AD_OP_custom_adjoint:
        (backward ? custom_backward : custom_forward)(tape, d, id);
        break;
    case AD_OP_matmul:
        matmul(tape, d, n, y, backward);
        break;
    default:
        break;
    }
}
