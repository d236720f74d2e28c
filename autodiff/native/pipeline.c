/* Software pipelining of a loop over rows: divisions and square roots of the next row start before
   the rest of this one. A processor looks only some hundred operations ahead, and a row fills that
   window with operations that wait for its own division. The head of a row holds what its slow
   operations need.

   Without it the product of the Hessian of three bodies, or of a gas, with a vector takes 1.2 to
   1.4 times as long. */
#include "autodiff/free.h"
#include "writer.h"

#include <stdlib.h>

struct pipeline {
    struct writer *w;
    bool *head;       /* per instruction */
    uint8_t *of_head; /* per location: has a variable in the head */
    uint8_t *carried; /* ... that the rest reads */
};

static bool is_slow(const ad_program *p, const struct instruction *in)
{
    enum ad_op op = (enum ad_op)p->values[in->value].op;
    return in->kind == DO_ELEMENTWISE && in->loc[0] == in->value &&
           (op == AD_OP_div || op == AD_OP_recip || op == AD_OP_recip0 || op == AD_OP_sqrt);
}

/* False if there is no slow operation. */
static bool find_head(struct pipeline *l)
{
    const struct writer *w = l->w;
    bool any = false;
    for (const struct instruction *in = w->end; in-- > w->first;) {
        if (!is_slow(w->p, in) && !(in->kind <= DO_DIFF_ADJOINT && l->of_head[in->loc[0]]))
            continue;
        any = true;
        l->head[in - w->first] = true;
        l->of_head[in->loc[0]] = 1;
        for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
            l->of_head[in->loc[k]] = 1;
    }
    return any;
}

static void find_carried(struct pipeline *l)
{
    const struct writer *w = l->w;
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 1; k <= in->n_in && reads_lanes(in) && !l->head[in - w->first]; k++) {
            uint32_t x = in->loc[k];
            l->carried[x] = l->of_head[x] && !(w->known[x] & EVERY_ROW);
        }
}

/* A line for each variable that is carried; the text has its number twice. */
static void write_carried(const struct pipeline *l, const char *format)
{
    for (uint32_t i = 0; i < l->w->n_known; i++)
        if (l->carried[i])
            ad_native_say(l->w, format, i, i);
}

static void write_half(const struct pipeline *l, bool head)
{
    struct writer *w = l->w;
    for (const struct instruction *in = w->first; in < w->end; in++)
        if (l->head[in - w->first] == head)
            ad_native_instruction(w, in, 0, 1);
    if (head)
        write_carried(l, "p%u = v%u_0;\n");
    ad_native_forget_rows(w);
}

static void write_loop(const struct pipeline *l)
{
    struct writer *w = l->w;
    write_carried(l, "V@ p%u, t%u;\n");
    ad_native_say(w, "if (row < row_end) {\nconst size_t r = row;\n");
    write_half(l, true);
    ad_native_say(w, "}\nfor (size_t now = row; now < row_end; now++) {\n");
    write_carried(l, "t%u = p%u;\n");
    ad_native_say(w, "{\nconst size_t r = now + 1 < row_end ? now + 1 : now;\n");
    write_half(l, true);
    ad_native_say(w, "}\nconst size_t r = now;\n");
    write_carried(l, "const V@ v%u_0 = t%u;\n");
    for (uint32_t i = 0; i < w->n_known; i++)
        w->known[i] |= l->carried[i];
    write_half(l, false);
    ad_native_say(w, "}\n");
}

bool ad_native_pipeline(struct writer *w, bool *written)
{
    struct pipeline l = {.w = w,
                         .head = calloc(w->g->count, sizeof *l.head),
                         .of_head = calloc(w->n_known, 1),
                         .carried = calloc(w->n_known, 1)};
    bool done = l.head && l.of_head && l.carried;
    *written = done && find_head(&l);
    if (*written) {
        find_carried(&l);
        w->halves = true;
        write_loop(&l);
        w->halves = false;
    }
    AD_FREE(l.head, l.of_head, l.carried);
    return done;
}
