/* A loop, forward. */
#include "autodiff/free.h"
#include "steps.h"

#include <stdlib.h>

static const size_t MEMORY = (size_t)32 << 20; /* of states, where nothing else is said */

/* ---- making ---- */

static bool make(struct scan *s, const struct loop *l, struct ad_error *error)
{
    ad_tape *body = l->body;
    s->steps = l->steps;
    s->proceed = l->proceed;
    s->context = l->context;
    s->element = type_bytes(body->type);
    s->n_state = l->n_state;
    s->n_in = l->n_in;
    s->n_operands = loop_operands(l);
    s->n_results = loop_results(l);
    s->operand = calloc((size_t)s->n_operands + s->n_results + 1, sizeof *s->operand);
    ad_var *out = calloc((size_t)s->n_results + 1, sizeof *out);
    bool done = s->operand && out;
    for (uint32_t k = 0; done && k < s->n_results; k++)
        out[k] = ad_at(body, l->ids[s->n_operands + k]);
    if (done && ad_compile(body, s->n_results, out, &s->program) != AD_OK) {
        ad_fail(error, body->error.status, "scan: in the body: %s", body->error.message);
        done = false;
    }
    free(out);
    if (!done)
        return false;
    s->result = s->operand + s->n_operands;
    for (uint32_t k = 0; k < s->n_operands + s->n_results; k++)
        s->operand[k] = port_of(l, k, ad_data(s->program, ad_at(body, l->ids[k])), s->element);
    for (uint32_t k = 0; k < s->n_state; k++)
        s->state_bytes += port_bytes(&s->operand[k]);
    s->wanted_slots = l->checkpoints ? l->checkpoints : MEMORY / (s->state_bytes + sizeof *s->at);
    s->state = malloc(s->state_bytes + 1);
    return s->state;
}

struct scan *ad_scan_new(const struct loop *l, struct ad_error *error)
{
    struct scan *s = calloc(1, sizeof *s);
    if (s && make(s, l, error))
        return s;
    ad_fail(error, AD_E_MEMORY, "out of memory for a loop");
    ad_scan_free(s);
    return NULL;
}

bool ad_scan_keep(struct scan *s)
{
    if (s->slots)
        return true;
    size_t n = s->wanted_slots < s->steps ? s->wanted_slots : s->steps;
    n = n ? n : 1;
    if (n > SIZE_MAX / 2 / (s->state_bytes + sizeof *s->at))
        return false;
    s->states = malloc(n * s->state_bytes + 1);
    s->at = malloc(n * sizeof *s->at);
    s->slots = s->states && s->at ? n : 0;
    return s->slots;
}

void ad_scan_free(struct scan *s)
{
    if (!s)
        return;
    ad_program_free(s->program);
    AD_FREE(s->operand, s->state, s->states, s->at, s);
}

const struct ad_error *ad_scan_error(const struct scan *s) { return &s->error; }

ad_program *ad_scan_program(struct scan *s) { return s->program; }

size_t ad_scan_steps(const struct scan *s) { return s->steps; }

size_t ad_scan_bytes(const struct scan *s)
{
    return s->slots * (s->state_bytes + sizeof *s->at) + s->state_bytes;
}

/* ---- running ---- */

bool ad_step_run(const struct scan *s, ad_program *p, bool *began, bool checked, size_t t,
                 const char *way, struct ad_error *error)
{
    struct ad_error found = {0};
    if (s->proceed && !s->proceed(s->context)) {
        error->status = AD_OK; /* before others: the values are not those of a whole run */
        ad_fail(error, AD_E_ACCURACY, "interrupted at step %zu%s", t, way);
        return false;
    }
    if (checked)
        ad_run_checked(p, &found);
    else if (*began)
        ad_rerun(p);
    else
        ad_run(p);
    *began = true;
    if (!checked && ad_program_error(p)->status == AD_OK)
        return true;
    found = checked ? found : *ad_program_error(p);
    if (found.status != AD_OK)
        ad_fail(error, found.status, "step %zu%s: %s", t, way, found.message);
    return found.status != AD_E_ACCURACY; /* of a loop inside */
}

/* Runs steps [from, to) on s->state; false: interrupted. */
static bool advance(struct scan *s, const struct matrix_at z[], size_t from, size_t to,
                    char *result, bool checked)
{
    for (size_t t = from; t < to; t++) {
        unpack(s->n_state, s->operand, s->state);
        for (uint32_t k = s->n_state; k < s->n_state + s->n_in; k++)
            load_block(&s->operand[k], &z[k], t);
        if (!ad_step_run(s, s->program, &s->began, checked, t, "", &s->error))
            return false;
        pack(s->n_state, s->result, s->state);
        if (!result)
            continue;
        char *value = result + s->state_bytes;
        for (uint32_t k = s->n_state; k < s->n_results; value += s->result[k].value, k++)
            store_block(&s->result[k], value, t);
    }
    return true;
}

/* Sets start and shared values. */
static void begin(struct scan *s, const struct matrix_at z[])
{
    s->began = false;
    s->error = (struct ad_error){0};
    for (uint32_t k = 0; k < s->n_operands; k++)
        if (k < s->n_state || k >= s->n_state + s->n_in)
            load_block(&s->operand[k], &z[k], 0);
    pack(s->n_state, s->operand, s->state);
}

static void store(struct scan *s, size_t t)
{
    memcpy(s->states + s->n_stored * s->state_bytes, s->state, s->state_bytes);
    s->at[s->n_stored++] = t;
}

/* From the state at t to that at `end`, storing those that the way back of `steps` steps wants;
   false: interrupted. */
static bool advance_storing(struct scan *s, const struct matrix_at z[], size_t t, size_t end,
                            size_t steps, char *result, bool checked)
{
    while (s->n_stored < s->slots && t + 1 < steps) {
        size_t next = t + ad_checkpoint_after(steps - t, s->slots - s->n_stored);
        if (!advance(s, z, t, next, result, checked))
            return false;
        store(s, t = next);
    }
    return advance(s, z, t, end, result, checked);
}

void ad_scan_store(struct scan *s, const struct matrix_at z[], size_t last, char *result,
                   bool checked)
{
    begin(s, z);
    s->n_stored = 0;
    if (s->slots)
        store(s, 0);
    s->complete = advance_storing(s, z, 0, last, s->steps, result, checked) && s->slots > 0;
}

bool ad_scan_state_at(struct scan *s, const struct matrix_at z[], size_t t)
{
    while (s->at[s->n_stored - 1] > t)
        s->n_stored--;
    size_t from = s->at[s->n_stored - 1];
    memcpy(s->state, s->states + (s->n_stored - 1) * s->state_bytes, s->state_bytes);
    return advance_storing(s, z, from, t, t + 1, NULL, false);
}

void ad_scan_run(struct scan *s, const struct matrix_at z[], char *result, bool checked)
{
    ad_scan_store(s, z, s->steps, result, checked);
    memcpy(result, s->state, s->state_bytes);
    for (uint32_t k = 0; is_interrupted(s) && k < s->n_results; result += s->result[k++].value)
        memset(result, 0xff, s->result[k].value); /* NaN */
}
