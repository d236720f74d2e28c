/* Machine code of many programs by one run of the compiler for each instruction set, because
   starting, linking and loading take longer than most random programs. Bypasses the cache and the
   estimate of whether compiling pays. */
#ifndef TESTS_AUTODIFF_NATIVE_NATIVE_BATCH_H
#define TESTS_AUTODIFF_NATIVE_NATIVE_BATCH_H

#include "autodiff/native/native.h"

enum { BATCH_PROGRAMS = 32, BATCH_ISAS = 3 };

struct native_batch {
    size_t n;
    ad_program *programs[BATCH_PROGRAMS];
    struct native *natives[BATCH_PROGRAMS];
    FILE *sources[BATCH_ISAS]; /* one for each instruction set that any program has */
    char *texts[BATCH_ISAS];
    size_t bytes[BATCH_ISAS];
    const char *isas[BATCH_ISAS];
    void *libraries[BATCH_ISAS];
};

/* Adds a program; false if it has nothing to compile. */
bool native_batch_add(struct native_batch *batch, ad_program *program);
/* Compiles and loads all that was added; false, with a message on standard error, if that fails. */
bool native_batch_load(struct native_batch *batch);
/* Unloads; the programs must be freed before. */
void native_batch_release(struct native_batch *batch);

#endif
