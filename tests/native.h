/* Helpers for tests of machine code: a cache folder, and programs to compare. */
#ifndef TESTS_NATIVE_H
#define TESTS_NATIVE_H

#include "autodiff/autodiff.h"
#include "close.h"
#include "files.h"

extern struct path native_cache; /* holds the folder leastaction */

/* Set up and tear down a group of tests: with a cache of its own, and with that of all tests, which
   run-tests names; without run-tests it is the group's own. */
int native_open_cache(void **state);
int native_share_cache(void **state);
int native_remove_cache(void **state);

/* From now on CC has -O0 behind all other flags, for what does not test the compiler's optimizer,
   which takes ten times as long. Such machine code needs a cache of its own. */
void native_quick_compiler(void);
/* Sets up a group of tests with both. */
int native_open_quick(void **state);

/* Skips a test where there is no compiler. */
void native_need_compiler(void);
/* Compiles a program to machine code, or fails the test. */
void native_make(ad_program *program);
/* Two programs agree on x, relative to the largest element: sums that cancel keep the rounding of
   their terms. */
void assert_same_values(const ad_program *interpreted, const ad_program *compiled, ad_var x,
                        double tolerance, const char *name);

#endif
