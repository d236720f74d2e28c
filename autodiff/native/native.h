/* Inside of the compiled back end, in native/. Fused segments become C, one function each
   (segment.c), over vectors of the compiler's own vector type (vectors.c); the system's compiler
   (cc.c) makes a shared object of it, kept in the user's cache folder (cache.c) and loaded in place
   of the interpreter (native.c). Matrix products and what else stands alone stay as they are; so
   does the interpreter, for whoever has no compiler, and as the oracle.

   A function keeps in registers what the interpreter has in tiles, and does the same operations in
   the same order: values are the same to rounding. */
#ifndef AUTODIFF_NATIVE_H
#define AUTODIFF_NATIVE_H

#include "cc.h"
#include "autodiff/exec/program.h"

#include <stdio.h>

/* Changes when emitted code and executor no longer fit those of before. */
#define NATIVE_VERSION 3

/* What replaces a program's segments. */
struct native {
    struct segment *segments;
    size_t n_segments, n_held; /* held: the first ones, that ad_rerun leaves out */
    size_t bytes;              /* of the source of functions */
    void *library;
};

void ad_native_free(struct native *native);

/* How a segment is walked. */
struct loop_order {
    struct segment segment; /* with chunks of its own */
    uint32_t number;        /* of the program's segment */
    uint32_t lanes;         /* of a vector */
    bool along_rows;        /* the space is one column: vectors take rows */
    bool rows_inside;       /* all rows of a block of columns, then the next block */
};

/* How segment `number` is best walked with vectors of `bytes`. */
struct loop_order ad_native_loop_order(const ad_program *program, uint32_t number, size_t bytes);

/* Bytes of a vector of the program's instruction set. */
size_t ad_native_vector_bytes(const ad_program *program);
/* Types, loads, stores and operations for vectors of so many lanes. */
void ad_native_vectors(FILE *out, const ad_program *program, uint32_t lanes);

/* Function s<number>: the arguments are those of ad_segment_code. False when out of memory. */
bool ad_native_segment(FILE *out, const ad_program *program, const struct loop_order *walk);

/* The source of a program, which the caller frees, and the segments that run it: the fused ones
   stand, in order, for its functions run0, run1, ... NULL when out of memory. */
char *ad_native_source(const ad_program *program, struct native *native);
/* How many functions that source has; puts them, loaded, in place of the interpreter. The program
   frees `native`; false when out of memory. */
size_t ad_native_functions(const struct native *native);
bool ad_native_put(ad_program *program, struct native *native, ad_segment_code *const functions[]);

/* A file of the cache is the user's own, holds this source, and is as it was written. */
bool ad_native_is_intact(const char *path, const char *source);

/* The shared object of this source and its functions run0 ... run<n - 1>: from the cache folder if
   it is there and unhurt, else compiled and kept there. NULL, with a reason in `note`, where that
   cannot be; what cannot be loaded is not kept. dlclose it. */
void *ad_native_load(const char *source, const char *isa, const struct compiler *compiler, size_t n,
                     ad_segment_code *functions[], struct ad_error *note);

#endif
