/* Small linear systems in direct evaluation, for sweeps.c. */

static void system_forward(const struct node *n, struct ad_direct *d, uint32_t id, R *y)
{
    const struct ad_kernels *k = ad_kernels_for(TYPE);
    const size_t side = n->aux & SYSTEM_SIDE, cols = n->cols;
    const bool cholesky = n->aux & SYSTEM_CHOLESKY;
    const R *v = d->value;
    if (n->op == AD_OP_factor) {
        size_t bad =
            k->factor(side, cols, y, cols, v + direct_offset(d, n->in[0]), cols, cholesky).singular;
        if (bad != SIZE_MAX && !d->singular) {
            d->singular = id;
            d->column = bad;
        }
        return;
    }
    const R *f = v + direct_offset(d, n->in[1]);
    if (n->op == AD_OP_logdet)
        k->logdet(side, cols, y, f, cols, cholesky);
    else
        k->solve(side, n->rows / side, cols, y, cols, f, cols, v + direct_offset(d, n->in[2]), cols,
                 cholesky, n->aux & SYSTEM_TRANSPOSED);
}

/* One right side of one column at a time: b' = a'^-1 g, a's adjoint -= b' x'. */
static void solve_backward(const struct node *n, struct ad_direct *d, const R *x, const R *g)
{
    const struct ad_kernels *kernels = ad_kernels_for(TYPE);
    const size_t side = n->aux & SYSTEM_SIDE, m = n->rows / side, cols = n->cols;
    const bool transposed = n->aux & SYSTEM_TRANSPOSED;
    const R *f = (const R *)d->value + direct_offset(d, n->in[1]);
    R *to_a = (R *)d->adjoint + direct_offset(d, n->in[0]),
      *to_b = (R *)d->adjoint + direct_offset(d, n->in[2]), b[AD_MOST_SIDE];
    for (size_t c = 0; c < cols; c++)
        for (size_t k = 0; k < m; k++) {
            kernels->solve(side, 1, 1, b, 1, f + c, cols, g + k * cols + c, m * cols,
                           n->aux & SYSTEM_CHOLESKY, !transposed);
            for (size_t i = 0; i < side; i++) {
                to_b[(i * m + k) * cols + c] += b[i];
                for (size_t j = 0; j < side; j++)
                    to_a[(i * side + j) * cols + c] -= transposed
                                                           ? x[(i * m + k) * cols + c] * b[j]
                                                           : b[i] * x[(j * m + k) * cols + c];
            }
        }
}

static void logdet_backward(const struct node *n, struct ad_direct *d, const R *g)
{
    const struct ad_kernels *kernels = ad_kernels_for(TYPE);
    const size_t side = n->aux & SYSTEM_SIDE, cols = n->cols;
    const R *f = (const R *)d->value + direct_offset(d, n->in[1]);
    R *to_a = (R *)d->adjoint + direct_offset(d, n->in[0]);
    for (size_t c = 0; c < cols; c++)
        for (size_t j = 0; j < side; j++) {
            R unit[AD_MOST_SIDE] = {0}, row[AD_MOST_SIDE];
            unit[j] = 1;
            kernels->solve(side, 1, 1, row, 1, f + c, cols, unit, 1, n->aux & SYSTEM_CHOLESKY,
                           true);
            for (size_t i = 0; i < side; i++)
                to_a[(i * side + j) * cols + c] += g[c] * row[i];
        }
}
