/* From schedule to program: passes over columns (passes.c, windows.c), memory of values
   (storage.c), tiles (tiles.c), instructions (emit.c). */
#ifndef AUTODIFF_COMPILE_PLAN_H
#define AUTODIFF_COMPILE_PLAN_H

#include "graph.h"

struct plan {
    struct graph *graph;
    struct ad_program *program;
    size_t memory; /* bytes of values so far */
    /* per value, while planning */
    uint32_t *last; /* last group that reads it */
    uint32_t
        *link; /* storage: lists of expiring and free memory; emit: 1 + last broadcast location */
    uint32_t *readers; /* emit: how many operands lie in its memory */
    uint32_t *spot;    /* tiles: 1 if it has a slot; for accumulated values: their sink */
    /* growth of the program's arrays */
    size_t max_instructions, max_segments, max_sinks, max_parts, max_numbers, max_factors;
    size_t tile_bytes, window_bytes;
};

/* Finds passes, once memory has been lent (passes.c); false when out of memory. */
bool ad_plan_passes(struct plan *plan);

/* The parts are adjacent along rows or columns and fill the result. */
bool ad_place_tiles(const struct graph *graph, const struct value *v);

/* One number for a whole space. */
static inline bool ad_is_number(const struct loc *l)
{
    return l->cs == 0 && l->rs == 0 && !l->list;
}

/* Assigns slots to a group's values, and tiles and chunks to its segment (rows, cols, count are
   set). */
bool ad_plan_tiles(struct plan *plan, const struct group *group, struct segment *segment);
/* Assigns memory to stored values and turns all locations into byte offsets. */
bool ad_plan_storage(struct plan *plan);
/* Reserves `copies` times `bytes` at *offset; false if the size overflows. */
static inline bool ad_plan_memory(struct plan *plan, size_t copies, size_t bytes, size_t *offset)
{
    *offset = plan->memory;
    if (bytes && copies > (SIZE_MAX / 4 - plan->memory) / bytes)
        return false;
    plan->memory += aligned(copies * bytes);
    return true;
}
/* Writes all instructions and segments; the second, those of a value with a segment of its own. */
bool ad_plan_emit(struct plan *plan);
bool ad_plan_alone(struct plan *plan, const struct group *group, struct segment segment);

/* Adds to an array of the program; false when out of memory. */
#define APPEND(array, count, max, element)                                                         \
    ((count) < (max) || ad_reserve((void **)&(array), (count), &(max), 1, sizeof *(array))         \
         ? ((array)[(count)++] = (element), true)                                                  \
         : false)

#endif
