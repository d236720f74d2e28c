/* Where the sums of a segment are (sums.c), for those that add to them (adds.c). */
#ifndef AUTODIFF_NATIVE_SUMS_H
#define AUTODIFF_NATIVE_SUMS_H

#include "writer.h"

/* The target row comes from an index list. */
bool ad_native_scatters(const struct writer *w, uint32_t sink);
/* A vector of doubles for all rows. */
bool ad_native_in_doubles(const struct writer *w, uint32_t sink);
/* Vectors that are stored after the rows of one vector of columns. */
bool ad_native_kept_for_columns(const struct writer *w, uint32_t sink);
/* Its rows are written one by one and stay in registers: the first value begins a sum. */
bool ad_native_sum_is_literal(const struct writer *w, uint32_t sink);
/* Consecutive rows mostly add to the same row, as those of one body in a list of pairs: f<run> sums
   them up for row i<run> in a register, which memory would have to return each time. */
bool ad_native_has_runs(const struct writer *w, const struct instruction *in);

static inline uint32_t run_of(const struct writer *w, const struct instruction *in)
{
    return (uint32_t)(in - w->p->instructions);
}

/* The beginning of a sum's name; that of a row in registers. */
const char *ad_native_sum(const struct writer *w);
void ad_native_name_sum(const struct writer *w, uint32_t sink, uint32_t row);
/* Start of the rows that are accumulated into, the chunk's private copy or the result, and the
   distance of two. */
void ad_native_rows(const struct writer *w, uint32_t sink);
size_t ad_native_row_bytes(const struct writer *w, uint32_t sink);

#endif
