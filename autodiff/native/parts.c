/* Splits segments that are too long for one function, because compile time grows faster than the
   length of a function (register allocation is quadratic). The loop body becomes several functions,
   called in turn for each vector; together they do all instructions in order, values and sums. They
   share a structure of the sums (sums.c) and of x, one vector per slot of the interpreter's tiles.
   A value that one part computes and another reads passes through x, which stays in the first-level
   cache; a slot is free when it is written, because slots were assigned in the same order of
   instructions (compile/tiles.c). */
#include "writer.h"

#include <stdlib.h>

enum { MOST_TOGETHER = 512, MOST_SUMS_TOGETHER = 64 }; /* instructions; sums of a whole segment */

static uint32_t n_parts(const struct writer *w) { return (w->g->count - 1) / MOST_TOGETHER + 1; }

static const struct instruction *part_begin(const struct writer *w, uint32_t part)
{
    return w->first + (uint64_t)w->g->count * part / n_parts(w);
}

/* Values on tiles that another part reads. */
static bool find_crossing(struct writer *w)
{
    uint32_t *home = calloc(w->n_known, sizeof *home);
    w->crosses = calloc(w->n_known, 1);
    for (uint32_t part = 0; home && w->crosses && part < n_parts(w); part++)
        for (const struct instruction *in = part_begin(w, part); in < part_begin(w, part + 1);
             in++) {
            for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
                w->crosses[in->loc[k]] |= home[in->loc[k]] != part;
            home[in->loc[0]] = part;
        }
    free(home);
    return home && w->crosses;
}

uint32_t ad_native_slot(const struct writer *w, uint32_t loc)
{
    return (uint32_t)(w->p->locs[loc].off /
                      ad_slot_bytes(w->p->element, &w->p->segments[w->walk->number]));
}

static void write_structure(const struct writer *w)
{
    uint32_t slots = 1;
    for (uint32_t i = 0; i < w->n_known; i++)
        if (w->crosses[i] && w->p->locs[i].base == BASE_TILE && ad_native_slot(w, i) >= slots)
            slots = ad_native_slot(w, i) + 1;
    ad_native_say(w, "struct parts%u {\nV@ x[%u];\n", w->walk->number, slots);
    ad_native_declare_sums(w);
    ad_native_say(w, "};\n");
}

static void write_part(struct writer w, uint32_t part)
{
    w.end = part_begin(&w, part + 1);
    w.first = part_begin(&w, part);
    ad_native_say(&w,
                  "static __attribute__((noinline)) void s%u_%u(char *m, char *win, const u32 *l,"
                  " size_t chunk, size_t r, size_t c%s, struct parts%u *a)\n{\n",
                  w.walk->number, part, w.ragged ? ", size_t next, I@ on" : "", w.walk->number);
    for (const struct instruction *in = w.first; in < w.end; in++)
        ad_native_instruction(&w, in, 0, 1);
    ad_native_say(&w, "}\n");
    ad_native_forget_rows(&w);
}

bool ad_native_parts(struct writer *w)
{
    if (w->g->count <= MOST_TOGETHER && w->g->n_sinks <= MOST_SUMS_TOGETHER)
        return true;
    if (!find_crossing(w))
        return false;
    write_structure(w);
    ad_native_sums_parts(w);
    for (uint32_t part = 0; part < n_parts(w); part++)
        write_part(*w, part);
    return true;
}

void ad_native_call_parts(struct writer *w)
{
    for (uint32_t part = 0; part < n_parts(w); part++)
        ad_native_say(w, "s%u_%u(m, win, l, chunk, r, %s%s, a);\n", w->walk->number, part,
                      w->walk->along_rows ? "0" : "c", w->ragged ? ", next, on" : "");
}
