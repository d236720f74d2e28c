/* Internals of writing one segment: names, locations, and where each statement is written.

   Variable v<location> holds a vector of a value; v<location>_<k> that of the k-th of several
   interleaved rows: their dependency chains are independent, so that a division of one row overlaps
   the sums of another. */
#ifndef AUTODIFF_NATIVE_WRITER_H
#define AUTODIFF_NATIVE_WRITER_H

#include "native.h"

enum {
    MAX_ARRAYS = 16,
    MAX_LISTS = 8,
    MAX_ARRAY_BYTES = 64 << 10, /* bytes that stay in the cache beside the rest */
    MAX_BESIDE = 4,             /* rows interleaved at most: registers run out beyond */
    MAX_LITERAL_ROWS = 16,
    MAX_PLACES = 768,
    EVERY_ROW = 1 << 30 /* of `known`: a variable for all rows */
};

/* Where a variable is declared: before the loops, between the two, or where it is used. */
enum scope { FUNCTION, OUTER, INNER };

/* Gathered rows of a value in memory: q<k> holds one vector of each. */
struct array {
    size_t off;
    uint32_t stride, rows, uses;
};

/* A row of memory whose columns a variable holds: v<number>, v<number>_<row>, a<number>,
   a<number>[row]. */
struct place {
    size_t at;
    uint8_t base;
    char kind;
    uint32_t number, row; /* UINT32_MAX: none */
};

/* What a sum over rows adds to. */
struct target {
    bool listed;             /* the target row comes from an index list */
    uint32_t begun, negated; /* rows that are written one by one: those that have a sum, or minus
                                that sum */
};

struct writer {
    FILE *out;
    const ad_program *p;
    const struct loop_order *walk;
    const struct segment *g;
    const struct instruction *first, *end;
    uint32_t *known;        /* per location: which rows have a variable */
    uint8_t *crosses;       /* per location: read by several parts; NULL in an unsplit segment */
    struct target *targets; /* per sink of the segment */
    uint32_t n_known;
    struct array arrays[MAX_ARRAYS];
    size_t n_arrays;
    uint32_t lists[MAX_LISTS]; /* per index list: the first of those that differ by a constant */
    size_t n_lists;
    struct place places[MAX_PLACES]; /* where rows are literal */
    size_t n_places;
    size_t n_joined; /* segments in one loop, all of them; 0: one alone */
    const struct loop_order *joined;
    bool ragged; /* the last vector overlaps the one before */
    bool halves; /* a row is written in two halves that share as little as possible */
    bool newton; /* reciprocals and roots are corrected guesses */
    uint32_t k;  /* which row is being written: of all where they are literal, else of the
                    interleaved ones */
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
/* Remembers the variable that holds a row of memory; names that of the row of a location, or loads
   it. */
void ad_native_remember(struct writer *w, struct place place);
void ad_native_fetch(struct writer *w, const struct loc *l);
/* The beginning of a load of columns: of what is far away with those to come. */
const char *ad_native_loads(const struct writer *w, const struct loc *l);
/* Whether anything reads the row of a value from memory, or a register is enough. */
bool ad_native_is_read(const struct writer *w, uint32_t value, uint8_t base, size_t at);
/* Byte where the row of a location begins. */
size_t ad_native_at(const struct writer *w, const struct loc *l);
/* Where the first row of a location begins. */
void ad_native_start(const struct writer *w, const struct loc *l);
void ad_native_name(const struct writer *w, uint32_t loc);
/* Declares the operands of an instruction, or of all, that belong in this scope. */
void ad_native_declare(struct writer *w, const struct instruction *in, enum scope scope);
void ad_native_declare_all(struct writer *w, enum scope scope);

/* Operations that read their operands lane by lane. */
static inline bool reads_lanes(const struct instruction *in)
{
    return in->kind != DO_DIFF && in->kind != DO_DIFF_ADJOINT;
}

/* A sum: accumulates instead of computing a value. */
static inline bool is_sum(const struct instruction *in) { return in->kind > DO_DIFF_ADJOINT; }

/* ---- operations: operations.c ---- */

/* Whether corrected guesses pay in this segment. */
bool ad_native_newton(const struct writer *w);
/* The statements an instruction needs before it, for rows [from, to), and its expression if it is
   no sum. */
void ad_native_prepare(struct writer *w, const struct instruction *in, uint32_t from, uint32_t to);
void ad_native_operation(struct writer *w, const struct instruction *in);

/* ---- sums: sums.c, adds.c ---- */

bool ad_native_find_targets(struct writer *w); /* false when out of memory */
void ad_native_declare_sums(const struct writer *w);
/* Code of the sums before and after all loops, the columns of one row, the rows of one vector of
   columns. */
enum moment { OPEN_SEGMENT, CLOSE_SEGMENT, OPEN_ROW, CLOSE_ROW, OPEN_COLUMNS, CLOSE_COLUMNS };
void ad_native_sums(struct writer *w, enum moment moment);
/* The functions in which that is done where a segment has parts. */
void ad_native_sums_parts(struct writer *w);
void ad_native_add(struct writer *w, const struct instruction *in);

/* ---- statements: segment.c ---- */

/* An instruction for rows [from, to). */
void ad_native_instruction(struct writer *w, const struct instruction *in, uint32_t from,
                           uint32_t to);
/* Another row or block of text begins: no variable of a row is declared. */
void ad_native_forget_rows(struct writer *w);

/* ---- parts.c ---- */

/* Writes the parts of a long segment and sets `crosses`; false when out of memory. */
bool ad_native_parts(struct writer *w);
/* Written in place of the instructions of a row. */
void ad_native_call_parts(struct writer *w);
/* The vector of x that a value on a tile passes through. */
uint32_t ad_native_slot(const struct writer *w, uint32_t loc);

/* ---- pipeline.c ---- */

/* Writes the loop over rows if it has slow operations; false when out of memory. */
bool ad_native_pipeline(struct writer *w, bool *written);

#endif
