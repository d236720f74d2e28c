/* Operands of compiled instructions: each is loaded once, as far outside the loops as possible. */
#include "writer.h"

#include <stdarg.h>

void ad_native_say(const struct writer *w, const char *format, ...)
{
    char text[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    for (const char *c = text; *c; c++)
        if (*c == '@')
            fprintf(w->out, "%u", w->walk->lanes);
        else
            fputc(*c, w->out);
}

/* ---- locations ---- */

/* List b is list a with a constant added. */
static bool same_list(const struct writer *w, uint32_t a, uint32_t b)
{
    const uint32_t *x = w->p->lists + a, *y = w->p->lists + b;
    for (uint32_t r = 1; r < w->g->rows; r++)
        if (y[r] - x[r] != y[0] - x[0])
            return false;
    return true;
}

static void find_list(struct writer *w, const struct loc *l)
{
    for (size_t k = 0; l->list && k < w->n_lists; k++)
        if (same_list(w, w->lists[k], l->list - 1))
            return;
    if (l->list && w->n_lists < MAX_LISTS)
        w->lists[w->n_lists++] = l->list - 1;
}

/* The coordinates of one body are adjacent: one index serves all of them. */
void ad_native_find_lists(struct writer *w)
{
    for (const struct instruction *in = w->first; in < w->end; in++) {
        if (in->kind == DO_ADD_ROWS)
            find_list(w, &w->p->locs[in->loc[0]]);
        for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
            find_list(w, &w->p->locs[in->loc[k]]);
    }
}

/* The index of row r in a list, from the list that it differs from by a constant. */
static void write_listed(const struct writer *w, uint32_t list)
{
    const uint32_t *lists = w->p->lists;
    for (size_t k = 0; k < w->n_lists; k++)
        if (same_list(w, w->lists[k], list)) {
            long more = (long)lists[list] - (long)lists[w->lists[k]];
            ad_native_say(w, "((size_t)l[%u + r] + %ld)", w->lists[k] + w->k, more);
            return;
        }
    ad_native_say(w, "(size_t)l[%u + r]", list + w->k);
}

static uint32_t literal_row(const struct writer *w, const struct loc *l)
{
    return l->list ? w->p->lists[l->list - 1 + w->k] : w->k;
}

size_t ad_native_at(const struct writer *w, const struct loc *l)
{
    return l->off + (size_t)literal_row(w, l) * l->rs * w->p->element;
}

void ad_native_row(const struct writer *w, const struct loc *l)
{
    if (w->walk->literal || w->g->rows == 1)
        ad_native_say(w, "%u", literal_row(w, l));
    else if (l->list)
        write_listed(w, l->list - 1);
    else
        ad_native_say(w, "(r + %u)", w->k);
}

void ad_native_start(const struct writer *w, const struct loc *l)
{
    ad_native_say(w, "%s + %zu", l->base == BASE_WINDOW ? "win" : "m", l->off);
}

void ad_native_address(const struct writer *w, const struct loc *l)
{
    ad_native_start(w, l);
    if (l->rs && (l->list || w->g->rows > 1)) {
        ad_native_say(w, " + ");
        ad_native_row(w, l);
        ad_native_say(w, " * %zu", l->rs * w->p->element);
    }
    if (l->cs && w->g->cols > 1)
        ad_native_say(w, " + c * %zu", w->p->element);
}

static enum scope scope_of(const struct writer *w, const struct loc *l)
{
    bool same_row = !l->rs && !l->list;
    if (w->crosses || l->base == BASE_TILE)
        return INNER;
    if (w->walk->along_rows)
        return same_row ? FUNCTION : INNER;
    if (same_row && !l->cs)
        return FUNCTION;
    return (w->walk->rows_inside ? same_row : !l->cs) ? OUTER : INNER;
}

/* ---- gathered rows ---- */

static struct array *array_of(struct writer *w, const struct loc *l)
{
    size_t k = 0;
    while (k < w->n_arrays && (w->arrays[k].off != l->off || w->arrays[k].stride != l->rs))
        k++;
    if (k == w->n_arrays && k < MAX_ARRAYS)
        w->arrays[w->n_arrays++] = (struct array){.off = l->off, .stride = l->rs};
    return k < MAX_ARRAYS ? &w->arrays[k] : NULL;
}

static bool reads_array(const struct writer *w, const struct loc *l)
{
    return w->walk->rows_inside && l->base == BASE_MEMORY && l->list && l->cs;
}

static void count_rows(struct writer *w, const struct loc *l)
{
    struct array *a = reads_array(w, l) ? array_of(w, l) : NULL;
    for (uint32_t r = 0; a && r < w->g->rows; r++) {
        uint32_t row = w->p->lists[l->list - 1 + r];
        a->rows = row < a->rows ? a->rows : row + 1;
        a->uses++;
    }
}

/* Rows that are read several times each, and few enough for the cache, are gathered first. */
void ad_native_find_arrays(struct writer *w)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
            count_rows(w, &w->p->locs[in->loc[k]]);
    for (struct array *a = w->arrays; a < w->arrays + w->n_arrays; a++)
        if (a->uses < 2 * a->rows || a->rows * w->walk->lanes * w->p->element > MAX_ARRAY_BYTES)
            a->rows = 0;
}

