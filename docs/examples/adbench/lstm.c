/* A long short-term memory whose gates are diagonal, as ADBench has it: the likelihood of a
   sequence, each character predicted from those before; unrolled, and as a loop of one step. */
#include "adbench.h"

enum { MOST_LAYERS = 4 };

/* The weights of `layers` layers, and hidden[i], cell[i] as columns 2 i and 2 i + 1 of the start.
 */
static ad_var weights(struct problem *p, const size_t size[3], ad_var *extra, ad_var state[])
{
    const size_t layers = size[0], b = size[1];
    ad_var main = adbench_input(p, 4 * b, 2 * layers, 21, 0, 0.5); /* weights, bias of each layer */
    *extra = adbench_input(p, b, 3, 22, 0, 0.5);
    ad_var start = adbench_constant(p, b, 2 * layers, 24, 0, 0.5);
    p->start = p->fixed;
    p->fixed = NULL;
    for (size_t i = 0; i < 2 * layers; i++)
        state[i] = ad_col(start, i);
    return main;
}

ad_var adbench_lstm_step(const size_t size[3], ad_var main, ad_var extra, ad_var x, ad_var next,
                         ad_var state[])
{
    const size_t b = size[1];
    x = ad_mul(x, ad_col(extra, 0));
    for (size_t i = 0; i < size[0]; i++) {
        ad_var w = ad_col(main, 2 * i), bias = ad_col(main, 2 * i + 1), gate[4];
        ad_var *hidden = &state[2 * i], *cell = &state[2 * i + 1];
        for (size_t k = 0; k < 4; k++)
            gate[k] = ad_add(ad_mul(k % 2 ? *hidden : x, ad_slice_rows(w, k * b, b)),
                             ad_slice_rows(bias, k * b, b));
        *cell = ad_add(ad_mul(*cell, ad_sigmoid(gate[0])),
                       ad_mul(ad_sigmoid(gate[1]), ad_tanh(gate[3])));
        x = *hidden = ad_mul(ad_sigmoid(gate[2]), ad_tanh(*cell));
    }
    ad_var y = ad_add(ad_mul(x, ad_col(extra, 1)), ad_col(extra, 2));
    return ad_dot(next, ad_sub(y, ad_log(ad_add(2.0, ad_sum(ad_exp(y))))));
}

void adbench_lstm(struct problem *p, const size_t size[3])
{
    const size_t b = size[1], steps = size[2];
    ad_var extra, state[2 * MOST_LAYERS], main = weights(p, size, &extra, state);
    ad_var sequence = adbench_constant(p, b, steps, 23, 0, 1), total = ad_scalar(p->tape, 0);
    for (size_t t = 0; t + 1 < steps; t++)
        total = ad_add(total, adbench_lstm_step(size, main, extra, ad_col(sequence, t),
                                                ad_col(sequence, t + 1), state));
    p->y = ad_mul(-1.0 / (double)((steps - 1) * b), total);
}

void adbench_lstm_loop(struct problem *p, const size_t size[3])
{
    const size_t b = size[1], steps = size[2], n = 2 * size[0];
    ad_var extra, start[2 * MOST_LAYERS], main = weights(p, size, &extra, start), each;
    ad_var sequence = adbench_constant(p, b, steps, 23, 0, 1);
    ad_tape *body = ad_tape_new(AD_F64);
    ad_var shared[] = {ad_input(body, 4 * b, n, "main"), ad_input(body, b, 3, "extra")};
    ad_var in[] = {ad_input(body, b, 1, "x"), ad_input(body, b, 1, "next")};
    ad_var state[2 * MOST_LAYERS], next[2 * MOST_LAYERS];
    for (size_t k = 0; k < n; k++)
        state[k] = next[k] = ad_input(body, b, 1, "state");
    ad_var out = adbench_lstm_step(size, shared[0], shared[1], in[0], in[1], next);
    const struct ad_body loop = {.size = sizeof loop,
                                 .tape = body,
                                 .n_state = n,
                                 .state = state,
                                 .next = next,
                                 .n_in = 2,
                                 .in = in,
                                 .n_shared = 2,
                                 .shared = shared,
                                 .n_out = 1,
                                 .out = &out};
    ad_var pairs[] = {ad_slice_cols(sequence, 0, steps - 1), ad_slice_cols(sequence, 1, steps - 1)};
    ad_scan(p->tape, &loop, steps - 1, start, pairs, (ad_var[]){main, extra}, next, &each);
    ad_tape_free(body);
    p->y = ad_mul(-1.0 / (double)((steps - 1) * b), ad_sum(each));
}
