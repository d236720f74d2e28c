/* Groups and packs (lanes.h). */
#include "lanes.h"
#include "autodiff/free.h"

#include <stdlib.h>
#include <string.h>

static bool is_convolution(const struct jet *it)
{
    return (it->kind >= JET_PRODUCT && it->kind <= JET_POWER) || it->kind == JET_INTEGRAL;
}

/* What coefficient k needs of the others' coefficients k. */
static size_t needs(const struct jet *it, uint32_t x[2])
{
    if (it->kind == JET_SELECT) {
        x[0] = it->da;
        x[1] = it->db;
    } else {
        x[0] = it->kind == JET_PIECEWISE ? JET_NONE : it->a;
        x[1] = it->kind == JET_PIECEWISE ? JET_NONE : it->b;
    }
    return 2;
}

/* Jets follow their operands, but for derivatives of integrals, of which order k - 1 is needed. */
static void find_levels(const ad_series *s, uint32_t *level)
{
    for (bool changed = true; changed;) {
        changed = false;
        for (uint32_t k = 0; k < s->n; k++) {
            uint32_t x[2], least = 0;
            for (size_t j = 0, n = needs(&s->jets[k], x); j < n; j++)
                if (x[j] != JET_NONE && level[x[j]] >= least)
                    least = level[x[j]] + 1;
            changed = changed || least > level[k];
            level[k] = least;
        }
    }
}

/* What the jets of a level are sorted by: those of one kind in the order of their operands, so that
   groups which read the same jets share a pack. */
struct place {
    uint32_t level, kind, a, b, id;
};

static int by_place(const void *x, const void *y)
{
    const uint32_t *p = x, *q = y;
    for (size_t k = 0; k < sizeof(struct place) / sizeof *p; k++)
        if (p[k] != q[k])
            return p[k] < q[k] ? -1 : 1;
    return 0;
}

static bool sort(const ad_series *s, const uint32_t *level, uint32_t *order)
{
    struct place *places = malloc((s->n + 1) * sizeof *places);
    for (uint32_t k = 0; places && k < s->n; k++) {
        const struct jet *it = &s->jets[k];
        places[k] = (struct place){level[k], it->kind, it->a, it->b, k};
    }
    if (places)
        qsort(places, s->n, sizeof *places, by_place);
    for (uint32_t k = 0; places && k < s->n; k++)
        order[k] = places[k].id;
    free(places);
    return places;
}

static size_t round_up(size_t n, size_t to) { return (n + to - 1) / to * to; }

static uint32_t find_pack(struct lanes *l, uint32_t n, uint32_t width, const uint32_t jets[])
{
    struct pack made = {.n = n, .width = width, .at = round_up(l->row, width)};
    memcpy(made.jets, jets, n * sizeof *jets);
    for (uint32_t k = 0; k < l->n_packs; k++) {
        const struct pack *p = &l->packs[k];
        if (p->width == width && p->n == n && memcmp(p->jets, made.jets, sizeof made.jets) == 0)
            return k;
    }
    l->packs[l->n_packs] = made;
    l->row = made.at + width;
    return (uint32_t)l->n_packs++;
}

static uint32_t operand_of(const struct jet *it, uint32_t self, size_t k)
{
    const uint32_t integral[] = {it->ea, it->da, it->eb, it->db};
    switch (it->kind) {
    case JET_INTEGRAL:
        return integral[k];
    case JET_SQUARE:
        return k ? JET_NONE : it->a;
    case JET_ROOT:
        return k ? JET_NONE : self;
    case JET_QUOTIENT:
        return k == 0 ? it->b : k == 1 ? self : JET_NONE;
    case JET_RECIP:
    case JET_RECIP0:
    case JET_POWER:
        return k == 0 ? it->a : k == 1 ? self : JET_NONE;
    default:
        return k == 0 ? it->a : k == 1 ? it->b : JET_NONE;
    }
}

static void pack_operands(const ad_series *s, struct lanes *l, struct group *g)
{
    for (g->width = 1; g->width < g->n;)
        g->width *= 2;
    for (size_t k = 0; k < GROUP_OPERANDS; k++) {
        uint32_t jets[MOST_LANES] = {JET_NONE};
        for (uint32_t i = 0; i < g->n; i++)
            jets[i] = operand_of(&s->jets[g->jets[i]], g->jets[i], k);
        if (jets[0] == JET_NONE)
            break;
        g->operand[g->n_operands++] = find_pack(l, g->n, g->width, jets);
    }
}

static bool joins(const ad_series *s, const struct group *g, uint32_t level, const struct jet *it,
                  size_t most)
{
    const struct jet *first = &s->jets[g->jets[0]];
    return g->level == level && g->kind == it->kind && g->n < most && it->kind != JET_PRODUCT0 &&
           (first->b == JET_NONE) == (it->b == JET_NONE);
}

static void find_groups(const ad_series *s, const uint32_t *level, size_t most, struct lanes *l)
{
    for (size_t i = 0; i < s->n; i++) {
        const uint32_t id = l->order[i];
        const struct jet *it = &s->jets[id];
        l->group_of[id] = JET_NONE;
        if (!is_convolution(it))
            continue;
        size_t k = l->n_groups; /* groups of this level are the last ones */
        while (k > 0 && l->groups[k - 1].level == level[id] &&
               !joins(s, &l->groups[k - 1], level[id], it, most))
            k--;
        if (k == 0 || l->groups[k - 1].level != level[id]) {
            k = ++l->n_groups;
            l->groups[k - 1] = (struct group){.kind = it->kind, .level = level[id]};
        }
        struct group *g = &l->groups[k - 1];
        g->jets[g->n++] = id;
        l->group_of[id] = (uint32_t)(k - 1);
    }
    for (size_t k = 0; k < l->n_groups; k++)
        pack_operands(s, l, &l->groups[k]);
}

bool ad_series_lanes(const ad_series *s, size_t most, size_t align, struct lanes *l)
{
    uint32_t *level = calloc(s->n + 1, sizeof *level);
    *l = (struct lanes){.order = malloc((s->n + 1) * sizeof *l->order),
                        .group_of = malloc((s->n + 1) * sizeof *l->group_of),
                        .groups = malloc((s->n + 1) * sizeof *l->groups),
                        .packs = calloc(GROUP_OPERANDS * (s->n + 1), sizeof *l->packs)};
    bool done = level && l->order && l->group_of && l->groups && l->packs;
    if (done) {
        find_levels(s, level);
        done = sort(s, level, l->order);
    }
    if (done) {
        find_groups(s, level, most, l);
        l->row = round_up(l->row, align);
    }
    free(level);
    return done;
}

void ad_series_lanes_free(struct lanes *l) { AD_FREE(l->order, l->group_of, l->groups, l->packs); }