void ad_native_fill_arrays(const struct writer *w)
{
    for (size_t k = 0; k < w->n_arrays; k++)
        if (w->arrays[k].rows)
            ad_native_say(w,
                          "V@ q%zu[%u];\nfor (size_t r = 0; r < %u; r++)"
                          " q%zu[r] = load@(m + %zu + r * %zu + c * %zu);\n",
                          k, w->arrays[k].rows, w->arrays[k].rows, k, w->arrays[k].off,
                          w->arrays[k].stride * w->p->element, w->p->element);
}

/* ---- loads ---- */

static void write_array_element(struct writer *w, const struct loc *l, const struct array *array)
{
    ad_native_say(w, "q%zu[", (size_t)(array - w->arrays));
    ad_native_row(w, l);
    ad_native_say(w, "]");
}

/* Vectors of rows of one column. */
static void write_load_along_rows(const struct writer *w, const struct loc *l)
{
    size_t step = l->rs * w->p->element;
    if (l->list && w->walk->lanes > 1) {
        ad_native_say(w, "rows@(m + %zu, l + %u + r, %zu)", l->off, l->list - 1, step);
        return;
    }
    ad_native_say(w, !l->rs                              ? "splat@("
                     : l->rs == 1 || w->walk->lanes == 1 ? "load@("
                                                         : "strided@(");
    ad_native_address(w, l);
    if (l->rs > 1 && w->walk->lanes > 1)
        ad_native_say(w, ", %zu", step);
    ad_native_say(w, ")");
}

static void write_place(const struct writer *w, const struct place *place)
{
    ad_native_say(w, "%c%u", place->kind, place->number);
    if (place->row != UINT32_MAX)
        ad_native_say(w, place->kind == 'a' ? "[%u]" : "_%u", place->row);
}

static struct place *find_place(struct writer *w, uint8_t base, size_t at)
{
    for (size_t k = 0; k < w->n_places; k++)
        if (w->places[k].base == base && w->places[k].at == at)
            return &w->places[k];
    return NULL;
}

void ad_native_remember(struct writer *w, struct place place)
{
    struct place *known = find_place(w, place.base, place.at);
    if (w->walk->literal && (known || w->n_places < MAX_PLACES))
        *(known ? known : &w->places[w->n_places++]) = place;
}

/* Stencils read beyond the vector of columns at hand. */
bool ad_native_is_read(const struct writer *w, uint32_t value, uint8_t base, size_t at)
{
    if (!w->n_joined || w->p->last[value] > w->joined[w->n_joined - 1].number)
        return true;
    for (size_t k = 0; k < w->n_joined; k++) {
        struct writer by = {.p = w->p};
        const struct segment *g = &w->joined[k].segment;
        const struct instruction *first = w->p->instructions + g->first;
        for (const struct instruction *in = first; in < first + g->count; in++)
            for (by.k = 0; !reads_lanes(in) && by.k < g->rows; by.k++)
                if (w->p->locs[in->loc[1]].base == base &&
                    ad_native_at(&by, &w->p->locs[in->loc[1]]) == at)
                    return true;
    }
    return false;
}

static void write_load(struct writer *w, const struct loc *l);

void ad_native_fetch(struct writer *w, const struct loc *l)
{
    const struct place *place =
        w->walk->literal && l->cs ? find_place(w, l->base, ad_native_at(w, l)) : NULL;
    if (place)
        write_place(w, place);
    else
        write_load(w, l);
}

/* The processor fetches ahead within a page alone, and a vector takes each row from another. */
const char *ad_native_loads(const struct writer *w, const struct loc *l)
{
    bool far = l->base == BASE_MEMORY && w->walk->lanes > 1 && ad_native_streams(w->p);
    return far ? "ahead@(" : "load@(";
}

static void write_load(struct writer *w, const struct loc *l)
{
    const struct array *array = reads_array(w, l) ? array_of(w, l) : NULL;
    if (array && array->rows) {
        write_array_element(w, l, array);
    } else if (w->walk->along_rows) {
        write_load_along_rows(w, l);
    } else {
        ad_native_say(w, "%s", l->cs ? ad_native_loads(w, l) : "splat@(");
        ad_native_address(w, l);
        ad_native_say(w, ")");
    }
}

/* ---- variables ---- */

void ad_native_name(const struct writer *w, uint32_t loc)
{
    if (w->known[loc] & EVERY_ROW)
        ad_native_say(w, "v%u", loc);
    else
        ad_native_say(w, "v%u_%u", loc, w->k);
}

static void declare(struct writer *w, uint32_t loc, enum scope scope)
{
    const struct loc *l = &w->p->locs[loc];
    uint32_t bit = scope == INNER ? 1u << w->k : EVERY_ROW;
    if ((w->known[loc] & (EVERY_ROW | bit)) || scope_of(w, l) != scope)
        return;
    w->known[loc] |= bit;
    ad_native_say(w, "const V@ ");
    ad_native_name(w, loc);
    ad_native_say(w, " = ");
    if (l->base == BASE_TILE)
        ad_native_say(w, "a->x[%u]", ad_native_slot(w, loc));
    else
        ad_native_fetch(w, l);
    ad_native_say(w, ";\n");
    if (l->cs && l->base != BASE_TILE)
        ad_native_remember(w, (struct place){ad_native_at(w, l), l->base, 'v', loc,
                                             scope == INNER ? w->k : UINT32_MAX});
}

void ad_native_declare(struct writer *w, const struct instruction *in, enum scope scope)
{
    for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
        declare(w, in->loc[k], scope);
}

void ad_native_declare_all(struct writer *w, enum scope scope)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        ad_native_declare(w, in, scope);
}
