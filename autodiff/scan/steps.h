/* Inside of scan/: what a step reads and writes, and a loop with its stored states. */
#ifndef AUTODIFF_SCAN_STEPS_H
#define AUTODIFF_SCAN_STEPS_H

#include "scan.h"

#include <string.h>

/* A variable of the body in the program of a step. */
struct port_at {
    char *data;
    size_t rows, row; /* bytes of a row */
    size_t value;     /* bytes of its matrix outside, and of a row there */
    size_t value_row;
};

static inline size_t port_bytes(const struct port_at *p) { return p->rows * p->row; }

/* Where variable k of a loop's body lies in the program; size_t elements of `element` bytes. */
static inline struct port_at port_of(const struct loop *l, uint32_t k, char *data, size_t element)
{
    size_t rows = loop_rows(l, k), row = loop_cols(l, k) * element;
    return (struct port_at){data, rows, node_at(l->body, l->ids[k])->cols * element, rows * row,
                            row};
}

/* Rows of a given number of bytes; most are one number. */
static inline void copy_rows(size_t rows, size_t bytes, char *to, size_t to_step, const char *from,
                             size_t from_step)
{
    if (bytes == sizeof(uint64_t))
        for (size_t r = 0; r < rows; r++)
            memcpy(to + r * to_step, from + r * from_step, sizeof(uint64_t));
    else if (bytes == sizeof(uint32_t))
        for (size_t r = 0; r < rows; r++)
            memcpy(to + r * to_step, from + r * from_step, sizeof(uint32_t));
    else
        for (size_t r = 0; r < rows; r++)
            memcpy(to + r * to_step, from + r * from_step, bytes);
}

/* Block t of a value outside, to the step or from it. */
static inline void load_block(const struct port_at *p, const struct matrix_at *x, size_t t)
{
    copy_rows(p->rows, p->row, p->data, p->row, x->start + t * p->row, x->step);
}
static inline void store_block(const struct port_at *p, char *value, size_t t)
{
    copy_rows(p->rows, p->row, value + t * p->row, p->value_row, p->data, p->row);
}

/* Ports one after the other, in `packed`. */
static inline void unpack(size_t n, const struct port_at *p, const char *packed)
{
    for (size_t k = 0; k < n; packed += port_bytes(&p[k]), k++)
        memcpy(p[k].data, packed, port_bytes(&p[k]));
}
static inline void pack(size_t n, const struct port_at *p, char *packed)
{
    for (size_t k = 0; k < n; packed += port_bytes(&p[k]), k++)
        memcpy(packed, p[k].data, port_bytes(&p[k]));
}

struct scan {
    ad_program *program;
    size_t steps, element;
    uint32_t n_state, n_in, n_operands, n_results;
    struct port_at *operand, *result; /* states, ins, shared; next states, outs */
    char *state;                      /* packed */
    size_t state_bytes;
    bool (*proceed)(void *context);
    void *context;
    bool began; /* this run has run the program */
    /* Stored: state at[k], in ascending order, in `states`. */
    size_t slots, n_stored, *at;
    char *states;
    bool complete; /* as a run of the loop leaves them */
    size_t wanted_slots;
    struct ad_error error; /* of the last run */
};

/* Runs the program of step t of s, forward or back; the first error is kept, with the step. False:
   interrupted. */
bool ad_step_run(const struct scan *s, ad_program *program, bool *began, bool checked, size_t t,
                 const char *way, struct ad_error *error);
/* Stores the states of a run through `last` steps of the loop, which leaves the state there. */
void ad_scan_store(struct scan *s, const struct matrix_at z[], size_t last, char *result,
                   bool checked);
/* From the last stored state, whose step is at most t, to that before step t, storing on the way.
   False: interrupted. */
bool ad_scan_state_at(struct scan *s, const struct matrix_at z[], size_t t);

static inline bool is_interrupted(const struct scan *s) { return s->error.status == AD_E_ACCURACY; }

#endif
