/* A loop, backward: the adjoint of a step is a program that takes the state before the step, and
   adjoints of what it leaves. A step whose results have adjoints of exactly 0 is left out. */
#include "autodiff/free.h"
#include "autodiff/gradient/sweep.h"
#include "steps.h"

#include <stdlib.h>

struct scan_adjoint {
    ad_program *program;
    size_t element;
    uint32_t n_state, n_in, n_operands, n_results;
    uint8_t *wanted;                          /* operands */
    struct port_at *operand, *seed, *adjoint; /* adjoint: data NULL where there is none */
    double *sums;                             /* of the adjoints of shared operands */
    size_t n_sums;
    char *bar; /* adjoint of the state, packed */
    bool began;
    struct ad_error error;
};

/* ---- making ---- */

/* Operands whose adjoint each step computes. */
static bool is_computed(const struct loop *l, const uint8_t *wanted, uint32_t k)
{
    return k < l->n_state || wanted[k];
}

/* Records the adjoint of a step on a copy of the body, and compiles it; x, seed: variables. */
static bool record(struct scan_adjoint *a, const struct loop *l, ad_tape *body, ad_var *x,
                   ad_var *g, ad_var *y, ad_var *seed, struct ad_error *error)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < a->n_operands; k++)
        if (is_computed(l, a->wanted, k))
            x[n++] = ad_at(body, l->ids[k]);
    for (uint32_t k = 0; k < a->n_results; k++) {
        y[k] = ad_at(body, l->ids[a->n_operands + k]);
        seed[k] = ad_input(body, ad_rows(y[k]), ad_cols(y[k]), "adjoint");
    }
    if (ad_sweep_back(body, a->n_results, y, seed, true, n, x, g) == AD_OK &&
        ad_compile(body, n, g, &a->program) == AD_OK)
        return true;
    ad_fail(error, body->error.status, "scan: in the body: %s", body->error.message);
    return false;
}

static void find_ports(struct scan_adjoint *a, const struct loop *l, ad_tape *body, const ad_var *g,
                       const ad_var *seed)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < a->n_operands; k++) {
        char *data = ad_data(a->program, ad_at(body, l->ids[k])), *to = NULL;
        if (is_computed(l, a->wanted, k))
            to = ad_data(a->program, g[n++]);
        a->operand[k] = port_of(l, k, data, a->element);
        a->adjoint[k] = port_of(l, k, to, a->element);
        if (k >= a->n_state + a->n_in && to)
            a->n_sums += port_bytes(&a->adjoint[k]) / a->element;
    }
    for (uint32_t k = 0; k < a->n_results; k++)
        a->seed[k] = port_of(l, a->n_operands + k, ad_data(a->program, seed[k]), a->element);
}

static bool make(struct scan_adjoint *a, const struct loop *l, const uint8_t *wanted,
                 struct ad_error *error)
{
    const size_t n = loop_operands(l), m = loop_results(l);
    a->element = type_bytes(l->body->type);
    a->n_state = l->n_state;
    a->n_in = l->n_in;
    a->n_operands = (uint32_t)n;
    a->n_results = (uint32_t)m;
    a->operand = calloc(2 * n + m + 1, sizeof *a->operand);
    a->wanted = malloc(n + 1);
    ad_tape *body = ad_tape_copy(l->body);
    ad_var *vars = calloc(2 * (n + m) + 1, sizeof *vars);
    bool done = a->operand && a->wanted && body && vars;
    if (done) {
        a->adjoint = a->operand + n;
        a->seed = a->adjoint + n;
        memcpy(a->wanted, wanted, n);
        done = record(a, l, body, vars, vars + n, vars + 2 * n, vars + 2 * n + m, error);
    }
    if (done) {
        size_t state_bytes = 0;
        find_ports(a, l, body, vars + n, vars + 2 * n + m);
        for (uint32_t k = 0; k < a->n_state; k++)
            state_bytes += port_bytes(&a->operand[k]);
        a->bar = malloc(state_bytes + 1);
        a->sums = malloc((a->n_sums + 1) * sizeof *a->sums);
        done = a->bar && a->sums;
    }
    ad_tape_free(body);
    free(vars);
    return done;
}

struct scan_adjoint *ad_scan_adjoint_new(const struct loop *l, const uint8_t wanted[],
                                         struct ad_error *error)
{
    struct scan_adjoint *a = calloc(1, sizeof *a);
    if (a && make(a, l, wanted, error))
        return a;
    ad_fail(error, AD_E_MEMORY, "out of memory for a loop");
    ad_scan_adjoint_free(a);
    return NULL;
}

void ad_scan_adjoint_free(struct scan_adjoint *a)
{
    if (!a)
        return;
    ad_program_free(a->program);
    AD_FREE(a->operand, a->wanted, a->sums, a->bar, a);
}

const struct ad_error *ad_scan_adjoint_error(const struct scan_adjoint *a) { return &a->error; }

ad_program *ad_scan_adjoint_program(struct scan_adjoint *a) { return a->program; }

