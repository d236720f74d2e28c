/* A compiled program: segments of instructions, and the memory they work on. compile/ makes it;
   exec/ interprets it, or a back end that registers itself (native/) runs it. */
#ifndef AUTODIFF_EXEC_PROGRAM_H
#define AUTODIFF_EXEC_PROGRAM_H

#include "autodiff/custom.h"
#include "autodiff/internal.h"
#include "autodiff/kernels/kernels.h"

/* ---- values ---- */

enum value_flags {
    VALUE_CONSTANT = 1, /* the same in every run */
    VALUE_OUTPUT = 2,
    VALUE_VIEW = 4,      /* reads another value's memory; has none of its own */
    VALUE_STORED = 8,    /* lies in memory, not in a tile */
    VALUE_BORROWED = 16, /* lies in the memory of its host */
    VALUE_ACCUMULATED =
        32, /* a sum whose terms accumulate into its memory: no instruction of its own */
    VALUE_NEGATED = 64, /* a sink that subtracts */
    VALUE_ADDS = 128,   /* a product that accumulates onto its memory */
    VALUE_HELD = 256,   /* depends on held inputs and constants only; set for constants too */
    VALUE_WINDOW = 512  /* has memory only for a block of columns at a time */
};

/* One live node; in[] and aux as in struct node, in[] renumbered. */
struct value {
    uint16_t op;
    uint16_t flags;
    uint32_t rows, cols;
    uint32_t in[3];
    uint32_t aux;
};

/* Where element (r, c) of a value lies: base + off + (row(r)*rs + c*cs) elements, with row(r) = r,
   or lists[list - 1 + r] if there is a list. Strides of 0 repeat. While compiling, off counts
   elements from the start of `root`; in the program it counts bytes from the base. */
struct loc {
    size_t off;
    uint32_t root, list, rs;
    uint8_t base, cs;
};

/* A window holds some columns of a value for one block of a pass; its base is where column 0 would
   be. */
enum { BASE_MEMORY, BASE_TILE, BASE_WINDOW, N_BASES };

/* Columns: blocks of a pass begin at multiples of the step, windows before them by as much as
   anything is read there, at most this margin. */
enum { WINDOW_STEP = 16, WINDOW_MARGIN = 64 };

/* An input or output; sorted by node. */
struct port {
    uint32_t node, value;
    bool input;
};

/* ---- instructions ---- */

enum instruction_kind {
    DO_ELEMENTWISE,
    DO_DIFF,
    DO_DIFF_ADJOINT,
    DO_SUM, /* partial sums in double */
    DO_SUM_COLS,
    DO_ADD_ROWS, /* accumulates tile rows into rows of the result: sums over rows, scatters */
    DO_PLACE,
    DO_TRANSPOSE,
    DO_MATMUL,
    DO_GATHER_COLS,
    DO_SCATTER_COLS,
    DO_CUMSUM,
    DO_FACTOR,
    DO_SOLVE,
    DO_LOGDET,
    DO_CUSTOM,
    DO_SCAN /* a loop, or back through one */
};

/* loc[0]: result; loc[1..3]: operands. Sinks: loc[3] is their number. diff: loc[2] numbers its
   scale in `numbers`, loc[3] tells repeat. matmul: loc[3] holds the bits below. place: parts
   loc[1] .. loc[1]+loc[2]. gather and scatter of columns: loc[2] is 1 + their list's place in
   `lists`. cumsum and small systems: loc[3] is aux of the node; factors are numbered in loc[2];
   solutions read their factor at loc[1] and their right sides at loc[2]. scan: loc[1] is its number
   in `scans`. */
enum { MATMUL_TA = 1, MATMUL_TB = 2, MATMUL_ADDS = 4 };

/* Whether one kernel computes an instruction and the one behind it: sine and cosine of one
   argument, or a product that is read once, by a sum; from JOINED_PRODUCT on by enum product_sum
   and variant. JOINED_BEHIND: the second one. */
enum { JOINED_NOT, JOINED_BEHIND, JOINED_CIRCLE, JOINED_PRODUCT };

struct instruction {
    ad_kernel *run;
    uint8_t kind, n_in;
    bool flat;      /* a tile is contiguous for every operand */
    uint8_t joined; /* JOINED_... */
    uint32_t value; /* the value it computes */
    uint32_t loc[4];
};

struct sink {
    uint8_t kind;
    uint32_t instruction;
    uint32_t rows, cols; /* of the result */
    bool begun;          /* the calls of the segment store the first value of every row */
    size_t partial;      /* offset of the private copies of the chunks */
    size_t stride;       /* bytes of one copy */
};

struct part {
    uint32_t loc, rows, cols;
    uint32_t row, col; /* position in the result */
};

