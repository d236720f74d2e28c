/* Inside of the emission of one segment: names, places, and what is written where.

   A variable v<location> holds a vector of a value; v<location>_<k> that of the k-th of several
   rows that are written side by side: their chains of operations do not wait for each other, so
   that a division of one row runs beside the sums of another. */
#ifndef AUTODIFF_NATIVE_WRITER_H
#define AUTODIFF_NATIVE_WRITER_H

#include "native.h"

enum {
    MAX_ARRAYS = 16,
    MAX_LISTS = 8,
    MAX_ARRAY_BYTES = 64 << 10, /* what stays in the cache beside the rest */
    MAX_BESIDE = 4,             /* rows side by side: registers end there */
    EVERY_ROW = 1 << 7          /* of `known`: a variable for all rows */
};

/* Where a variable is declared: before the loops, between the two, or where it is used. */
enum scope { FUNCTION, OUTER, INNER };

/* Rows of a value in memory that are read by number: one vector of each lies in q<k>. */
struct array {
    size_t off;
    uint32_t stride, rows, uses;
};

struct writer {
    FILE *out;
    const ad_program *p;
    const struct loop_order *walk;
    const struct segment *g;
    const struct instruction *first, *end;
    uint8_t *known;     /* per location: which of the rows side by side have a variable */
    uint8_t *crosses;   /* per location: read by several parts; NULL where the segment is whole */
    uint8_t *scattered; /* per sink of the segment: rows are added into rows by number */
    uint32_t n_known;
    struct array arrays[MAX_ARRAYS];
    size_t n_arrays;
    uint32_t lists[MAX_LISTS]; /* of row numbers: the first of those that differ by a constant */
    size_t n_lists;
    bool ragged;     /* the last vector is moved back over the one before */
    bool halves;     /* a row is written in two halves, that share no more than they must */
    bool literal;    /* rows are numbers: `row` the first of those side by side */
    uint32_t row, k; /* k: which of them is written */
};

/* Writes; @ becomes the number of lanes. */
void ad_native_say(const struct writer *w, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* ---- operands: operands.c ---- */

void ad_native_find_lists(struct writer *w);
void ad_native_find_arrays(struct writer *w);
void ad_native_fill_arrays(const struct writer *w);
/* The row of a location, and the address of its element in row r, column c. */
void ad_native_row(const struct writer *w, const struct loc *l);
void ad_native_address(const struct writer *w, const struct loc *l);
void ad_native_name(const struct writer *w, uint32_t loc);
/* Declares the operands of an instruction, or of all, that belong in this scope. */
void ad_native_declare(struct writer *w, const struct instruction *in, enum scope scope);
void ad_native_declare_all(struct writer *w, enum scope scope);

/* Operations that read their operands lane by lane. */
static inline bool reads_lanes(const struct instruction *in)
{
    return in->kind != DO_DIFF && in->kind != DO_DIFF_ADJOINT;
}

/* Adds up, instead of computing a value. */
static inline bool is_sum(const struct instruction *in) { return in->kind > DO_DIFF_ADJOINT; }

/* ---- operations: operations.c ---- */

/* What must stand before it, and the expression of an instruction that is no sum. */
void ad_native_prepare(const struct writer *w, const struct instruction *in);
void ad_native_operation(const struct writer *w, const struct instruction *in);

/* ---- sums: sums.c ---- */

bool ad_native_find_scatters(struct writer *w); /* false when out of memory */
void ad_native_declare_sums(const struct writer *w);
/* What sums need before and after all loops, the columns of one row, the rows of one vector of
   columns. */
enum moment { OPEN_SEGMENT, CLOSE_SEGMENT, OPEN_ROW, CLOSE_ROW, OPEN_COLUMNS, CLOSE_COLUMNS };
void ad_native_sums(const struct writer *w, enum moment moment);
/* The functions in which that is done where a segment has parts. */
void ad_native_sums_parts(const struct writer *w);
void ad_native_add(const struct writer *w, const struct instruction *in);

/* ---- statements: segment.c ---- */

void ad_native_instruction(struct writer *w, const struct instruction *in);
/* Another row begins, or another block of the text: no variable of one row is declared. */
void ad_native_forget_rows(struct writer *w);

/* ---- parts.c ---- */

/* Writes the parts of a segment that is long, and sets `crosses`. False when out of memory. */
bool ad_native_parts(struct writer *w);
/* Stands for the instructions of a row. */
void ad_native_call_parts(struct writer *w);
/* Which vector of x a value on a tile goes through. */
uint32_t ad_native_slot(const struct writer *w, uint32_t loc);

/* ---- pipeline.c ---- */

/* Writes the loop over rows if there is something slow in it; false when out of memory. */
bool ad_native_pipeline(struct writer *w, bool *written);

#endif
