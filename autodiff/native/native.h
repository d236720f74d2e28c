/* Internals of the native back end. Fused segments become C, one function each (segment.c), over
   the compiler's vector types (vectors.c); the system's compiler (cc.c) makes a shared object, kept
   in the user's cache (cache.c) and loaded in place of the interpreter (native.c). Other
   operations, such as matrix products, stay as they are; the interpreter remains for systems
   without a compiler, and as the oracle of tests.

   A function keeps in registers what the interpreter keeps in tiles, and does the same operations
   in the same order: values agree to rounding. */
#ifndef AUTODIFF_NATIVE_NATIVE_H
#define AUTODIFF_NATIVE_NATIVE_H

#include "cc.h"
#include "autodiff/exec/program.h"

#include <stdio.h>

/* Increased when emitted code and executor are incompatible with earlier ones. */
#define NATIVE_VERSION 4

/* Replaces a program's segments. */
struct native {
    struct segment *segments;
    size_t n_segments, n_held;   /* held: the first ones, skipped by ad_rerun */
    size_t bytes, loops, sincos; /* in the source of the functions */
    uint64_t key;                /* of the whole source, in the cache */
    bool built;                  /* by this program, not found in the cache */
    void *library;
};

void ad_native_free(struct native *native);

/* Loop order of one segment. */
struct loop_order {
    struct segment segment; /* with chunks of its own */
    uint32_t number;        /* of the program's segment */
    uint32_t lanes;         /* of a vector */
    bool along_rows;        /* the space is one column: vectors run along rows */
    bool rows_inside;       /* the loop over rows is inside that over blocks of columns */
    bool literal;           /* rows are written one by one, without a loop */
    uint32_t joined;        /* this many segments from here on share one loop; 0: in another's */
};

/* The best loop order of segment `number` for vectors of `bytes`. */
struct loop_order ad_native_loop_order(const ad_program *program, uint32_t number, size_t bytes);

/* Its rows can be written one by one. */
bool ad_native_is_literal(const struct loop_order *walk);
/* How many segments, the first of n and those behind it, can share one loop over columns
   (loops.c). */
uint32_t ad_native_joined(const ad_program *program, size_t n, const struct loop_order walks[]);

/* Bytes of a vector of the program's instruction set. */
size_t ad_native_vector_bytes(const ad_program *program);
/* Writes types, loads, stores and operations for vectors of `lanes`. */
void ad_native_vectors(FILE *out, const ad_program *program, uint32_t lanes);

/* Whether what the program holds would fill the caches: vectors of results that no segment reads
   are stored past them, and rows are fetched ahead. */
bool ad_native_streams(const ad_program *program);

/* Writes function s<number>, of type ad_segment_code, or j<number of the first> of n segments in
   one loop; false when out of memory. */
bool ad_native_segment(FILE *out, const ad_program *program, size_t n,
                       const struct loop_order walks[]);

/* The source of a program, freed by the caller, and the segments that replace the program's: the
   fused ones are, in order, its functions run0, run1, ... NULL when out of memory. */
char *ad_native_source(const ad_program *program, struct native *native);
/* The number of functions of that source; and installing the loaded functions in place of the
   interpreter, after which the program frees `native`; false when out of memory. */
size_t ad_native_functions(const struct native *native);
bool ad_native_put(ad_program *program, struct native *native, ad_segment_code *const functions[]);

/* True if the user owns the cache file, it holds this source, and its checksum is right. */
bool ad_native_is_intact(const char *path, const char *source);

/* LEASTACTION_NATIVE=0. */
bool ad_native_turned_off(void);
/* The text to compile and to cache: that of `body`, which is freed, and everything else that the
   machine code depends on. NULL when out of memory, or of NULL. */
char *ad_native_full_source(char *body, const char *isa, const struct compiler *compiler);
/* The shared object of this source and its functions run0 ... run<n - 1>: loaded from the cache if
   intact, else compiled (*built, may be NULL), unless compiler is NULL, and cached. NULL, with a
   reason in `note`, if that fails; an object that does not load is not kept. The caller calls
   dlclose. */
void *ad_native_load(const char *source, const char *isa, const struct compiler *compiler, size_t n,
                     ad_segment_code *functions[], bool *built, struct ad_error *note);
/* The name of a source in the cache, and the mark there that its machine code was found slower than
   the interpreter. */
uint64_t ad_native_key(const char *source);
bool ad_native_is_slow(uint64_t key);
void ad_native_mark_slow(uint64_t key);

#endif