/* Code of a back end for rows [row, row_end), columns [col, col_end) of a fused segment; `chunk` is
   the number of the chunk; window: base of windows. */
typedef void ad_segment_code(char *memory, char *window, const uint32_t *lists, size_t chunk,
                             size_t row, size_t row_end, size_t col, size_t col_end);

struct segment {
    ad_segment_code *code; /* NULL: the instructions are interpreted */
    uint32_t first, count; /* instructions */
    uint32_t rows, cols;   /* iteration space */
    uint32_t tile_rows, tile_cols;
    uint32_t chunks; /* depends on sizes alone, so that threads change no result */
    bool by_rows;    /* chunks split rows, else columns */
    /* Consecutive segments of one pass (compile/passes.c) run a chunk of columns one after the
       other; 0: no pass. Some compute `before` and `after` more columns for those that follow. */
    uint32_t pass;
    uint8_t before, after, margin;
    /* A product that adds up the columns of a pass has a number there. A block computes it once the
       block before has done number `turn`, the last one into the same memory. 0: none. */
    uint8_t adds, turn;
    bool fused;
    bool clear; /* place: the parts do not cover the result */
    uint32_t first_sink, n_sinks;
    uint32_t first_call, n_calls; /* for segments of few tiles */
};

/* A kernel call with precomputed addresses. run NULL: a is an instruction to run on the tile that
   begins at row n. With `second`, o and second are the sine and the cosine of a. */
struct call {
    ad_kernel *run;
    size_t n;
    void *o, *second;
    const void *a, *b, *c;
};

/* Size of the slots that hold the values of a segment's tiles. */
static inline size_t ad_slot_bytes(size_t element, const struct segment *s)
{
    return aligned((size_t)s->tile_rows * s->tile_cols * element);
}

struct check;

/* Another way to run a program's segments; a program has none until a back end registers itself. */
struct back_end {
    /* Called before segments [*first, *last) run: returns the segments to run instead, and sets
     *first and *last; NULL: run the program's own. */
    const struct segment *(*prepare)(ad_program *program, bool again, size_t *first, size_t *last);
    void (*free)(void *state);
};

/* A factor of small systems, or a user's own operation, and the result of its last run: `found` has
   the column where it failed. */
struct factor {
    uint32_t value;
    struct ad_factored found;
    enum custom_fault fault;
};

/* A loop of a program, or the way back through one that comes before. */
struct program_scan {
    uint32_t value;
    struct scan *scan;            /* its own, or */
    struct scan_adjoint *adjoint; /* NULL in a loop */
    uint32_t of;                  /* the number of the loop this is the way back through */
    uint32_t n_operands;
    uint32_t *operand; /* values */
    struct matrix_at *z;
};

struct ad_program {
    enum ad_type type;
    uint32_t recording; /* number of the recording whose handles name the ports */
    size_t element;
    const struct ad_kernels *kernels;
    struct value *values; /* shapes and operations, for reports */
    size_t n_values;
    uint32_t *nodes; /* of the values, on the tape */
    uint32_t *last;  /* segments that are the last to read their memory; UINT32_MAX: any may */
    struct loc *locs;
    struct instruction *instructions;
    size_t n_instructions;
    struct segment *segments;
    size_t n_segments, n_constant_segments, n_held_segments;
    struct sink *sinks;
    size_t n_sinks;
    struct part *parts;
    size_t n_parts;
    struct call *calls;
    size_t n_calls;
    struct custom *customs;
    size_t n_customs;
    struct program_scan *scans;
    size_t n_scans;
    double *numbers;
    size_t n_numbers;
    uint32_t *lists;
    size_t n_lists;
    struct port *ports;
    size_t n_ports;
    char **labels; /* of labelled values: parallel to label_values */
    uint32_t *label_values;
    size_t n_labels;
    char *memory; /* values */
    char *tiles;  /* of the first thread; of the others */
    char *more_tiles;
    size_t memory_bytes, tile_bytes, window; /* window: where on a thread's tiles windows begin */
    size_t threads;
    bool has_matmul;  /* or another call of OpenBLAS */
    double *products; /* seconds of products; NULL: not measured */
    bool was_run;
    bool held_stand; /* values that depend on held inputs are up to date */
    struct factor *factors;
    size_t n_factors;
    struct ad_error error;           /* of the last run */
    const struct back_end *back_end; /* NULL: interpreted; its state: */
    void *back_end_state;
};

/* The program of a step of loop number k, and how many steps the loop has. */
ad_program *ad_step_program(const ad_program *program, size_t k);
size_t ad_step_count(const ad_program *program, size_t k);

/* Runs segments [first, last), the program's own or a back end's. With `check`, records the
   earliest value that is not finite. */
void ad_execute(const ad_program *program, const struct segment *segments, size_t first,
                size_t last, struct check *check);

#endif
