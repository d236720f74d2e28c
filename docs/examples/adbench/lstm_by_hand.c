/* The gradient of the LSTM by a loop over programs of one step, written by hand: forward once, with
   all states stored, and back, each step's gradient seeded with the adjoints of the states after
   it. */
#include "adbench.h"

#include <stdlib.h>
#include <string.h>

enum { STATES = 4, SHARED = 2 };

/* Compiled once, for all calls: a step, and the gradient of one. */
static struct {
    ad_tape *tape;
    ad_var state[STATES], x[2], shared[SHARED], next[STATES], seed[STATES], by[STATES + SHARED];
    ad_program *forward, *back;
} step;

static void make_step(const struct problem *p, const size_t size[3])
{
    const size_t b = size[1];
    step.tape = ad_tape_new(AD_F64);
    for (size_t k = 0; k < STATES; k++) {
        step.state[k] = step.next[k] = ad_input(step.tape, b, 1, NULL);
        step.seed[k] = ad_input(step.tape, b, 1, NULL);
    }
    for (size_t k = 0; k < 2; k++) {
        step.x[k] = ad_input(step.tape, b, 1, NULL);
        step.shared[k] = ad_hold(ad_input(step.tape, ad_rows(p->x[k]), ad_cols(p->x[k]), NULL));
    }
    ad_var y =
        adbench_lstm_step(size, step.shared[0], step.shared[1], step.x[0], step.x[1], step.next);
    for (size_t k = 0; k < STATES; k++)
        y = ad_add(y, ad_dot(step.seed[k], step.next[k]));
    ad_var by[STATES + SHARED];
    memcpy(by, step.state, sizeof step.state);
    memcpy(by + STATES, step.shared, sizeof step.shared);
    ad_grad(y, STATES + SHARED, by, step.by);
    if (ad_compile(step.tape, STATES, step.next, &step.forward) != AD_OK ||
        ad_compile(step.tape, STATES + SHARED, step.by, &step.back) != AD_OK)
        abort();
    ad_native(step.forward, 1e6, NULL);
    ad_native(step.back, 1e6, NULL);
}

static void set_step(ad_program *q, const double *state, const double *sequence, size_t b,
                     size_t steps, size_t t)
{
    double *x = ad_data(q, step.x[0]), *next = ad_data(q, step.x[1]);
    for (size_t k = 0; k < STATES; k++)
        memcpy(ad_data(q, step.state[k]), state + k * b, b * sizeof *state);
    for (size_t i = 0; i < b; i++) {
        x[i] = sequence[i * steps + t];
        if (next)
            next[i] = sequence[i * steps + t + 1];
    }
}

void adbench_lstm_by_hand(const struct problem *p, const size_t size[3], double *gradient)
{
    const size_t b = size[1], steps = size[2], width = STATES * b;
    if (!step.tape)
        make_step(p, size);
    double *states = malloc(steps * width * sizeof *states);
    if (!states || size[0] * 2 != STATES)
        abort();
    for (size_t k = 0; k < STATES; k++)
        for (size_t i = 0; i < b; i++)
            states[k * b + i] = p->start[i * STATES + k];
    for (size_t k = 0; k < SHARED; k++) {
        ad_set(step.forward, step.shared[k], p->at[k]);
        ad_set(step.back, step.shared[k], p->at[k]);
    }
    for (size_t t = 0; t + 1 < steps; t++) {
        set_step(step.forward, states + t * width, p->fixed, b, steps, t);
        t ? (void)ad_rerun(step.forward) : ad_run(step.forward);
        for (size_t k = 0; k < STATES; k++)
            memcpy(states + (t + 1) * width + k * b, ad_data(step.forward, step.next[k]),
                   b * sizeof *states);
    }
    const size_t n[] = {8 * b * size[0], 3 * b};
    memset(gradient, 0, (n[0] + n[1]) * sizeof *gradient);
    for (size_t k = 0; k < STATES; k++)
        memset(ad_data(step.back, step.seed[k]), 0, b * sizeof *gradient);
    for (size_t t = steps - 1; t-- > 0;) {
        set_step(step.back, states + t * width, p->fixed, b, steps, t);
        t + 2 < steps ? (void)ad_rerun(step.back) : ad_run(step.back);
        for (size_t k = 0; k < STATES; k++)
            memcpy(ad_data(step.back, step.seed[k]), ad_data(step.back, step.by[k]),
                   b * sizeof *gradient);
        double *to = gradient;
        for (size_t k = 0; k < SHARED; to += n[k++]) {
            const double *g = ad_data(step.back, step.by[STATES + k]);
            for (size_t i = 0; i < n[k]; i++)
                to[i] += g[i];
        }
    }
    for (size_t i = 0; i < n[0] + n[1]; i++)
        gradient[i] *= -1.0 / (double)((steps - 1) * b);
    free(states);
}