size_t ad_scan_adjoint_bytes(const struct scan_adjoint *a) { return a->n_sums * sizeof *a->sums; }

/* ---- running ---- */

static bool is_zero(const char *bytes, size_t n)
{
    return !n || (!bytes[0] && !memcmp(bytes, bytes + 1, n - 1));
}

/* Sets the adjoints of what step t leaves; false where all are 0. */
static bool load_seeds(const struct scan_adjoint *a, size_t state_bytes, const char *seed, size_t t)
{
    bool any = !is_zero(a->bar, state_bytes);
    const char *value = seed + state_bytes;
    unpack(a->n_state, a->seed, a->bar);
    for (uint32_t k = a->n_state; k < a->n_results; value += a->seed[k].value, k++) {
        const struct port_at *p = &a->seed[k];
        load_block(p, &(struct matrix_at){value, p->value_row}, t);
        any = any || !is_zero(p->data, port_bytes(p));
    }
    return any;
}

static void add_to(double *sums, const struct port_at *p, size_t element)
{
    const size_t n = port_bytes(p) / element;
    const void *data = p->data;
    if (element == sizeof(double)) {
        const double *x = data;
#pragma omp simd
        for (size_t i = 0; i < n; i++)
            sums[i] += x[i];
    } else {
        const float *x = data;
#pragma omp simd
        for (size_t i = 0; i < n; i++)
            sums[i] += (double)x[i];
    }
}

/* Keeps what step t made, or that it made nothing. */
static void take_adjoints(struct scan_adjoint *a, size_t t, bool any, char *result)
{
    double *sums = a->sums;
    if (any)
        pack(a->n_state, a->adjoint, a->bar);
    for (uint32_t k = 0; k < a->n_operands; k++) {
        const struct port_at *p = &a->adjoint[k];
        const bool in = k >= a->n_state && k < a->n_state + a->n_in;
        if (in && a->wanted[k] && any)
            store_block(p, result, t);
        else if (in && a->wanted[k])
            for (size_t r = 0; r < p->rows; r++)
                memset(result + t * p->row + r * p->value_row, 0, p->row);
        else if (k >= a->n_state && a->wanted[k]) {
            if (any)
                add_to(sums, p, a->element);
            sums += port_bytes(p) / a->element;
        }
        result += a->wanted[k] ? p->value : 0;
    }
}

/* The adjoints of start and of shared operands. */
static void finish(const struct scan_adjoint *a, char *result)
{
    const double *sums = a->sums;
    const char *bar = a->bar;
    for (uint32_t k = 0; k < a->n_operands; k++) {
        const struct port_at *p = &a->adjoint[k];
        const size_t n = port_bytes(p) / a->element;
        if (k < a->n_state) {
            if (a->wanted[k])
                memcpy(result, bar, port_bytes(p));
            bar += port_bytes(p);
        } else if (k >= a->n_state + a->n_in && a->wanted[k]) {
            if (a->element == sizeof(double))
                memcpy(result, sums, n * sizeof *sums);
            else
                for (size_t i = 0; i < n; i++)
                    ((float *)(void *)result)[i] = (float)sums[i];
            sums += n;
        }
        result += a->wanted[k] ? p->value : 0;
    }
}

void ad_scan_adjoint_run(struct scan_adjoint *a, struct scan *s, const struct matrix_at z[],
                         const char *seed, char *result, bool checked)
{
    a->began = false;
    a->error = (struct ad_error){0};
    memset(a->sums, 0, a->n_sums * sizeof *a->sums);
    memcpy(a->bar, seed, s->state_bytes);
    for (uint32_t k = a->n_state + a->n_in; k < a->n_operands; k++)
        load_block(&a->operand[k], &z[k], 0);
    if (!s->complete && !is_interrupted(s))
        ad_scan_store(s, z, 0, NULL, false);
    for (size_t t = s->steps; !is_interrupted(s) && t-- > 0;) {
        bool any = load_seeds(a, s->state_bytes, seed, t);
        if (any) {
            if (!ad_scan_state_at(s, z, t))
                break;
            unpack(a->n_state, a->operand, s->state);
            for (uint32_t k = a->n_state; k < a->n_state + a->n_in; k++)
                load_block(&a->operand[k], &z[k], t);
            if (!ad_step_run(s, a->program, &a->began, checked, t, " of the adjoint", &a->error)) {
                s->error = a->error;
                break;
            }
        }
        take_adjoints(a, t, any, result);
    }
    if (is_interrupted(s)) {
        a->error = s->error;
        s->complete = false;
        for (uint32_t k = 0; k < a->n_operands;
             result += a->wanted[k] ? a->adjoint[k].value : 0, k++)
            memset(result, 0xff, a->wanted[k] ? a->adjoint[k].value : 0); /* NaN */
        return;
    }
    finish(a, result);
    s->complete = s->slots >= s->steps;
    if (s->complete)
        s->n_stored = s->steps;
}
