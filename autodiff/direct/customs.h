/* A user's own operation in direct evaluation, for sweeps.c. */

static void custom_failed(struct ad_direct *d, const ad_tape *tape, uint32_t id, bool adjoint,
                          enum custom_fault fault, size_t col)
{
    if (fault != CUSTOM_DONE)
        ad_custom_report(&d->error, id, adjoint, &tape->customs[node_at(tape, id)->aux], fault,
                         col);
}

static void custom_columns(const ad_tape *tape, struct ad_direct *d, uint32_t id, bool adjoint,
                           const struct custom_matrix in[], R *out)
{
    const struct node *n = node_at(tape, id);
    const struct custom *c = &tape->customs[n->aux];
    const size_t block = ad_custom_block(c), cols = n->cols;
    for (size_t from = 0; from < cols; from += block)
        custom_failed(d, tape, id, adjoint,
                      ad_custom_run(c, TYPE, adjoint, from,
                                    cols - from < block ? cols - from : block, in,
                                    (struct custom_matrix){out, cols}),
                      from);
}

static void custom_forward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    struct custom_matrix in[3];
    for (size_t k = 0; k < ad_ops[n->op].arity; k++)
        in[k] = (struct custom_matrix){(R *)d->value + direct_offset(d, n->in[k]), n->cols};
    custom_columns(tape, d, id, n->op == AD_OP_custom_adjoint, in,
                   (R *)d->value + direct_offset(d, id));
}

static void custom_backward(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    const size_t x = direct_offset(d, n->in[0]), y = direct_offset(d, id),
                 size = node_size(node_at(tape, n->in[0]));
    R *values = d->value, *adjoints = d->adjoint, *gx = NULL;
    const enum custom_fault fault = n->op == AD_OP_custom_adjoint       ? CUSTOM_SECOND
                                    : !tape->customs[n->aux].by.adjoint ? CUSTOM_NO_ADJOINT
                                    : !(gx = malloc(size * sizeof *gx)) ? CUSTOM_MEMORY
                                                                        : CUSTOM_DONE;
    custom_failed(d, tape, id, true, fault, 0);
    if (!gx)
        return;
    const struct custom_matrix in[] = {
        {values + x, n->cols}, {values + y, n->cols}, {adjoints + y, n->cols}};
    custom_columns(tape, d, id, true, in, gx);
    for (size_t k = 0; k < size; k++)
        adjoints[x + k] += gx[k];
    free(gx);
}
