/* A long short-term memory whose gates are diagonal, as ADBench has it: the likelihood of a
   sequence, each character predicted from those before. */
#include "adbench.h"

#include <stdlib.h>

void adbench_lstm(struct problem *p, const size_t size[3])
{
    const size_t layers = size[0], b = size[1], steps = size[2];
    ad_var main = adbench_input(p, 4 * b, 2 * layers, 21, 0, 0.5); /* weights, bias of each layer */
    ad_var extra = adbench_input(p, b, 3, 22, 0, 0.5);
    ad_var sequence = adbench_constant(p, b, steps, 23, 0, 1);
    ad_var start = adbench_constant(p, b, 2 * layers, 24, 0, 0.5), total = ad_scalar(p->tape, 0);
    ad_var *hidden = malloc(layers * sizeof *hidden), *cell = malloc(layers * sizeof *cell);
    if (!hidden || !cell)
        abort();
    for (size_t i = 0; i < layers; i++) {
        hidden[i] = ad_col(start, 2 * i);
        cell[i] = ad_col(start, 2 * i + 1);
    }
    for (size_t t = 0; t + 1 < steps; t++) {
        ad_var x = ad_mul(ad_col(sequence, t), ad_col(extra, 0));
        for (size_t i = 0; i < layers; i++) {
            ad_var w = ad_col(main, 2 * i), bias = ad_col(main, 2 * i + 1), gate[4];
            for (size_t k = 0; k < 4; k++)
                gate[k] = ad_add(ad_mul(k % 2 ? hidden[i] : x, ad_slice_rows(w, k * b, b)),
                                 ad_slice_rows(bias, k * b, b));
            cell[i] = ad_add(ad_mul(cell[i], ad_sigmoid(gate[0])),
                             ad_mul(ad_sigmoid(gate[1]), ad_tanh(gate[3])));
            x = hidden[i] = ad_mul(ad_sigmoid(gate[2]), ad_tanh(cell[i]));
        }
        ad_var y = ad_add(ad_mul(x, ad_col(extra, 1)), ad_col(extra, 2));
        ad_var norm = ad_log(ad_add(2.0, ad_sum(ad_exp(y))));
        total = ad_add(total, ad_dot(ad_col(sequence, t + 1), ad_sub(y, norm)));
    }
    p->y = ad_mul(-1.0 / (double)((steps - 1) * b), total);
    free(hidden);
    free(cell);
}
