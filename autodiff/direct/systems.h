/* Linear systems in direct evaluation, for sweeps.c. */

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

static R *system_room(struct ad_direct *d, size_t side, size_t vectors)
{
    R *room = calloc(vectors * side, sizeof *room);
    if (!room)
        ad_fail(&d->error, AD_E_MEMORY, "out of memory for the adjoint of a linear system");
    return room;
}

/* One right side of one column at a time: b' = a'^-1 g, a's adjoint -= b' x'. */
static void solve_backward(const struct node *n, struct ad_direct *d, const R *x, const R *g)
{
    const struct ad_kernels *kernels = ad_kernels_for(TYPE);
    const size_t side = n->aux & SYSTEM_SIDE, m = n->rows / side, cols = n->cols;
    const bool transposed = n->aux & SYSTEM_TRANSPOSED;
    const R *f = (const R *)d->value + direct_offset(d, n->in[1]);
    R *to_a = (R *)d->adjoint + direct_offset(d, n->in[0]),
      *to_b = (R *)d->adjoint + direct_offset(d, n->in[2]), *b = system_room(d, side, 1);
    if (!b)
        return;
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
    free(b);
}

static void logdet_backward(const struct node *n, struct ad_direct *d, const R *g)
{
    const struct ad_kernels *kernels = ad_kernels_for(TYPE);
    const size_t side = n->aux & SYSTEM_SIDE, cols = n->cols;
    const R *f = (const R *)d->value + direct_offset(d, n->in[1]);
    R *to_a = (R *)d->adjoint + direct_offset(d, n->in[0]), *unit = system_room(d, side, 2);
    if (!unit)
        return;
    R *row = unit + side;
    for (size_t c = 0; c < cols; c++)
        for (size_t j = 0; j < side; j++) {
            unit[j] = 1;
            kernels->solve(side, 1, 1, row, 1, f + c, cols, unit, 1, n->aux & SYSTEM_CHOLESKY,
                           true);
            unit[j] = 0;
            for (size_t i = 0; i < side; i++)
                to_a[(i * side + j) * cols + c] += g[c] * row[i];
        }
    free(unit);
}

static void system_backward(const struct node *n, struct ad_direct *d, uint32_t id, R *y)
{
    if (n->op == AD_OP_solve)
        solve_backward(n, d, (R *)d->value + direct_offset(d, id), y);
    else if (n->op == AD_OP_logdet)
        logdet_backward(n, d, y);
}
