/* What each row adds to the sums of a segment (sums.c). */
#include "sums.h"

/* The value to add, without the lanes that the previous vector already had. */
static void write_new_lanes(const struct writer *w, uint32_t loc)
{
    ad_native_say(w, w->ragged ? "only@(on, " : "(");
    ad_native_name(w, loc);
    ad_native_say(w, ")");
}

static void add_to_sum(const struct writer *w, const struct instruction *in, char sign)
{
    ad_native_say(w, "%s%u %c= wide@(", ad_native_sum(w), in->loc[3], sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, ");\n");
}

static void add_to_row_sums(const struct writer *w, const struct instruction *in)
{
    if (w->walk->along_rows) { /* each lane is a row, and all of it */
        ad_native_say(w, "{ const D@ d = wide@(");
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, "); COPY(%s%u + r, &d, sizeof d); }\n", ad_native_sum(w), in->loc[3]);
        return;
    }
    ad_native_say(w, "%s%u[", ad_native_sum(w), in->loc[3]);
    ad_native_row(w, &(struct loc){0});
    ad_native_say(w, "] += across@(wide@(");
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "));\n");
}

/* The target row. A sum over rows that shares its memory with scatters has one row. */
static void write_target(const struct writer *w, const struct instruction *in)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    if (o->list)
        ad_native_row(w, o);
    else
        ad_native_say(w, "0");
}

/* Lanes are rows: each has a target row of its own, or all have the same. */
static void scatter_lanes(const struct writer *w, const struct instruction *in, char sign)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    if (!o->list) {
        ad_native_say(w, "{ char *to = ");
        ad_native_rows(w, in->loc[3]);
        ad_native_say(w, "; store1(to, load1(to) %c (R)across@(wide@(", sign);
        write_new_lanes(w, in->loc[1]);
        ad_native_say(w, "))); }\n");
        return;
    }
    ad_native_say(w, "scatter@(");
    ad_native_rows(w, in->loc[3]);
    ad_native_say(w, ", l + %u + r, %zu, %c", o->list - 1, ad_native_row_bytes(w, in->loc[3]),
                  sign);
    ad_native_name(w, in->loc[1]);
    ad_native_say(w, ", %s);\n", w->ragged ? "next - r" : "0");
}

static void add_in_memory(const struct writer *w, const struct instruction *in, char sign)
{
    ad_native_say(w, "{ char *to = ");
    ad_native_rows(w, in->loc[3]);
    ad_native_say(w, " + ");
    write_target(w, in);
    ad_native_say(w, " * %zu + c * %zu; store@(to, load@(to) %c ",
                  ad_native_row_bytes(w, in->loc[3]), w->p->element, sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "); }\n");
}

/* A row in a register begins as its first value; one that begins with a difference is negated. */
static void add_literal(struct writer *w, const struct instruction *in, char sign)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    const uint32_t sink = in->loc[3], row = o->list ? w->p->lists[o->list - 1 + w->k] : 0;
    struct target *target = &w->targets[sink - w->g->first_sink];
    const uint32_t bit = 1u << row;
    const bool begun = target->begun & bit, minus = sign == '-', negated = target->negated & bit;
    ad_native_name_sum(w, sink, row);
    ad_native_say(w, !begun ? " = " : minus == negated ? " += " : minus ? " -= " : " = ");
    ad_native_name(w, in->loc[1]);
    if (begun && negated && !minus) {
        ad_native_say(w, " - ");
        ad_native_name_sum(w, sink, row);
    }
    ad_native_say(w, ";\n");
    target->begun |= bit;
    target->negated = minus && (negated || !begun) ? target->negated | bit : target->negated & ~bit;
}

static void add_to_run(const struct writer *w, const struct instruction *in)
{
    const uint32_t o = run_of(w, in);
    ad_native_say(w, "if (i%u != ", o);
    write_target(w, in);
    ad_native_say(w, ") { a%u[i%u] += f%u; f%u = all@(0); i%u = ", in->loc[3], o, o, o, o);
    write_target(w, in);
    ad_native_say(w, "; }\nf%u", o);
}

static void add_in_registers(struct writer *w, const struct instruction *in, char sign)
{
    const bool run = ad_native_has_runs(w, in);
    if (run)
        add_to_run(w, in);
    else
        ad_native_say(w, "%s%u", ad_native_sum(w), in->loc[3]);
    if (ad_native_scatters(w, in->loc[3]) && !run) {
        ad_native_say(w, "[");
        write_target(w, in);
        ad_native_say(w, "]");
    }
    ad_native_say(w, " %c= ", sign);
    ad_native_name(w, in->loc[1]);
    ad_native_say(w, ";\n");
}

void ad_native_add(struct writer *w, const struct instruction *in)
{
    uint32_t sink = in->loc[3];
    char sign = w->p->values[in->value].flags & VALUE_NEGATED ? '-' : '+';
    if (ad_native_in_doubles(w, sink))
        add_to_sum(w, in, sign);
    else if (in->kind == DO_SUM_COLS)
        add_to_row_sums(w, in);
    else if (w->walk->along_rows)
        scatter_lanes(w, in, sign);
    else if (!ad_native_kept_for_columns(w, sink))
        add_in_memory(w, in, sign);
    else
        (ad_native_sum_is_literal(w, sink) ? add_literal : add_in_registers)(w, in, sign);
}
