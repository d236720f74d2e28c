/* Internals of the executor: tiles of fused segments, segments of one operation. */
#ifndef AUTODIFF_EXEC_EXEC_H
#define AUTODIFF_EXEC_EXEC_H

#include "program.h"

/* The first value that is not finite; value UINT32_MAX: none. */
struct check {
    uint32_t value, row, col;
    double found;
};

/* A window of a segment's iteration space, and the base of its locations. */
struct tile {
    uint32_t row, rows, col, cols;
    char *base[N_BASES];
    uint32_t chunk;
};

/* Rows of the tile that begins at `row`. */
static inline uint32_t tile_rows_at(const struct segment *g, uint32_t row)
{
    return g->rows - row < g->tile_rows ? g->rows - row : g->tile_rows;
}

/* Runs the instructions of a fused segment over one tile. */
void ad_run_tile(const ad_program *program, const struct segment *segment, const struct tile *tile,
                 struct check *check);
/* Rows and columns of a chunk. */
struct tile ad_extent(const struct segment *segment, uint32_t chunk);
/* Runs a segment over rows and columns tile by tile, after zeroing what it accumulates into; and
   adds what the chunks have accumulated, in order. */
void ad_run_range(const ad_program *program, const struct segment *segment,
                  const struct tile *range, struct check *check);
void ad_collect_sinks(const ad_program *program, const struct segment *segment,
                      struct check *check);
/* Runs the n segments of a pass (pass.c). */
void ad_run_pass(const ad_program *program, const struct segment *segments, size_t n,
                 struct check *check);
/* The call for a row, or a flat tile, of an instruction and the one behind it, which are joined. */
struct call ad_joined_call(const ad_program *program, const struct instruction *instruction,
                           const struct tile *tile, uint32_t row);
/* The tiles of a thread. */
static inline char *tiles_of(const ad_program *p, size_t thread)
{
    return thread ? p->more_tiles + (thread - 1) * p->tile_bytes : p->tiles;
}
/* Runs one instruction over one tile. */
void ad_run_instruction(const ad_program *program, const struct segment *segment,
                        const struct instruction *instruction, const struct tile *tile);
/* A segment of one operation, over the columns of a tile where it belongs to a pass. */
void ad_run_alone(const ad_program *program, const struct segment *segment,
                  const struct tile *tile);
/* The first value of the last run that went wrong, a factor or a loop, which *error names;
   UINT32_MAX and status AD_OK: none. */
uint32_t ad_report_run(const ad_program *program, struct ad_error *error);
/* Loops (scans.c): those of the tape, for the values that its nodes became; false, with an error,
   where they cannot be made. Running one; freeing all; bytes of all. */
bool ad_make_scans(ad_program *program, ad_tape *tape, const uint32_t *renumber);
void ad_run_scan(const ad_program *program, const struct instruction *instruction,
                 struct check *check);
void ad_free_scans(ad_program *program);
size_t ad_scans_bytes(const ad_program *program);
/* Factors of small systems, solutions, log-determinants (systems.c). */
void ad_run_system(const ad_program *program, const struct segment *segment);
/* A user's own operation, or its adjoint (custom.c). */
void ad_run_custom(const ad_program *program, const struct segment *segment);
/* The first factor with a singular column, or own operation that failed, which *error names; NULL,
   and status AD_OK: none. */
const struct factor *ad_report_singular(const ad_program *program, struct ad_error *error);
/* Checks the stored result of an instruction for values that are not finite. */
void ad_inspect_value(const ad_program *program, const struct instruction *instruction,
                      struct check *check);

/* The same for the columns of a tile alone. */
void ad_inspect_tile(const ad_program *program, const struct instruction *instruction,
                     const struct tile *tile, struct check *check);

/* Writes the calls of segments of few tiles; false when out of memory. */
bool ad_resolve_calls(ad_program *program);

/* Rows of a location under a tile. */
struct cursor {
    char *start;
    const uint32_t *list; /* row numbers, or NULL */
    size_t step;          /* bytes from row to row */
};

static inline struct cursor cursor_at(const ad_program *p, const struct loc *l,
                                      const struct tile *t)
{
    struct cursor c = {t->base[l->base] + l->off, NULL, l->rs * p->element};
    if (l->base == BASE_TILE)
        return c;
    c.start += (size_t)t->col * l->cs * p->element;
    if (l->list)
        c.list = p->lists + (l->list - 1 + t->row);
    else
        c.start += t->row * c.step;
    return c;
}

static inline char *cursor_row(const struct cursor *c, uint32_t r)
{
    return c->start + (c->list ? c->list[r] : r) * c->step;
}

/* A tile one column wide (column.c): runs an elementwise instruction in one kernel call, false
   where that is impossible; accumulates its rows, times 1 or -1, into others. */
bool ad_run_column(const ad_program *program, const struct instruction *instruction,
                   const struct tile *tile);
void ad_add_column(const ad_program *program, const struct cursor *to, const struct cursor *from,
                   uint32_t rows, double sign);

/* Start of row r of a value in memory. */
static inline char *value_row(const ad_program *p, const struct loc *l, size_t r)
{
    return p->memory + l->off + (l->list ? p->lists[l->list - 1 + r] : r) * l->rs * p->element;
}

static inline double element_at(const ad_program *p, const char *row, size_t i)
{
    return p->type == AD_F32 ? (double)((const float *)(const void *)row)[i]
                             : ((const double *)(const void *)row)[i];
}

/* The private copy of a sink's result that a chunk accumulates into. */
static inline double *sink_copy(const ad_program *p, const struct sink *s, uint32_t chunk)
{
    return (double *)(void *)(p->memory + s->partial + chunk * s->stride);
}

/* Location of the rows that a chunk's sink accumulates into. */
static inline struct loc sink_rows(const ad_program *p, const struct segment *g,
                                   const struct instruction *in, uint32_t chunk)
{
    struct loc o = p->locs[in->loc[0]];
    const struct sink *s = &p->sinks[in->loc[3]];
    if (g->by_rows && g->chunks > 1) {
        o.off = s->partial + chunk * s->stride;
        o.rs = o.rs ? s->cols : 0;
    }
    return o;
}

#endif
