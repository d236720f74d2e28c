/* How machine code carries the jets of a series: convolutions of one kind that may be done at once
   share vectors. */
#ifndef AUTODIFF_SERIES_LANES_H
#define AUTODIFF_SERIES_LANES_H

#include "internal.h"

enum { MOST_LANES = 8, GROUP_OPERANDS = 4 };

/* The coefficients of up to `width` jets, order by order; what is beyond the last repeats the
   first. */
struct pack {
    uint32_t jets[MOST_LANES];
    uint32_t n, width;
    size_t at; /* in the row of each order, in doubles */
};

/* Jets of one kind and level. Operands are packs: of a product a and b, of a square a, of a
   quotient b and y, of a reciprocal and a power a and y, of a root y, of an integral ea, da, eb and
   db. */
struct group {
    uint32_t jets[MOST_LANES];
    uint32_t n, width;
    uint32_t operand[GROUP_OPERANDS], n_operands;
    uint16_t kind;
    uint32_t level;
};

struct lanes {
    uint32_t *order;    /* [n] jets, by level: what they need of their own order comes before */
    uint32_t *group_of; /* [n], or JET_NONE */
    struct group *groups;
    struct pack *packs;
    size_t n_groups, n_packs;
    size_t row; /* doubles of one order's packs, which lie together */
};

/* Groups of at most `most` jets; packs lie at multiples of their width,
   rows of them at those of `align`. */
bool ad_series_lanes(const ad_series *series, size_t most, size_t align, struct lanes *lanes);
void ad_series_lanes_free(struct lanes *lanes);

#endif
